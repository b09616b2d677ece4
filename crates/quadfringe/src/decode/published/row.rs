//! Steps 2 to 6 of the published chain on one row, small enough to stay in the nearest cache.

use super::Unwrapping;
use super::means::Means;
use crate::Shot;
use crate::angle::atan2;
use crate::condition::{Plan, Sample};
use crate::decode::output::OutputRow;
use crate::decode::uncertainty::{Sureness, two_step_deviation};
use crate::demod::{
    Aligned, Background, BackgroundScratch, Half, RowFilter, RowScratch, coarsen, remove_background,
};
use multiversion::multiversion;

/// What is the same for all rows of a shot.
pub(super) struct RowPlan<'a> {
    pub conditioning: &'a Plan,
    pub unwrapping: &'a Unwrapping,
    /// For rows of means of so many `pixels`.
    pub filter: &'a RowFilter,
    pub pixels: usize,
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
    /// G and IR without background, as means of pixels.
    fringes: [Aligned<f32>; 2],
    spare: [Aligned<f32>; 2],
    background: BackgroundScratch,
    fourier: RowScratch,
    means: Means,
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
            fringes: Default::default(),
            spare: Default::default(),
            background: BackgroundScratch::default(),
            fourier: filter.scratch(),
            means: Means::default(),
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
        self.remove_backgrounds([first, second, third], plan.pixels);
        self.two_step(plan.sureness.noise, out.modulation, out.sigma);
        let fringes = self.fringes.each_ref().map(|row| &**row);
        let periods = [second, third].map(|period_px| period_px / plan.pixels as f32);
        plan.filter.transform(fringes, periods, &mut self.fourier);
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

    /// Step 2: half the sum of the envelopes. G and IR become means of so many `pixels`, a power of two.
    #[inline(always)]
    fn remove_backgrounds(&mut self, [first, second, third]: [f32; 3], pixels: usize) {
        let kind = Background::MeanEnvelope;
        let Self { light: [red, green, blue, infrared], fringes, spare: [means, spare], background, .. } =
            self;
        for light in [red, blue] {
            means.resize(light.len());
            remove_background(light, kind, first, background, means);
            std::mem::swap(light, means);
        }
        for ((light, period_px), fringes) in [(green, second), (infrared, third)].into_iter().zip(fringes) {
            coarsen(light, pixels, means, spare);
            fringes.resize(means.len());
            remove_background(means, kind, period_px / pixels as f32, background, fringes);
        }
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
        let phase = &mut *self.wrapped[index + 1];
        match plan.pixels {
            1 => self.means.spread::<1>(signal, phase, modulation),
            2 => self.means.spread::<2>(signal, phase, modulation),
            _ => self.means.spread::<4>(signal, phase, modulation),
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
