//! Maps on a grid of cells: quantities that vary slowly (offset, amplitude, beats) are kept once per cell.
//!
//! Planes of pixels are padded to whole vectors ([`LANES`]), cells are a power of two of pixels wide, so that every
//! vector holds whole cells and no loop has a remainder.

use crate::parallel::lanes::{LANES, Lanes};
use crate::parallel::slots::Slots;
use multiversion::multiversion;
use rayon::prelude::*;

/// Cells of `step` x `step` pixels over an image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Grid {
    pub height: usize,
    pub width: usize,
    /// Length of a padded row of pixels.
    pub stride: usize,
    /// Pixels along a side of a cell: 1, 2, 4, 8 or 16; on the finer image of [`Self::over`] 32 or 64 too.
    pub step: usize,
    pub rows: usize,
    pub columns: usize,
}

/// A window over cells.
#[derive(Debug, Clone, Copy)]
pub(super) struct CellWindow {
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
pub(super) struct TaskWork<S> {
    pub rows: S,
    cells: CellWork,
}

/// Rows of cells above and below a row of the image.
pub(super) struct CellRows {
    pub above: usize,
    pub below: usize,
    /// Weight of the row below, in [0, 1).
    pub weight: f32,
}

impl Grid {
    /// Cells of at most `side` pixels.
    pub fn new(shape: [usize; 2], side: f64) -> Self {
        Self::with_stride(shape, shape[1].next_multiple_of(LANES), side)
    }

    /// The same over planes with rows of `stride` pixels, whole vectors.
    pub fn with_stride([height, width]: [usize; 2], stride: usize, side: f64) -> Self {
        let step = 1 << (side.clamp(1.0, LANES as f64).log2() as usize);
        Self { height, width, stride, step, rows: height.div_ceil(step), columns: stride / step }
    }

    /// The same cells over an image with one pixel for every `factor` x `factor`.
    pub fn shrunk(&self, factor: usize) -> Self {
        Self {
            height: self.height.div_ceil(factor),
            width: self.width.div_ceil(factor),
            stride: self.stride / factor,
            step: self.step / factor,
            ..*self
        }
    }

    /// The same cells over the pixels of `other`.
    pub fn over(&self, other: &Self) -> Self {
        let Self { height, width, stride, .. } = *other;
        Self { height, width, stride, step: self.step * stride / self.stride, ..*self }
    }

    /// Pixels of a padded plane.
    pub fn pixels(&self) -> usize {
        self.stride * self.height
    }

    /// The rows of cells around row `y` of the image; level at the borders.
    pub fn between(&self, y: usize) -> CellRows {
        let place = (y as f32 + 0.5) / self.step as f32 - 0.5;
        let above = place.floor();
        let clamp = |row: f32| row.clamp(0.0, (self.rows - 1) as f32) as usize;
        CellRows { above: clamp(above), below: clamp(above + 1.0), weight: place - above }
    }

    /// Rows of the image that stand for a row of cells: all of them, or `most` spread symmetrically.
    pub fn samples(&self, cell_row: usize, most: usize) -> impl Iterator<Item = usize> {
        let (step, height) = (self.step, self.height);
        let count = most.min(step);
        (0..count)
            .map(move |i| cell_row * step + (2 * i + 1) * step / (2 * count))
            .map(move |y| y.min(height - 1))
    }

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

    /// A map given on the cells, at row `y` of the image: bilinear, level at the borders.
    fn expand(&self, maps: &CellMaps, map: usize, y: usize, mix: &mut Vec<f32>, out: &mut [f32]) {
        let CellRows { above, below, weight } = self.between(y);
        mix.resize(self.columns + 2, 0.0);
        blend(maps.line(above, map), maps.line(below, map), weight, &mut mix[1..=self.columns]);
        (mix[0], mix[self.columns + 1]) = (mix[1], mix[self.columns]);
        spread(self.step, mix, out);
    }
}

/// Several maps on the cells, kept row of cells by row of cells.
#[derive(Debug, Clone, Default)]
pub(super) struct CellMaps {
    columns: usize,
    count: usize,
    data: Vec<f32>,
}

impl CellMaps {
    /// Room for `count` maps.
    pub fn new(count: usize) -> Self {
        Self { count, ..Self::default() }
    }

    fn shape(&mut self, grid: &Grid, count: usize) {
        (self.columns, self.count) = (grid.columns, count);
        self.data.resize(grid.rows * grid.columns * count, 0.0);
    }

    fn row(&self, row: usize) -> &[f32] {
        &self.data[row * self.count * self.columns..][..self.count * self.columns]
    }

    /// One row of one map.
    pub fn line(&self, row: usize, map: usize) -> &[f32] {
        &self.data[(row * self.count + map) * self.columns..][..self.columns]
    }

    /// The first `N` maps in row `y` of the image at column `x`, between cells as [`Grid::expand`].
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

    /// Fill every map, row of cells by row of cells.
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
pub(super) struct RowMaps {
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
            grid.expand(maps, first + k, y, &mut self.mix, row);
        }
        let mut rows = self.rows.iter_mut();
        std::array::from_fn(|_| rows.next().expect("made above").as_mut_slice())
    }
}

/// Sums of `step` pixels of every `count`th vector from number `k` on.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn fold(step: usize, k: usize, vectors: &[Lanes], count: usize, line: &mut [f32]) {
    match step {
        1 => fold_by::<1>(k, vectors, count, line),
        2 => fold_by::<2>(k, vectors, count, line),
        4 => fold_by::<4>(k, vectors, count, line),
        8 => fold_by::<8>(k, vectors, count, line),
        _ => fold_by::<16>(k, vectors, count, line),
    }
}

#[inline(always)]
fn fold_by<const S: usize>(k: usize, vectors: &[Lanes], count: usize, line: &mut [f32]) {
    for (vector, cells) in vectors[k..].iter().step_by(count).zip(line.chunks_exact_mut(LANES / S)) {
        for (cell, pixels) in cells.iter_mut().zip(vector.as_chunks::<S>().0) {
            // By halves: a sum one after the other would wait for each.
            let mut sums = *pixels;
            let mut half = S / 2;
            while half > 0 {
                for x in 0..half {
                    sums[x] += sums[x + half];
                }
                half /= 2;
            }
            *cell = sums[0];
        }
    }
}

/// Linear interpolation between centres of cells `step` pixels wide, up to 64; `mix` has one cell more on each side.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
pub(super) fn spread(step: usize, mix: &[f32], out: &mut [f32]) {
    match step {
        1 => out.copy_from_slice(&mix[1..=out.len()]),
        2 => spread_by::<2>(mix, out),
        4 => spread_by::<4>(mix, out),
        8 => spread_by::<8>(mix, out),
        16 => spread_by::<16>(mix, out),
        32 => spread_by::<32>(mix, out),
        _ => spread_by::<64>(mix, out),
    }
}

#[inline(always)]
fn spread_by<const S: usize>(mix: &[f32], out: &mut [f32]) {
    // The pixels from the centre of a cell to that of the next; the first half lies before the image.
    let part: [f32; S] = std::array::from_fn(|x| (x as f32 + 0.5) / S as f32);
    let between = |left: usize| -> [f32; S] {
        let (from, way) = (mix[left], mix[left + 1] - mix[left]);
        part.map(|part| from + way * part)
    };
    let (first, rest) = out.split_at_mut(S / 2);
    first.copy_from_slice(&between(0)[S / 2..]);
    let (whole, last) = rest.as_chunks_mut::<S>();
    let cells = whole.len();
    for (i, pixels) in whole.iter_mut().enumerate() {
        *pixels = between(i + 1);
        // A cell that fills vectors is one; otherwise the compiler makes vectors of cells and takes them apart again.
        if S >= 8 {
            std::hint::black_box(());
        }
    }
    last.copy_from_slice(&between(cells + 1)[..S / 2]);
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
pub(super) fn blend(above: &[f32], below: &[f32], weight: f32, out: &mut [f32]) {
    for ((out, a), b) in out.iter_mut().zip(above).zip(below) {
        *out = a + (b - a) * weight;
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn add_scaled(weight: f32, from: &[f32], to: &mut [f32]) {
    to.iter_mut().zip(from).for_each(|(t, f)| *t += weight * f);
}

/// `line` averaged by `kernel`, with zeros beyond its ends.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn smooth_line(kernel: &[f32], line: &mut [f32], spare: &mut Vec<f32>) {
    let (length, reach) = (line.len(), kernel.len() / 2);
    spare.clear();
    spare.resize(reach, 0.0);
    spare.extend_from_slice(line);
    spare.resize(length.next_multiple_of(LANES) + kernel.len(), 0.0);
    let smooth = |from: usize| {
        let mut sum = [0.0; LANES];
        for (weight, part) in kernel.iter().zip(spare[from..].windows(LANES)) {
            for x in 0..LANES {
                sum[x] += weight * part[x];
            }
        }
        sum
    };
    let (whole, rest) = line.as_chunks_mut();
    for (i, out) in whole.iter_mut().enumerate() {
        *out = smooth(i * LANES);
    }
    let smoothed = smooth(length - rest.len());
    rest.copy_from_slice(&smoothed[..rest.len()]);
}

/// A Gaussian cut at three sigma; one tap for a sigma of 0.
pub(super) fn kernel(sigma: f32) -> Vec<f32> {
    if sigma <= 0.0 {
        return vec![1.0];
    }
    let reach = (3.0 * sigma).ceil().max(1.0) as i32;
    let weights = (-reach..=reach).map(|k| (-0.5 * (k as f32 / sigma).powi(2)).exp());
    let weights: Vec<f32> = weights.collect();
    let sum: f32 = weights.iter().sum();
    weights.into_iter().map(|w| w / sum).collect()
}
