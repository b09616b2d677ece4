//! Steps 2 to 6 of the published chain on a strip of rows, small enough to stay in the nearest cache.

use super::Unwrapping;
use super::means::{Means, lesser};
use crate::Shot;
use crate::angle::atan2;
use crate::condition::{Plan, Sample};
use crate::decode::output::OutputRow;
use crate::decode::uncertainty::{Sureness, two_step_deviation};
use crate::demod::{
    Aligned, Background, BackgroundScratch, Half, RowFilter, RowScratch, coarsen, remove_background,
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
    /// G and IR are means of squares of so many pixels, a power of two; as many rows are a strip.
    pub pixels: usize,
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
    light: [Aligned<f32>; 4],
    /// R and B without background.
    pair: [Aligned<f32>; 2],
    /// Wrapped phase of R and B, row by row.
    first: Vec<Aligned<f32>>,
    /// Sums over the rows of G and IR, then their means without background.
    sums: [Aligned<f32>; 2],
    fringes: [Aligned<f32>; 2],
    /// Wrapped phases of G and IR, for all rows, and the lesser square of their modulations.
    others: [Aligned<f32>; 2],
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
    for (i, row) in out.iter_mut().enumerate() {
        plan.conditioning.row(shot, y + i, &mut strip.light_mut());
        let gaps = fill_gaps(&mut strip.light[3]);
        strip.sum(i);
        strip.two_step(i, plan, row);
        gaps.into_iter().for_each(|x| row.modulation[x] = f32::NAN);
    }
    strip.fourier(plan, out.len());
    for (i, row) in out.iter_mut().enumerate() {
        strip.order(i, y + i, plan, row);
    }
}

impl Strip {
    /// Make rows that may have served another image fit for this one.
    #[inline(always)]
    fn ready(&mut self, plan: &StripPlan<'_>, width: usize) {
        self.light_of(width);
        self.first.resize_with(plan.pixels, Aligned::default);
        let Self { pair, first, sums, others, power, fourier, .. } = self;
        let rows = pair.iter_mut().chain(first).chain(sums).chain(others).chain([power]);
        rows.for_each(|row| row.resize(width));
        plan.filter.ready(fourier);
    }

    /// Linear light of R, G, B, IR of one row, `width` pixels to be filled.
    pub fn light_of(&mut self, width: usize) -> [&mut [f32]; 4] {
        self.light.each_mut().map(|row| {
            row.resize(width);
            &mut **row
        })
    }

    /// The same of the width that it has.
    fn light_mut(&mut self) -> [&mut [f32]; 4] {
        self.light.each_mut().map(|row| &mut **row)
    }

    /// Linear red light.
    pub fn red(&self) -> &[f32] {
        &self.light[0]
    }

    /// Linear blue light.
    pub fn blue(&self) -> &[f32] {
        &self.light[2]
    }

    /// G and IR of row `i` of the strip are taken in.
    #[inline(always)]
    fn sum(&mut self, i: usize) {
        let [_, green, _, infrared] = &mut self.light;
        for (sum, light) in self.sums.iter_mut().zip([green, infrared]) {
            if i == 0 {
                std::mem::swap(sum, light);
            } else {
                sum.iter_mut().zip(&**light).for_each(|(sum, light)| *sum += light);
            }
        }
    }

    /// Steps 2 and 3: R and B of row `i` without background, their modulations made equal, (S2). The square of the modulation
    /// stands in for it until all channels are known.
    #[inline(always)]
    fn two_step(&mut self, i: usize, plan: &StripPlan<'_>, out: &mut OutputRow<'_>) {
        let Self { light: [red, _, blue, _], pair, background, first, .. } = self;
        for (light, fringes) in [red, blue].into_iter().zip(pair.iter_mut()) {
            remove_background(light, BACKGROUND, plan.periods_px[0], background, fringes);
        }
        let [red, blue] = pair.each_ref().map(|row| &**row);
        let equal = (power(red) / power(blue).max(f32::MIN_POSITIVE)).sqrt();
        let noise = plan.sureness.noise;
        let out = first[i].iter_mut().zip(out.modulation.iter_mut()).zip(out.sigma.iter_mut());
        for ((&red, &blue), ((phase, modulation), sigma)) in red.iter().zip(blue).zip(out) {
            let blue = blue * equal;
            *phase = atan2(-blue, red);
            *modulation = red * red + blue * blue;
            *sigma = two_step_deviation([red, blue], equal, noise);
        }
    }

    /// Steps 2 and 4: G and IR, as means of squares of pixels over so many `rows`, by the improved Fourier filter (S3). The
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
            remove_background(means, BACKGROUND, period, background, fringes);
        }
        let fringes = self.fringes.each_ref().map(|row| &**row);
        plan.filter.transform(fringes, periods, &mut self.fourier);
        self.power.fill(f32::INFINITY);
        for (half, (weights, phase)) in
            [Half::Real, Half::Imaginary].into_iter().zip(plan.weights.iter().zip(&mut self.others))
        {
            let signal = plan.filter.analytic(half, weights, &mut self.fourier);
            match pixels {
                1 => self.means.spread::<1>(signal, phase, &mut self.power),
                2 => self.means.spread::<2>(signal, phase, &mut self.power),
                _ => self.means.spread::<4>(signal, phase, &mut self.power),
            }
        }
    }

    /// Steps 5 and 6 of row `i` of the strip, row `y` of the shot: orders, and what is known of them.
    #[inline(always)]
    fn order(&self, i: usize, y: usize, plan: &StripPlan<'_>, out: &mut OutputRow<'_>) {
        let [second, third] = self.others.each_ref().map(|row| &**row);
        let wrapped = [&*self.first[i], second, third];
        match plan.unwrapping {
            Unwrapping::Ladder(ladder) => ladder.order_row(wrapped, out.phase, out.quality),
            Unwrapping::AlongRay(table) => table.order_row(y, wrapped, out.phase, out.quality),
        }
        plan.trust(&self.power, out);
        plan.sureness.odds.another(out.quality, out.wrong);
    }
}

/// Sum of squares, eight sums side by side.
#[inline(always)]
fn power(row: &[f32]) -> f32 {
    let mut sums = [0.0f32; 8];
    let blocks = row.chunks_exact(8);
    let rest = blocks.remainder();
    for block in blocks {
        for (sum, v) in sums.iter_mut().zip(block) {
            *sum += v * v;
        }
    }
    for (sum, v) in sums.iter_mut().zip(rest) {
        *sum += v * v;
    }
    sums.iter().sum()
}

/// Put the last number seen into gaps, where the infrared chip sees nothing, and say where they are: one NaN would
/// spread over the whole row in the Fourier filter.
#[inline(always)]
fn fill_gaps(row: &mut [f32]) -> Vec<usize> {
    // A vector comparison of all pixels; there are gaps only with registration.
    if row.iter().fold(true, |whole, v| whole & v.is_finite()) {
        return Vec::new();
    }
    let mut seen = row.iter().copied().find(|v| v.is_finite()).unwrap_or(0.0);
    let mut gaps = Vec::new();
    for (x, value) in row.iter_mut().enumerate() {
        if value.is_finite() {
            seen = *value;
        } else {
            gaps.push(x);
            *value = seen;
        }
    }
    gaps
}
