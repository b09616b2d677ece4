//! Maps on the cells, and their values on rows of pixels.

use super::grid::{CellRows, Grid};
use super::rows::{blend, spread};
use rayon::prelude::*;

/// Several maps on the cells, kept row of cells by row of cells.
#[derive(Debug, Clone, Default)]
pub(in crate::joint) struct CellMaps {
    columns: usize,
    pub(super) count: usize,
    pub(super) data: Vec<f32>,
}

impl CellMaps {
    /// Room for `count` maps.
    pub fn new(count: usize) -> Self {
        Self { count, ..Self::default() }
    }

    pub(super) fn shape(&mut self, grid: &Grid, count: usize) {
        (self.columns, self.count) = (grid.columns, count);
        self.data.resize(grid.rows * grid.columns * count, 0.0);
    }

    pub(super) fn row(&self, row: usize) -> &[f32] {
        &self.data[row * self.count * self.columns..][..self.count * self.columns]
    }

    /// One row of one map.
    pub fn line(&self, row: usize, map: usize) -> &[f32] {
        &self.data[(row * self.count + map) * self.columns..][..self.columns]
    }

    /// The first `N` maps in row `y` of the image at column `x`, between cells as [`Self::expand`].
    #[inline(always)]
    pub fn at<const N: usize>(&self, grid: &Grid, y: usize, x: f32) -> [f32; N] {
        let CellRows { above, below, weight: down } = grid.between(y);
        // One more, so that what is cut off rounds down.
        let place = (x + 0.5) / grid.step as f32 + 0.5;
        let next = place.max(0.0) as usize;
        let to_right = place - next as f32;
        let (left, right) = (next.saturating_sub(1), next.min(self.columns - 1));
        std::array::from_fn(|k| {
            let (above, below) = (self.line(above, k), self.line(below, k));
            let mix = |column: usize| above[column] + (below[column] - above[column]) * down;
            mix(left) + (mix(right) - mix(left)) * to_right
        })
    }

    /// One map at row `y` of the image: bilinear between cells, level at the borders.
    fn expand(&self, grid: &Grid, map: usize, y: usize, mix: &mut Vec<f32>, out: &mut [f32]) {
        let CellRows { above, below, weight } = grid.between(y);
        mix.resize(self.columns + 2, 0.0);
        blend(self.line(above, map), self.line(below, map), weight, &mut mix[1..=self.columns]);
        (mix[0], mix[self.columns + 1]) = (mix[1], mix[self.columns]);
        spread(grid.step, mix, out);
    }

    /// Fill every map, row of cells by row of cells. Of maps that have this size already, the lines hold what they held.
    pub fn fill<const N: usize>(&mut self, grid: &Grid, fill: impl Fn(usize, [&mut [f32]; N]) + Sync) {
        self.shape(grid, N);
        let columns = self.columns;
        self.data.par_chunks_mut(N * columns).enumerate().for_each(|(row, lines)| {
            let mut lines = lines.chunks_exact_mut(columns);
            fill(row, std::array::from_fn(|_| lines.next().expect("as many lines as maps")));
        });
    }
}

/// Slow maps interpolated along one row of pixels.
#[derive(Debug, Default)]
pub(in crate::joint) struct RowMaps {
    mix: Vec<f32>,
    rows: Vec<Vec<f32>>,
}

impl RowMaps {
    /// `N` maps from number `first` on, at row `y` of the image.
    pub fn sample<const N: usize>(
        &mut self,
        grid: &Grid,
        maps: &CellMaps,
        first: usize,
        y: usize,
    ) -> [&[f32]; N] {
        self.sample_mut(grid, maps, first, y).map(|row| &*row)
    }

    /// The same, to be changed.
    pub fn sample_mut<const N: usize>(
        &mut self,
        grid: &Grid,
        maps: &CellMaps,
        first: usize,
        y: usize,
    ) -> [&mut [f32]; N] {
        self.rows.resize_with(self.rows.len().max(N), Vec::new);
        for (k, row) in self.rows[..N].iter_mut().enumerate() {
            row.resize(grid.stride, 0.0);
            maps.expand(grid, first + k, y, &mut self.mix, row);
        }
        let mut rows = self.rows.iter_mut();
        std::array::from_fn(|_| rows.next().expect("made above").as_mut_slice())
    }
}
