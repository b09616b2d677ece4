//! Steps 2 to 6 of the published chain on a strip of rows, small enough to stay in the nearest cache.

use super::Unwrapping;
use super::means::{Means, lesser};
use super::uncertainty::{Sureness, two_step_deviation};
use crate::Shot;
use crate::condition::{Plan, Sample};
use crate::decode::output::OutputRow;
use crate::parallel::Aligned;
use crate::parallel::angle::{atan2, coarse_atan2, round};
use crate::stages::{Background, BackgroundScratch, Half, RowFilter, RowScratch, coarsen, draw_background};
use multiversion::multiversion;
use std::f32::consts::TAU;

/// The published background: half the sum of the envelopes.
const BACKGROUND: Background = Background::MeanEnvelope;

/// What is the same for all strips of a shot.
pub(super) struct StripPlan<'a> {
    pub conditioning: &'a Plan,
    pub unwrapping: &'a Unwrapping,
    /// For rows of means of so many `pixels`.
    pub filter: &'a RowFilter,
    /// G and IR are means of so many pixels of a row, a power of two, and of all rows of a strip.
    pub pixels: usize,
    /// Rows of a strip.
    pub rows: usize,
    pub periods_px: [f32; 3],
    /// Filters of G and IR.
    pub weights: [Vec<f32>; 2],
    pub modulation_min: f32,
    pub quality_min: f32,
    /// What the shot shows of its own noise.
    pub sureness: Sureness,
}

/// Working rows of one task.
#[derive(Debug, Default)]
pub(super) struct Strip {
    /// Light of R and B, row by row.
    pair: Vec<[Aligned<f32>; 2]>,
    /// G and IR of the row last read.
    others: [Aligned<f32>; 2],
    /// Where IR sees nothing, row by row.
    gaps: Vec<Vec<usize>>,
    /// Sums over the rows of R and B, then their means without background.
    pair_sums: [Aligned<f32>; 2],
    /// Their background.
    levels: [Aligned<f32>; 2],
    /// Sums over the rows of G and IR, and their means without background.
    sums: [Aligned<f32>; 2],
    fringes: [Aligned<f32>; 2],
    /// Wrapped phases of G and IR at every pixel, and the lesser square of their modulations.
    phases: [Aligned<f32>; 2],
    power: Aligned<f32>,
    /// Wrapped phase of the means of R and B, and what it is absolutely.
    middle: Aligned<f32>,
    absolute: Aligned<f32>,
    /// Margins of the orders, and how likely these are wrong.
    margin: Aligned<f32>,
    wrong: Aligned<f32>,
    spare: [Aligned<f32>; 2],
    background: BackgroundScratch,
    fourier: RowScratch,
    means: Means,
}

/// The rows of a shot from row `y` on, as many as `out` has, from bytes to phase, modulation and quality. Without fused
/// multiplication: every number comes out the same for vectors of any width.
#[multiversion(targets("x86_64+avx2"))]
pub(super) fn decode_strip<T: Sample>(
    strip: &mut Strip,
    plan: &StripPlan<'_>,
    shot: &Shot<'_, T>,
    y: usize,
    out: &mut [OutputRow<'_>],
) {
    strip.ready(plan, out[0].phase.len());
    for i in 0..out.len() {
        plan.conditioning.row(shot, y + i, &mut strip.light_of(i));
        fill_gaps(&mut strip.others[1], &mut strip.gaps[i]);
        strip.sum(i);
    }
    let equal = strip.two_step(plan, out.len());
    strip.fourier(plan, out.len());
    strip.order(y + out.len() / 2, plan);
    for (i, row) in out.iter_mut().enumerate() {
        strip.row(i, equal, plan, row);
    }
}

impl Strip {
    /// Make rows that may have served another image fit for this one.
    #[inline(always)]
    fn ready(&mut self, plan: &StripPlan<'_>, width: usize) {
        self.pair.resize_with(plan.rows, Default::default);
        self.gaps.resize_with(plan.rows, Default::default);
        let Self {
            pair,
            others,
            pair_sums,
            levels,
            sums,
            phases,
            power,
            middle,
            absolute,
            margin,
            wrong,
            fourier,
            ..
        } = self;
        let rows = pair.iter_mut().flatten().chain(others).chain(pair_sums).chain(levels).chain(sums);
        rows.chain(phases).chain([power, middle, absolute, margin, wrong]).for_each(|row| row.resize(width));
        plan.filter.ready(fourier);
    }

    /// Linear light of R, G, B, IR of row `i`, to be filled.
    #[inline(always)]
    fn light_of(&mut self, i: usize) -> [&mut [f32]; 4] {
        let [red, blue] = &mut self.pair[i];
        let [green, infrared] = &mut self.others;
        [red, green, blue, infrared].map(|row| &mut **row)
    }

    /// The same of a row of `width` pixels on its own.
    pub fn light(&mut self, width: usize) -> [&mut [f32]; 4] {
        if self.pair.is_empty() {
            self.pair.resize_with(1, Default::default);
        }
        self.pair[0].iter_mut().chain(&mut self.others).for_each(|row| row.resize(width));
        self.light_of(0)
    }

    /// Linear red light of the row on its own.
    pub fn red(&self) -> &[f32] {
        &self.pair[0][0]
    }

    /// Linear blue light of the row on its own.
    pub fn blue(&self) -> &[f32] {
        &self.pair[0][1]
    }

    /// Row `i` of the strip is taken in.
    #[inline(always)]
    fn sum(&mut self, i: usize) {
        let Self { pair, others, pair_sums, sums, .. } = self;
        for (sum, light) in sums.iter_mut().zip(others) {
            if i == 0 {
                std::mem::swap(sum, light);
            } else {
                add(light, sum);
            }
        }
        for (sum, light) in pair_sums.iter_mut().zip(&pair[i]) {
            if i == 0 {
                sum.copy_from_slice(light);
            } else {
                add(light, sum);
            }
        }
    }

    /// Steps 2 and 3: background of R and B, which is that of their means over so many `rows`, and the phase of the means, (S2).
    /// The modulation of R over that of B makes them equal.
    #[inline(always)]
    fn two_step(&mut self, plan: &StripPlan<'_>, rows: usize) -> f32 {
        let Self { pair_sums, levels, background, middle, .. } = self;
        let mut powers = [0.0; 2];
        for ((sum, level), channel) in pair_sums.iter_mut().zip(levels).zip(&mut powers) {
            sum.iter_mut().for_each(|sum| *sum *= 1.0 / rows as f32);
            draw_background(sum, BACKGROUND, plan.periods_px[0], background, level);
            sum.iter_mut().zip(&**level).for_each(|(sum, level)| *sum -= level);
            *channel = power(sum);
        }
        let [red, blue] = powers;
        let equal = (red / blue.max(f32::MIN_POSITIVE)).sqrt();
        for ((middle, red), blue) in middle.iter_mut().zip(&*pair_sums[0]).zip(&*pair_sums[1]) {
            *middle = coarse_atan2(-blue * equal, *red);
        }
        equal
    }

    /// Steps 2 and 4: G and IR, as means over so many `rows` and some pixels of each, by the improved Fourier filter (S3). The
    /// lesser modulation counts.
    #[inline(always)]
    fn fourier(&mut self, plan: &StripPlan<'_>, rows: usize) {
        let pixels = plan.pixels;
        let periods = [plan.periods_px[1], plan.periods_px[2]].map(|period_px| period_px / pixels as f32);
        let Self { sums, fringes, spare: [means, spare], background, .. } = self;
        for ((sum, period), fringes) in sums.iter().zip(periods).zip(fringes) {
            coarsen(sum, pixels, means, spare);
            means.iter_mut().for_each(|mean| *mean *= 1.0 / rows as f32);
            fringes.resize(means.len());
            draw_background(means, BACKGROUND, period, background, fringes);
            fringes.iter_mut().zip(&**means).for_each(|(level, mean)| *level = mean - *level);
        }
        let fringes = self.fringes.each_ref().map(|row| &**row);
        plan.filter.transform(fringes, periods, &mut self.fourier);
        self.power.fill(f32::INFINITY);
        for (half, (weights, phase)) in
            [Half::Real, Half::Imaginary].into_iter().zip(plan.weights.iter().zip(&mut self.phases))
        {
            let signal = plan.filter.analytic(half, weights, &mut self.fourier);
            match pixels {
                1 => self.means.spread::<1>(signal, phase, &mut self.power),
                2 => self.means.spread::<2>(signal, phase, &mut self.power),
                _ => self.means.spread::<4>(signal, phase, &mut self.power),
            }
        }
    }

    /// Step 5: orders of the phases of the means; rows from `y` on are meant.
    #[inline(always)]
    fn order(&mut self, y: usize, plan: &StripPlan<'_>) {
        let Self { middle, phases: [second, third], absolute, margin, wrong, .. } = self;
        let wrapped = [&**middle, second, third];
        match plan.unwrapping {
            Unwrapping::Ladder(ladder) => ladder.order_row(wrapped, absolute, margin),
            Unwrapping::AlongRay(table) => table.order_row(y, wrapped, absolute, margin),
        }
        plan.sureness.odds.another(margin, wrong);
    }

    /// Steps 3 and 6: absolute phase of row `i`, (S2) with the turn nearest to that of the means, and what is known of it. What has
    /// too little light or too doubtful an order is no data.
    #[inline(always)]
    fn row(&self, i: usize, equal: f32, plan: &StripPlan<'_>, out: &mut OutputRow<'_>) {
        let noise = plan.sureness.noise;
        let [red, blue] = self.pair[i].each_ref().map(|row| row.iter());
        let [red_level, blue_level] = self.levels.each_ref().map(|row| row.iter());
        let fringes = red.zip(red_level).zip(blue.zip(blue_level));
        let known = self.absolute.iter().zip(&*self.margin).zip(&*self.power);
        let maps = out.phase.iter_mut().zip(out.quality.iter_mut());
        let maps = maps.zip(out.modulation.iter_mut().zip(out.sigma.iter_mut()));
        for ((fringes, known), ((phase, quality), (modulation, sigma))) in fringes.zip(known).zip(maps) {
            let (((red, red_level), (blue, blue_level)), ((absolute, margin), power)) = (fringes, known);
            let (red, blue) = (red - red_level, (blue - blue_level) * equal);
            *sigma = two_step_deviation([red, blue], equal, noise);
            *modulation = lesser(*power, red * red + blue * blue).sqrt();
            let lit = *modulation >= plan.modulation_min;
            let sure = lit & (*margin >= plan.quality_min);
            let wrapped = atan2(-blue, red);
            let found = wrapped + TAU * round((absolute - wrapped) * (1.0 / TAU));
            *phase = if sure { found } else { f32::NAN };
            let positive = if *margin > 0.0 { *margin } else { 0.0 };
            *quality = if lit { positive } else { f32::NAN };
        }
        out.wrong.copy_from_slice(&self.wrong);
        for &x in &self.gaps[i] {
            [out.phase[x], out.quality[x], out.modulation[x]] = [f32::NAN; 3];
        }
    }
}

/// Every number more by that of another row.
#[inline(always)]
fn add(row: &[f32], sum: &mut [f32]) {
    sum.iter_mut().zip(row).for_each(|(sum, light)| *sum += light);
}

/// Sum of squares, eight sums side by side.
#[inline(always)]
fn power(row: &[f32]) -> f32 {
    let mut sums = [0.0f32; 8];
    let (blocks, rest) = row.as_chunks::<8>();
    for block in blocks {
        sums.iter_mut().zip(block).for_each(|(sum, value)| *sum += value * value);
    }
    sums.iter_mut().zip(rest).for_each(|(sum, value)| *sum += value * value);
    sums.iter().sum()
}

/// Put the last number seen into gaps, where the infrared chip sees nothing, and say where they are: one NaN would
/// spread over the whole row in the Fourier filter.
#[inline(always)]
fn fill_gaps(row: &mut [f32], gaps: &mut Vec<usize>) {
    gaps.clear();
    // A vector comparison of all pixels; there are gaps only with registration.
    if row.iter().fold(true, |whole, v| whole & v.is_finite()) {
        return;
    }
    let mut seen = row.iter().copied().find(|v| v.is_finite()).unwrap_or(0.0);
    for (x, value) in row.iter_mut().enumerate() {
        if value.is_finite() {
            seen = *value;
        } else {
            gaps.push(x);
            *value = seen;
        }
    }
}
