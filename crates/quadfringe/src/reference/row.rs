//! One row through steps 1 to 4.

use super::demodulate::{BLOCK, Light, SetPlan, SetRow, Source};
use super::images::StepImages;
use super::noise::NoiseSamples;
use super::params::{SAMPLE_STRIDE, WRONG_MAX};
use super::search::{Found, Phases, Search, Variances};
use super::trust::Agreement;
use crate::Reason;
use crate::condition::Sample;
use crate::decode::output::{OutputRow, hole_unless};
use multiversion::multiversion;
use std::f32::consts::TAU;

/// Working memory of one task.
#[derive(Debug, Default)]
pub(super) struct Work {
    rows: Vec<SetRow>,
    phases: Phases,
    found: Found,
}

/// What all rows of a measurement share.
pub(super) struct RowPlan<'a, 'i, T> {
    pub images: &'a StepImages<'i, T>,
    pub plans: &'a [SetPlan],
    pub light: &'a Light,
    pub search: &'a Search,
    pub modulation_min: f32,
}

/// The statistics of a measurement, by which rows are written.
pub(super) struct Writer {
    pub variances: Variances,
    /// Share of pixels whose phases are arbitrary.
    pub strays: f32,
    /// Cost from which a pixel states more uncertainty than the others.
    pub usual: f32,
    /// The first fringe number.
    pub number: f32,
    /// Expected peak of the noise over all images, fraction of full scale.
    pub noise_peak: f32,
}

impl<'i, T: Sample> RowPlan<'_, 'i, T> {
    fn source(&self, k: usize, noise: f32) -> Source<'_, 'i, T> {
        Source { images: self.images, k, plan: &self.plans[k], light: self.light, noise }
    }

    /// Samples of the noise of row `y`, for each fringe number.
    pub fn noise(&self, work: &mut Work, y: usize) -> Vec<NoiseSamples> {
        demodulate_row(self, work, y, 0.0);
        let sampled = work.rows.iter().enumerate().map(|(k, fringes)| {
            let mut samples = NoiseSamples::default();
            samples.add(self.source(k, 0.0), y, fringes, self.modulation_min);
            samples
        });
        sampled.collect()
    }

    /// How well the phases of the lit pixels of row `y` agree, by noise alone.
    pub fn agreements(&self, work: &mut Work, y: usize, variances: Variances) -> Vec<Agreement> {
        let mut out = Vec::new();
        self.sample(work, y, variances, |phases, found, i| {
            out.push(Agreement { cost: found.cost[i], variance_rad2: phases.variance_rad2(i) });
        });
        out
    }

    /// Evidence of the lit pixels of row `y` that they are points.
    pub fn evidence(&self, work: &mut Work, y: usize, variances: Variances) -> Vec<f32> {
        let mut out = Vec::new();
        self.sample(work, y, variances, |_, found, i| out.push(found.evidence[i]));
        out
    }

    fn sample(
        &self,
        work: &mut Work,
        y: usize,
        variances: Variances,
        mut take: impl FnMut(&Phases, &Found, usize),
    ) {
        demodulate_row(self, work, y, variances.noise);
        let width = self.images.shape()[1];
        for b in 0..width.div_ceil(BLOCK) {
            search_block(self, work, b, variances);
            let lit = |x: &usize| work.rows.iter().all(|row| row.modulation[*x] >= self.modulation_min);
            let pixels = (b * BLOCK..width.min((b + 1) * BLOCK)).filter(|x| x % SAMPLE_STRIDE == 0);
            pixels.filter(lit).for_each(|x| take(&work.phases, &work.found, x - b * BLOCK));
        }
    }

    /// Decodes row `y`.
    pub fn decode(&self, work: &mut Work, y: usize, writer: &Writer, out: &mut OutputRow<'_>) {
        decode_row(self, work, y, writer, out);
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn demodulate_row<T: Sample>(plan: &RowPlan<'_, '_, T>, work: &mut Work, y: usize, noise: f32) {
    fill(plan, work, y, noise);
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn search_block<T: Sample>(plan: &RowPlan<'_, '_, T>, work: &mut Work, b: usize, variances: Variances) {
    work.phases.take(&work.rows, b, variances);
    plan.search.run(&work.phases, &mut work.found);
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn decode_row<T: Sample>(
    plan: &RowPlan<'_, '_, T>,
    work: &mut Work,
    y: usize,
    writer: &Writer,
    out: &mut OutputRow<'_>,
) {
    fill(plan, work, y, writer.variances.noise);
    for b in 0..out.phase.len().div_ceil(BLOCK) {
        work.phases.take(&work.rows, b, writer.variances);
        plan.search.run(&work.phases, &mut work.found);
        writer.write(plan.modulation_min, work, b, out);
    }
}

#[inline(always)]
fn fill<T: Sample>(plan: &RowPlan<'_, '_, T>, work: &mut Work, y: usize, noise: f32) {
    work.rows.resize_with(plan.plans.len(), SetRow::default);
    for (k, row) in work.rows.iter_mut().enumerate() {
        row.resize(plan.images.shape()[1]);
        row.fill(plan.source(k, noise), y);
    }
}

impl Writer {
    /// Writes block `b` of a row.
    #[inline(always)]
    fn write(&self, modulation_min: f32, work: &Work, b: usize, out: &mut OutputRow<'_>) {
        let (mut least, mut peaks) = ([f32::MAX; BLOCK], [0.0f32; BLOCK]);
        for row in &work.rows {
            let brightest = peaks.iter_mut().zip(&row.peak.as_chunks::<BLOCK>().0[b]);
            brightest.for_each(|(peak, seen)| *peak = peak.max(*seen));
            for (least, modulation) in least.iter_mut().zip(&row.modulation.as_chunks::<BLOCK>().0[b]) {
                // Written so that NaN, of saturated pixels, stays.
                *least = if *least < *modulation { *least } else { *modulation };
            }
        }
        let Found { column, precision, cost, next, likelihoods, evidence } = &work.found;
        let turn = TAU * self.number;
        let first = b * BLOCK;
        for i in 0..BLOCK.min(out.phase.len() - first) {
            let x = first + i;
            let unlit = hole_unless(least[i] >= modulation_min);
            let random = self.strays / (self.strays + (1.0 - self.strays) * evidence[i] + f32::MIN_POSITIVE);
            let wrong = 1.0 - (1.0 - random) / likelihoods[i];
            let hole = unlit + hole_unless(wrong <= WRONG_MAX);
            out.phase[x] = turn * column[i] + hole;
            out.modulation[x] = least[i];
            out.quality[x] = 1.0 - (cost[i] / next[i]).sqrt() + unlit;
            out.wrong[x] = wrong + hole;
            let lit = if wrong <= WRONG_MAX { Reason::Returned } else { Reason::DoubtfulOrder };
            out.reason[x] = match least[i] {
                unknown if unknown.is_nan() => Reason::Saturated,
                least if least < modulation_min => {
                    Reason::without_fringes(peaks[i] - self.noise_peak, modulation_min)
                }
                _ => lit,
            };
            let excess = if cost[i] > self.usual { cost[i] / self.usual } else { 1.0 };
            out.sigma[x] = turn * (excess / precision[i]).sqrt() + hole;
        }
    }
}
