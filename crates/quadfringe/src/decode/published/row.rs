//! Steps 2 to 6 of the published chain on one row, small enough to stay in the nearest cache.

use crate::angle::atan2;
use crate::demod::{Background, BackgroundScratch, Half, RowFilter, RowScratch, background_row};
use crate::unwrap::Ladder;

/// What is the same for all rows of a shot.
pub(super) struct RowPlan<'a> {
    pub ladder: &'a Ladder,
    pub filter: &'a RowFilter,
    pub periods_px: [f32; 3],
    /// Filters of G and IR.
    pub weights: [Vec<f32>; 2],
    pub modulation_min: f32,
    pub quality_min: f32,
}

/// Working rows of one thread.
pub(super) struct Rows {
    light: [Vec<f32>; 4],
    level: Vec<f32>,
    wrapped: [Vec<f32>; 3],
    background: BackgroundScratch,
    fourier: RowScratch,
    wide: bool,
}

impl Rows {
    pub fn new(filter: &RowFilter, width: usize) -> Self {
        let row = || vec![0.0; width];
        Self {
            light: [row(), row(), row(), row()],
            level: row(),
            wrapped: [row(), row(), row()],
            background: BackgroundScratch::default(),
            fourier: filter.scratch(),
            wide: has_wide_vectors(),
        }
    }

    /// Linear light of R, G, B, IR, to be filled.
    pub fn light_mut(&mut self) -> [&mut [f32]; 4] {
        self.light.each_mut().map(Vec::as_mut_slice)
    }

    /// Linear red light.
    pub fn red(&self) -> &[f32] {
        &self.light[0]
    }

    /// Phase, modulation and quality from the light that was filled in.
    pub fn decode(&mut self, plan: &RowPlan<'_>, out: [&mut [f32]; 3]) {
        #[cfg(target_arch = "x86_64")]
        if self.wide {
            // SAFETY: the processor has been asked for AVX2.
            #[expect(unsafe_code, reason = "code for an instruction set chosen at run time")]
            return unsafe { self.decode_wide(plan, out) };
        }
        self.decode_any(plan, out);
    }

    /// The same code for vectors of eight. Without fused multiplication: every number comes out the same.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn decode_wide(&mut self, plan: &RowPlan<'_>, out: [&mut [f32]; 3]) {
        self.decode_any(plan, out);
    }

    #[inline(always)]
    fn decode_any(&mut self, plan: &RowPlan<'_>, [phase, modulation, quality]: [&mut [f32]; 3]) {
        let unseen = fill_gaps(&mut self.light[3]);
        let [first, second, third] = plan.periods_px;
        for (channel, period_px) in [first, second, first, third].into_iter().enumerate() {
            self.remove_background(channel, period_px);
        }
        self.two_step(modulation);
        let fringes = [self.light[1].as_slice(), self.light[3].as_slice()];
        plan.filter.transform(fringes, [second, third], &mut self.fourier);
        self.fourier(plan, Half::Real, modulation);
        self.fourier(plan, Half::Imaginary, modulation);
        let [first, second, third] = &self.wrapped;
        plan.ladder.order_row([first, second, third], phase, quality);
        let maps = phase.iter_mut().zip(quality.iter_mut()).zip(&*modulation);
        for ((phase, quality), &modulation) in maps {
            let lit = modulation >= plan.modulation_min;
            let sure = lit & (*quality >= plan.quality_min);
            *phase = if sure { *phase } else { f32::NAN };
            let positive = if *quality > 0.0 { *quality } else { 0.0 };
            *quality = if lit { positive } else { f32::NAN };
        }
        for x in unseen {
            (phase[x], modulation[x], quality[x]) = (f32::NAN, f32::NAN, f32::NAN);
        }
    }

    /// Step 2: half the sum of the envelopes.
    #[inline(always)]
    fn remove_background(&mut self, channel: usize, period_px: f32) {
        let light = &mut self.light[channel];
        let kind = Background::MeanEnvelope;
        background_row(light, kind, period_px, &mut self.background, &mut self.level);
        light.iter_mut().zip(&self.level).for_each(|(v, l)| *v -= l);
    }

    /// Step 3: R and B, their modulations made equal, (S2).
    #[inline(always)]
    fn two_step(&mut self, modulation: &mut [f32]) {
        let [red, _, blue, _] = &self.light;
        let equal = (power(red) / power(blue).max(f32::MIN_POSITIVE)).sqrt();
        let out = self.wrapped[0].iter_mut().zip(modulation);
        for ((&red, &blue), (phase, modulation)) in red.iter().zip(blue).zip(out) {
            let blue = blue * equal;
            *phase = atan2(-blue, red);
            *modulation = (red * red + blue * blue).sqrt();
        }
    }

    /// Step 4: G or IR by the improved Fourier filter (S3). The least modulation of all channels counts.
    #[inline(always)]
    fn fourier(&mut self, plan: &RowPlan<'_>, half: Half, modulation: &mut [f32]) {
        let index = if half == Half::Real { 0 } else { 1 };
        let signal = plan.filter.analytic(half, &plan.weights[index], &mut self.fourier);
        let out = self.wrapped[index + 1].iter_mut().zip(modulation);
        for (z, (phase, modulation)) in signal.iter().zip(out) {
            *phase = atan2(z.im, z.re);
            let own = (z.re * z.re + z.im * z.im).sqrt();
            *modulation = if own < *modulation { own } else { *modulation };
        }
    }
}

fn has_wide_vectors() -> bool {
    #[cfg(target_arch = "x86_64")]
    return std::arch::is_x86_feature_detected!("avx2");
    #[cfg(not(target_arch = "x86_64"))]
    false
}

/// Sum of squares, eight sums side by side.
#[inline(always)]
fn power(row: &[f32]) -> f32 {
    let mut sums = [0.0f32; 8];
    for block in row.chunks(8) {
        for (sum, v) in sums.iter_mut().zip(block) {
            *sum += v * v;
        }
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
