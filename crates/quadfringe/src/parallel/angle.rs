//! Fast arctangent, sine and cosine with stated errors, and wrapping of angles.

use std::f32::consts::{FRAC_PI_2, PI, TAU};

/// atan(a) / a over [0, 1] in powers of a^2: reweighted least squares on 4000 Chebyshev nodes; greatest error of
/// the polynomial 4e-8 rad, before rounding to `f32`. The test below measures the total error.
const ATAN: [f32; 8] = [
    0.999_999_34,
    -0.333_298_62,
    0.199_465_66,
    -0.139_086_3,
    0.096_421_98,
    -0.055_912_334,
    0.021_862_963,
    -0.004_054_568_5,
];

/// A shorter polynomial for atan(a) / a with an error of at most 1.2e-5 rad, for angles that only select whole turns.
const COARSE_ATAN: [f32; 5] = [0.999_866_3, -0.330_304_8, 0.180_159_3, -0.085_156_35, 0.020_845_114];

/// sin(2 pi t) / t over |t| <= 1/4 in powers of t^2, fitted in the same way; greatest error of the polynomial 4e-9.
const SINE: [f32; 5] = [TAU, -41.341_656, 81.601_01, -76.549_85, 39.537_205];

/// 2 pi in two parts. Whole turns times the first part are exact in `f32`, so only the small second part rounds.
const TAU_HIGH: f32 = 6.281_25;
const TAU_LOW: f32 = 0.001_935_307_2;

/// Sine and cosine, greatest error 4e-7 for |angle| < 1000 rad. It has no branches, so loops vectorise.
#[inline(always)]
pub(crate) fn sin_cos(angle: f32) -> (f32, f32) {
    let t = wrap(angle) * (1.0 / TAU);
    (sine(t), sine(0.25 - t.abs()))
}

/// Sine of an angle in turns, in [-1/2, 1/2].
#[inline(always)]
fn sine(t: f32) -> f32 {
    let half = if t < 0.0 { -0.5 } else { 0.5 };
    let folded = if t.abs() > 0.25 { half - t } else { t };
    let square = folded * folded;
    five_terms(SINE, square) * folded
}

/// Four-quadrant arctangent, greatest error 4e-7 rad; `atan2(0, 0)` is 0; NaN in, NaN out. It has no branches,
/// so loops vectorise.
#[inline(always)]
pub(crate) fn atan2(y: f32, x: f32) -> f32 {
    let a = ratio(y, x);
    unfold(eight_terms(ATAN, a * a) * a, y, x)
}

/// Like [`atan2`], with an error of at most 1.3e-5 rad.
#[inline(always)]
pub(crate) fn coarse_atan2(y: f32, x: f32) -> f32 {
    let a = ratio(y, x);
    unfold(five_terms(COARSE_ATAN, a * a) * a, y, x)
}

/// The smaller of |x| and |y| divided by the greater one.
#[inline(always)]
fn ratio(y: f32, x: f32) -> f32 {
    let (ax, ay) = (x.abs(), y.abs());
    // Comparisons with NaN are false. Then `low` is y and `high` is x, so that a NaN in either reaches the result.
    let low = if ax < ay { ax } else { ay };
    let high = if ay > ax { ay } else { ax };
    let tiny = high < f32::MIN_POSITIVE;
    low / if tiny { f32::MIN_POSITIVE } else { high }
}

/// Moves `angle`, which lies in the first octant, to the octant of the point.
#[inline(always)]
fn unfold(angle: f32, y: f32, x: f32) -> f32 {
    let folded = if y.abs() > x.abs() { FRAC_PI_2 - angle } else { angle };
    let half = if x < 0.0 { PI - folded } else { folded };
    if y < 0.0 { -half } else { half }
}

/// A polynomial in `t` by Estrin's scheme: its terms are computed in parallel, while those of Horner's scheme wait for
/// each other.
#[inline(always)]
fn eight_terms([a, b, c, d, e, f, g, h]: [f32; 8], t: f32) -> f32 {
    let square = t * t;
    let low = (a + b * t) + (c + d * t) * square;
    let high = (e + f * t) + (g + h * t) * square;
    low + high * (square * square)
}

#[inline(always)]
fn five_terms([a, b, c, d, e]: [f32; 5], t: f32) -> f32 {
    let square = t * t;
    (a + b * t) + ((c + d * t) + e * square) * square
}

/// Round to the nearest whole number for |x| < 2^21 without a function call: adding 1.5 * 2^23 removes the fraction.
#[inline(always)]
pub(crate) fn round(x: f32) -> f32 {
    const SHIFT: f32 = 12_582_912.0;
    (x + SHIFT) - SHIFT
}

/// The angle in [-pi, pi] that differs from `angle` by whole turns, exact to 3e-7 rad for |angle| < 1000 rad.
#[inline(always)]
pub(crate) fn wrap(angle: f32) -> f32 {
    let turns = round(angle * (1.0 / TAU));
    (angle - turns * TAU_HIGH) - turns * TAU_LOW
}

/// The angle in [0, 2 pi) that differs from `angle` by whole turns.
#[inline(always)]
pub(crate) fn wrap_positive(angle: f32) -> f32 {
    let below = wrap(angle);
    let lifted = if below < 0.0 { below + TAU } else { below };
    if lifted < TAU { lifted } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arctangents_stay_within_their_bounds_on_the_whole_circle() {
        for (found, bound) in [(atan2 as fn(f32, f32) -> f32, 4e-7), (coarse_atan2, 1.3e-5)] {
            let worst = (0..1_000_000)
                .map(|i| f64::from(i) * std::f64::consts::TAU / 1e6 - std::f64::consts::PI)
                .map(|t| (f64::from(found(t.sin() as f32, t.cos() as f32)) - t).abs())
                .map(|e| e.min(std::f64::consts::TAU - e))
                .fold(0.0, f64::max);
            assert!(worst < bound, "{worst}");
            assert_eq!(found(0.0, 0.0), 0.0);
            assert!(found(f32::NAN, 1.0).is_nan() && found(1.0, f32::NAN).is_nan());
        }
    }

    #[test]
    fn sine_and_cosine_stay_within_their_bounds() {
        for i in -500_000..500_000 {
            let angle = i as f32 * 2e-3;
            let (s, c) = sin_cos(angle);
            let exact = f64::from(angle).sin_cos();
            assert!((f64::from(s) - exact.0).abs() < 4e-7, "sin {angle}");
            assert!((f64::from(c) - exact.1).abs() < 4e-7, "cos {angle}");
        }
    }

    #[test]
    fn wrapping_stays_in_range() {
        for i in -1000..1000 {
            let angle = i as f32 * 0.1;
            assert!(wrap(angle).abs() <= PI + 1e-5);
            assert!((0.0..TAU).contains(&wrap_positive(angle)));
            let turns = (angle - wrap_positive(angle)) / TAU;
            assert!((turns - turns.round()).abs() < 1e-4);
        }
    }
}
