//! Steps 1 to 7 on a strip of a few rows, which is small enough to stay in the nearest cache.

mod alone;
mod pairs;

use super::Unwrapping;
use super::uncertainty::{ShotStatistics, two_step_sigma};
use crate::condition::{Plan, Sample};
use crate::decode::output::OutputRow;
use crate::parallel::Aligned;
use crate::parallel::angle::{atan2, coarse_atan2};
use crate::stages::{
    self, Background, BackgroundScratch, Blocks, Half, Interpolation, Judged, Limits, Phases, RowFilter,
    RowPair, RowScratch, coarsen, lesser, row_background, with_turns_of,
};
use crate::{Reason, Shot};
pub(super) use alone::Alone;
use alone::MeansRow;
use multiversion::multiversion;
pub(super) use pairs::FourierPair;
use pairs::Quadrature;

/// The published background: half the sum of the envelopes.
const BACKGROUND: Background = Background::MeanEnvelope;

/// The data that all strips of a shot share.
pub(super) struct StripPlan<'a> {
    pub conditioning: &'a Plan,
    pub unwrapping: &'a Unwrapping,
    /// Fourier filter for rows of block means.
    pub filter: &'a RowFilter,
    /// Whether there is a third phase, of IR or of B alone.
    pub third: bool,
    /// The Fourier filter for R if B is not in quadrature with it. B then has the place of IR.
    pub alone: Option<Alone>,
    /// Weights of the filter for G and IR.
    pub weights: FourierPair<Vec<f32>>,
    /// A strip has the rows of one block.
    pub blocks: Blocks,
    /// Fringe periods along the rows in camera pixels.
    pub periods_px: Phases<f32>,
    pub limits: Limits,
    pub statistics: ShotStatistics,
}

type Row = Aligned<f32>;

/// Working rows of one task.
#[derive(Debug, Default)]
pub(super) struct Strip {
    /// Light of R and B for each row.
    quadrature: Vec<Quadrature<Row>>,
    /// Light of G and IR of the row that was read last.
    others: FourierPair<Row>,
    /// Columns without infrared light for each row.
    gaps: Vec<Vec<usize>>,
    /// First the sums of R and B over the rows, then the means minus the background.
    quadrature_means: Quadrature<Row>,
    /// Background of the means of R and B.
    levels: Quadrature<Row>,
    /// Sums of G and IR over the rows.
    sums: FourierPair<Row>,
    /// Block means of G and IR minus their background.
    fringes: FourierPair<Row>,
    /// Phases of the block means at every pixel: wrapped for R and B, up to whole turns for G and IR.
    phases: Phases<Row>,
    /// The smaller of the squared modulations of G and IR; that of G without infrared.
    power: Row,
    /// Absolute phase of the means.
    absolute: Row,
    /// Margin of its order, and (`wrong`) the probability that the order is wrong.
    margin: Row,
    wrong: Row,
    coarse: Row,
    spare: Row,
    background: BackgroundScratch,
    fourier: RowScratch,
    interpolation: Interpolation,
}

/// Decodes the rows of `out`, which start at row `y`, to phase, modulation and quality. Fused multiply-add is not
/// enabled, so the results are the same for vectors of any width.
#[multiversion(targets("x86_64+avx2"))]
pub(super) fn decode_strip<T: Sample>(
    strip: &mut Strip,
    plan: &StripPlan<'_>,
    shot: &Shot<'_, T>,
    y: usize,
    out: &mut [OutputRow<'_>],
) {
    strip.resize(plan, out[0].phase.len());
    // 1. Linear light (S1).
    for i in 0..out.len() {
        plan.conditioning.row(shot, y + i, &mut strip.light_of(i, plan.alone.is_some()));
        stages::fill_row_gaps(&mut strip.others.infrared, &mut strip.gaps[i]);
        strip.sum(i);
    }
    // 2. and 3. Background and two-step phase of the means of R and B (S2).
    let ratio = strip.two_step(plan, out.len());
    // 2. and 4. Background and Fourier phase of the block means of G and IR (S3).
    strip.fourier(plan, out.len());
    if let Some(alone) = &plan.alone {
        // 4. Without a quadrature, also of R.
        strip.fourier_red(plan, alone);
    }
    // 5. Fringe orders of the means (S4).
    strip.order(y + out.len() / 2, plan);
    // 6. and 7. Absolute two-step phase of single pixels, its uncertainty, and no data where the modulation is low.
    for (i, row) in out.iter_mut().enumerate() {
        match &plan.alone {
            None => strip.row(i, ratio, plan, row),
            Some(alone) => alone.write(strip.means(i), plan.statistics.noise, plan.limits, row),
        }
    }
}

impl Strip {
    /// Adapts rows that may have been used for another image.
    #[inline(always)]
    fn resize(&mut self, plan: &StripPlan<'_>, width: usize) {
        self.quadrature.resize_with(plan.blocks.rows, Default::default);
        self.gaps.resize_with(plan.blocks.rows, Default::default);
        let Phases { quadrature, green, infrared } = &mut self.phases;
        let phases = [quadrature, green, infrared];
        let rows = self.quadrature.iter_mut().flat_map(Quadrature::both_mut).chain(self.others.both_mut());
        let rows = rows.chain(self.quadrature_means.both_mut()).chain(self.levels.both_mut());
        let rows = rows.chain(self.sums.both_mut()).chain(phases);
        rows.chain([&mut self.power, &mut self.absolute, &mut self.margin, &mut self.wrong])
            .for_each(|row| row.resize(width));
        plan.filter.ready(&mut self.fourier);
    }

    /// Computes phase and modulation of R from the means of the rows, whose background is removed.
    #[inline(always)]
    fn fourier_red(&mut self, plan: &StripPlan<'_>, alone: &Alone) {
        let pixels = plan.blocks.columns;
        let period = plan.periods_px.quadrature / pixels as f32;
        let Self { quadrature_means, coarse, spare, power, phases, .. } = self;
        coarsen(&quadrature_means.red, pixels, coarse, spare);
        let both = RowPair { real: &**coarse, imaginary: &**coarse };
        plan.filter.transform(both, RowPair { real: period, imaginary: period }, &mut self.fourier);
        let signal = plan.filter.analytic(Half::Real, &alone.weights, &mut self.fourier);
        self.interpolation.run_for(pixels, signal, &mut phases.quadrature, power);
    }

    /// What the means of the rows say about row `i`.
    fn means(&self, i: usize) -> MeansRow<'_> {
        MeansRow {
            absolute: &self.absolute,
            margin: &self.margin,
            wrong: &self.wrong,
            power: &self.power,
            light: &self.quadrature[i].red,
            level: &self.levels.red,
        }
    }

    /// Rows for the linear light of R, G, B, IR of row `i`. B `alone` has the place of IR, which is dark.
    #[inline(always)]
    fn light_of(&mut self, i: usize, alone: bool) -> [&mut [f32]; 4] {
        let Quadrature { red, blue } = &mut self.quadrature[i];
        let FourierPair { green, infrared } = &mut self.others;
        let [blue, infrared] = if alone { [infrared, blue] } else { [blue, infrared] };
        [red, green, blue, infrared].map(|row| &mut **row)
    }

    /// Working rows for the linear light of a single row of `width` pixels, outside a strip.
    pub fn light(&mut self, width: usize) -> [&mut [f32]; 4] {
        if self.quadrature.is_empty() {
            self.quadrature.resize_with(1, Default::default);
        }
        let rows = self.quadrature[0].both_mut().into_iter().chain(self.others.both_mut());
        rows.for_each(|row| row.resize(width));
        self.light_of(0, false)
    }

    /// Linear red light of this single row.
    pub fn red(&self) -> &[f32] {
        &self.quadrature[0].red
    }

    /// Linear blue light of this single row.
    pub fn blue(&self) -> &[f32] {
        &self.quadrature[0].blue
    }

    /// Adds row `i` of the strip to the sums.
    #[inline(always)]
    fn sum(&mut self, i: usize) {
        for (sum, light) in self.sums.both_mut().into_iter().zip(self.others.both_mut()) {
            if i == 0 {
                std::mem::swap(sum, light);
            } else {
                stages::add(light, sum);
            }
        }
        let light = self.quadrature[i].both_mut();
        for (sum, light) in self.quadrature_means.both_mut().into_iter().zip(light) {
            if i == 0 {
                sum.copy_from_slice(light);
            } else {
                stages::add(light, sum);
            }
        }
    }

    /// Computes the background of the means of R and B over `rows` rows, and the phase of these means. Returns the
    /// modulation of R divided by the modulation of B.
    #[inline(always)]
    fn two_step(&mut self, plan: &StripPlan<'_>, rows: usize) -> f32 {
        let Self { quadrature_means, levels, background, phases, .. } = self;
        for (mean, level) in quadrature_means.both_mut().into_iter().zip(levels.both_mut()) {
            stages::scale(mean, rows);
            row_background(mean, BACKGROUND, plan.periods_px.quadrature, background, level);
            mean.iter_mut().zip(&**level).for_each(|(mean, level)| *mean -= level);
        }
        let Quadrature { red, blue } = &*quadrature_means;
        let ratio = stages::row_modulation_ratio(red, blue);
        for ((phase, red), blue) in phases.quadrature.iter_mut().zip(&**red).zip(&**blue) {
            *phase = coarse_atan2(-blue * ratio, *red);
        }
        ratio
    }

    /// Computes phases and modulations of G and IR from their means over blocks of `rows` rows.
    #[inline(always)]
    fn fourier(&mut self, plan: &StripPlan<'_>, rows: usize) {
        let pixels = plan.blocks.columns;
        let Phases { green, infrared, .. } = plan.periods_px.map(|period_px| period_px / pixels as f32);
        let Self { sums, fringes, coarse, spare, background, .. } = self;
        let channels = sums.both_mut().into_iter().zip([green, infrared]).zip(fringes.both_mut());
        for ((sum, period), fringes) in channels {
            coarsen(sum, pixels, coarse, spare);
            stages::scale(coarse, rows);
            fringes.resize(coarse.len());
            row_background(coarse, BACKGROUND, period, background, fringes);
            fringes.iter_mut().zip(&**coarse).for_each(|(level, mean)| *level = mean - *level);
        }
        let FourierPair { green: green_fringes, infrared: infrared_fringes } = &self.fringes;
        let fringes = RowPair { real: &**green_fringes, imaginary: &**infrared_fringes };
        plan.filter.transform(fringes, RowPair { real: green, imaginary: infrared }, &mut self.fourier);
        self.power.fill(f32::INFINITY);
        let channels = [
            (Half::Real, &plan.weights.green, &mut self.phases.green),
            (Half::Imaginary, &plan.weights.infrared, &mut self.phases.infrared),
        ];
        for (half, weights, phase) in channels.into_iter().take(if plan.third { 2 } else { 1 }) {
            let signal = plan.filter.analytic(half, weights, &mut self.fourier);
            self.interpolation.run_for(pixels, signal, phase, &mut self.power);
        }
    }

    /// Computes the absolute phase of the means; a search along camera rays uses the rays of row `y`.
    #[inline(always)]
    fn order(&mut self, y: usize, plan: &StripPlan<'_>) {
        let Self { phases, absolute, margin, wrong, .. } = self;
        let wrapped = phases.as_ref().map(|row| &**row);
        match plan.unwrapping {
            Unwrapping::Ladder(ladder) => ladder.order_row(wrapped, absolute, margin),
            Unwrapping::AlongRay(table) => table.order_row(y, wrapped, absolute, margin),
        }
        plan.statistics.wrong_orders.row(margin, wrong);
    }

    /// Writes the results of row `i`: the two-step phase of each pixel with the whole turns of the means, and its
    /// uncertainty. The phase is NaN where the modulation or the margin is too low.
    #[inline(always)]
    fn row(&self, i: usize, ratio: f32, plan: &StripPlan<'_>, out: &mut OutputRow<'_>) {
        let (noise, limits) = (plan.statistics.noise, plan.limits);
        let Quadrature { red, blue } = &self.quadrature[i];
        let fringes = red.iter().zip(&*self.levels.red).zip(blue.iter().zip(&*self.levels.blue));
        let known = self.absolute.iter().zip(&*self.margin).zip(&*self.power);
        let maps = out.phase.iter_mut().zip(out.quality.iter_mut()).zip(out.reason.iter_mut());
        let maps = maps.zip(out.modulation.iter_mut().zip(out.sigma.iter_mut()));
        for ((fringes, known), (((phase, quality), reason), (modulation, sigma))) in
            fringes.zip(known).zip(maps)
        {
            let (((red, red_level), (blue, blue_level)), ((absolute, margin), power)) = (fringes, known);
            // A quarter period apart, fringes of the two are never dark together.
            let light = red.max(*blue);
            let (red, blue) = (red - red_level, (blue - blue_level) * ratio);
            *sigma = two_step_sigma(red, blue, ratio, noise);
            *modulation = lesser(*power, red * red + blue * blue).sqrt();
            let judged = Judged::of(*margin, *modulation, limits);
            *phase = judged.phase(with_turns_of(*absolute, atan2(-blue, red)));
            *quality = judged.quality(*margin);
            *reason = judged.reason(light, limits);
        }
        out.wrong.copy_from_slice(&self.wrong);
        for &x in &self.gaps[i] {
            [out.phase[x], out.quality[x], out.modulation[x]] = [f32::NAN; 3];
            out.reason[x] = Reason::NoImage;
        }
    }
}
