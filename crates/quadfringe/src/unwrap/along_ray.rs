//! Fringe orders by the light of both projectors where they really stand.

use crate::FringeCode;
use crate::angle::{round, wrap_positive};
use std::f32::consts::TAU;

/// Pixels that are searched together.
const BLOCK: usize = 64;

/// What is known of the rays of a row of pixels, an entry for each pixel.
#[derive(Debug, Clone, Copy)]
pub struct RayRow<'a> {
    /// The infrared phase in rad as a cubic of the first absolute phase, from the constant term up.
    pub infrared: [&'a [f32]; 4],
    /// Least and greatest first absolute phase in rad that a surface on the ray can have; NaN where there is none.
    pub range_rad: [&'a [f32]; 2],
}

impl RayRow<'_> {
    /// The infrared phase in rad, not wrapped, at a pixel of the row whose first absolute phase is known.
    #[must_use]
    pub fn infrared_rad(&self, column: usize, phase_rad: f32) -> f32 {
        let [e0, e1, e2, e3] = self.infrared.map(|line| line[column]);
        e0 + phase_rad * (e1 + phase_rad * (e2 + phase_rad * e3))
    }
}

/// Orders of one pixel at a time, searched along the camera ray: each candidate is a point of the ray, which both
/// projectors light with phases that are known. The one that the second and third phase agree with best wins, whether
/// the projectors are coaxial or not.
#[derive(Debug, Clone)]
pub(crate) struct AlongRay {
    /// Second fringe number over the first.
    ratio: f32,
    /// Square of the distance of neighbouring candidates, turns.
    apart: f32,
}

impl AlongRay {
    pub fn new(code: &FringeCode) -> Self {
        let numbers = code.numbers();
        let apart = code.ambiguity_margin_rad() as f32 / TAU;
        Self { ratio: (numbers[1] / numbers[0]) as f32, apart: apart * apart }
    }

    /// Order a row of pixels: absolute phase, and 1 when the second and third phase are met exactly, 0 when another
    /// candidate is as good; NaN in, NaN out, and where no candidate lies on the ray.
    #[inline(always)]
    pub fn order_row(&self, wrapped: [&[f32]; 3], rays: &RayRow<'_>, phase: &mut [f32], margin: &mut [f32]) {
        let out = phase.chunks_mut(BLOCK).zip(margin.chunks_mut(BLOCK));
        for (block, (phase, margin)) in out.enumerate() {
            let at = block * BLOCK..block * BLOCK + phase.len();
            let wrapped = wrapped.map(|row| &row[at.clone()]);
            let rays = RayRow {
                infrared: rays.infrared.map(|row| &row[at.clone()]),
                range_rad: rays.range_rad.map(|row| &row[at.clone()]),
            };
            self.order_block(wrapped, &rays, phase, margin);
        }
    }

    #[inline(always)]
    fn order_block(&self, wrapped: [&[f32]; 3], rays: &RayRow<'_>, phase: &mut [f32], margin: &mut [f32]) {
        let ([first, second, third], [low, high]) = (wrapped, rays.range_rad);
        let [e0, e1, e2, e3] = rays.infrared;
        let count = phase.len();
        let (mut least, mut next) = ([f32::INFINITY; BLOCK], [self.apart; BLOCK]);
        // Neighbours have nearly the same candidates.
        let ends =
            (low.iter().fold(f32::INFINITY, |a, b| a.min(*b)), high.iter().fold(0.0, |a: f32, b| a.max(*b)));
        let orders = (ends.0 / TAU).floor() as i32 - 1..(ends.1 / TAU).ceil() as i32;
        for order in orders {
            let turns = TAU * order as f32;
            for i in 0..count {
                let guess = wrap_positive(first[i]) + turns;
                let infrared = e0[i] + guess * (e1[i] + guess * (e2[i] + guess * e3[i]));
                let cost = miss(guess * self.ratio, second[i]) + miss(infrared, third[i]);
                let on_the_ray = (guess >= low[i]) & (guess <= high[i]);
                let cost = if on_the_ray { cost } else { f32::INFINITY };
                let better = cost < least[i];
                let behind = if better { least[i] } else { cost };
                next[i] = if behind < next[i] { behind } else { next[i] };
                least[i] = if better { cost } else { least[i] };
                phase[i] = if better { guess } else { phase[i] };
            }
        }
        for i in 0..count {
            let found = least[i].is_finite();
            let lead = 1.0 - (least[i] / next[i].max(f32::MIN_POSITIVE)).sqrt();
            phase[i] = if found { phase[i] } else { f32::NAN };
            margin[i] = if found { lead.max(0.0) } else { f32::NAN };
        }
    }
}

/// Squared difference of two angles in turns, whole turns left out.
#[inline(always)]
fn miss(predicted: f32, seen: f32) -> f32 {
    let turns = (predicted - seen) * (1.0 / TAU);
    let rest = turns - round(turns);
    rest * rest
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::angle::wrap;

    fn search(first: f32, infrared: [f32; 4], range: [f32; 2], truth: f32) -> (f32, f32) {
        let code = FringeCode::optimum(36, 912).expect("valid code");
        let [e0, e1, e2, e3] = infrared;
        let seen = e0 + truth * (e1 + truth * (e2 + truth * e3));
        let wrapped = [wrap(first), wrap(truth * 35.0 / 36.0), wrap(seen)].map(|v| [v]);
        let (coefficients, range) = (infrared.map(|v| [v]), range.map(|v| [v]));
        let rays = RayRow {
            infrared: coefficients.each_ref().map(|v| v.as_slice()),
            range_rad: range.each_ref().map(|v| v.as_slice()),
        };
        let (mut phase, mut margin) = ([0.0], [0.0]);
        let wrapped = wrapped.each_ref().map(|v| v.as_slice());
        AlongRay::new(&code).order_row(wrapped, &rays, &mut phase, &mut margin);
        (phase[0], margin[0])
    }

    #[test]
    fn a_pair_that_is_far_from_coaxial_is_ordered_right() {
        for i in 0..2000 {
            let truth = 0.11 * i as f32;
            let (phase, margin) = search(truth, [4.0, 0.85, -1e-4, 1e-7], [-0.3, 226.5], truth);
            assert!((phase - truth).abs() < 1e-3 && margin > 0.98, "{truth}: {phase} {margin}");
        }
    }

    #[test]
    fn candidates_end_with_the_ray() {
        let coaxial = [0.0, 30.0 / 36.0, 0.0, 0.0];
        let (phase, margin) = search(100.0, coaxial, [60.0, 90.0], 100.0);
        assert!((60.0..=90.0).contains(&phase) && margin < 0.2, "{phase} {margin}");
        for range in [[f32::NAN, f32::NAN], [99.0, 99.5]] {
            assert!(search(100.0, coaxial, range, 100.0).0.is_nan());
        }
        assert!(search(f32::NAN, coaxial, [0.0, 226.0], 100.0).0.is_nan());
    }
}
