//! Steps 2 to 6 of the published chain on a strip of rows, small enough to stay in the nearest cache.

use super::Unwrapping;
use super::means::{Means, lesser};
use crate::Shot;
use crate::angle::{atan2, coarse_atan2, wrap};
use crate::condition::{Plan, Sample};
use crate::decode::output::OutputRow;
use crate::decode::uncertainty::{Sureness, two_step_deviation};
use crate::demod::{
    Aligned, Background, BackgroundScratch, Half, RowFilter, RowScratch, coarsen, draw_background,
};
use multiversion::multiversion;

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

impl StripPlan<'_> {
    /// Square roots of the lesser `powers` are modulations. What has too little light or too doubtful an order is no data.
    #[inline(always)]
    fn trust(&self, powers: &[f32], out: &mut OutputRow<'_>) {
        let maps = out.phase.iter_mut().zip(out.quality.iter_mut()).zip(out.modulation.iter_mut());
        for (((phase, quality), modulation), power) in maps.zip(powers) {
            *modulation = lesser(*power, *modulation).sqrt();
            let lit = *modulation >= self.modulation_min;
            let sure = lit & (*quality >= self.quality_min);
            *phase = if sure { *phase } else { f32::NAN };
            let positive = if *quality > 0.0 { *quality } else { 0.0 };
            *quality = if lit { positive } else { f32::NAN };
        }
    }
}

/// Working rows of one thread.
#[derive(Debug, Default)]
pub(super) struct Strip {
    /// R and B row by row: their light, then without background; in the end their wrapped phase takes the place of R.
    pair: Vec<[Aligned<f32>; 2]>,
    /// G and IR of the row last read.
    others: [Aligned<f32>; 2],
    /// Where IR sees nothing, row by row.
    gaps: Vec<Vec<usize>>,
    /// Sums over the rows of R and B, and their background.
    pair_sums: [Aligned<f32>; 2],
    level: Aligned<f32>,
    /// Sums over the rows of G and IR, then their means without background.
    sums: [Aligned<f32>; 2],
    fringes: [Aligned<f32>; 2],
    /// Wrapped phases of G and IR, for all rows, and the lesser square of their modulations.
    phases: [Aligned<f32>; 2],
    /// The same turned to where one row is, and the phase of R and B that they belong to.
    turned: [Aligned<f32>; 2],
    middle: Aligned<f32>,
    power: Aligned<f32>,
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
    let equal = strip.two_step_fringes(plan, out.len());
    strip.fourier(plan, out.len());
    for (i, row) in out.iter_mut().enumerate() {
        strip.two_step(i, equal, plan, row);
        strip.turn(i, plan);
        strip.order(i, y + i, plan, row);
    }
}

impl Strip {
    /// Make rows that may have served another image fit for this one.
    #[inline(always)]
    fn ready(&mut self, plan: &StripPlan<'_>, width: usize) {
        self.pair.resize_with(plan.rows, Default::default);
        self.gaps.resize_with(plan.rows, Default::default);
        let Self { pair, others, pair_sums, level, sums, phases, turned, middle, power, fourier, .. } = self;
        let rows = pair.iter_mut().flatten().chain(others).chain(pair_sums).chain([level]).chain(sums);
        rows.chain(phases).chain(turned).chain([middle, power]).for_each(|row| row.resize(width));
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

    /// Step 2: R and B without background, which is that of their mean over so many `rows`; and the modulation of R over
    /// that of B.
    #[inline(always)]
    fn two_step_fringes(&mut self, plan: &StripPlan<'_>, rows: usize) -> f32 {
        let Self { pair, pair_sums, level, background, middle, .. } = self;
        let mut powers = [0.0; 2];
        for (channel, (sum, power)) in pair_sums.iter_mut().zip(&mut powers).enumerate() {
            sum.iter_mut().for_each(|sum| *sum *= 1.0 / rows as f32);
            draw_background(sum, BACKGROUND, plan.periods_px[0], background, level);
            sum.iter_mut().zip(&**level).for_each(|(sum, level)| *sum -= level);
            for row in &mut pair[..rows] {
                *power += without(&mut row[channel], level);
            }
        }
        let [red, blue] = powers;
        let equal = (red / blue.max(f32::MIN_POSITIVE)).sqrt();
        for ((middle, red), blue) in middle.iter_mut().zip(&*pair_sums[0]).zip(&*pair_sums[1]) {
            *middle = coarse_atan2(-blue * equal, *red);
        }
        equal
    }

    /// Step 3: phase of row `i` from R and B, their modulations made equal, (S2). The square of the modulation stands in for
    /// it until all channels are known.
    #[inline(always)]
    fn two_step(&mut self, i: usize, equal: f32, plan: &StripPlan<'_>, out: &mut OutputRow<'_>) {
        let [red, blue] = &mut self.pair[i];
        let noise = plan.sureness.noise;
        let maps = out.modulation.iter_mut().zip(out.sigma.iter_mut());
        for ((red, &mut blue), (modulation, sigma)) in red.iter_mut().zip(&mut **blue).zip(maps) {
            let blue = blue * equal;
            let power = *red * *red + blue * blue;
            *sigma = two_step_deviation([*red, blue], equal, noise);
            *red = atan2(-blue, *red);
            *modulation = power;
        }
        self.gaps[i].iter().for_each(|&x| out.modulation[x] = f32::NAN);
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

    /// Phases of G and IR where row `i` is: along a surface they turn with that of R and B, which each row knows of itself.
    #[inline(always)]
    fn turn(&mut self, i: usize, plan: &StripPlan<'_>) {
        let Self { pair, phases, turned: [green, infrared], middle, .. } = self;
        let ratios = [1, 2].map(|channel| plan.periods_px[0] / plan.periods_px[channel]);
        let seen = pair[i][0].iter().zip(&**middle).zip(phases[0].iter().zip(&*phases[1]));
        for ((green, infrared), ((here, middle), (second, third))) in
            green.iter_mut().zip(&mut **infrared).zip(seen)
        {
            let turn = wrap(here - middle);
            *green = second + ratios[0] * turn;
            *infrared = third + ratios[1] * turn;
        }
    }

    /// Steps 5 and 6 of row `i` of the strip, row `y` of the shot: orders, and what is known of them.
    #[inline(always)]
    fn order(&self, i: usize, y: usize, plan: &StripPlan<'_>, out: &mut OutputRow<'_>) {
        let [second, third] = self.turned.each_ref().map(|row| &**row);
        let wrapped = [&*self.pair[i][0], second, third];
        match plan.unwrapping {
            Unwrapping::Ladder(ladder) => ladder.order_row(wrapped, out.phase, out.quality),
            Unwrapping::AlongRay(table) => table.order_row(y, wrapped, out.phase, out.quality),
        }
        plan.trust(&self.power, out);
        plan.sureness.odds.another(out.quality, out.wrong);
    }
}

/// Every number more by that of another row.
#[inline(always)]
fn add(row: &[f32], sum: &mut [f32]) {
    sum.iter_mut().zip(row).for_each(|(sum, light)| *sum += light);
}

/// Take a background away; sum of squares of what is left, eight sums side by side.
#[inline(always)]
fn without(row: &mut [f32], level: &[f32]) -> f32 {
    let mut sums = [0.0f32; 8];
    let (blocks, rest) = row.as_chunks_mut::<8>();
    let (levels, last) = level.as_chunks::<8>();
    for (row, level) in blocks.iter_mut().zip(levels) {
        let fringes: [f32; 8] = std::array::from_fn(|i| row[i] - level[i]);
        *row = fringes;
        sums.iter_mut().zip(fringes).for_each(|(sum, value)| *sum += value * value);
    }
    for ((value, level), sum) in rest.iter_mut().zip(last).zip(&mut sums) {
        *value -= level;
        *sum += *value * *value;
    }
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
