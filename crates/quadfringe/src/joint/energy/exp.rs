//! The exponential function for vectors of cells.

use std::f32::consts::{LN_2, LOG2_E};

/// `2^t - 1` over t over [-1/2, 1/2] in powers of t, highest first.
const POWERS: [f32; 6] = [0.000_154_03, 0.001_333_36, 0.009_618_13, 0.055_504_11, 0.240_226_5, LN_2];

/// Exponential function; relative error below 8e-6 for |x| < 79, limited beyond. It has no branches, so loops vectorise.
#[inline(always)]
pub(super) fn exp(x: f32) -> f32 {
    let power = x * LOG2_E;
    let power = if power > 115.0 { 115.0 } else { power };
    let power = if power > -115.0 { power } else { -115.0 };
    let whole = power.round_ties_even();
    let part = power - whole;
    let rest = POWERS.iter().fold(0.0, |sum, term| sum * part + term) * part + 1.0;
    // Adding 2^23 brings the whole number into the last bits of the mantissa, from where it moves into the exponent.
    rest * f32::from_bits((whole + (8_388_608.0 + 127.0)).to_bits() << 23)
}

#[cfg(test)]
mod tests {
    use super::exp;

    #[test]
    fn the_relative_error_is_small_everywhere() {
        for i in -7900..=7900 {
            let x = i as f32 * 0.01;
            let error = f64::from(exp(x)) / f64::from(x).exp() - 1.0;
            assert!(error.abs() < 8e-6, "{x} {error}");
        }
        assert!(exp(1e9).is_finite() && exp(-1e9) > 0.0);
    }
}
