//! Sums over windows of cells.

use super::grid::Grid;
use super::maps::CellMaps;
use super::rows::{add_scaled, fold, kernel, smooth_line};
use crate::parallel::lanes::{LANES, Lanes};
use crate::parallel::slots::Slots;
use rayon::prelude::*;

/// A window over cells.
#[derive(Debug, Clone, Copy)]
pub(in crate::joint) struct CellWindow {
    /// Width (sigma of a Gaussian) in cells.
    pub sigma_cells: f32,
    /// Rows of pixels that stand for a row of cells, at most.
    pub sampled_rows: usize,
}

/// Working memory of one task that sums up rows of cells.
#[derive(Debug, Default)]
struct CellWork {
    columns: Vec<Lanes>,
    spare: Vec<f32>,
    total: Vec<f32>,
}

/// Working memory of one task: rows that its caller needs, and those of the cells.
#[derive(Debug, Default)]
pub(in crate::joint) struct TaskWork<S> {
    pub rows: S,
    cells: CellWork,
}

impl Grid {
    /// Sums over the pixels of every cell of `N` terms, averaged along rows and columns by a Gaussian of `sigma` cells
    /// (cut at the borders: only ratios of the sums have a meaning). `add` puts the terms of one row of pixels on top
    /// of its argument; `most` rows of pixels stand for a row of cells. `finish` receives the sums of every row of
    /// cells with its number and fills its row of `out`.
    pub fn window_sums<const N: usize, S: Default + Send>(
        &self,
        CellWindow { sigma_cells: sigma, sampled_rows: most }: CellWindow,
        slots: &Slots<TaskWork<S>>,
        sums: &mut CellMaps,
        out: &mut CellMaps,
        add: impl Fn(&mut S, usize, &mut [[Lanes; N]]) + Sync,
        finish: impl Fn(usize, [&[f32]; N], &mut [f32]) + Sync,
    ) {
        let kernel = kernel(sigma);
        sums.shape(self, N);
        sums.data.par_chunks_mut(N * self.columns).enumerate().for_each_init(
            || slots.take(),
            |slot, (cell_row, out)| {
                let TaskWork { rows: state, cells: CellWork { columns, spare, .. } } = &mut **slot;
                columns.clear();
                columns.resize(N * self.stride / LANES, [0.0; LANES]);
                let columns = columns.as_chunks_mut().0;
                for y in self.samples(cell_row, most) {
                    add(state, y, columns);
                }
                for (k, line) in out.chunks_exact_mut(self.columns).enumerate() {
                    self.fold(k, columns, line);
                    smooth_line(&kernel, line, spare);
                }
            },
        );
        self.sum_down(&kernel, slots, sums, out, finish);
    }

    /// `N` maps averaged like the sums of [`Self::window_sums`]; a map without lines is 1 everywhere.
    pub fn smooth<'a, const N: usize, S: Default + Send>(
        &self,
        sigma: f32,
        slots: &Slots<TaskWork<S>>,
        sums: &mut CellMaps,
        out: &mut CellMaps,
        line: impl Fn(usize, usize) -> Option<&'a [f32]> + Sync,
        finish: impl Fn(usize, [&[f32]; N], &mut [f32]) + Sync,
    ) {
        let kernel = kernel(sigma);
        sums.shape(self, N);
        sums.data.par_chunks_mut(N * self.columns).enumerate().for_each_init(
            || slots.take(),
            |slot, (row, out)| {
                let spare = &mut slot.cells.spare;
                for (k, target) in out.chunks_exact_mut(self.columns).enumerate() {
                    match line(row, k) {
                        Some(source) => target.copy_from_slice(source),
                        None => target.fill(1.0),
                    }
                    smooth_line(&kernel, target, spare);
                }
            },
        );
        self.sum_down(&kernel, slots, sums, out, finish);
    }

    /// Sums of neighbouring rows of cells, handed to `finish` row by row.
    fn sum_down<const N: usize, S: Default + Send>(
        &self,
        kernel: &[f32],
        slots: &Slots<TaskWork<S>>,
        sums: &CellMaps,
        out: &mut CellMaps,
        finish: impl Fn(usize, [&[f32]; N], &mut [f32]) + Sync,
    ) {
        out.shape(self, out.count);
        let (reach, length) = (kernel.len() / 2, out.count * self.columns);
        out.data.par_chunks_mut(length).enumerate().for_each_init(
            || slots.take(),
            |slot, (row, out)| {
                let total = &mut slot.cells.total;
                total.clear();
                total.resize(N * self.columns, 0.0);
                for (k, &weight) in kernel.iter().enumerate() {
                    if let Some(other) = (row + k).checked_sub(reach).filter(|&r| r < self.rows) {
                        add_scaled(weight, sums.row(other), total);
                    }
                }
                finish(row, std::array::from_fn(|k| &total[k * self.columns..][..self.columns]), out);
            },
        );
    }

    /// Term `k` of columns of pixels as one sum per cell.
    pub fn fold<const N: usize>(&self, k: usize, columns: &[[Lanes; N]], line: &mut [f32]) {
        fold(self.step, k, columns.as_flattened(), N, line);
    }
}
