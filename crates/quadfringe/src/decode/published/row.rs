//! Steps 2 to 6 of the published chain on one row, small enough to stay in the nearest cache.

use super::Unwrapping;
use crate::Shot;
use crate::angle::{atan2, coarse_atan2, wrap};
use crate::condition::{Plan, Sample};
use crate::decode::output::OutputRow;
use crate::decode::uncertainty::{Sureness, two_step_deviation};
use crate::demod::{
    Aligned, Background, BackgroundScratch, BandFilter, Half, RowFilter, RowScratch, remove_background,
};
use multiversion::multiversion;
use rustfft::num_complex::Complex32;

/// What is the same for all rows of a shot.
pub(super) struct RowPlan<'a> {
    pub conditioning: &'a Plan,
    pub unwrapping: &'a Unwrapping,
    pub filter: &'a RowFilter,
    pub periods_px: [f32; 3],
    /// Filters of G and IR.
    pub bands: [BandFilter; 2],
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
    sparse: Sparse,
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
            sparse: Sparse::default(),
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
        let band = &plan.bands[index];
        let signal = plan.filter.analytic(half, band, &mut self.fourier);
        let phase = &mut *self.wrapped[index + 1];
        match band.every() {
            1 => {
                for (z, (phase, modulation)) in signal.iter().zip(phase.iter_mut().zip(modulation)) {
                    *phase = coarse_atan2(z.im, z.re);
                    *modulation = lesser(z.re * z.re + z.im * z.im, *modulation);
                }
            }
            2 => self.sparse.spread::<2>(signal, phase, modulation),
            _ => self.sparse.spread::<4>(signal, phase, modulation),
        }
    }
}

#[inline(always)]
fn lesser(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// An analytic signal that is not known at every pixel.
#[derive(Debug, Default)]
struct Sparse {
    phase: Vec<f32>,
    /// Squares of the modulation.
    power: Vec<f32>,
    /// What is added to either up to the next sample.
    steps: [Vec<f32>; 2],
}

impl Sparse {
    /// Phases between the samples of a signal, on a straight line from one to the next, and the least squares of the
    /// modulation. The phases are not wrapped.
    #[inline(always)]
    fn spread<const EVERY: usize>(
        &mut self,
        signal: &[Complex32],
        phase: &mut [f32],
        modulation: &mut [f32],
    ) {
        let Self { phase: sampled, power, steps } = self;
        let [turns, growth] = steps;
        for row in [&mut *sampled, &mut *power, &mut *turns, &mut *growth] {
            row.resize(signal.len(), 0.0);
        }
        for ((z, sampled), power) in signal.iter().zip(sampled.iter_mut()).zip(power.iter_mut()) {
            *sampled = coarse_atan2(z.im, z.re);
            *power = z.re * z.re + z.im * z.im;
        }
        let part = 1.0 / EVERY as f32;
        for ((step, here), next) in turns.iter_mut().zip(&*sampled).zip(&sampled[1..]) {
            *step = part * wrap(next - here);
        }
        for ((step, here), next) in growth.iter_mut().zip(&*power).zip(&power[1..]) {
            *step = part * (next - here);
        }
        let samples = sampled.iter().zip(&*turns).zip(power.iter().zip(&*growth));
        let (phase, last_phase) = phase.as_chunks_mut::<EVERY>();
        let (modulation, last_modulation) = modulation.as_chunks_mut::<EVERY>();
        let whole = phase.len();
        for (((start, turn), (power, growth)), (phase, modulation)) in
            samples.zip(phase.iter_mut().zip(modulation))
        {
            for i in 0..EVERY {
                phase[i] = *start + i as f32 * *turn;
                modulation[i] = lesser(*power + i as f32 * *growth, modulation[i]);
            }
        }
        for (i, (phase, modulation)) in last_phase.iter_mut().zip(last_modulation).enumerate() {
            *phase = sampled[whole] + i as f32 * turns[whole];
            *modulation = lesser(power[whole] + i as f32 * growth[whole], *modulation);
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

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts::TAU;

    #[test]
    fn a_sparse_signal_is_known_at_every_pixel() {
        // An odd length: the last pixels lie between the last samples.
        const WIDTH: usize = 1021;
        let at = |x: f32| TAU * x / 29.0 + 2.0 * (TAU * x / 300.0).sin();
        let signal = |every: usize| -> Vec<Complex32> {
            let samples = 0..=WIDTH / every;
            samples.map(|i| Complex32::from_polar(0.25, at((every * i) as f32))).collect()
        };
        let mut sparse = Sparse::default();
        for (every, bound) in [(2, 1e-3), (4, 4e-3)] {
            let (mut phase, mut modulation) = (vec![0.0; WIDTH], vec![1.0; WIDTH]);
            modulation[5] = 0.01;
            match every {
                2 => sparse.spread::<2>(&signal(2), &mut phase, &mut modulation),
                _ => sparse.spread::<4>(&signal(4), &mut phase, &mut modulation),
            }
            for (x, phase) in phase.iter().enumerate() {
                assert!(wrap(phase - at(x as f32)).abs() < bound, "{every} {x}");
                let least = if x == 5 { 0.01 } else { 0.0625 };
                assert!((modulation[x] - least).abs() < 1e-6, "{every} {x}");
            }
        }
    }
}
