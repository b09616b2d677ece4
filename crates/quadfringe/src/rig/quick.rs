//! The light of sinusoidal fringes by a short polynomial, several pixels at a time.
//!
//! No bit of an image depends on it: a pixel counts only if every light within the error of the polynomial rounds to the
//! same number, and is computed from the cosine of the standard library otherwise.

use multiversion::multiversion;
use ndarray::ArrayView1;
use std::f64::consts::TAU;

use super::params::{QUICK_ERROR, QUICK_PHASE_MAX_RAD};
use super::{Bench, Hit, Light, RenderOptions};
use crate::encoding::{Axis, Channel};

/// Fringes of the four channels in a form that loops over pixels use.
pub(super) struct Quick {
    channels: [Wave; 4],
    /// How far the light of each captured channel may be from the exact one.
    errors: [f64; 4],
}

/// The sinusoid `cos(rad_per_side position / side + shift)` over the positions of one projector.
struct Wave {
    /// 0 for even light.
    rad_per_side: f64,
    shift_rad: f64,
    /// Columns or rows of the projector.
    side_px: f64,
    projector: usize,
    axis: usize,
    /// Level of even light.
    even: f64,
}

/// Levels of a row of pixels, by projected channel.
pub(super) struct Levels([Vec<f64>; 4]);

impl Levels {
    pub(super) fn at(&self, column: usize) -> [f64; 4] {
        self.0.each_ref().map(|levels| levels[column])
    }
}

impl Quick {
    /// `None` for images as patterns, and for responses and phases for which the error is not known.
    pub(super) fn new(bench: &Bench, lights: &[Light<'_>; 4], options: &RenderOptions) -> Option<Self> {
        if options.projector_exponent != [1.0; 4] {
            return None;
        }
        let mut channels = Vec::with_capacity(4);
        for (channel, light) in Channel::ALL.into_iter().zip(lights) {
            channels.push(Wave::new(bench, channel, light)?);
        }
        let brightest = f64::from(options.albedo.greatest());
        let errors = std::array::from_fn(|captured| {
            let received = options.crosstalk[captured].iter().zip(options.ambient);
            let light = received.map(|(share, ambient)| share * (1.0 + ambient)).sum::<f64>();
            QUICK_ERROR * options.gain[captured] * light * brightest
        });
        Some(Self { channels: channels.try_into().ok()?, errors })
    }

    /// Levels that the projectors send to a row of pixels; NaN where a pixel is not lit.
    pub(super) fn levels(&self, hits: ArrayView1<'_, Hit>) -> Levels {
        Levels(self.channels.each_ref().map(|wave| {
            if wave.rad_per_side == 0.0 {
                return vec![wave.even; hits.len()];
            }
            let at = |hit: &Hit| hit.lit_from_px[wave.projector][wave.axis];
            let mut levels: Vec<f64> = hits.iter().map(at).collect();
            wave.send(&mut levels);
            levels
        }))
    }

    /// The light of the captured channels as it is stored, if the error changes none.
    pub(super) fn certain(&self, light: [f64; 4]) -> Option<[f32; 4]> {
        let low: [f32; 4] = std::array::from_fn(|i| (light[i] - self.errors[i]) as f32);
        let high: [f32; 4] = std::array::from_fn(|i| (light[i] + self.errors[i]) as f32);
        (low == high).then_some(low)
    }
}

impl Wave {
    fn new(bench: &Bench, channel: Channel, light: &Light<'_>) -> Option<Self> {
        let projector = channel.projector();
        let device = bench.projector(projector);
        let even = Self {
            rad_per_side: 0.0,
            shift_rad: 0.0,
            side_px: 1.0,
            projector: projector.index(),
            axis: 0,
            even: 0.0,
        };
        match light {
            Light::Uniform(level) => Some(Self { even: *level, ..even }),
            Light::Fringes { number, shift_rad, axis } => {
                let (axis, side) = match axis {
                    Axis::Columns => (0, device.width),
                    Axis::Rows => (1, device.height),
                };
                let rad_per_side = TAU * number;
                let bounded = rad_per_side.abs() + shift_rad.abs() < QUICK_PHASE_MAX_RAD;
                (bounded && rad_per_side != 0.0).then_some(Self {
                    rad_per_side,
                    shift_rad: *shift_rad,
                    side_px: side as f64,
                    axis,
                    ..even
                })
            }
            Light::Image(_) => None,
        }
    }

    /// Turns positions on the projector into levels.
    fn send(&self, levels: &mut [f64]) {
        send(self.rad_per_side, self.shift_rad, self.side_px, levels);
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn send(rad_per_side: f64, shift_rad: f64, side_px: f64, levels: &mut [f64]) {
    for level in levels {
        *level = 0.5 + 0.5 * cosine(rad_per_side * (*level / side_px) + shift_rad);
    }
}

/// 2 pi in two parts. Whole turns times the first part are exact.
const TAU_HIGH: f64 = 6.283_185_310_661_793;
const TAU_LOW: f64 = -3.482_206_278_201_666_4e-9;
/// sin(x) / x in powers of x^2: 1, -1/3!, 1/5! and so on.
const SINE: [f64; 11] = [
    1.0,
    -1.666_666_666_666_666_6e-1,
    8.333_333_333_333_333e-3,
    -1.984_126_984_126_984e-4,
    2.755_731_922_398_589_3e-6,
    -2.505_210_838_544_172e-8,
    1.605_904_383_682_161_3e-10,
    -7.647_163_731_819_816e-13,
    2.811_457_254_345_520_6e-15,
    -8.220_635_246_624_33e-18,
    1.957_294_106_339_126_3e-20,
];

/// Cosine without branches, so that loops over it vectorise.
#[inline(always)]
fn cosine(angle_rad: f64) -> f64 {
    const SHIFT: f64 = 6_755_399_441_055_744.0; // 1.5 * 2^52: adding it rounds to a whole number
    let turns = (angle_rad * (1.0 / TAU) + SHIFT) - SHIFT;
    let half = 0.5 * ((angle_rad - turns * TAU_HIGH) - turns * TAU_LOW);
    let square = half * half;
    let sine = half * SINE.iter().rev().fold(0.0, |sum, term| sum * square + term);
    1.0 - 2.0 * sine * sine
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_polynomial_is_far_better_than_the_error_that_is_allowed_for() {
        for i in 0..200_000 {
            let angle = (f64::from(i) - 100_000.0) * (0.99e-5 * QUICK_PHASE_MAX_RAD);
            assert!((cosine(angle) - angle.cos()).abs() < 0.05 * QUICK_ERROR, "{angle}");
        }
        assert!(cosine(f64::NAN).is_nan());
    }

    #[test]
    fn light_next_to_a_rounding_limit_is_not_certain() {
        let bench = Bench::reference();
        let lights = [(); 4].map(|()| Light::fringes(36.0, 0.1));
        let quick = Quick::new(&bench, &lights, &RenderOptions::default()).expect("sinusoids");
        let limit = f64::from(0.5f32) + 0.5 * f64::from(f32::EPSILON) * 0.5;
        assert_eq!(quick.certain([0.25, 0.25, 0.25, limit]), None);
        assert_eq!(quick.certain([0.25, 0.25, 0.25, limit + 1e-10]).map(|light| light[0]), Some(0.25));
        let bent = RenderOptions { projector_exponent: [2.2; 4], ..RenderOptions::default() };
        assert!(Quick::new(&bench, &lights, &bent).is_none());
    }
}
