//! Whether the channels agree: what noise does not explain of the difference between the phase by R and B and that by G and IR.
//!
//! All four channels measure the same column. Where backgrounds, modulations or albedo are wrong - beside edges, at the border of
//! the image, on coloured prints, on a surface that moves - each pair is off in a way of its own, and the mean of both by
//! about half of what they differ by.

use super::cells::{CellMaps, CellWork, RowMaps, kernel};
use super::photometry::{Backgrounds, carriers};
use super::scene::Scene;
use crate::parallel::lanes::{LANES, Lanes, add, lanes, take};
use crate::parallel::slots::Slots;
use multiversion::multiversion;

/// Width (sigma) in fringe periods of the windows that give a phase of each pair.
const WINDOW: f32 = 0.125;
/// Width (sigma) in fringe periods of the surroundings over which their squared differences are averaged.
const SURROUNDINGS: f32 = 0.4;
/// Rows of pixels that stand for a row of cells.
const SAMPLED_ROWS: usize = 2;
/// Least share of the information that a pair must have to be asked.
const SHARE_MIN: f32 = 0.02;

/// Variance of the phase by what the pairs disagree on, cell by cell, and working maps.
#[derive(Debug)]
pub(crate) struct Agreement {
    variance: CellMaps,
    excess: CellMaps,
    sums: CellMaps,
    slots: Slots<(RowMaps, CellWork)>,
}

impl Default for Agreement {
    fn default() -> Self {
        Self {
            variance: CellMaps::new(1),
            excess: CellMaps::new(2),
            sums: CellMaps::default(),
            slots: Slots::default(),
        }
    }
}

impl Agreement {
    /// Ask a final absolute phase in rad; intensities have the standard deviation `noise`, `modulation` is 0 where there is no
    /// light, `ratios` are the fringe numbers over the first.
    pub fn measure(
        &mut self,
        scene: &Scene<'_>,
        (ratios, noise): ([f32; 3], f32),
        backgrounds: &Backgrounds,
        phase: &[f32],
        modulation: &[f32],
    ) {
        let grid = scene.grid;
        let sigma = scene.cells(WINDOW);
        // Sum of squares of the weights of the window, along rows times along columns.
        let share = kernel(sigma).iter().map(|weight| weight * weight).sum::<f32>().powi(2);
        let variance = noise * noise * share;
        let Self { excess, sums, slots, variance: out, .. } = self;
        grid.window_sums::<4, RowMaps>(
            (sigma, SAMPLED_ROWS),
            slots,
            sums,
            excess,
            |maps, y, sums| {
                // Among many a pixel finds backgrounds that agree; what it left says how much is to be doubted.
                let model = backgrounds.sample_own(scene, y, maps);
                let pixels = [phase, modulation, scene.usable].map(|plane| scene.row(plane, y));
                add_pairs(model, pixels, scene.rows(y), ratios, sums);
            },
            |_, sums, out| disagree(sums, variance, out),
        );
        let excess = &*excess;
        grid.smooth::<2, RowMaps>(
            scene.cells(SURROUNDINGS),
            slots,
            sums,
            out,
            |row, k| Some(excess.line(row, k)),
            |_, [weight, excess], out| {
                for (out, (weight, excess)) in out.iter_mut().zip(weight.iter().zip(excess)) {
                    *out = excess.max(0.0) / weight.max(1e-6);
                }
            },
        );
    }

    /// Variance of the phase along row `y`, rad^2.
    pub fn row<'a>(&self, scene: &Scene<'_>, y: usize, maps: &'a mut RowMaps) -> &'a [f32] {
        let [row] = maps.sample(scene.grid, &self.variance, 0, y);
        row
    }
}

/// Adds, for R with B and for G with IR, what the intensities still say about the phase, and how much they know of it with the
/// albedo eliminated.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn add_pairs(
    model: [&[f32]; 8],
    pixels: [&[f32]; 3],
    light: [&[f32]; 4],
    ratios: [f32; 3],
    sums: &mut [[Lanes; 4]],
) {
    let (model, pixels, light) = (model.map(lanes), pixels.map(lanes), light.map(lanes));
    for (i, sums) in sums.iter_mut().enumerate() {
        let (model, light) = (take(&model, i), take(&light, i));
        let [phase, modulation, usable] = take(&pixels, i);
        let mut terms = [[0.0; LANES]; 4];
        for x in 0..LANES {
            let (cosines, derivatives) = carriers(phase[x], ratios, 0.0);
            let (mut mm, mut ms) = (1e-9f32, 0.0f32);
            let (mut seen, mut known, mut mixed) = ([0.0f32; 2], [0.0f32; 2], [0.0f32; 2]);
            for c in 0..4 {
                let (a, b) = (model[2 * c][x], model[2 * c + 1][x]);
                let (m, d) = (a + b * cosines[c], b * derivatives[c]);
                mm += m * m;
                ms += m * light[c][x];
                seen[c % 2] += d * light[c][x];
                known[c % 2] += d * d;
                mixed[c % 2] += d * m;
            }
            let albedo = ms / mm;
            let weight = if modulation[x] > 0.0 { usable[x] * albedo } else { 0.0 };
            for k in 0..2 {
                terms[2 * k][x] = weight * (seen[k] - albedo * mixed[k]);
                terms[2 * k + 1][x] = weight * albedo * (known[k] - mixed[k] * mixed[k] / mm);
            }
        }
        add(sums, &terms);
    }
}

/// Weight, and what the squared difference of the pairs is above that of noise, as a variance of the mean of both.
fn disagree([seen, known, other_seen, other_known]: [&[f32]; 4], variance: f32, out: &mut [f32]) {
    let columns = seen.len();
    for i in 0..columns {
        let (own, other) = (known[i], other_known[i]);
        let whole = own + other;
        let asked = whole > 1e-9 && own.min(other) > SHARE_MIN * whole;
        (out[i], out[columns + i]) = (0.0, 0.0);
        if asked {
            let apart = seen[i] / own - other_seen[i] / other;
            let by_noise = variance * (1.0 / own + 1.0 / other);
            let shares = (own * own + other * other) / (2.0 * whole * whole);
            (out[i], out[columns + i]) = (1.0, shares * (apart * apart - by_noise).min(1.0));
        }
    }
}
