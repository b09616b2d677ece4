//! Step 2: the mask of pixels that all projectors light, and the noise of the intensities.
//!
//! R and B are a quarter period apart, so on a lit surface they are never both at the bottom of their range: at least one
//! lies 0.146 of its range or more above it. In a shadow all channels lie at the bottom. Bottom and range are taken
//! from the neighbourhood of each pixel, so neither the ambient light nor the albedo has to be known. Three colours of different
//! fringe numbers come closer to the bottom together, where two of them are alike.

use super::cells::{CellMaps, CellWindow, Grid, RowMaps, TaskWork};
use super::levels::{LEVEL_MAPS, LevelRows, heights};
use super::neighbours::{around, least_of_nine, sum_of_nine};
use super::noise::noise_of_image;
use super::params::illumination::{CORE_SHARE, HEIGHT_MIN, HEIGHT_MIN_ALONE, REACH};
use super::params::tasks::ROWS;
use super::scene::ScaledGrid;
use crate::parallel::lanes::{Lanes, add, lanes, take};
use crate::parallel::slots::Slots;
use multiversion::multiversion;
use rayon::prelude::*;

/// The mask of lit pixels, with its working maps.
#[derive(Debug, Default)]
pub(super) struct LitMask {
    means: CellMaps,
    extremes: CellMaps,
    levels: CellMaps,
    slots: Slots<TaskWork<Rows>>,
    /// Standard deviation of the intensities in the last image, in linear light.
    pub noise: f32,
    /// Least range of fringes, in linear light.
    pub range_min: f32,
    /// The channel that is absent; the plane of its light is 0.
    absent: Option<usize>,
    /// Whether the infrared light comes from a projector that may light where the visible one does not.
    visible_alone: bool,
}

/// Rows of one task.
#[derive(Debug, Default)]
struct Rows {
    maps: RowMaps,
    spare: Vec<f32>,
    /// Squared heights above the bottom, and their sums over nine pixels, for the rows that a task needs.
    heights: Vec<f32>,
    sums: Vec<f32>,
    /// The least of nine such sums.
    least: Vec<f32>,
}

impl LitMask {
    pub fn new(absent: Option<usize>) -> Self {
        Self { absent, ..Self::default() }
    }

    /// From now on, only R, G and B decide which pixels are lit.
    pub fn see_visible_light_alone(&mut self) {
        self.visible_alone = true;
    }

    /// Writes 1 for every lit pixel, 0 elsewhere. Keeps `range_min`. The content of `sums` is lost.
    pub fn find(
        &mut self,
        ScaledGrid { grid, period_px, .. }: ScaledGrid<'_>,
        light: [&[f32]; 4],
        range_min: f32,
        sums: &mut CellMaps,
        lit: &mut [f32],
    ) {
        self.range_min = range_min;
        let reach = (REACH * period_px as f32 / grid.step as f32).ceil();
        self.cell_means(grid, light, sums);
        self.cell_extremes(grid, reach as usize);
        self.cell_levels(grid, reach / 2.0, range_min, sums);
        self.find_again(grid, light, lit);
    }

    /// As [`Self::find`], on a finer image of the same scene. Bottom and range are taken from the last [`Self::find`];
    /// `grid` must have the same cells.
    pub fn find_again(&mut self, grid: &Grid, light: [&[f32]; 4], lit: &mut [f32]) {
        self.noise = noise_of_image(light[0], grid);
        let this = &*self;
        lit.par_chunks_mut(ROWS * grid.stride).enumerate().for_each_init(
            || this.slots.take(),
            |slot, (block, lit)| this.find_rows(grid, light, block * ROWS, &mut slot.rows, lit),
        );
    }

    /// 1 / range^2 of the four channels around the pixels of row `y`; the range is at least [`Self::range_min`].
    pub fn precision<'a>(&self, grid: &Grid, y: usize, maps: &'a mut RowMaps) -> [&'a [f32]; 4] {
        LevelRows::new(maps.sample::<LEVEL_MAPS>(grid, &self.levels, 0, y)).precision
    }

    /// Computes the mask of the rows from `first` on.
    fn find_rows(&self, grid: &Grid, light: [&[f32]; 4], first: usize, rows: &mut Rows, lit: &mut [f32]) {
        let stride = grid.stride;
        let Rows { maps, spare, heights: above, sums, least } = rows;
        let last = first + lit.len() / stride - 1;
        // Beyond the border of the image the rows at the border are used again.
        let [high, mean, lowest] =
            [3, 2, 1].map(|reach| first.saturating_sub(reach)..=(last + reach).min(grid.height - 1));
        above.resize((ROWS + 6) * stride, 0.0);
        sums.resize((ROWS + 4) * stride, 0.0);
        least.resize((ROWS + 2) * stride, 0.0);
        for (y, out) in high.clone().zip(above.chunks_exact_mut(stride)) {
            self.heights(grid, light, y, maps, out);
        }
        let limit = 9.0 * if self.absent == Some(2) { HEIGHT_MIN_ALONE } else { HEIGHT_MIN };
        let near = |y: usize, first: usize| around(y, grid.height).map(|y| (y - first) * stride);
        for (y, out) in mean.clone().zip(sums.chunks_exact_mut(stride)) {
            let near = near(y, *high.start()).map(|at| &above[at..at + stride]);
            sum_of_nine(near, grid.width, spare, out);
        }
        // A mean over nine pixels carries light one pixel into a shadow; the least of nine such means does not.
        for (y, out) in lowest.clone().zip(least.chunks_exact_mut(stride)) {
            let near = near(y, *mean.start()).map(|at| &sums[at..at + stride]);
            least_of_nine(near, grid.width, spare, out);
        }
        for (y, lit) in (first..=last).zip(lit.chunks_exact_mut(stride)) {
            let near = near(y, *lowest.start()).map(|at| &least[at..at + stride]);
            least_of_nine(near, grid.width, spare, lit);
            let [_, here, _] = near;
            for (lit, here) in lit.iter_mut().zip(here) {
                // Light that noise alone takes below the limit has no pixel near it that is far below.
                *lit = f32::from(u8::from((*here > limit) | (*lit > CORE_SHARE * limit)));
            }
            lit[grid.width..].fill(0.0);
        }
    }

    /// Squared heights of the light above its bottom along row `y` (J2).
    fn heights(&self, grid: &Grid, light: [&[f32]; 4], y: usize, maps: &mut RowMaps, out: &mut [f32]) {
        let mut levels = LevelRows::new(maps.sample::<LEVEL_MAPS>(grid, &self.levels, 0, y));
        let mut light = light.map(|plane| &plane[y * grid.stride..][..grid.stride]);
        let variance = self.noise * self.noise;
        match if self.visible_alone { Some(3) } else { self.absent } {
            None => heights::<4>(&levels, light, variance, out),
            Some(absent) => {
                for rows in [&mut levels.bottom, &mut levels.precision, &mut light] {
                    rows.swap(absent, 3);
                }
                heights::<3>(&levels, light, variance, out);
            }
        }
    }

    /// Removes lit pixels that are `reach_px` pixels or less away from an unlit pixel along rows and columns, because light
    /// interpolated from a mosaic reaches that far. The content of `scratch` is lost.
    pub fn erode(&mut self, grid: &Grid, reach_px: usize, scratch: &mut [f32], lit: &mut [f32]) {
        let stride = grid.stride;
        for _ in 0..reach_px {
            let before = &mut scratch[..grid.pixels()];
            before.copy_from_slice(lit);
            let (before, slots) = (&*before, &self.slots);
            lit.par_chunks_mut(stride).enumerate().for_each_init(
                || slots.take(),
                |slot, (y, lit)| {
                    let near = around(y, grid.height).map(|row| &before[row * stride..][..stride]);
                    least_of_nine(near, grid.width, &mut slot.rows.spare, lit);
                    lit[grid.width..].fill(0.0);
                },
            );
        }
    }

    /// Mean light of each channel in every cell.
    fn cell_means(&mut self, grid: &Grid, light: [&[f32]; 4], sums: &mut CellMaps) {
        let inside: Vec<f32> = (0..grid.stride).map(|x| f32::from(u8::from(x < grid.width))).collect();
        self.means = CellMaps::new(4);
        grid.window_sums::<5, Rows>(
            CellWindow { sigma_cells: 0.0, sampled_rows: usize::MAX },
            &self.slots,
            sums,
            &mut self.means,
            |_, y, sums| {
                let rows = light.map(|plane| &plane[y * grid.stride..][..grid.stride]);
                add_light(&inside, rows, sums);
            },
            |_, [count, sums @ ..], out| {
                for (sums, out) in sums.iter().zip(out.chunks_exact_mut(grid.columns)) {
                    let mut last = 0.0;
                    for ((mean, sum), n) in out.iter_mut().zip(*sums).zip(count) {
                        // In the padding the last cell is repeated.
                        last = if *n > 0.0 { sum / n } else { last };
                        *mean = last;
                    }
                }
            },
        );
    }

    /// Least and greatest mean of each channel within `reach` cells.
    fn cell_extremes(&mut self, grid: &Grid, reach: usize) {
        let means = &self.means;
        self.extremes.fill::<LEVEL_MAPS>(grid, |row, out| {
            let near = row.saturating_sub(reach)..(row + reach + 1).min(grid.rows);
            for (k, out) in out.into_iter().enumerate() {
                let mut column = means.line(row, k / 2).to_vec();
                let pick = if k % 2 == 0 { lower } else { upper };
                near.clone().for_each(|other| pick(means.line(other, k / 2), &mut column));
                out.copy_from_slice(&column);
                for shift in 1..=reach.min(grid.columns - 1) {
                    let n = grid.columns - shift;
                    pick(&column[shift..], &mut out[..n]);
                    pick(&column[..n], &mut out[shift..]);
                }
            }
        });
    }

    /// Bottom and 1 / range^2 of each channel, from extremes averaged over `sigma` cells.
    fn cell_levels(&mut self, grid: &Grid, sigma: f32, range_min: f32, sums: &mut CellMaps) {
        self.levels = CellMaps::new(LEVEL_MAPS);
        let Self { slots, extremes, levels, .. } = self;
        grid.smooth::<9, Rows>(
            sigma,
            slots,
            sums,
            levels,
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

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts::{FRAC_PI_2, TAU};

    #[test]
    fn erosion_removes_what_interpolation_reaches() {
        let grid = Grid::new([20, 32], 4.0);
        let mut lit = vec![1.0; grid.pixels()];
        lit[9 * grid.stride + 12] = 0.0;
        LitMask::new(None).erode(&grid, 2, &mut vec![0.0; grid.pixels()], &mut lit);
        let dark = |y: usize| (0..grid.width).filter(|x| lit[y * grid.stride + x] == 0.0).collect::<Vec<_>>();
        assert!(
            (0..20).all(|y| dark(y) == if (7..=11).contains(&y) { vec![10, 11, 12, 13, 14] } else { vec![] })
        );
    }

    #[test]
    fn a_shadow_differs_from_dark_fringes_under_any_ambient_light() {
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
            let scaled = ScaledGrid { grid: &grid, period_px: 25.3, factor: 1 };
            LitMask::new(None).find(scaled, light, 0.04, &mut CellMaps::default(), &mut lit);
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
