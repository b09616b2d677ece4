//! A raw Bayer mosaic as linear R, G and B at every pixel.
//!
//! Each colour is interpolated from its own samples alone: the channels carry different fringes, so that nothing is
//! known about one colour from another. R and B, one sample in two columns and two rows, go half way between samples by
//! Lagrange's polynomial through six of them, row by row and column by column. G, on the squares of one colour of a
//! chessboard, goes half way along both diagonals by the polynomial through four. Both are exact for the mean and take
//! less than a thousandth from fringes of 20 pixels, where the mean of neighbours takes a twentieth.

use super::linear::{Linear, extend, row_of};
use super::{Sample, Shot};
use crate::{BayerPattern, Channel};
use multiversion::multiversion;
use ndarray::ArrayView2;
use rayon::prelude::*;

#[cfg(test)]
mod tests;

/// Samples beyond either end of a row of one colour that the interpolation reaches.
const MARGIN: usize = 3;
/// Rows beyond the first and the last that it reaches.
const ROW_MARGIN: usize = 5;
/// Samples of one colour that are worked on at a time, in the nearest cache.
const BLOCK: usize = 64;

/// Linear light of a mosaic with margins: each row as its even columns, then its odd ones.
#[derive(Debug, Clone, Default)]
pub(super) struct Mosaic {
    light: Vec<f32>,
    /// Samples of half a row, margins included.
    half: usize,
    first_red: [usize; 2],
}

impl Mosaic {
    /// Take in the samples of a shot.
    pub fn fill<T: Sample>(&mut self, raw: &ArrayView2<'_, T>, pattern: BayerPattern, linear: &Linear) {
        let (rows, columns) = raw.dim();
        self.first_red = pattern.first_red();
        self.half = columns.div_ceil(2) + 2 * MARGIN;
        let (half, stride) = (self.half, 2 * self.half);
        self.light.resize((rows + 2 * ROW_MARGIN) * stride, 0.0);
        let inner = &mut self.light[ROW_MARGIN * stride..][..rows * stride];
        inner.par_chunks_mut(stride).enumerate().for_each(|(y, line)| {
            let (even, odd) = line.split_at_mut(half);
            let channels = [0, 1].map(|x| pattern.channel(y, x).index());
            let samples = [&mut even[MARGIN..], &mut odd[MARGIN..]];
            split_row(linear, channels, &row_of(raw, y), samples);
            extend(even, MARGIN, columns.div_ceil(2));
            extend(odd, MARGIN, columns / 2);
        });
        self.extend_rows(rows);
    }

    /// Rows above and below, mirrored at the first and the last row of the same colours as [`extend`] does.
    fn extend_rows(&mut self, rows: usize) {
        for i in 1..=ROW_MARGIN {
            let first = i % 2;
            let last_alike = rows - 1 - (rows - 1 + first) % 2;
            self.mirror_row(ROW_MARGIN - i, first, (2 * first + i).min(last_alike));
            let beyond = rows - 1 + i;
            let last = rows - 1 - i % 2;
            self.mirror_row(ROW_MARGIN + beyond, last, (2 * last).saturating_sub(beyond).max(beyond % 2));
        }
    }

    /// Line `to` of the store, from the row it is mirrored at and its mirror image.
    fn mirror_row(&mut self, to: usize, at: usize, image: usize) {
        let stride = 2 * self.half;
        let start = |row: usize| (row + ROW_MARGIN) * stride;
        for i in 0..stride {
            self.light[to * stride + i] = 2.0 * self.light[start(at) + i] - self.light[start(image) + i];
        }
    }

    /// Columns of one parity of the row `row_margin + offset` rows from the first.
    fn line(&self, y: usize, offset: isize, parity: usize) -> &[f32] {
        let row = (y + ROW_MARGIN).wrapping_add_signed(offset);
        &self.light[(2 * row + parity) * self.half..][..self.half]
    }

    /// R, G and B at every pixel of row `y`.
    pub fn row(&self, y: usize, [red, green, blue]: [&mut [f32]; 3]) {
        let [row, column] = self.first_red;
        for (out, row, column) in [(red, row, column), (blue, 1 - row, 1 - column)] {
            if y % 2 == row {
                own_row(self.line(y, 0, column), column, out);
            } else {
                let lines = [-5, -3, -1, 1, 3, 5].map(|offset| self.line(y, offset, column));
                row_between(lines, column, out);
            }
        }
        let column = (y + row + column + 1) % 2;
        let near = [-1, 1].map(|offset| self.line(y, offset, 1 - column));
        let alike = [-2, 2].map(|offset| self.line(y, offset, column));
        let far = [-3, 3].map(|offset| self.line(y, offset, 1 - column));
        green_row(self.line(y, 0, column), near, alike, far, column, green);
    }
}

/// The columns of a row of raw samples by their parity, as linear light.
#[multiversion(targets("x86_64+avx2"))]
fn split_row<T: Sample>(linear: &Linear, channels: [usize; 2], row: &[T], out: [&mut [f32]; 2]) {
    linear.row_of_two(channels, row, out);
}

/// R or B in a row that has samples of it, in every other column from `column` on.
#[multiversion(targets("x86_64+avx2"))]
fn own_row(line: &[f32], column: usize, out: &mut [f32]) {
    for (block, out) in out.chunks_mut(2 * BLOCK).enumerate() {
        spread(&line[block * BLOCK..], column, out);
    }
}

/// R or B in a row between rows that have samples of it.
#[multiversion(targets("x86_64+avx2"))]
fn row_between(lines: [&[f32]; 6], column: usize, out: &mut [f32]) {
    let mut line = [0.0; BLOCK + 2 * MARGIN];
    for (block, out) in out.chunks_mut(2 * BLOCK).enumerate() {
        let n = out.len().div_ceil(2) + 2 * MARGIN;
        half_way_each(lines.map(|l| &l[block * BLOCK..][..n]), &mut line[..n]);
        spread(&line, column, out);
    }
}

/// Samples of every other column to every column of a block.
#[inline(always)]
fn spread(line: &[f32], column: usize, out: &mut [f32]) {
    let n = out.len().div_ceil(2);
    let mut between = [0.0; BLOCK];
    let taps = std::array::from_fn(|i| &line[i + 1 - column..][..n]);
    half_way_each(taps, &mut between[..n]);
    interleave([&line[MARGIN..][..n], &between[..n]], column, out);
}

/// Lagrange's polynomial through six samples, half way between the middle two.
#[inline(always)]
fn half_way_each([a, b, c, d, e, f]: [&[f32]; 6], out: &mut [f32]) {
    let n = out.len();
    let (a, b, c, d, e, f) = (&a[..n], &b[..n], &c[..n], &d[..n], &e[..n], &f[..n]);
    for k in 0..n {
        out[k] =
            (150.0 / 256.0) * (c[k] + d[k]) - (25.0 / 256.0) * (b[k] + e[k]) + (3.0 / 256.0) * (a[k] + f[k]);
    }
}

/// Write samples, in every other column from `column` on, and what stands between them.
#[inline(always)]
fn interleave([own, between]: [&[f32]; 2], column: usize, out: &mut [f32]) {
    let [first, second] = if column == 0 { [own, between] } else { [between, own] };
    let mut pairs = out.chunks_exact_mut(2);
    for ((pair, first), second) in (&mut pairs).zip(first).zip(second) {
        (pair[0], pair[1]) = (*first, *second);
    }
    if let [last] = pairs.into_remainder() {
        *last = first[first.len() - 1];
    }
}

/// G in a row whose own samples stand in every other column from `column` on. `near`, `alike` and `far` are the rows one,
/// two and three above and below: the columns that have G.
#[multiversion(targets("x86_64+avx2"))]
fn green_row(
    here: &[f32],
    near: [&[f32]; 2],
    alike: [&[f32]; 2],
    far: [&[f32]; 2],
    column: usize,
    out: &mut [f32],
) {
    let mut between = [0.0; BLOCK];
    for (block, out) in out.chunks_mut(2 * BLOCK).enumerate() {
        let n = out.len().div_ceil(2);
        let start = block * BLOCK + MARGIN;
        // The samples to the left of the pixels between start here, those to the right one later.
        let left = start - column;
        let touching = [
            &here[left..left + n],
            &here[left + 1..left + 1 + n],
            &near[0][start..start + n],
            &near[1][start..start + n],
        ];
        let second = [
            &near[0][start - 1..start - 1 + n],
            &near[0][start + 1..start + 1 + n],
            &near[1][start - 1..start - 1 + n],
            &near[1][start + 1..start + 1 + n],
            &alike[0][left..left + n],
            &alike[0][left + 1..left + 1 + n],
            &alike[1][left..left + n],
            &alike[1][left + 1..left + 1 + n],
        ];
        let third = [
            &here[left - 1..left - 1 + n],
            &here[left + 2..left + 2 + n],
            &far[0][start..start + n],
            &far[1][start..start + n],
        ];
        let between = &mut between[..n];
        for k in 0..n {
            let [a, b, c, d] = touching.map(|tap| tap[k]);
            let [e, f, g, h, i, j, l, m] = second.map(|tap| tap[k]);
            let [o, p, q, r] = third.map(|tap| tap[k]);
            let second = (e + f) + (g + h) + ((i + j) + (l + m));
            between[k] = (81.0 / 256.0) * ((a + b) + (c + d)) - (9.0 / 256.0) * second
                + (1.0 / 256.0) * ((o + p) + (q + r));
        }
        interleave([&here[start..start + n], between], column, out);
    }
}

/// What saturated samples do to row `y`: which pixels take their main share from none, and which take it from
/// saturated samples of R and of B. The farther samples of the interpolation weigh a tenth at most.
pub(super) fn saturation_row<T: Sample>(
    shot: &Shot<'_, T>,
    y: usize,
    limit: f32,
    unsaturated: &mut [bool],
    glare: &mut [bool],
) {
    unsaturated.fill(true);
    glare.fill(false);
    let Some((raw, pattern)) = shot.mosaic() else { return };
    let mut touched = Vec::new();
    for row in y.saturating_sub(1)..(y + 2).min(raw.nrows()) {
        let samples = row_of(&raw, row);
        if samples.iter().fold(false, |found, s| found | (s.intensity() >= limit)) {
            touched.resize(samples.len(), [false; 3]);
            let saturated = samples.iter().enumerate().filter(|(_, s)| s.intensity() >= limit);
            for (x, _) in saturated {
                let channel = pattern.channel(row, x);
                // G goes along the diagonals of its chessboard: from above and below to the pixel itself alone.
                let reach = usize::from(channel != Channel::G || row == y);
                let end = (x + reach + 1).min(samples.len());
                touched[x.saturating_sub(reach)..end].iter_mut().for_each(|t| t[channel.index()] = true);
            }
        }
    }
    for ((unsaturated, glare), [red, green, blue]) in unsaturated.iter_mut().zip(glare).zip(touched) {
        *unsaturated = !(red || green || blue);
        *glare = red && blue;
    }
}
