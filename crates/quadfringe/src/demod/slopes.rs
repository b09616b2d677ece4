//! Slopes of the phase on the cells, from a wrapped phase.

use super::cells::{CellMaps, CellWork, RowMaps};
use super::lanes::{LANES, Lanes, lanes, take};
use super::scene::Scene;
use crate::angle::wrap;
use crate::slots::Slots;
use multiversion::multiversion;
use std::f32::consts::PI;

/// Width (sigma) in fringe periods over which slopes are averaged.
const WIDTH: f32 = 0.43;
/// Rows of pixels that stand for a row of cells.
const SAMPLED_ROWS: usize = 2;

/// Slopes of the phase in rad per cell, which stays right when the cells are laid over another image.
#[derive(Debug)]
pub(crate) struct Slopes {
    maps: CellMaps,
    sums: CellMaps,
    slots: Slots<([Vec<f32>; 2], CellWork)>,
}

impl Default for Slopes {
    fn default() -> Self {
        Self { maps: CellMaps::new(3), sums: CellMaps::default(), slots: Slots::default() }
    }
}

impl Slopes {
    /// Measure a phase (rad, wrapped or not); `modulation` is 0 where there is no light.
    pub fn measure(&mut self, scene: &Scene<'_>, phase: &[f32], modulation: &[f32]) {
        let grid = scene.grid;
        grid.window_sums::<4, [Vec<f32>; 2]>(
            (scene.cells(WIDTH), SAMPLED_ROWS),
            &self.slots,
            &mut self.sums,
            &mut self.maps,
            |right, y, sums| {
                let below = (y + 1).min(grid.height - 1);
                for (shifted, plane) in right.iter_mut().zip([phase, modulation]) {
                    shifted.clear();
                    shifted.extend_from_slice(&scene.row(plane, y)[1..grid.width]);
                    shifted.resize(grid.stride, 0.0);
                }
                let here = [scene.row(phase, y), scene.row(modulation, y)];
                add_steps(here, [&right[0], &right[1]], [0, 1], sums);
                add_steps(here, [scene.row(phase, below), scene.row(modulation, below)], [2, 3], sums);
            },
            |_, [w, along, v, down], out| {
                let (columns, step) = (w.len(), grid.step as f32);
                for i in 0..columns {
                    out[i] = step * along[i] / w[i].max(1e-6);
                    out[columns + i] = step * down[i] / v[i].max(1e-6);
                    out[2 * columns + i] = (out[i] * out[i] + out[columns + i] * out[columns + i]) / 24.0;
                }
            },
        );
    }

    /// Slopes of nothing.
    #[cfg(test)]
    pub fn flat(grid: &super::cells::Grid) -> Self {
        let mut flat = Self::default();
        flat.maps.fill::<3>(grid, |_, lines| lines.into_iter().for_each(|line| line.fill(0.0)));
        flat
    }

    /// Slopes along and down at a cell.
    pub fn at(&self, row: usize, column: usize) -> [f32; 2] {
        [0, 1].map(|k| self.maps.line(row, k)[column])
    }

    /// Share of the contrast of the first fringes that averaging camera pixels has cost in row `y`; that of others goes with
    /// the square of their number. Of a phase with the step `s` per pixel, the mean of `f` parts of it, it is
    /// `(1 - 1 / f^2) s^2 / 24` in each direction.
    pub fn loss<'a>(&self, scene: &Scene<'_>, y: usize, maps: &'a mut RowMaps) -> &'a [f32] {
        let [row] = maps.sample_mut(scene.grid, &self.maps, 2, y);
        let scale = loss_scale(scene);
        row.iter_mut().for_each(|loss| *loss *= scale);
        row
    }

    /// The same at a cell.
    pub fn loss_at(&self, scene: &Scene<'_>, [row, column]: [usize; 2]) -> f32 {
        self.maps.line(row, 2)[column] * loss_scale(scene)
    }

    /// Slopes along row `y`.
    pub fn along<'a>(&self, scene: &Scene<'_>, y: usize, maps: &'a mut RowMaps) -> &'a [f32] {
        let [row] = maps.sample(scene.grid, &self.maps, 0, y);
        row
    }

    /// Slopes down at row `y`.
    pub fn down<'a>(&self, scene: &Scene<'_>, y: usize, maps: &'a mut RowMaps) -> &'a [f32] {
        let [row] = maps.sample(scene.grid, &self.maps, 1, y);
        row
    }
}

fn loss_scale(scene: &Scene<'_>) -> f32 {
    (1.0 - 1.0 / (scene.factor * scene.factor) as f32) / (scene.grid.step * scene.grid.step) as f32
}

/// Adds weights and weighted differences between lit pixels; a difference near half a turn belongs to an edge.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn add_steps(here: [&[f32]; 2], there: [&[f32]; 2], to: [usize; 2], sums: &mut [[Lanes; 4]]) {
    let (here, there) = (here.map(lanes), there.map(lanes));
    for (i, sums) in sums.iter_mut().enumerate() {
        let ([phase, lit], [other, other_lit]) = (take(&here, i), take(&there, i));
        let mut terms = [[0.0; LANES]; 2];
        for x in 0..LANES {
            let step = wrap(other[x] - phase[x]);
            let part = step * (1.0 / PI);
            let near = 1.0 - part * part;
            let both = (lit[x] > 0.0) & (other_lit[x] > 0.0);
            let weight = if both { near * near } else { 0.0 };
            (terms[0][x], terms[1][x]) = (weight, weight * step);
        }
        for x in 0..LANES {
            sums[to[0]][x] += terms[0][x];
            sums[to[1]][x] += terms[1][x];
        }
    }
}
