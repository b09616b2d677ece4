//! Exponential function and logarithm for vectors of cells.

use std::f32::consts::{LN_2, LOG2_E};

/// `2^t - 1` over t over [-1/2, 1/2] in powers of t, highest first.
const POWERS: [f32; 6] = [0.000_154_03, 0.001_333_36, 0.009_618_13, 0.055_504_11, 0.240_226_5, LN_2];

/// Exponential function; relative error below 8e-6 for |x| < 79, limited beyond. It has no branches, so loops vectorise.
#[inline(always)]
pub(crate) fn exp(x: f32) -> f32 {
    let power = x * LOG2_E;
    let power = if power > 115.0 { 115.0 } else { power };
    let power = if power > -115.0 { power } else { -115.0 };
    let whole = power.round_ties_even();
    let part = power - whole;
    let rest = POWERS.iter().fold(0.0, |sum, term| sum * part + term) * part + 1.0;
    // Adding 2^23 brings the whole number into the last bits of the mantissa, from where it moves into the exponent.
    rest * f32::from_bits((whole + (8_388_608.0 + 127.0)).to_bits() << 23)
}

/// `ln(1 + t) / t` over t from -1/3 to 1/3 in powers of t, highest first.
const LOGARITHM: [f32; 8] = [
    -0.154_031_56,
    0.171_112_27,
    -0.164_127_99,
    0.197_950_3,
    -0.250_080_27,
    0.333_379_9,
    -0.499_999_3,
    0.999_999_8,
];

/// Logarithm of 1 + x for x >= 0, as [`ln`].
#[inline(always)]
pub(crate) fn ln_1p(x: f32) -> f32 {
    ln(1.0 + x)
}

/// Logarithm of a normal x > 0; error below 1e-6 of the result plus 1e-6. It has no branches, so loops vectorise.
#[inline(always)]
pub(crate) fn ln(x: f32) -> f32 {
    // x = 2^whole (1 + part), with 1 + part from 2/3 to 4/3.
    let two_thirds = 0x3F2A_AAAB_u32;
    let bits = x.to_bits().wrapping_sub(two_thirds);
    let whole = (bits as i32 >> 23) as f32;
    let part = f32::from_bits((bits & 0x007F_FFFF).wrapping_add(two_thirds)) - 1.0;
    LOGARITHM.iter().fold(0.0, |sum, term| sum * part + term) * part + whole * LN_2
}

#[cfg(test)]
mod tests {
    use super::{exp, ln, ln_1p};

    #[test]
    fn the_logarithm_is_right_everywhere() {
        for i in 0..8000 {
            let x = 1e-4 * 1.004f32.powi(i);
            let (found, expected) = (f64::from(ln_1p(x)), f64::from(x).ln_1p());
            assert!((found - expected).abs() < 1e-6 * expected + 1e-6, "{x} {found} {expected}");
        }
        assert_eq!(ln_1p(0.0), 0.0);
        for i in 1..8000 {
            let x = 1e-4 * i as f32;
            let (found, expected) = (f64::from(ln(x)), f64::from(x).ln());
            assert!((found - expected).abs() < 1e-6 * expected.abs() + 1e-6, "{x} {found} {expected}");
        }
    }

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
