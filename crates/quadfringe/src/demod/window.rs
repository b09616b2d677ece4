//! A smoothing window that follows the local slope of the phase and stops at edges.
//!
//! Neighbours count as far as their phase fits the slope through the pixel within the noise (a bilateral window,
//! Tukey's biweight), first along rows and then along columns; what is added up are the normal equations of a
//! Gauss-Newton step, so that every neighbour counts by what it knows.

use super::cells::{LANES, Lanes, RowMaps, lanes, lanes_mut, put, take};
use super::scene::Scene;
use super::slopes::Slopes;
use crate::angle::wrap;
use crate::slots::Slots;
use multiversion::multiversion;
use rayon::prelude::*;
use std::f32::consts::TAU;

/// Width (sigma) of the window in fringe periods.
const WIDTH: f32 = 0.125;
/// Neighbours further off than this many noise widths belong to another surface.
const REACH_SIGMAS: f32 = 7.0;
/// The same for a capture without noise.
const REACH_RAD: f32 = 0.06;
/// Rows that one task works on.
const BLOCK: usize = 32;
/// One pixel in so many is asked for the noise.
const NOISE_STRIDE: usize = 13;

/// The window of one shot.
#[derive(Clone, Copy)]
pub(crate) struct Window<'a> {
    scene: &'a Scene<'a>,
    slopes: &'a Slopes,
    modulation: &'a [f32],
    radius: usize,
    sigma: f32,
    noise: f32,
}

/// A phase and the normal equations of a step of it: `numerator / denominator`, and `variance`, the sum of squared
/// weights times denominators, all 0 where there is nothing to measure by.
#[derive(Debug, Clone, Default)]
pub(crate) struct Steps {
    pub phase: Vec<f32>,
    pub numerator: Vec<f32>,
    pub denominator: Vec<f32>,
    pub variance: Vec<f32>,
}

impl Steps {
    pub fn resize(&mut self, pixels: usize) {
        for map in [&mut self.phase, &mut self.numerator, &mut self.denominator, &mut self.variance] {
            map.resize(pixels, 0.0);
        }
    }
}

/// Rows of one task.
#[derive(Debug, Default)]
pub(crate) struct WindowRows {
    maps: RowMaps,
    slopes: Vec<f32>,
    sharpness: Vec<f32>,
    padded: [Vec<f32>; 4],
}

impl<'a> Window<'a> {
    /// A window over a scene whose intensities have `noise` (standard deviation in linear light); `modulation` is 0
    /// where there is no light.
    pub fn new(scene: &'a Scene<'a>, slopes: &'a Slopes, modulation: &'a [f32], noise: f32) -> Self {
        let sigma = (WIDTH * scene.period_px as f32).clamp(0.8, 6.0);
        Self { scene, slopes, modulation, radius: (2.0 * sigma).ceil() as usize, sigma, noise }
    }

    /// Modulation of row `y`, 0 where there is no light.
    pub fn modulation(&self, y: usize) -> &'a [f32] {
        self.scene.row(self.modulation, y)
    }

    /// The same with a reach of two pixels, enough on the way to a solution.
    pub fn near(self) -> Self {
        Self { radius: self.radius.min(2), ..self }
    }

    /// Average along row `y`: phase and normal equations of a step of it are replaced by phase plus mean step, weight and
    /// variance (the sum of squared weights times denominators).
    pub fn along(&self, y: usize, rows: &mut WindowRows, [phase, numerator, denominator, variance]: [&mut [f32]; 4]) {
        let (grid, radius) = (self.scene.grid, self.radius);
        let WindowRows { maps, sharpness, padded, .. } = rows;
        let slope = self.slopes.along(self.scene, y, maps);
        self.sharpen(y, sharpness);
        for (row, source) in padded.iter_mut().zip([&*phase, &*numerator, &*denominator, slope]) {
            row.clear();
            row.resize(radius, 0.0);
            row.extend_from_slice(&source[..grid.width]);
            row.resize(2 * radius + grid.stride, 0.0);
        }
        let taps = self.taps(0..2 * radius + 1);
        let padded = padded.each_ref().map(Vec::as_slice);
        average_along(&taps, padded, [slope, sharpness], [phase, denominator, variance]);
    }

    /// Distances and weights of the neighbours with numbers `numbers`, of which the middle one is the pixel itself.
    fn taps(&self, numbers: std::ops::Range<usize>) -> Vec<[f32; 2]> {
        let distance = |k: usize| k as f32 - self.radius as f32;
        numbers.map(|k| [0.5 * distance(k), (-0.5 * (distance(k) / self.sigma).powi(2)).exp()]).collect()
    }

    /// Average along columns what [`Self::along`] left; `information` receives one over the variance of the phase for
    /// intensities of unit noise.
    pub fn down<T: Send>(
        &self,
        steps: &Steps,
        slots: &Slots<T>,
        rows: impl Fn(&mut T) -> &mut WindowRows + Sync,
        phase: &mut [f32],
        information: &mut [f32],
    ) {
        let stride = self.scene.grid.stride;
        let out = phase.par_chunks_mut(BLOCK * stride).zip(information.par_chunks_mut(BLOCK * stride));
        out.enumerate().for_each_init(|| slots.take(), |slot, (block, (phase, information))| {
            let first = block * BLOCK;
            let rows = rows(slot);
            self.slopes_down(first, phase.len() / stride, rows);
            let lines = phase.chunks_exact_mut(stride).zip(information.chunks_exact_mut(stride));
            for (i, (phase, information)) in lines.enumerate() {
                self.row_down(steps, first + i, i, rows, [phase, information]);
            }
        });
    }

    /// Slopes of the rows that `count` rows from `first` on need.
    fn slopes_down(&self, first: usize, count: usize, rows: &mut WindowRows) {
        let stride = self.scene.grid.stride;
        rows.slopes.resize((BLOCK + 2 * self.radius) * stride, 0.0);
        for (k, line) in rows.slopes.chunks_exact_mut(stride).take(count + 2 * self.radius).enumerate() {
            let y = (first + k).saturating_sub(self.radius).min(self.scene.grid.height - 1);
            line.copy_from_slice(self.slopes.down(self.scene, y, &mut rows.maps));
        }
    }

    /// Row `y`, number `index` of its block.
    fn row_down(
        &self,
        steps: &Steps,
        y: usize,
        index: usize,
        rows: &mut WindowRows,
        out: [&mut [f32]; 2],
    ) {
        let grid = self.scene.grid;
        self.sharpen(y, &mut rows.sharpness);
        let slope = |k: usize| &rows.slopes[(index + k) * grid.stride..][..grid.stride];
        // Neighbours inside the image.
        let inside = self.radius.saturating_sub(y)..(grid.height + self.radius - y).min(2 * self.radius + 1);
        let there: Vec<[&[f32]; 4]> = (inside.clone())
            .map(|k| {
                let [phase, weight, variance] = [&steps.phase, &steps.denominator, &steps.variance]
                    .map(|map| self.scene.row(map, y + k - self.radius));
                [phase, weight, variance, slope(k)]
            })
            .collect();
        let here = [self.scene.row(&steps.phase, y), slope(self.radius), &rows.sharpness];
        average_down(&self.taps(inside), &there, here, out);
    }

    /// How sharply a misfit counts at every pixel of a row: one over the square of what still belongs to the surface.
    fn sharpen(&self, y: usize, sharpness: &mut Vec<f32>) {
        sharpness.resize(self.scene.grid.stride, 0.0);
        sharpen(self.modulation(y), REACH_SIGMAS * self.noise, sharpness);
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn sharpen(modulation: &[f32], reach: f32, sharpness: &mut [f32]) {
    for (sharp, &modulation) in sharpness.iter_mut().zip(modulation) {
        let reach = reach / if modulation > 1e-6 { modulation } else { 1e-6 };
        let reach = if reach > REACH_RAD { reach } else { REACH_RAD };
        let reach = if reach < TAU { reach } else { TAU };
        *sharp = 1.0 / (reach * reach);
    }
}

/// Weight of a neighbour `d` off the slope between two pixels.
#[inline(always)]
fn fit(d: f32, sharpness: f32) -> f32 {
    let miss = 1.0 - d * d * sharpness;
    let fits = if miss > 0.0 { miss } else { 0.0 };
    fits * fits
}

/// Average over neighbours along a row, as far as they fit: the phase between two pixels is the mean of their slopes
/// times their distance, which is exact for a surface of constant curvature.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn average_along(taps: &[[f32; 2]], there: [&[f32]; 4], here: [&[f32]; 2], out: [&mut [f32]; 3]) {
    let here = here.map(lanes);
    let mut out = out.map(lanes_mut);
    for i in 0..here[0].len() {
        let ([slope, sharpness], phase) = (take(&here, i), out[0][i]);
        let mut sums = [[0.0; LANES]; 3];
        for (k, &[half, near]) in taps.iter().enumerate() {
            let from = i * LANES + k;
            let [other, numerator, denominator, other_slope]: [&Lanes; 4] =
                there.map(|row| row[from..].first_chunk().expect("rows are padded"));
            for x in 0..LANES {
                let d = other[x] - phase[x] - (slope[x] + other_slope[x]) * half;
                let weight = near * fit(d, sharpness[x]);
                let known = weight * denominator[x];
                sums[0][x] += weight * numerator[x] + known * d;
                sums[1][x] += known;
                sums[2][x] += weight * known;
            }
        }
        let mut found = [phase, sums[1], sums[2]];
        for x in 0..LANES {
            found[0][x] += sums[0][x] / if sums[1][x] > 1e-20 { sums[1][x] } else { 1e-20 };
        }
        put(&mut out, i, &found);
    }
}

/// The same along columns, over `there`: phase, weight, variance and slope of every neighbouring row.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn average_down(taps: &[[f32; 2]], there: &[[&[f32]; 4]], here: [&[f32]; 3], out: [&mut [f32]; 2]) {
    let here = here.map(lanes);
    let mut out = out.map(lanes_mut);
    for i in 0..here[0].len() {
        let [phase, slope, sharpness] = take(&here, i);
        let mut sums = [[0.0; LANES]; 3];
        for (&[half, near], there) in taps.iter().zip(there) {
            let [other, weight, variance, other_slope]: [&Lanes; 4] = there.map(|row| &lanes(row)[i]);
            for x in 0..LANES {
                let d = other[x] - phase[x] - (slope[x] + other_slope[x]) * half;
                let fit = near * fit(d, sharpness[x]);
                let known = fit * weight[x];
                sums[0][x] += known * d;
                sums[1][x] += known;
                sums[2][x] += fit * fit * variance[x];
            }
        }
        let mut found = [phase, [0.0; LANES]];
        for x in 0..LANES {
            let [top, bottom, square] = [sums[0][x], sums[1][x], sums[2][x]];
            found[0][x] += top / if bottom > 1e-20 { bottom } else { 1e-20 };
            found[1][x] = bottom * bottom / if square > 1e-20 { square } else { 1e-20 };
        }
        put(&mut out, i, &found);
    }
}

/// Standard deviation of the intensities, from the second differences of the phase: slopes and most curvature drop out.
pub(crate) fn noise(scene: &Scene<'_>, phase: &[f32], modulation: &[f32]) -> f32 {
    let grid = scene.grid;
    let mut seen: Vec<f32> = (0..phase.len())
        .step_by(NOISE_STRIDE)
        .filter(|i| (1..grid.width - 1).contains(&(i % grid.stride)))
        .filter(|&i| modulation[i - 1].min(modulation[i]).min(modulation[i + 1]) > 0.0)
        .map(|i| {
            let bend = wrap(wrap(phase[i + 1] - phase[i]) - wrap(phase[i] - phase[i - 1]));
            bend.abs() * modulation[i]
        })
        .collect();
    if seen.is_empty() {
        return 0.0;
    }
    let middle = seen.len() / 2;
    let (_, median, _) = seen.select_nth_unstable_by(middle, f32::total_cmp);
    *median / (0.6745 * 6f32.sqrt())
}
