//! Where light of the projector falls: shadows are told from fringes by the four channels together.
//!
//! R and B are a quarter period apart, so on a lit surface they are never both at the bottom of their fringes: together
//! they stand at least 0.15 of their range above it. In a shadow all four channels lie at the bottom. Bottom and range
//! are taken from the surroundings of each pixel, so that neither the ambient light nor the albedo has to be known.

use super::cells::{CellMaps, CellWork, Grid, RowMaps};
use super::scene::around;
use crate::parallel::lanes::{LANES, Lanes, add, lanes, lanes_mut, take};
use crate::parallel::slots::Slots;
use multiversion::multiversion;
use rayon::prelude::*;

/// Half width of the surroundings in fringe periods: a whole fringe with something to spare.
const SURROUNDINGS: f32 = 0.75;
/// Least sum of squared heights above the bottom, in units of the range. R and B alone reach 2 x 0.146^2 = 0.043.
const LEAST: f32 = 0.02;
/// Pixels that are asked for the noise, at most twice as many.
const NOISE_SAMPLES: usize = 1 << 14;
/// Rows that one task works on.
const BLOCK: usize = 32;

/// Working maps of the search for light.
#[derive(Debug, Default)]
pub(crate) struct LightFinder {
    means: CellMaps,
    extremes: CellMaps,
    smoothed: CellMaps,
    sums: CellMaps,
    slots: Slots<(Rows, CellWork)>,
    /// Standard deviation of the intensities of the last image, in linear light.
    pub noise: f32,
}

/// Rows of one task.
#[derive(Debug, Default)]
struct Rows {
    maps: RowMaps,
    sums: Vec<f32>,
    /// Heights above the bottom, and their means, of the rows that a task needs.
    heights: Vec<f32>,
    means: Vec<f32>,
}

impl LightFinder {
    /// Writes 1 for every pixel that is lit, 0 elsewhere. `range_min` is the least range of fringes, in linear light.
    pub fn find(
        &mut self,
        grid: &Grid,
        light: [&[f32]; 4],
        (period_px, range_min): (f64, f32),
        lit: &mut [f32],
    ) {
        let reach = (SURROUNDINGS * period_px as f32 / grid.step as f32).ceil();
        self.surroundings(grid, light, reach, range_min);
        self.refind(grid, light, lit);
    }

    /// The same on a finer image of the same scene: its grid has the cells of the last [`Self::find`].
    pub fn refind(&mut self, grid: &Grid, light: [&[f32]; 4], lit: &mut [f32]) {
        let (stride, noise) = (grid.stride, noise(light[0], grid));
        self.noise = noise;
        let (smoothed, slots) = (&self.smoothed, &self.slots);
        lit.par_chunks_mut(BLOCK * stride).enumerate().for_each_init(
            || slots.take(),
            |slot, (block, lit)| {
                let Rows { maps, sums, heights, means } = &mut slot.0;
                let first = block * BLOCK;
                let last = first + lit.len() / stride - 1;
                // Rows that repeat at the border of the image are those at the border.
                let [high, mean] =
                    [2, 1].map(|reach| first.saturating_sub(reach)..=(last + reach).min(grid.height - 1));
                heights.resize((BLOCK + 4) * stride, 0.0);
                means.resize((BLOCK + 2) * stride, 0.0);
                for (y, out) in high.clone().zip(heights.chunks_exact_mut(stride)) {
                    let maps = maps.sample::<8>(grid, smoothed, 0, y);
                    let light = light.map(|plane| &plane[y * stride..][..stride]);
                    self::heights(maps, light, noise * noise, out);
                }
                let near = |y: usize, first: usize| around(y, grid.height).map(|y| (y - first) * stride);
                for (y, out) in mean.clone().zip(means.chunks_exact_mut(stride)) {
                    let near = near(y, *high.start()).map(|at| &heights[at..at + stride]);
                    sum_of_nine(near, grid.width, sums, out);
                }
                for (y, lit) in (first..=last).zip(lit.chunks_exact_mut(stride)) {
                    // The mean reaches one pixel into a shadow: the least of the means does not.
                    let near = near(y, *mean.start()).map(|at| &means[at..at + stride]);
                    least_of_nine(near, grid.width, 9.0 * LEAST, sums, lit);
                }
            },
        );
    }

    /// Takes what lies `reach_px` pixels and less from the dark: light interpolated from rows and columns reaches that far.
    /// In the corner of the square around a pixel stands a product of two far samples, with a hundredth of the weight:
    /// the corners of the last ring do not count.
    pub fn shrink(&mut self, grid: &Grid, reach_px: usize, lent: &mut [f32], lit: &mut [f32]) {
        let stride = grid.stride;
        for ring in 1..=reach_px {
            let above = &mut lent[..grid.pixels()];
            above.copy_from_slice(lit);
            let (above, slots) = (&*above, &self.slots);
            let corners = ring == 1 || ring < reach_px;
            lit.par_chunks_mut(stride).enumerate().for_each_init(
                || slots.take(),
                |slot, (y, lit)| {
                    let near = around(y, grid.height).map(|row| &above[row * stride..][..stride]);
                    if corners {
                        least_of_nine(near, grid.width, 0.5, &mut slot.0.sums, lit);
                    } else {
                        least_of_five(near, grid.width, 0.5, lit);
                    }
                },
            );
        }
    }

    /// Bottom of the light of each channel around every cell, and the inverse square of its range.
    fn surroundings(&mut self, grid: &Grid, light: [&[f32]; 4], reach: f32, range_min: f32) {
        let inside: Vec<f32> = (0..grid.stride).map(|x| f32::from(u8::from(x < grid.width))).collect();
        self.means = CellMaps::new(4);
        grid.window_sums::<5, Rows>(
            (0.0, usize::MAX),
            &self.slots,
            &mut self.sums,
            &mut self.means,
            |_, y, sums| {
                let rows = light.map(|plane| &plane[y * grid.stride..][..grid.stride]);
                add_light(&inside, rows, sums);
            },
            |_, [count, sums @ ..], out| {
                for (sums, out) in sums.iter().zip(out.chunks_exact_mut(grid.columns)) {
                    let mut last = 0.0;
                    for ((mean, sum), n) in out.iter_mut().zip(*sums).zip(count) {
                        // Padding repeats the last cell.
                        last = if *n > 0.0 { sum / n } else { last };
                        *mean = last;
                    }
                }
            },
        );
        let (means, reach_cells) = (&self.means, reach as usize);
        self.extremes.fill::<8>(grid, |row, out| {
            let near = row.saturating_sub(reach_cells)..(row + reach_cells + 1).min(grid.rows);
            for (k, out) in out.into_iter().enumerate() {
                let mut column = means.line(row, k / 2).to_vec();
                let pick = if k % 2 == 0 { lower } else { upper };
                near.clone().for_each(|other| pick(means.line(other, k / 2), &mut column));
                out.copy_from_slice(&column);
                for shift in 1..=reach_cells.min(grid.columns - 1) {
                    let n = grid.columns - shift;
                    pick(&column[shift..], &mut out[..n]);
                    pick(&column[..n], &mut out[shift..]);
                }
            }
        });
        self.smoothed = CellMaps::new(8);
        let Self { slots, extremes, sums, smoothed, .. } = self;
        average(grid, reach / 2.0, range_min, slots, extremes, sums, smoothed);
    }
}

fn average(
    grid: &Grid,
    sigma: f32,
    range_min: f32,
    slots: &Slots<(Rows, CellWork)>,
    extremes: &CellMaps,
    sums: &mut CellMaps,
    out: &mut CellMaps,
) {
    grid.smooth::<9, Rows>(
        sigma,
        slots,
        sums,
        out,
        |row, k| if k == 0 { None } else { Some(extremes.line(row, k - 1)) },
        |_, [weight, maps @ ..], out| {
            let mut lines = out.chunks_exact_mut(grid.columns);
            for pair in maps.chunks_exact(2) {
                let (low, range) = (lines.next().expect("two lines"), lines.next().expect("two lines"));
                for i in 0..grid.columns {
                    low[i] = pair[0][i] / weight[i];
                    range[i] = (pair[1][i] / weight[i] - low[i]).max(range_min).powi(-2);
                }
            }
        },
    );
}

fn lower(from: &[f32], to: &mut [f32]) {
    to.iter_mut().zip(from).for_each(|(t, &f)| *t = if f < *t { f } else { *t });
}

fn upper(from: &[f32], to: &mut [f32]) {
    to.iter_mut().zip(from).for_each(|(t, &f)| *t = if f > *t { f } else { *t });
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn add_light(inside: &[f32], light: [&[f32]; 4], sums: &mut [[Lanes; 5]]) {
    let [r, g, b, ir] = light.map(lanes);
    let rows = [lanes(inside), r, g, b, ir];
    for (i, sums) in sums.iter_mut().enumerate() {
        add(sums, &take(&rows, i));
    }
}

/// Sum of squared heights above the bottom in units of the range, noise taken off.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn heights(maps: [&[f32]; 8], light: [&[f32]; 4], noise: f32, out: &mut [f32]) {
    let (maps, light) = (maps.map(lanes), light.map(lanes));
    for (i, out) in lanes_mut(out).iter_mut().enumerate() {
        let (maps, light) = (take(&maps, i), take(&light, i));
        let mut sum = [0.0; LANES];
        for c in 0..4 {
            for x in 0..LANES {
                let height = light[c][x] - maps[2 * c][x];
                sum[x] += (height * height - noise) * maps[2 * c + 1][x];
            }
        }
        *out = sum;
    }
}

/// Sum over a pixel and its eight neighbours; borders repeat.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn sum_of_nine(rows: [&[f32]; 3], width: usize, spare: &mut Vec<f32>, out: &mut [f32]) {
    spare.resize(width + 2, 0.0);
    let [a, b, c] = rows.map(|row| &row[..width]);
    let middle = &mut spare[1..=width];
    for x in 0..width {
        middle[x] = a[x] + b[x] + c[x];
    }
    (spare[0], spare[width + 1]) = (spare[1], spare[width]);
    let [left, middle, right] = [0, 1, 2].map(|k| &spare[k..k + width]);
    for (x, out) in out[..width].iter_mut().enumerate() {
        *out = left[x] + middle[x] + right[x];
    }
}

/// 1 where the least of nine sums is above `limit`, 0 in the padding.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn least_of_nine(rows: [&[f32]; 3], width: usize, limit: f32, spare: &mut Vec<f32>, out: &mut [f32]) {
    let least = |a: f32, b: f32| if a < b { a } else { b };
    spare.resize(width + 2, 0.0);
    let [a, b, c] = rows.map(|row| &row[..width]);
    let middle = &mut spare[1..=width];
    for x in 0..width {
        middle[x] = least(least(a[x], b[x]), c[x]);
    }
    (spare[0], spare[width + 1]) = (spare[1], spare[width]);
    let [left, middle, right] = [0, 1, 2].map(|k| &spare[k..k + width]);
    let (out, padding) = out.split_at_mut(width);
    padding.fill(0.0);
    for (x, out) in out.iter_mut().enumerate() {
        *out = if least(least(left[x], middle[x]), right[x]) > limit { 1.0 } else { 0.0 };
    }
}

/// The same of a pixel and its four neighbours in row and column.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn least_of_five(rows: [&[f32]; 3], width: usize, limit: f32, out: &mut [f32]) {
    let least = |a: f32, b: f32| if a < b { a } else { b };
    let [above, own, below] = rows.map(|row| &row[..width]);
    let (out, padding) = out.split_at_mut(width);
    padding.fill(0.0);
    for x in 0..width {
        out[x] = least(least(above[x], below[x]), own[x]);
    }
    for x in 0..width {
        let beside = least(own[x.saturating_sub(1)], own[(x + 1).min(width - 1)]);
        out[x] = if least(out[x], beside) > limit { 1.0 } else { 0.0 };
    }
}

/// Standard deviation of the noise of the red plane, from a mask that is blind to anything that varies along rows
/// alone or along columns alone (Immerkaer, Comput. Vis. Image Underst. 64, 300 (1996)).
fn noise(red: &[f32], grid: &Grid) -> f32 {
    let stride = grid.stride;
    // An odd step is no part of a row, which is whole vectors long.
    let step = (red.len() / NOISE_SAMPLES) | 1;
    let mut seen: Vec<f32> = (stride + 1..red.len().saturating_sub(stride + 1))
        .step_by(step)
        .filter(|i| i % stride + 1 < grid.width)
        .map(|i| {
            let bend = |at: usize| red[at - 1] - 2.0 * red[at] + red[at + 1];
            (bend(i - stride) - 2.0 * bend(i) + bend(i + stride)).abs()
        })
        .collect();
    if seen.is_empty() {
        return 0.0;
    }
    let middle = seen.len() / 2;
    let (_, median, _) = seen.select_nth_unstable_by(middle, f32::total_cmp);
    *median / (0.6745 * 6.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts::{FRAC_PI_2, TAU};

    #[test]
    fn the_dark_takes_what_interpolation_reaches() {
        let grid = Grid::new([20, 32], 4.0);
        let mut lit = vec![1.0; grid.pixels()];
        lit[9 * grid.stride + 12] = 0.0;
        LightFinder::default().shrink(&grid, 2, &mut vec![0.0; grid.pixels()], &mut lit);
        let dark = |y: usize| (0..grid.width).filter(|x| lit[y * grid.stride + x] == 0.0).collect::<Vec<_>>();
        assert_eq!((7..=11).map(dark).map(|row| row.len()).collect::<Vec<_>>(), [3, 5, 5, 5, 3]);
        assert_eq!((dark(6), dark(7), dark(9)), (vec![], vec![11, 12, 13], vec![10, 11, 12, 13, 14]));
    }

    #[test]
    fn a_shadow_is_told_from_dark_fringes_whatever_the_ambient_light() {
        let grid = Grid::new([80, 208], 4.0);
        let in_shadow = |x: usize, y: usize| (60..90).contains(&x) && (20..60).contains(&y);
        for ambient in [0.0, 0.1, 0.3] {
            let plane = |number: f32, shift: f32| -> Vec<f32> {
                (0..grid.pixels())
                    .map(|i| (i % grid.stride, i / grid.stride))
                    .map(|(x, y)| {
                        let fringe = 0.25 + 0.25 * (TAU * number * x as f32 / 912.0 + shift).cos();
                        ambient + if in_shadow(x, y) { 0.0 } else { fringe }
                    })
                    .collect()
            };
            let planes = [plane(36.0, 0.0), plane(35.0, 0.0), plane(36.0, FRAC_PI_2), plane(30.0, 0.0)];
            let mut lit = vec![0.0; grid.pixels()];
            let light = planes.each_ref().map(Vec::as_slice);
            LightFinder::default().find(&grid, light, (25.3, 0.04), &mut lit);
            for (i, lit) in lit.iter().enumerate() {
                let (x, y) = (i % grid.stride, i / grid.stride);
                if in_shadow(x, y) {
                    assert_eq!(*lit, 0.0, "shadow at {x} {y}, ambient {ambient}");
                } else if !(57..93).contains(&x) || !(17..63).contains(&y) {
                    assert_eq!(*lit, 1.0, "light at {x} {y}, ambient {ambient}");
                }
            }
        }
    }
}
