//! The published chain: every row on its own, from bytes to absolute phase.

use super::{Decoded, Options};
use crate::angle::atan2;
use crate::condition::{Plan, Sample};
use crate::demod::{Background, BackgroundScratch, Band, RowFilter, RowScratch, background_row, carrier};
use crate::unwrap::Ladder;
use crate::{FringeCode, Shot};
use ndarray::Array2;
use rayon::prelude::*;

/// Rows of the red image that are looked at for the carrier.
const CARRIER_ROWS: usize = 32;

pub(super) struct Published {
    ladder: Ladder,
    filter: RowFilter,
    numbers: [f64; 3],
    shape: [usize; 2],
}

/// Working rows of one thread.
struct Rows {
    light: [Vec<f32>; 4],
    level: Vec<f32>,
    wrapped: [Vec<f32>; 3],
    background: BackgroundScratch,
    fourier: RowScratch,
}

impl Published {
    pub fn new(code: &FringeCode, shape: [usize; 2]) -> Self {
        Self { ladder: Ladder::new(code), filter: RowFilter::new(shape[1]), numbers: code.numbers(), shape }
    }

    pub fn run<T: Sample>(&self, plan: &Plan, shot: &Shot<'_, T>, options: &Options, out: &mut Decoded) {
        let period = options.period_px.unwrap_or_else(|| self.period_px(plan, shot));
        let periods = self.numbers.map(|n| (period * self.numbers[0] / n) as f32);
        let weights = [1, 2].map(|i: usize| self.filter.weights(Band::Improved, periods[i]));
        out.rows().enumerate().for_each_init(
            || self.rows(),
            |rows, (y, [phase, modulation, quality])| {
                let [r, g, b, ir] = &mut rows.light;
                plan.row(shot, y, &mut [r, g, b, ir]);
                modulation.fill(f32::INFINITY);
                rows.two_step(periods[0], modulation);
                rows.fourier(&self.filter, 1, periods[1], &weights[0], modulation);
                rows.fourier(&self.filter, 2, periods[2], &weights[1], modulation);
                let [first, second, third] = &rows.wrapped;
                for x in 0..phase.len() {
                    let found = self.ladder.order([first[x], second[x], third[x]]);
                    let lit = modulation[x] >= options.modulation_min;
                    let sure = lit && found.margin >= options.quality_min;
                    phase[x] = if sure { found.phase_rad } else { f32::NAN };
                    quality[x] = if lit { found.margin.max(0.0) } else { f32::NAN };
                }
            },
        );
    }

    fn rows(&self) -> Rows {
        let row = || vec![0.0; self.shape[1]];
        Rows {
            light: [row(), row(), row(), row()],
            level: row(),
            wrapped: [row(), row(), row()],
            background: BackgroundScratch::default(),
            fourier: self.filter.scratch(),
        }
    }

    /// Fringe period along rows, from a few rows of red light; the whole row when there is none to see.
    fn period_px<T: Sample>(&self, plan: &Plan, shot: &Shot<'_, T>) -> f64 {
        let [height, width] = self.shape;
        let step = height.div_ceil(CARRIER_ROWS);
        let mut rows = self.rows();
        let mut red = Array2::zeros((height.div_ceil(step), width));
        for (mut target, y) in red.rows_mut().into_iter().zip((0..height).step_by(step)) {
            let [r, g, b, ir] = &mut rows.light;
            plan.row(shot, y, &mut [r, g, b, ir]);
            target.iter_mut().zip(r.iter()).for_each(|(t, v)| *t = *v);
        }
        carrier(red.view()).row_px.clamp(3.0, width as f64)
    }
}

impl Rows {
    /// Step 3: R and B, their modulations made equal, (S2).
    fn two_step(&mut self, period_px: f32, modulation: &mut [f32]) {
        for channel in [0, 2] {
            self.remove_background(channel, period_px);
        }
        let power = |row: &[f32]| row.iter().map(|v| v * v).sum::<f32>();
        let equal = (power(&self.light[0]) / power(&self.light[2]).max(f32::MIN_POSITIVE)).sqrt();
        let pairs = self.light[0].iter().zip(&self.light[2]);
        let out = self.wrapped[0].iter_mut().zip(modulation);
        for ((&red, &blue), (phase, modulation)) in pairs.zip(out) {
            let blue = blue * equal;
            *phase = atan2(-blue, red);
            *modulation = (red * red + blue * blue).sqrt();
        }
    }

    /// Step 4: G or IR by the improved Fourier filter (S3).
    fn fourier(
        &mut self,
        filter: &RowFilter,
        index: usize,
        period_px: f32,
        weights: &[f32],
        modulation: &mut [f32],
    ) {
        let channel = [0, 1, 3][index];
        self.remove_background(channel, period_px);
        self.fourier.input.copy_from_slice(&self.light[channel]);
        filter.analytic(weights, &mut self.fourier);
        let out = self.wrapped[index].iter_mut().zip(modulation);
        for (z, (phase, modulation)) in self.fourier.output.iter().zip(out) {
            *phase = atan2(z.im, z.re);
            *modulation = modulation.min((z.re * z.re + z.im * z.im).sqrt());
        }
    }

    /// Step 2: half the sum of the envelopes.
    fn remove_background(&mut self, channel: usize, period_px: f32) {
        let light = &mut self.light[channel];
        background_row(light, Background::MeanEnvelope, period_px, &mut self.background, &mut self.level);
        light.iter_mut().zip(&self.level).for_each(|(v, l)| *v -= l);
    }
}
