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

use super::cells::{CellMaps, CellWindow, Grid, RowMaps, TaskWork};
use super::infrared::with_waves;
use super::local_fit::LocalFit;
use super::model::{CellFringes, FringeRows, contrast, count};
use super::params::photometry::{CELL, NEIGHBOURHOOD, OTHER_TEXTURE_MIN, OTHER_TEXTURE_NOISES, WINDOW};
use super::scene::{PhaseMap, Scene};
use super::slopes::Slopes;
use crate::parallel::slots::Slots;
use choice::Choice;
use multiversion::multiversion;
use project::add_projected;
use solve::{SUMS, improve};

/// Offsets and amplitudes on cells that are wider than the cells of the scene.
#[derive(Debug)]
pub(in crate::joint) struct Photometry {
    grid: Grid,
    maps: CellMaps,
    next: CellMaps,
    sums: CellMaps,
    choice: Choice,
    slots: Slots<TaskWork<Rows>>,
}

/// Working rows.
#[derive(Debug, Default)]
struct Rows {
    maps: RowMaps,
    losses: RowMaps,
    usable: Vec<f32>,
}

/// How offsets and amplitudes are fitted.
pub(in crate::joint) struct PhotometryFit {
    /// Greatest misfit (root mean square residual over modulation) of a pixel that takes part.
    pub misfit_max: f32,
    /// Noise divided by modulation.
    pub relative_noise: f32,
    /// Number of pixel rows that are sampled for each row of cells.
    pub sampled_rows: usize,
    /// Weight of the given phase relative to the information about the phase in the light.
    pub phase_trust: f32,
    /// A pixel takes part if at least this share of the window of the slopes around it is lit.
    pub lit_share_min: f32,
}

impl Photometry {
    pub fn new() -> Self {
        Self {
            grid: Grid::new([1, 1], 1.0),
            maps: CellMaps::new(8),
            next: CellMaps::new(8),
            sums: CellMaps::default(),
            choice: Choice::default(),
            slots: Slots::default(),
        }
    }

    /// Starts from the offsets and amplitudes of the local fit, which needs no orders, averaged over the neighbourhood. Where the
    /// phase hardly changes in a window, later fits cannot improve them.
    pub fn start(&mut self, scene: &Scene<'_>, fit: &LocalFit, slopes: &Slopes, ratios: [f32; 4]) {
        let fine = scene.grid;
        let side = (CELL * scene.period_px).max(fine.step as f64);
        self.grid = Grid::with_stride([fine.height, fine.width], fine.stride, side);
        let times = self.grid.step / fine.step;
        self.choice.forget();
        self.next.fill::<8>(&self.grid, |row, lines| {
            for column in 0..lines[0].len() {
                let inside = |at: usize, count: usize| (at * times + times / 2).min(count - 1);
                let cell = [inside(row, fine.rows), inside(column, fine.columns)];
                let CellFringes { offset, amplitude } = fit.cell(cell[0], cell[1]);
                let loss = slopes.loss_at(scene, cell);
                for (c, ratio) in ratios.into_iter().enumerate() {
                    lines[2 * c][column] = offset[c];
                    lines[2 * c + 1][column] = amplitude[c] / contrast(loss * ratio * ratio);
                }
            }
        });
        self.draw_together(scene, f32::INFINITY);
    }

    /// Offsets and amplitudes that the pixels of row `y` have chosen, in the scene of the fit or a finer image of it.
    pub fn sample<'a>(&self, scene: &Scene<'_>, y: usize, maps: &'a mut RowMaps) -> FringeRows<'a> {
        let grid = self.grid.over(scene.grid);
        let mut rows = maps.sample_mut(&grid, &self.maps, 0, y);
        self.choice.apply(&grid, &self.maps, y, &mut rows);
        FringeRows::from_interleaved(rows.map(|row| &*row))
    }

    /// Offsets and amplitudes at the positions of the pixels, whatever place they have chosen.
    pub fn sample_in_place<'a>(&self, scene: &Scene<'_>, y: usize, maps: &'a mut RowMaps) -> FringeRows<'a> {
        FringeRows::from_interleaved(maps.sample(&self.grid.over(scene.grid), &self.maps, 0, y))
    }

    /// Lets every pixel choose among the offsets and amplitudes of the places around it, given the phase in `map` and intensities
    /// with the standard deviation `noise`. Returns the share of the lit pixels that choose another place.
    pub fn choose_places(
        &mut self,
        scene: &Scene<'_>,
        ratios: [f32; 4],
        map: PhaseMap<'_>,
        slopes: &Slopes,
        noise: f32,
    ) -> f32 {
        let grid = self.grid.over(scene.grid);
        self.choice.make((&grid, &self.maps), scene, (ratios, slopes), [map.phase, map.modulation], noise)
    }

    /// Offsets and amplitudes near the middle of a cell of the scene's grid.
    pub fn cell(&self, scene: &Scene<'_>, row: usize, column: usize) -> CellFringes {
        let times = self.grid.over(scene.grid).step / scene.grid.step;
        let value = |k: usize| self.maps.line(row / times, k)[column / times];
        CellFringes { offset: [0, 2, 4, 6].map(value), amplitude: [1, 3, 5, 7].map(value) }
    }

    /// Fits offsets and amplitudes to an absolute phase. Pixels that have chosen another place take no part.
    pub fn fit(
        &mut self,
        scene: &Scene<'_>,
        ratios: [f32; 4],
        PhaseMap { phase, modulation }: PhaseMap<'_>,
        slopes: &Slopes,
        fit: &PhotometryFit,
    ) {
        let Self { grid, maps, next, sums, slots, choice, .. } = self;
        let &PhotometryFit { misfit_max, relative_noise, sampled_rows, phase_trust, lit_share_min } = fit;
        let sigma_cells = WINDOW * scene.period_px as f32 / grid.step as f32;
        grid.window_sums::<SUMS, Rows>(
            CellWindow { sigma_cells, sampled_rows },
            slots,
            sums,
            next,
            |rows, y, sums| {
                let Rows { maps: model, losses, usable } = rows;
                let model = model.sample::<8>(grid, maps, 0, y);
                take_part(scene, choice, slopes, lit_share_min, y, losses, usable);
                let [phase, modulation] = [phase, modulation].map(|plane| scene.row(plane, y));
                let pixels = [phase, modulation, usable, slopes.loss(scene, y, losses)];
                let limits = [count(ratios) * misfit_max * misfit_max, phase_trust];
                with_waves!(scene, y, ratios, |waves| {
                    add_projected(model, pixels, scene.rows(y), waves, limits, sums);
                });
            },
            |row, sums, out| {
                let before: [&[f32]; 8] = std::array::from_fn(|k| maps.line(row, k));
                improve(sums, before, out);
            },
        );
        self.draw_together(scene, (OTHER_TEXTURE_NOISES * relative_noise).max(OTHER_TEXTURE_MIN));
    }

    /// Draws every cell to the mean of its neighbourhood unless the two differ by more than `threshold`.
    fn draw_together(&mut self, scene: &Scene<'_>, threshold: f32) {
        let Self { grid, maps, next, sums, slots, .. } = self;
        let sigma = NEIGHBOURHOOD * scene.period_px as f32 / grid.step as f32;
        let fitted = &*next;
        grid.smooth::<8, Rows>(
            sigma,
            slots,
            sums,
            maps,
            |row, k| Some(fitted.line(row, k)),
            |row, wide, out| blend(threshold, std::array::from_fn(|k| fitted.line(row, k)), wide, out),
        );
    }
}

/// Writes which pixels of row `y` take part in a fit.
fn take_part(
    scene: &Scene<'_>,
    choice: &Choice,
    slopes: &Slopes,
    lit_share_min: f32,
    y: usize,
    maps: &mut RowMaps,
    usable: &mut Vec<f32>,
) {
    usable.clear();
    usable.extend_from_slice(scene.row(scene.usable, y));
    choice.leave_out(y, usable);
    if lit_share_min > 0.0 {
        let shares = slopes.lit(scene, y, maps).iter();
        usable.iter_mut().zip(shares).for_each(|(usable, &lit)| {
            *usable = if lit >= lit_share_min { *usable } else { 0.0 };
        });
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
