//! Three colours of different fringe numbers: R has no channel in quadrature, and a Fourier filter gives its phase too.

use super::{Strip, StripPlan, coarsen};
use crate::decode::output::OutputRow;
use crate::stages::{Half, Judged, RowFilter, RowPair};

/// What the phase of R alone needs.
pub(in crate::published) struct Alone {
    /// Weights of the filter.
    weights: Vec<f32>,
    /// Standard deviation of the phase for unit noise of a pixel and a modulation of 1.
    noise_share: f32,
}

impl Alone {
    /// For blocks of `pixels` pixels.
    pub fn new(filter: &RowFilter, weights: Vec<f32>, pixels: usize) -> Self {
        let noise_share = filter.phase_noise(&weights) / (pixels as f32).sqrt();
        Self { weights, noise_share }
    }
}

impl Strip {
    /// Computes phase and modulation of R from the means of the rows, whose background is removed.
    #[inline(always)]
    pub(super) fn fourier_red(&mut self, plan: &StripPlan<'_>, alone: &Alone) {
        let pixels = plan.blocks.columns;
        let period = plan.periods_px.quadrature / pixels as f32;
        let Self { quadrature_means, coarse, spare, power, phases, .. } = self;
        coarsen(&quadrature_means.red, pixels, coarse, spare);
        let both = RowPair { real: &**coarse, imaginary: &**coarse };
        plan.filter.transform(both, RowPair { real: period, imaginary: period }, &mut self.fourier);
        let signal = plan.filter.analytic(Half::Real, &alone.weights, &mut self.fourier);
        self.interpolation.run_for(pixels, signal, &mut phases.quadrature, power);
    }

    /// Writes the results of row `i`: the phase of the means, which all rows of the strip share.
    #[inline(always)]
    pub(super) fn row_of_means(
        &self,
        i: usize,
        alone: &Alone,
        plan: &StripPlan<'_>,
        out: &mut OutputRow<'_>,
    ) {
        let deviation = plan.statistics.noise * alone.noise_share;
        let known = self.absolute.iter().zip(&*self.margin).zip(&*self.power);
        let light = self.quadrature[i].red.iter().zip(&*self.levels.red);
        let maps = out.phase.iter_mut().zip(out.quality.iter_mut()).zip(out.reason.iter_mut());
        let maps = maps.zip(out.modulation.iter_mut().zip(out.sigma.iter_mut()));
        for ((((absolute, margin), power), (red, level)), maps) in known.zip(light).zip(maps) {
            let (((phase, quality), reason), (modulation, sigma)) = maps;
            *modulation = power.sqrt();
            *sigma = deviation / modulation.max(1e-6);
            let judged = Judged::of(*margin, *modulation, plan.limits);
            *phase = judged.phase(*absolute);
            *quality = judged.quality(*margin);
            // A dark fringe of R has the light of its surroundings.
            *reason = judged.reason(red.max(*level), plan.limits);
        }
        out.wrong.copy_from_slice(&self.wrong);
    }
}
