//! The steps that lower the energy of a tile, and what they have found.

use super::blocks::information;
use super::data::linearise;
use super::plane::{Column, vectors};
use super::priors::weigh;
use super::scales::{Determined, Scales};
use super::solve::solve;
use super::start::contrast_and_albedo;
use super::tile::{Found, Tile};
use super::variance::variance;
use crate::joint::model::{absent, count};
use crate::joint::params::energy::{BEND_GROWTH, DETAIL_STEPS, OUTER_STEPS, RESTING_RAD, SIDE, STEP_MAX};
use crate::parallel::exp::exp;
use crate::parallel::lanes::{LANES, Lanes};

/// Writes albedo and contrast of a vector of cells.
#[inline(always)]
fn write_light(cells: &Column, inside: Lanes, at: usize, found: &mut Found) {
    let [red, green, blue, infrared] = &mut found.albedo;
    let planes = [red, green, blue, infrared, &mut found.contrast];
    let [red, green, blue, infrared] = &cells.albedo;
    for (plane, logarithm) in planes.into_iter().zip([red, green, blue, infrared, &cells.contrast]) {
        let mut value = [0.0; LANES];
        for x in 0..LANES {
            value[x] = inside[x] * exp(logarithm[x]);
        }
        plane.set(at, value);
    }
}

impl Tile {
    /// Minimises the energy. The phase and the light must be set; `noise` is the variance of the intensity of a cell, and `detail` the
    /// factor by which narrower relief is kept than the shot suggests.
    pub fn minimise(&mut self, noise: f32, detail: f32) {
        self.scales = Scales { noise, misfit: 1.0, ..Scales::default() };
        self.unknown.phase.copy(&self.start);
        self.spread.clear();
        contrast_and_albedo(self, 1.0);
        self.descend(noise, self.scales.bend, OUTER_STEPS);
        self.restart(noise);
        let sums = linearise(self);
        self.scales.estimate_noise(&sums, self.ratios, noise..=f32::INFINITY);
        self.bend = self.scales.bend;
        if detail != 1.0 {
            self.resolve(detail);
        }
        weigh(self);
    }

    /// Descends once more, with the scales that were found but for that of the surface (J36).
    fn resolve(&mut self, detail: f32) {
        self.scales.bend *= detail.powi(4);
        for _ in 0..DETAIL_STEPS {
            weigh(self);
            solve(self);
            self.advance();
            linearise(self);
        }
    }

    /// Lowers the energy from the present unknowns, and estimates the scales. `noise` is the least variance of the noise, and `bend_max`
    /// the greatest variance of the bending in the first step; it grows from step to step (J43). While it limits the surface, the noise
    /// may not rise, or it would explain what the surface may not. At most `steps` follow in which it does not.
    pub(super) fn descend(&mut self, noise: f32, mut bend_max: f32, steps: usize) {
        self.scales.determined = Determined::default();
        let (mut outer, mut free, mut limited) = (0, 0, false);
        while free < steps {
            let sums = linearise(self);
            let most = if limited { self.scales.misfit } else { f32::INFINITY };
            self.scales.estimate_noise(&sums, self.ratios, noise..=most);
            let sums = weigh(self);
            if outer > 0 {
                let channels = count(self.ratios);
                let information = information(&self.derivatives, &self.weights, self.ratios);
                bend_max *= BEND_GROWTH * BEND_GROWTH;
                self.scales.estimate_priors(&sums, information, channels, bend_max);
                weigh(self);
            }
            limited = self.scales.bend >= bend_max;
            solve(self);
            let moved = self.advance();
            debug_assert!(moved.is_finite(), "a step of a tile is not finite");
            free += usize::from(!limited);
            if outer > 1 && !limited && moved < RESTING_RAD {
                break;
            }
            outer += 1;
        }
    }

    /// Writes the correction of the phase, its variance, and the albedo and contrast of every channel; `noise` as in `minimise`.
    pub fn write(&mut self, noise: f32, found: &mut Found) {
        variance(self, noise, &mut found.variance);
        let Self { start, inside, unknown, scales, bend, ratios, .. } = self;
        for at in vectors() {
            let (phase, start) = (unknown.phase.get(at), start.get(at));
            let mut correction = [0.0; LANES];
            for x in 0..LANES {
                correction[x] = phase[x] - start[x];
            }
            found.correction.set(at, correction);
            found.inside.set(at, inside.get(at));
            write_light(&Column::of(unknown, at), inside.get(at), at, found);
        }
        if let Some(absent) = absent(*ratios) {
            // The channel has no albedo; its logarithm was 0.
            found.albedo[absent].clear();
        }
        found.channel_contrast = scales.channel_contrast;
        found.bend = *bend;
    }

    /// Adds the step to the unknowns; returns the root mean square of the change of the phase.
    fn advance(&mut self) -> f32 {
        let (mut squares, mut cells) = (0.0, 1e-9);
        let planes = self.unknown.planes_mut().into_iter().zip(self.step.planes());
        for (n, (unknown, step)) in planes.enumerate() {
            for y in 0..SIDE {
                for (unknown, step) in unknown.row_mut(y).iter_mut().zip(step.row(y)) {
                    let step = step.clamp(-STEP_MAX, STEP_MAX);
                    *unknown += step;
                    squares += if n == 0 { step * step } else { 0.0 };
                }
            }
        }
        for y in 0..SIDE {
            cells += self.inside.row(y).iter().sum::<f32>();
        }
        (squares / cells).sqrt()
    }
}
