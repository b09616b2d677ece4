//! Step 5: photometry, which fits offset and amplitude of every channel once the absolute phase is known.
//!
//! In the model (S1) each pixel has a phase and an albedo, and each window of about a fringe has offsets `A` and amplitudes `B`.
//! To first order, an error of the phase or the albedo changes the four intensities of a pixel in known directions. These
//! directions are projected out (variable projection; Golub and Pereyra, SIAM J. Numer. Anal. 10, 413 (1973)), so that neither
//! noise of the phase nor texture reaches `A` and `B`, and one fit replaces many alternating ones.

mod choice;
#[cfg(test)]
mod edge;
mod project;
mod solve;
#[cfg(test)]
mod tests;

use super::cells::{CellMaps, CellWindow, RowMaps, TaskWork};
use super::infrared::with_waves;
use super::local_fit::LocalFit;
use super::model::{CellFringes, FringeRows, count};
use super::params::photometry::{NEIGHBOURHOOD, OTHER_TEXTURE, WINDOW};
use super::params::pyramid::SAMPLED_ROWS;
use super::params::validity::MISFIT_MAX;
use super::scene::{PhaseMap, Scene};
use crate::parallel::slots::Slots;
use choice::Choice;
use multiversion::multiversion;
use project::add_projected;
use solve::{SUMS, improve};
use std::f32::consts::TAU;

/// Offsets and amplitudes on the cells of the scene.
#[derive(Debug)]
pub(in crate::joint) struct Photometry {
    maps: CellMaps,
    next: CellMaps,
    choice: Choice,
    slots: Slots<TaskWork<Rows>>,
}

/// Working rows.
#[derive(Debug, Default)]
struct Rows {
    maps: RowMaps,
    usable: Vec<f32>,
}

impl Photometry {
    pub fn new() -> Self {
        Self {
            maps: CellMaps::new(8),
            next: CellMaps::new(8),
            choice: Choice::default(),
            slots: Slots::default(),
        }
    }

    /// Starts from the offsets and amplitudes of the local fit, which needs no orders, averaged over the neighbourhood. Where the
    /// phase hardly changes in a window, later fits cannot improve them. The content of `sums` is lost.
    pub fn start(&mut self, scene: &Scene<'_>, fit: &LocalFit, sums: &mut CellMaps) {
        self.choice.forget();
        self.next.fill::<8>(scene.grid, |row, lines| {
            for column in 0..lines[0].len() {
                let CellFringes { offset, amplitude } = fit.cell(row, column);
                for c in 0..4 {
                    (lines[2 * c][column], lines[2 * c + 1][column]) = (offset[c], amplitude[c]);
                }
            }
        });
        self.draw_together(scene, f32::INFINITY, sums);
    }

    /// From now on, the pixels are those of the full image. A mean over the pixels of `coarse` has lost a share of the contrast (J1).
    pub fn sharpen(&mut self, coarse: &Scene<'_>, ratios: [f32; 4]) {
        let turned = TAU / coarse.period_px as f32;
        let lost = (1.0 - 1.0 / (coarse.factor * coarse.factor) as f32) * turned * turned / 24.0;
        let loss = ratios.map(|ratio| lost * ratio * ratio);
        let gain = loss.map(|loss| 1.0 / (1.0 - loss + 0.3 * loss * loss));
        let fitted = std::mem::replace(&mut self.maps, CellMaps::new(8));
        self.maps.fill::<8>(coarse.grid, |row, lines| {
            for (k, line) in lines.into_iter().enumerate() {
                let gain = if k % 2 == 1 { gain[k / 2] } else { 1.0 };
                line.iter_mut().zip(fitted.line(row, k)).for_each(|(out, value)| *out = gain * value);
            }
        });
    }

    /// Offsets and amplitudes that the pixels of row `y` have chosen, in the scene of the fit or a finer image of it.
    pub fn sample<'a>(&self, scene: &Scene<'_>, y: usize, maps: &'a mut RowMaps) -> FringeRows<'a> {
        let mut rows = maps.sample_mut(scene.grid, &self.maps, 0, y);
        self.choice.apply(scene.grid, &self.maps, y, &mut rows);
        FringeRows::from_interleaved(rows.map(|row| &*row))
    }

    /// Offsets and amplitudes at the positions of the pixels, whatever place they have chosen.
    pub fn sample_in_place<'a>(&self, scene: &Scene<'_>, y: usize, maps: &'a mut RowMaps) -> FringeRows<'a> {
        FringeRows::from_interleaved(maps.sample(scene.grid, &self.maps, 0, y))
    }

    /// Lets every pixel choose among the offsets and amplitudes of the places around it, given the phase in `map` and intensities
    /// with the standard deviation `noise`.
    pub fn choose_places(&mut self, scene: &Scene<'_>, ratios: [f32; 4], map: PhaseMap<'_>, noise: f32) {
        self.choice.make(&self.maps, scene, ratios, [map.phase, map.modulation], noise);
    }

    /// Offsets and amplitudes in one cell.
    pub fn cell(&self, row: usize, column: usize) -> CellFringes {
        let value = |k: usize| self.maps.line(row, k)[column];
        CellFringes { offset: [0, 2, 4, 6].map(value), amplitude: [1, 3, 5, 7].map(value) }
    }

    /// Fits offsets and amplitudes to an absolute phase, whose weight relative to the information about it in the light is
    /// `phase_trust`. Pixels that have chosen another place take no part. The content of `sums` is lost.
    pub fn fit(
        &mut self,
        scene: &Scene<'_>,
        ratios: [f32; 4],
        PhaseMap { phase, modulation }: PhaseMap<'_>,
        phase_trust: f32,
        sums: &mut CellMaps,
    ) {
        let Self { maps, next, slots, choice } = self;
        let grid = scene.grid;
        grid.window_sums::<SUMS, Rows>(
            CellWindow { sigma_cells: scene.cells(WINDOW), sampled_rows: SAMPLED_ROWS },
            slots,
            sums,
            next,
            |Rows { maps: model, usable }, y, sums| {
                let model = model.sample::<8>(grid, maps, 0, y);
                usable.clear();
                usable.extend_from_slice(scene.row(scene.usable, y));
                choice.leave_out(y, usable);
                let [phase, modulation] = [phase, modulation].map(|plane| scene.row(plane, y));
                let limits = [count(ratios) * MISFIT_MAX * MISFIT_MAX, phase_trust];
                with_waves!(scene, y, ratios, |waves| {
                    add_projected(model, [phase, modulation, usable], scene.rows(y), waves, limits, sums);
                });
            },
            |row, sums, out| {
                let before: [&[f32]; 8] = std::array::from_fn(|k| maps.line(row, k));
                improve(sums, before, out);
            },
        );
        self.draw_together(scene, OTHER_TEXTURE, sums);
    }

    /// Draws every cell to the mean of its neighbourhood unless the two differ by more than `threshold`.
    fn draw_together(&mut self, scene: &Scene<'_>, threshold: f32, sums: &mut CellMaps) {
        let Self { maps, next, slots, .. } = self;
        let fitted = &*next;
        scene.grid.smooth::<8, Rows>(
            scene.cells(NEIGHBOURHOOD),
            slots,
            sums,
            maps,
            |row, k| Some(fitted.line(row, k)),
            |row, wide, out| blend(threshold, std::array::from_fn(|k| fitted.line(row, k)), wide, out),
        );
    }
}

/// Draws the fit of every cell to the mean of its neighbourhood unless their textures differ (J14).
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn blend(threshold: f32, cell: [&[f32]; 8], wide: [&[f32]; 8], out: &mut [f32]) {
    let columns = cell[0].len();
    for i in 0..columns {
        let norm = |maps: &[&[f32]; 8]| (0..8).map(|k| maps[k][i] * maps[k][i]).sum::<f32>().max(1e-12);
        // Only ratios have a meaning, because the albedo of the pixels compensates a common factor.
        let scale = (norm(&cell) / norm(&wide)).sqrt();
        let size = norm(&cell);
        let square: f32 = (0..8).map(|k| (cell[k][i] - scale * wide[k][i]).powi(2)).sum();
        let apart = square / (size * threshold * threshold);
        let weight = (apart - 1.0).clamp(0.0, 1.0);
        for k in 0..8 {
            out[k * columns + i] = scale * wide[k][i] + weight * (cell[k][i] - scale * wide[k][i]);
        }
    }
}
