//! Pixels of the stacks, packed for fast evaluation, and their two-step phase error for any response.

use super::Response;
use crate::condition::params::{HUBER_RAD, LEVEL_MAX};
use crate::parallel::angle::atan2;
use ndarray::{Array2, ArrayView1, Zip};
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Number of pixels that are evaluated together. Sums run over the blocks in a fixed order, so the result does not
/// depend on the number of threads.
const BLOCK: usize = 256;

/// One pixel over all steps, and its first harmonic.
#[derive(Clone, Copy)]
pub(super) struct Trace<'a> {
    /// Intensities, fractions of full scale.
    pub steps: ArrayView1<'a, f32>,
    /// First harmonic over the steps, `b exp(i Phi)`.
    pub harmonic: [f32; 2],
}

/// A block of pixels: levels `(steps, pixels)` and the unit vectors of their phases.
struct Block {
    levels: Array2<u16>,
    cos: Vec<f32>,
    sin: Vec<f32>,
}

/// All pixels of an estimate.
pub(super) struct Samples {
    blocks: Vec<Block>,
    partner: Array2<f32>,
}

impl Samples {
    pub fn new(traces: &[Trace<'_>]) -> Self {
        Self {
            blocks: traces.par_chunks(BLOCK).map(Block::new).collect(),
            partner: quarter_period_later(traces[0].steps.len()),
        }
    }

    pub fn steps(&self) -> usize {
        self.partner.nrows()
    }

    pub fn len(&self) -> usize {
        self.blocks.iter().map(|block| block.cos.len()).sum()
    }

    /// Mean over pixels and steps of the Huber loss of the two-step error; the square of the error in rad^2 where it is
    /// small.
    pub fn cost(&self, response: &Response) -> f64 {
        let sums = self.per_block(response, |errors| vec![huber_sum(errors)]);
        sums[0] / (self.len() * self.steps()) as f64
    }

    /// Mean over the steps of the Huber loss of each pixel, in rad^2.
    pub fn costs(&self, response: &Response) -> Vec<f64> {
        let steps = self.steps() as f64;
        let each = |errors: &Array2<f32>| {
            errors.columns().into_iter().map(|column| huber(column).sum::<f64>() / steps).collect()
        };
        self.of_blocks(response, each).concat()
    }

    /// RMS of the two-step error of each step, rad.
    pub fn rms_rad(&self, response: &Response) -> Vec<f64> {
        let square = |row: ArrayView1<'_, f32>| row.iter().map(|e| f64::from(e * e)).sum();
        let sums = self.per_block(response, |errors| errors.outer_iter().map(square).collect());
        let mean = |sum: f64| (sum / self.len() as f64).sqrt();
        sums.into_iter().map(mean).collect()
    }

    fn per_block(&self, response: &Response, sums: impl Fn(&Array2<f32>) -> Vec<f64> + Sync) -> Vec<f64> {
        let add = |a: Vec<f64>, b: Vec<f64>| a.iter().zip(b).map(|(x, y)| x + y).collect();
        self.of_blocks(response, sums).into_iter().reduce(add).unwrap_or_default()
    }

    fn of_blocks(
        &self,
        response: &Response,
        found: impl Fn(&Array2<f32>) -> Vec<f64> + Sync,
    ) -> Vec<Vec<f64>> {
        let table: Vec<f32> =
            (0..=LEVEL_MAX as usize).map(|level| response.linear(level as f32 / LEVEL_MAX)).collect();
        self.blocks.par_iter().map(|block| found(&block.errors_rad(&table, &self.partner))).collect()
    }
}

impl Block {
    fn new(traces: &[Trace<'_>]) -> Self {
        let level = |value: f32| (value * LEVEL_MAX).round() as u16;
        let shape = (traces[0].steps.len(), traces.len());
        let unit = |t: &Trace<'_>, part: usize| t.harmonic[part] / t.harmonic[0].hypot(t.harmonic[1]);
        Self {
            levels: Array2::from_shape_fn(shape, |(s, p)| level(traces[p].steps[s])),
            cos: traces.iter().map(|t| unit(t, 0)).collect(),
            sin: traces.iter().map(|t| unit(t, 1)).collect(),
        }
    }

    /// For every step s, the phase from this step and its partner a quarter period later, minus the phase of the whole
    /// stack: `(steps, pixels)`.
    fn errors_rad(&self, table: &[f32], partner: &Array2<f32>) -> Array2<f32> {
        let steps = self.levels.nrows();
        let mut light = self.levels.mapv(|level| table[usize::from(level)]);
        let mean = light.sum_axis(ndarray::Axis(0)) / steps as f32;
        light -= &mean;
        let mut errors = Array2::zeros(self.levels.raw_dim());
        for (s, mut row) in errors.outer_iter_mut().enumerate() {
            for (&weight, later) in partner.row(s).iter().zip(light.outer_iter()) {
                if weight != 0.0 {
                    row.scaled_add(weight, &later);
                }
            }
            let (sin, cos) = (TAU * s as f64 / steps as f64).sin_cos();
            let (sin, cos) = (sin as f32, cos as f32);
            Zip::from(&mut row).and(light.row(s)).and(&self.cos).and(&self.sin).for_each(|e, &d, &c, &s| {
                // (d - i e) exp(-i Phi) exp(-2 pi i s / N), with e the partner
                let (re, im) = (d * c - *e * s, -*e * c - d * s);
                *e = atan2(im * cos - re * sin, re * cos + im * sin);
            });
        }
        errors
    }
}

fn huber_sum(errors_rad: &Array2<f32>) -> f64 {
    let mut sums = vec![0.0f32; errors_rad.ncols()];
    for row in errors_rad.outer_iter() {
        for (sum, e) in sums.iter_mut().zip(row) {
            let e = e.abs();
            let tail = HUBER_RAD * (2.0 * e - HUBER_RAD);
            *sum += if e < HUBER_RAD { e * e } else { tail };
        }
    }
    sums.into_iter().map(f64::from).sum()
}

/// Huber loss of the errors of one pixel.
fn huber(errors_rad: ArrayView1<'_, f32>) -> impl Iterator<Item = f64> {
    errors_rad.into_iter().map(|e| {
        let (e, bend) = (f64::from(e.abs()), f64::from(HUBER_RAD));
        if e < bend { e * e } else { bend * (2.0 * e - bend) }
    })
}

/// Weights `(steps, steps)` that give the signal a quarter period after each step, by trigonometric interpolation. If the
/// number of steps N is a multiple of 4, this is the step N / 4 later.
fn quarter_period_later(steps: usize) -> Array2<f32> {
    let n = steps as f64;
    let wave = |k: usize, x: f64| {
        let twice = if 2 * k == steps { 1.0 } else { 2.0 };
        twice * (TAU * k as f64 * x / n).cos()
    };
    Array2::from_shape_fn((steps, steps), |(s, t)| {
        let x = s as f64 + n / 4.0 - t as f64;
        let weight = (1.0 + (1..=steps / 2).map(|k| wave(k, x)).sum::<f64>()) / n;
        if weight.abs() < 1e-9 { 0.0 } else { weight as f32 }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::Array1;

    fn signal(steps: usize, phase: f64) -> Array1<f32> {
        let angle = |s: usize| phase + TAU * s as f64 / steps as f64;
        Array1::from_shape_fn(steps, |s| (0.5 + 0.4 * angle(s).cos()) as f32)
    }

    #[test]
    fn a_linear_signal_has_no_two_step_error_for_any_number_of_steps() {
        for steps in 5..=17 {
            let phases: Vec<f64> = (0..300).map(|p| 0.021 * f64::from(p)).collect();
            let values: Vec<_> = phases.iter().map(|&p| signal(steps, p)).collect();
            let traces: Vec<_> = phases
                .iter()
                .zip(&values)
                .map(|(&p, v)| Trace { steps: v.view(), harmonic: [p.cos() as f32, p.sin() as f32] })
                .collect();
            let samples = Samples::new(&traces);
            let rms = samples.rms_rad(&Response::default());
            assert!(rms.iter().all(|&e| e < 1e-3), "{steps} {rms:?}");
        }
    }

    #[test]
    fn the_partner_of_a_multiple_of_four_steps_is_a_step() {
        let weights = quarter_period_later(12);
        for ((s, t), &w) in weights.indexed_iter() {
            assert_eq!(w, if t == (s + 3) % 12 { 1.0 } else { 0.0 });
        }
    }
}
