//! The image pyramid: one shot at full resolution and on the coarse level. A level has four planes of linear light, and masks.

mod upsample;

pub(in crate::joint) use upsample::{Levels, Upsampler};

use crate::joint::cells::Grid;
use crate::joint::infrared::PairPhase;
use crate::joint::params::pyramid::{COARSE_PERIOD_MIN_PX, FACTOR_MAX};
use crate::joint::scene::{Frame, ScaledGrid, Scene};
use crate::parallel::lanes::{LANES, lanes, lanes_mut};
use multiversion::multiversion;
use rayon::prelude::*;

/// Both levels of one shot.
#[derive(Debug)]
pub(in crate::joint) struct Pyramid {
    pub full: Level,
    pub coarse: Level,
}

impl Pyramid {
    /// Makes a pyramid for a full image with this number of pixels, including padding.
    pub fn new(pixels: usize) -> Self {
        let mut full = Level::default();
        full.resize(pixels);
        Self { full, coarse: Level::default() }
    }

    /// Makes the coarse level. If the factor is 1, the full level is moved there until [`Self::restore`].
    pub fn shrink(&mut self, frame: &Frame<'_>) {
        match frame.coarse.factor {
            1 => std::mem::swap(&mut self.full, &mut self.coarse),
            factor => self.coarse.shrink(&self.full, frame.coarse.grid, frame.full.grid, factor),
        }
    }

    /// Moves the full level back after the steps on the coarse level.
    pub fn restore(&mut self, frame: &Frame<'_>) {
        if frame.coarse.factor == 1 {
            std::mem::swap(&mut self.full, &mut self.coarse);
        }
    }

    /// The coarse and the full level as scenes.
    pub fn scenes<'a>(&'a self, frame: &Frame<'a>) -> [Scene<'a>; 2] {
        [self.coarse.scene(frame.coarse), self.full.scene(frame.full)]
    }
}

/// Factor by which the coarse level has fewer pixels along a side: the greatest that still resolves the fringes.
pub(in crate::joint) fn factor(period_px: f64, grid: &Grid) -> usize {
    let mut factor = 1;
    while factor < FACTOR_MAX.min(grid.step) && period_px >= 2.0 * COARSE_PERIOD_MIN_PX * factor as f64 {
        factor *= 2;
    }
    factor
}

/// Planes of pixels in padded rows of their grid.
#[derive(Debug, Default)]
pub(in crate::joint) struct Level {
    pub light: [Vec<f32>; 4],
    /// 1 where light of the projector may fall, 0 for glare.
    pub lit: Vec<f32>,
    /// 1 for pixels that may take part in a fit: not saturated in all channels, seen by both chips.
    pub usable: Vec<f32>,
    /// The infrared phase of a calibrated pair; `None` for coaxial projectors.
    pub pair: Option<PairPhase>,
}

impl Level {
    pub fn resize(&mut self, pixels: usize) {
        let planes = self.light.iter_mut().chain([&mut self.lit, &mut self.usable]);
        planes.for_each(|plane| plane.resize(pixels, 0.0));
    }

    /// The level as a scene with a grid of cells.
    pub fn scene<'a>(&'a self, ScaledGrid { grid, period_px, factor }: ScaledGrid<'a>) -> Scene<'a> {
        let light = self.light.each_ref().map(Vec::as_slice);
        Scene { light, usable: &self.usable, grid, period_px, factor, pair: self.pair.as_ref() }
    }

    /// Removes the pixels where the mask `illuminated` is 0.
    pub fn restrict(&mut self, grid: &Grid, illuminated: &[f32]) {
        let masks = self.lit.par_chunks_mut(grid.stride).zip(self.usable.par_chunks_mut(grid.stride));
        masks.zip(illuminated.par_chunks(grid.stride)).for_each(|((lit, usable), illuminated)| {
            for ((lit, usable), illuminated) in lit.iter_mut().zip(usable).zip(illuminated) {
                *lit *= illuminated;
                *usable *= *lit;
            }
        });
    }

    /// Fills this level with the means of `factor` x `factor` pixels of `fine`. A mean is lit if all of its pixels are lit, and
    /// usable if at least half of them are usable. A mean that lies partly beyond the last row or column is therefore unlit; its
    /// light comes from the last row repeated, or from the existing columns. `grid` is the grid of this level.
    pub fn shrink(&mut self, fine: &Self, grid: &Grid, fine_grid: &Grid, factor: usize) {
        self.resize(grid.pixels());
        if let Some(pair) = &fine.pair {
            self.pair.get_or_insert_default().shrink(pair, grid, fine_grid);
        }
        let planes = self.light.each_mut().map(|plane| plane.par_chunks_mut(grid.stride));
        let [red, green, blue, infrared] = planes;
        let masks = self.lit.par_chunks_mut(grid.stride).zip(self.usable.par_chunks_mut(grid.stride));
        let rows = red.zip(green).zip(blue.zip(infrared)).zip(masks).enumerate();
        rows.for_each(|(row, (((red, green), (blue, infrared)), (lit, usable)))| {
            let light = [red, green, blue, infrared].into_iter().zip(&fine.light);
            for (out, plane) in light {
                mean(factor, &rows_of(plane, fine_grid, row, factor), out);
                if !fine_grid.width.is_multiple_of(factor) {
                    // The padding is dark, so the sum has fewer terms.
                    out[grid.width - 1] *= factor as f32 / (fine_grid.width % factor) as f32;
                }
            }
            least(factor, &rows_of(&fine.lit, fine_grid, row, factor), lit);
            if (row + 1) * factor > fine_grid.height {
                // The mean does not belong to the middle of the pixel.
                lit.fill(0.0);
            }
            // Noise saturates single pixels of a fringe maximum; without its maximum a fringe cannot be fitted.
            mean(factor, &rows_of(&fine.usable, fine_grid, row, factor), usable);
            at_least_half(lit, usable);
        });
    }
}

/// The `factor` rows of `plane` that form row `row` of the coarse image.
fn rows_of<'a>(plane: &'a [f32], grid: &Grid, row: usize, factor: usize) -> Vec<&'a [f32]> {
    debug_assert_eq!(plane.len(), grid.pixels());
    let place = |i: usize| (row * factor + i).min(grid.height - 1) * grid.stride;
    (0..factor).map(|i| &plane[place(i)..][..grid.stride]).collect()
}

/// Replaces shares of a half or more by `lit`, and smaller ones by 0.
fn at_least_half(lit: &[f32], shares: &mut [f32]) {
    for (share, lit) in shares.iter_mut().zip(lit) {
        *share = if *share >= 0.5 { *lit } else { 0.0 };
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn mean(factor: usize, rows: &[&[f32]], out: &mut [f32]) {
    match factor {
        2 => fold::<2>(rows, out, |a, b| a + b, 0.25),
        _ => fold::<4>(rows, out, |a, b| a + b, 0.0625),
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn least(factor: usize, rows: &[&[f32]], out: &mut [f32]) {
    let lower = |a: f32, b: f32| if a < b { a } else { b };
    match factor {
        2 => fold::<2>(rows, out, lower, 1.0),
        _ => fold::<4>(rows, out, lower, 1.0),
    }
}

/// Combines `F` rows and `F` columns into one.
#[inline(always)]
fn fold<const F: usize>(rows: &[&[f32]], out: &mut [f32], join: impl Fn(f32, f32) -> f32, scale: f32) {
    for (i, out) in lanes_mut(out).iter_mut().enumerate() {
        let mut columns = [[0.0; LANES]; F];
        for (k, row) in rows.iter().enumerate() {
            let row = &lanes(row)[F * i..F * (i + 1)];
            for (column, pixels) in columns.iter_mut().zip(row) {
                for x in 0..LANES {
                    column[x] = if k == 0 { pixels[x] } else { join(column[x], pixels[x]) };
                }
            }
        }
        let columns = columns.as_flattened();
        for x in 0..LANES {
            let mut sum = columns[F * x];
            for k in 1..F {
                sum = join(sum, columns[F * x + k]);
            }
            out[x] = scale * sum;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shrunk_image_has_means_of_light_and_the_least_of_masks_at_odd_borders_too() {
        let (height, width) = (5, 7);
        // One pixel is saturated in one square, two in another, three in a third.
        let saturated = [(0, 0), (2, 0), (3, 1), (2, 2), (2, 3), (3, 2)];
        for factor in [2, 4] {
            let fine_grid = Grid::with_stride([height, width], LANES * factor, 4.0);
            let grid = fine_grid.shrunk(factor);
            assert_eq!((grid.stride, grid.step, grid.rows), (LANES, 4 / factor, fine_grid.rows));
            let (mut fine, mut out) = (Level::default(), Level::default());
            fine.resize(fine_grid.pixels());
            for (y, x) in (0..height).flat_map(|y| (0..width).map(move |x| (y, x))) {
                let at = y * fine_grid.stride + x;
                fine.light.iter_mut().for_each(|plane| plane[at] = (10 * y + x) as f32);
                fine.usable[at] = f32::from(u8::from(!saturated.contains(&(y, x))));
                fine.lit[at] = f32::from(u8::from((y, x) != (1, 2)));
            }
            out.shrink(&fine, &grid, &fine_grid, factor);
            for (row, column) in (0..grid.height).flat_map(|y| (0..grid.width).map(move |x| (y, x))) {
                let ys = (0..factor).map(|i| (row * factor + i).min(height - 1));
                let xs = column * factor..((column + 1) * factor).min(width);
                let pixels: Vec<_> = ys.flat_map(|y| xs.clone().map(move |x| (y, x))).collect();
                let mean = pixels.iter().map(|(y, x)| (10 * y + x) as f32).sum::<f32>() / pixels.len() as f32;
                let at = row * grid.stride + column;
                assert!(
                    (out.light[2][at] - mean).abs() < 1e-4,
                    "{row} {column}: {} {mean}",
                    out.light[2][at]
                );
                let dark = pixels.contains(&(1, 2));
                let beyond = (row + 1) * factor > height || (column + 1) * factor > width;
                assert_eq!(out.lit[at] == 0.0, dark || beyond, "{row} {column}");
                let unusable = pixels.iter().filter(|pixel| saturated.contains(pixel)).count();
                let usable = out.lit[at] > 0.0 && 2 * unusable <= pixels.len();
                assert_eq!(out.usable[at] > 0.0, usable, "{row} {column}");
            }
        }
    }
}
