//! Steps 2 to 6 of the published chain on one row, small enough to stay in the nearest cache.

use super::Unwrapping;
use crate::Shot;
use crate::angle::{atan2, coarse_atan2};
use crate::condition::{Plan, Sample};
use crate::decode::output::OutputRow;
use crate::decode::uncertainty::{Sureness, two_step_deviation};
use crate::demod::{Aligned, Background, BackgroundScratch, Half, RowFilter, RowScratch, remove_background};
use multiversion::multiversion;

/// What is the same for all rows of a shot.
pub(super) struct RowPlan<'a> {
    pub conditioning: &'a Plan,
    pub unwrapping: &'a Unwrapping,
    pub filter: &'a RowFilter,
    pub periods_px: [f32; 3],
    /// Filters of G and IR.
    pub weights: [Vec<f32>; 2],
    pub modulation_min: f32,
    pub quality_min: f32,
    /// What the shot shows of its own noise.
    pub sureness: Sureness,
}

impl RowPlan<'_> {
    /// What has too little light or too doubtful an order is no data.
    #[inline(always)]
    fn trust(&self, out: &mut OutputRow<'_>) {
        let maps = out.phase.iter_mut().zip(out.quality.iter_mut()).zip(out.modulation.iter_mut());
        for ((phase, quality), modulation) in maps {
            *modulation = modulation.sqrt();
            let lit = *modulation >= self.modulation_min;
            let sure = lit & (*quality >= self.quality_min);
            *phase = if sure { *phase } else { f32::NAN };
            let positive = if *quality > 0.0 { *quality } else { 0.0 };
            *quality = if lit { positive } else { f32::NAN };
        }
    }
}

/// Working rows of one thread.
pub(super) struct Rows {
    light: [Aligned<f32>; 4],
    wrapped: [Aligned<f32>; 3],
    spare: Aligned<f32>,
    background: BackgroundScratch,
    fourier: RowScratch,
}

/// Row `y` of a shot from bytes to phase, modulation and quality. Without fused multiplication: every number comes out
/// the same for vectors of any width.
#[multiversion(targets("x86_64+avx2"))]
pub(super) fn decode_row<T: Sample>(
    rows: &mut Rows,
    plan: &RowPlan<'_>,
    shot: &Shot<'_, T>,
    y: usize,
    out: &mut OutputRow<'_>,
) {
    plan.conditioning.row(shot, y, &mut rows.light_mut());
    rows.decode(plan, y, out);
}

impl Rows {
    pub fn new(filter: &RowFilter, width: usize) -> Self {
        let row = || Aligned::new(width);
        Self {
            light: [row(), row(), row(), row()],
            wrapped: [row(), row(), row()],
            spare: row(),
            background: BackgroundScratch::default(),
            fourier: filter.scratch(),
        }
    }

    /// Linear light of R, G, B, IR, to be filled.
    pub fn light_mut(&mut self) -> [&mut [f32]; 4] {
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

    /// Phase, modulation and quality from the light that was filled in.
    #[inline(always)]
    fn decode(&mut self, plan: &RowPlan<'_>, y: usize, out: &mut OutputRow<'_>) {
        let unseen = fill_gaps(&mut self.light[3]);
        let [first, second, third] = plan.periods_px;
        for (channel, period_px) in [first, second, first, third].into_iter().enumerate() {
            self.remove_background(channel, period_px);
        }
        self.two_step(plan.sureness.noise, out.modulation, out.sigma);
        let fringes = [&*self.light[1], &*self.light[3]];
        plan.filter.transform(fringes, [second, third], &mut self.fourier);
        self.fourier(plan, Half::Real, out.modulation);
        self.fourier(plan, Half::Imaginary, out.modulation);
        let wrapped = self.wrapped.each_ref().map(|row| &**row);
        match plan.unwrapping {
            Unwrapping::Ladder(ladder) => ladder.order_row(wrapped, out.phase, out.quality),
            Unwrapping::AlongRay(table) => table.order_row(y, wrapped, out.phase, out.quality),
        }
        plan.trust(out);
        plan.sureness.odds.another(out.quality, out.wrong);
        for x in unseen {
            (out.phase[x], out.modulation[x], out.quality[x]) = (f32::NAN, f32::NAN, f32::NAN);
        }
    }

    /// Step 2: half the sum of the envelopes.
    #[inline(always)]
    fn remove_background(&mut self, channel: usize, period_px: f32) {
        let light = &mut self.light[channel];
        let kind = Background::MeanEnvelope;
        remove_background(light, kind, period_px, &mut self.background, &mut self.spare);
        std::mem::swap(light, &mut self.spare);
    }

    /// Step 3: R and B, their modulations made equal, (S2). The square of the modulation stands in for it until all
    /// channels are known.
    #[inline(always)]
    fn two_step(&mut self, noise: f32, modulation: &mut [f32], sigma: &mut [f32]) {
        let [red, _, blue, _] = self.light.each_ref().map(|row| &**row);
        let equal = (power(red) / power(blue).max(f32::MIN_POSITIVE)).sqrt();
        let out = self.wrapped[0].iter_mut().zip(modulation).zip(sigma);
        for ((&red, &blue), ((phase, modulation), sigma)) in red.iter().zip(blue).zip(out) {
            let blue = blue * equal;
            *phase = atan2(-blue, red);
            *modulation = red * red + blue * blue;
            *sigma = two_step_deviation([red, blue], equal, noise);
        }
    }

    /// Step 4: G or IR by the improved Fourier filter (S3). The least modulation of all channels counts.
    #[inline(always)]
    fn fourier(&mut self, plan: &RowPlan<'_>, half: Half, modulation: &mut [f32]) {
        let index = if half == Half::Real { 0 } else { 1 };
        let signal = plan.filter.analytic(half, &plan.weights[index], &mut self.fourier);
        let out = self.wrapped[index + 1].iter_mut().zip(modulation);
        for (z, (phase, modulation)) in signal.iter().zip(out) {
            *phase = coarse_atan2(z.im, z.re);
            let own = z.re * z.re + z.im * z.im;
            *modulation = if own < *modulation { own } else { *modulation };
        }
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
