//! Slopes of the phase on the cells, from a phase that may be wrapped.

use super::cells::{CellMaps, CellWindow, RowMaps, TaskWork};
use super::params::pyramid::SAMPLED_ROWS;
use super::params::slopes::WIDTH;
use super::scene::{PhaseMap, Scene};
use crate::parallel::angle::wrap;
use crate::parallel::lanes::{LANES, Lanes, lanes, take};
use crate::parallel::slots::Slots;
use multiversion::multiversion;
use std::f32::consts::PI;

/// Number of sums: weight and weighted phase difference along the row, and the same two down the column.
const TERMS: usize = 4;

/// A row shifted by one pixel, so that each entry holds the right neighbour.
#[derive(Debug, Default)]
struct ShiftedRows {
    phase: Vec<f32>,
    modulation: Vec<f32>,
}

/// Slopes of the phase in rad per cell. In this unit they hold for every level of the image pyramid, because the levels
/// have the same cells.
#[derive(Debug)]
pub(super) struct Slopes {
    maps: CellMaps,
    slots: Slots<TaskWork<ShiftedRows>>,
}

impl Default for Slopes {
    fn default() -> Self {
        Self { maps: CellMaps::new(2), slots: Slots::default() }
    }
}

impl Slopes {
    /// Measures the slopes of a phase. The content of `sums` is lost.
    pub fn measure(&mut self, scene: &Scene<'_>, map: PhaseMap<'_>, sums: &mut CellMaps) {
        let (PhaseMap { phase, modulation }, grid) = (map, scene.grid);
        let Self { maps, slots } = self;
        grid.window_sums::<TERMS, ShiftedRows>(
            CellWindow { sigma_cells: scene.cells(WIDTH), sampled_rows: SAMPLED_ROWS },
            slots,
            sums,
            maps,
            |right, y, sums| {
                let below = (y + 1).min(grid.height - 1);
                for (shifted, plane) in [(&mut right.phase, phase), (&mut right.modulation, modulation)] {
                    shifted.clear();
                    shifted.extend_from_slice(&scene.row(plane, y)[1..grid.width]);
                    shifted.resize(grid.stride, 0.0);
                }
                let here = [scene.row(phase, y), scene.row(modulation, y)];
                add_steps(here, [&right.phase, &right.modulation], [0, 1], sums);
                add_steps(here, [scene.row(phase, below), scene.row(modulation, below)], [2, 3], sums);
            },
            |_, [w, along, v, down], out| {
                let (columns, step) = (w.len(), grid.step as f32);
                let slope = |i: usize, sum: &[f32], weight: &[f32]| step * sum[i] / weight[i].max(1e-6);
                for i in 0..columns {
                    out[i] = slope(i, along, w);
                    out[columns + i] = slope(i, down, v);
                }
            },
        );
    }

    /// Slopes along and down at a cell.
    pub fn at(&self, row: usize, column: usize) -> [f32; 2] {
        [0, 1].map(|k| self.maps.line(row, k)[column])
    }

    /// Slopes along row `y`.
    pub fn along<'a>(&self, scene: &Scene<'_>, y: usize, maps: &'a mut RowMaps) -> &'a [f32] {
        let [row] = maps.sample(scene.grid, &self.maps, 0, y);
        row
    }

    /// Slopes down the columns at row `y`.
    pub fn down<'a>(&self, scene: &Scene<'_>, y: usize, maps: &'a mut RowMaps) -> &'a [f32] {
        let [row] = maps.sample(scene.grid, &self.maps, 1, y);
        row
    }
}

/// Adds the differences between lit pixels, and their weights. A difference near half a turn has a small weight,
/// because it belongs to an edge.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn add_steps(here: [&[f32]; 2], there: [&[f32]; 2], to: [usize; 2], sums: &mut [[Lanes; TERMS]]) {
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

#[cfg(test)]
mod tests {
    use super::super::cells::Grid;
    use super::*;

    #[test]
    fn slopes_of_a_wrapped_plane_are_exact_and_reach_beyond_the_lit_surface() {
        let grid = Grid::new([96, 256], 4.0);
        let phase: Vec<f32> = (0..grid.pixels())
            .map(|i| wrap(0.25 * (i % grid.stride) as f32 - 0.1 * (i / grid.stride) as f32))
            .collect();
        // The surface is lit up to column 160. The window is 11 cells wide at each side.
        let lit: Vec<f32> = (0..grid.pixels()).map(|i| f32::from(u8::from(i % grid.stride < 160))).collect();
        let light = vec![0.5; grid.pixels()];
        let scene =
            Scene { light: [&light; 4], usable: &light, grid: &grid, period_px: 35.0, factor: 1, pair: None };
        let mut slopes = Slopes::default();
        slopes.measure(&scene, PhaseMap { phase: &phase, modulation: &lit }, &mut CellMaps::default());
        for column in [4, 39, 44] {
            let [along, down] = slopes.at(12, column);
            assert!((along - 1.0).abs() < 1e-3 && (down + 0.4).abs() < 1e-3, "{column}: {along} {down}");
        }
        assert_eq!(slopes.at(12, 60), [0.0, 0.0]);
    }
}
