//! Fringe orders along the camera ray, for two calibrated projectors.
//!
//! Each candidate order of the first phase is a point on the camera ray. Both projectors are calibrated, so the second and
//! the third phase at this point are known. The candidate whose phases agree best with the measured ones wins. The
//! projectors need not be coaxial.

use super::Phases;
use crate::encoding::FourChannel;
use crate::parallel::angle::{round, wrap_positive};
use std::f32::consts::TAU;

/// Number of pixels that are searched together, as vectors.
const BLOCK: usize = 64;

/// The rays of a row of pixels, with one entry per pixel.
///
/// ```
/// use quadfringe::stages::RayRow;
/// // Coaxial projectors: the infrared phase is 30 / 36 of the first one.
/// let (zero, ratio, end) = ([0.0], [30.0 / 36.0], [226.0]);
/// let row = RayRow { infrared: [&zero, &ratio, &zero, &zero], low_rad: &zero, high_rad: &end };
/// assert!((row.infrared_rad(0, 36.0) - 30.0).abs() < 1e-5);
/// ```
#[derive(Debug, Clone, Copy)]
pub struct RayRow<'a> {
    /// Coefficients of the infrared phase in rad as a cubic of the first absolute phase, from the constant term up.
    pub infrared: [&'a [f32]; 4],
    /// Least first absolute phase in rad that a surface on the ray can have; NaN if there is none.
    pub low_rad: &'a [f32],
    /// Greatest such phase in rad. The two differ by no more than the width of the field.
    pub high_rad: &'a [f32],
}

impl RayRow<'_> {
    /// The infrared phase in rad, not wrapped, for the first absolute phase of a pixel of the row.
    #[must_use]
    pub fn infrared_rad(&self, column: usize, phase_rad: f32) -> f32 {
        let [e0, e1, e2, e3] = self.infrared.map(|line| line[column]);
        e0 + phase_rad * (e1 + phase_rad * (e2 + phase_rad * e3))
    }
}

/// Search along the camera ray, one pixel at a time.
///
/// If the beat of the first two fringe numbers has one fringe over the field, it gives an estimate that limits the
/// candidates: a candidate that is further from it than half a fringe of the beat with the third number cannot win.
#[derive(Debug, Clone)]
pub(crate) struct AlongRay {
    /// Second fringe number divided by the first.
    ratio: f32,
    /// Squared distance between the phases of the two closest candidates, turns^2.
    apart: f32,
    near: Option<Near>,
}

/// Candidates near the estimate that the beat of the first two phases gives.
#[derive(Debug, Clone, Copy)]
struct Near {
    /// 1, or -1 if the second fringe number is greater than the first.
    sign: f32,
    /// Number of orders after which all phases but the infrared one repeat.
    cycle: f32,
    /// Number of candidates on each side of the estimate.
    reach: i32,
}

impl Near {
    fn of(numbers: Phases<f64>) -> Option<Self> {
        let Phases { quadrature: first, green: second, infrared: third } = numbers;
        let whole = first.fract() == 0.0 && (first - second).abs() == 1.0;
        let reach = (0.5 * first / (first - third).abs()).ceil();
        let shorter = 2.0 * reach + 1.0 < first;
        (whole && shorter).then_some(Self {
            sign: (first - second) as f32,
            cycle: first as f32,
            reach: reach as i32,
        })
    }
}

/// Least and second least cost of the candidates so far, for a block of pixels. Costs are not negative, so their bits,
/// read as integers, have the same order. A choice between integers compiles without masked stores; a choice between
/// floating-point numbers needs them.
struct Best {
    least: [u32; BLOCK],
    next: [u32; BLOCK],
}

impl AlongRay {
    pub fn new(code: &FourChannel) -> Self {
        let numbers = Phases::from_array(code.numbers());
        let apart = code.ambiguity_margin_rad as f32 / TAU;
        let ratio = (numbers.green / numbers.quadrature) as f32;
        Self { ratio, apart: apart * apart, near: Near::of(numbers) }
    }

    /// Absolute phase and margin of a row of pixels. The margin is 1 if the second and the third phase agree exactly, and
    /// 0 if another candidate agrees equally well. NaN in, NaN out; NaN also where no candidate lies on the ray.
    #[inline(always)]
    pub fn order_row(
        &self,
        wrapped: Phases<&[f32]>,
        rays: &RayRow<'_>,
        phase: &mut [f32],
        margin: &mut [f32],
    ) {
        let out = phase.chunks_mut(BLOCK).zip(margin.chunks_mut(BLOCK));
        for (block, (phase, margin)) in out.enumerate() {
            let at = block * BLOCK..block * BLOCK + phase.len();
            let wrapped = wrapped.map(|row| &row[at.clone()]);
            let rays = RayRow {
                infrared: rays.infrared.map(|row| &row[at.clone()]),
                low_rad: &rays.low_rad[at.clone()],
                high_rad: &rays.high_rad[at.clone()],
            };
            let mut best = Best::beyond(self.apart);
            match self.near {
                Some(near) => self.try_near(near, wrapped, &rays, &mut best, phase),
                None => self.try_all(wrapped, &rays, &mut best, phase),
            }
            best.finish(phase, margin);
        }
    }

    /// Try the candidates near the estimate of the beat of the first two phases.
    #[inline(always)]
    fn try_near(
        &self,
        near: Near,
        wrapped: Phases<&[f32]>,
        rays: &RayRow<'_>,
        best: &mut Best,
        phase: &mut [f32],
    ) {
        let Phases { quadrature: first, green: second, .. } = wrapped;
        let (low, high) = (rays.low_rad, rays.high_rad);
        let mut start = [0.0; BLOCK];
        for i in 0..phase.len() {
            let fine = wrap_positive(first[i]);
            let coarse = wrap_positive((first[i] - second[i]) * near.sign) * near.cycle;
            start[i] = fine + TAU * round((coarse - fine) * (1.0 / TAU));
        }
        let cycle = TAU * near.cycle;
        for step in -near.reach..=near.reach {
            let turns = TAU * step as f32;
            let guess = |i: usize| {
                // The beat has the same phase at both ends of the field, so the estimate may lie a cycle off.
                let guess = start[i] + turns;
                let guess = if guess > high[i] { guess - cycle } else { guess };
                if guess < low[i] { guess + cycle } else { guess }
            };
            self.try_one(guess, wrapped, rays, best, phase);
        }
    }

    /// Try every order that a pixel of the block can have.
    #[inline(always)]
    fn try_all(&self, wrapped: Phases<&[f32]>, rays: &RayRow<'_>, best: &mut Best, phase: &mut [f32]) {
        let low = rays.low_rad.iter().fold(f32::INFINITY, |a, b| a.min(*b));
        let high = rays.high_rad.iter().fold(0.0, |a: f32, b| a.max(*b));
        for order in (low / TAU).floor() as i32 - 1..(high / TAU).ceil() as i32 {
            let turns = TAU * order as f32;
            self.try_one(|i| wrap_positive(wrapped.quadrature[i]) + turns, wrapped, rays, best, phase);
        }
    }

    /// Try one candidate for each pixel.
    #[inline(always)]
    fn try_one(
        &self,
        guess: impl Fn(usize) -> f32,
        wrapped: Phases<&[f32]>,
        rays: &RayRow<'_>,
        best: &mut Best,
        phase: &mut [f32],
    ) {
        let Phases { green: second, infrared: third, .. } = wrapped;
        let (low, high) = (rays.low_rad, rays.high_rad);
        let [e0, e1, e2, e3] = rays.infrared;
        for i in 0..phase.len() {
            let guess = guess(i);
            let infrared = e0[i] + guess * (e1[i] + guess * (e2[i] + guess * e3[i]));
            let cost =
                squared_difference(guess * self.ratio, second[i]) + squared_difference(infrared, third[i]);
            let on_the_ray = (guess >= low[i]) & (guess <= high[i]);
            let cost = if on_the_ray { cost } else { f32::INFINITY };
            let cost = cost.to_bits();
            let least = best.least[i];
            best.next[i] = best.next[i].min(cost.max(least));
            best.least[i] = least.min(cost);
            phase[i] = if cost < least { guess } else { phase[i] };
        }
    }
}

impl Best {
    /// The state before the first candidate. The second least cost starts at `apart` and cannot exceed it.
    #[inline(always)]
    fn beyond(apart: f32) -> Self {
        Self { least: [f32::INFINITY.to_bits(); BLOCK], next: [apart.to_bits(); BLOCK] }
    }

    /// Writes the margins. Phase and margin become NaN where there was no candidate.
    #[inline(always)]
    fn finish(&self, phase: &mut [f32], margin: &mut [f32]) {
        for (i, (phase, margin)) in phase.iter_mut().zip(margin).enumerate() {
            let [least, next] = [&self.least, &self.next].map(|costs| f32::from_bits(costs[i]));
            let found = least.is_finite();
            let lead = 1.0 - (least / next.max(f32::MIN_POSITIVE)).sqrt();
            *phase = if found { *phase } else { f32::NAN };
            *margin = if found { lead.max(0.0) } else { f32::NAN };
        }
    }
}

/// Squared difference of two angles in turns, modulo whole turns.
#[inline(always)]
fn squared_difference(predicted: f32, seen: f32) -> f32 {
    let turns = (predicted - seen) * (1.0 / TAU);
    let rest = turns - round(turns);
    rest * rest
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::encoding::Encoding;
    use crate::parallel::angle::wrap;

    const COAXIAL: [f32; 4] = [0.0, 30.0 / 36.0, 0.0, 0.0];
    const APART: [f32; 4] = [4.0, 0.85, -1e-4, 1e-7];

    fn optimum() -> AlongRay {
        AlongRay::new(&FourChannel::of(Encoding::optimum(36, 912)))
    }

    /// Phase and margin found for a pixel with the absolute phase `truth`, after `noise` is added to its three phases.
    fn search(
        way: &AlongRay,
        infrared: [f32; 4],
        range: [f32; 2],
        truth: f32,
        noise: [f32; 3],
    ) -> (f32, f32) {
        let [e0, e1, e2, e3] = infrared;
        let seen = e0 + truth * (e1 + truth * (e2 + truth * e3));
        let exact = [truth, truth * way.ratio, seen];
        let wrapped = Phases::from_array(std::array::from_fn(|i| [wrap(exact[i] + noise[i])]));
        let (coefficients, [low, high]) = (infrared.map(|v| [v]), range.map(|v| [v]));
        let rays = RayRow {
            infrared: coefficients.each_ref().map(|v| v.as_slice()),
            low_rad: &low,
            high_rad: &high,
        };
        let (mut phase, mut margin) = ([0.0], [0.0]);
        way.order_row(wrapped.as_ref().map(|v| v.as_slice()), &rays, &mut phase, &mut margin);
        (phase[0], margin[0])
    }

    #[test]
    fn orders_are_right_for_projectors_far_from_coaxial() {
        let other = FourChannel::of(Encoding::four_channel([1920.0 / 42.0, 1920.0 / 45.0, 40.0], 1920));
        let backwards = FourChannel::of(Encoding::four_channel([35.0, 36.0, 30.0], 912));
        for way in [optimum(), AlongRay::new(&other), AlongRay::new(&backwards)] {
            for i in 0..1990 {
                let truth = 0.11 * i as f32;
                let (phase, margin) = search(&way, APART, [-0.3, 219.5], truth, [0.0; 3]);
                assert!((phase - truth).abs() < 1e-3 && margin > 0.97, "{way:?} {truth}: {phase} {margin}");
            }
        }
    }

    #[test]
    fn near_candidates_are_as_good_as_all() {
        let near = optimum();
        let all = AlongRay { near: None, ..near.clone() };
        assert!(near.near.is_some());
        for i in 0..4000 {
            let truth = 0.0564 * i as f32 + 0.12;
            let stray = |k: f32| 0.12 * (k * i as f32).sin();
            let noise = [stray(1.3), stray(2.7), stray(3.9)];
            let found = [&near, &all].map(|way| search(way, APART, [-0.124, 226.07], truth, noise));
            assert!((found[0].0 - found[1].0).abs() < 1e-3, "{truth}: {found:?}");
            assert!((found[0].0 - truth).abs() < 0.5, "{truth}: {found:?}");
        }
    }

    #[test]
    fn candidates_end_with_the_ray() {
        for way in [optimum(), AlongRay { near: None, ..optimum() }] {
            let none = [0.0; 3];
            let (phase, margin) = search(&way, COAXIAL, [60.0, 90.0], 100.0, none);
            assert!(phase.is_nan() || ((60.0..=90.0).contains(&phase) && margin < 0.2), "{phase} {margin}");
            for range in [[f32::NAN, f32::NAN], [99.0, 99.5]] {
                assert!(search(&way, COAXIAL, range, 100.0, none).0.is_nan());
            }
            assert!(search(&way, COAXIAL, [0.0, 226.0], f32::NAN, none).0.is_nan());
        }
    }
}
