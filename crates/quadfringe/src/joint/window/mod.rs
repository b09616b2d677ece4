//! A smoothing window that follows the local slope of the phase and stops at edges.
//!
//! This is a bilateral window with Tukey's biweight: the weight of a neighbour decreases with the difference between its phase
//! and the phase that the slope predicts, in units of the noise. The window runs first along rows and then along columns. It adds
//! up the normal equations of a Gauss-Newton step, so that every neighbour has the weight of its information.

mod rows;
#[cfg(test)]
mod tests;

use super::cells::RowMaps;
use super::params::phase::{SIGMA_MAX_PX, WIDE, WIDTH};
use super::params::tasks::ROWS;
use super::residuals::Residuals;
use super::scene::Scene;
use super::slopes::Slopes;
use crate::parallel::slots::Slots;
use rayon::prelude::*;
use rows::{average_neighbours, sharpen};

/// The window of one shot.
#[derive(Clone, Copy)]
pub(super) struct Window<'a> {
    scene: &'a Scene<'a>,
    slopes: &'a Slopes,
    modulation: &'a [f32],
    /// Number of neighbours on each side; `spacing` is the distance between them in pixels.
    radius: usize,
    spacing: usize,
    sigma: f32,
    noise: f32,
    residuals: Option<&'a Residuals>,
}

/// Normal equations of a step of the phase along a row. The step is the numerator divided by the denominator; both are 0 for
/// pixels that take no part.
pub(super) struct NormalRows<'a> {
    pub numerator: &'a mut [f32],
    pub denominator: &'a mut [f32],
}

/// One row of a phase averaged along rows, with its weight.
pub(super) struct AverageRow<'a> {
    pub phase: &'a mut [f32],
    pub weight: &'a mut [f32],
}

/// A phase averaged along rows, and its weight.
#[derive(Clone, Copy)]
pub(super) struct Average<'a> {
    pub phase: &'a [f32],
    pub weight: &'a [f32],
}

/// Rows of one task.
#[derive(Debug, Default)]
pub(super) struct WindowRows {
    maps: RowMaps,
    slopes: Vec<f32>,
    sharpness: Vec<f32>,
    residuals: RowMaps,
    weight: Vec<f32>,
    /// Numerators of pixels whose step is taken already: 0.
    no_step: Vec<f32>,
    padded: [Vec<f32>; 4],
}

impl<'a> Window<'a> {
    /// A window over a scene whose intensities have `noise` (standard deviation in linear light); `modulation` is 0
    /// where there is no light.
    pub fn new(scene: &'a Scene<'a>, slopes: &'a Slopes, modulation: &'a [f32], noise: f32) -> Self {
        let sigma = (WIDTH * scene.period_px as f32).min(SIGMA_MAX_PX);
        let radius = (2.0 * sigma).ceil() as usize;
        Self { scene, slopes, modulation, radius, spacing: 1, sigma, noise, residuals: None }
    }

    /// Modulation of row `y`, 0 where there is no light.
    pub fn modulation(&self, y: usize) -> &'a [f32] {
        self.scene.row(self.modulation, y)
    }

    /// This window with a reach of two pixels, which is enough for intermediate steps.
    pub fn near(self) -> Self {
        Self { radius: self.radius.min(2), ..self }
    }

    /// This window with a reach of a whole fringe. Errors that wrong offsets and amplitudes cause change their sign along a
    /// fringe and average out.
    pub fn wide(self) -> Self {
        let sigma = WIDE * self.scene.period_px as f32;
        // The window is still smooth if its neighbours are a third of sigma apart.
        let spacing = (sigma / 3.0).max(1.0) as usize;
        Self { sigma, spacing, radius: (2.0 * sigma / spacing as f32).ceil() as usize, ..self }
    }

    /// This window, but tolerating greater phase differences where the `residuals` of the model exceed the noise.
    pub fn loosened(self, residuals: &'a Residuals) -> Self {
        Self { residuals: Some(residuals), ..self }
    }

    /// Averages a phase along row `y`. `measure` writes the normal equations of its step: `numerator / denominator`, or 0 for
    /// pixels that take no part. `out` receives the phase plus the mean step, and the weight.
    pub fn along(
        &self,
        y: usize,
        rows: &mut WindowRows,
        phase: &[f32],
        measure: impl FnOnce(NormalRows<'_>),
        out: AverageRow<'_>,
    ) {
        let (grid, reach) = (self.scene.grid, self.reach());
        let WindowRows { maps, sharpness, residuals, padded, .. } = rows;
        let slope = self.slopes.along(self.scene, y, maps);
        self.sharpen(y, residuals, sharpness);
        let inner = padded.each_mut().map(|row| {
            row.resize(2 * reach + grid.stride, 0.0);
            // A wider window may have left values before and after the row.
            let (before, rest) = row.split_at_mut(reach);
            let (inner, behind) = rest.split_at_mut(grid.stride);
            before.fill(0.0);
            behind.fill(0.0);
            inner
        });
        let [phases, slopes, numerator, denominator] = inner;
        phases.copy_from_slice(phase);
        slopes.copy_from_slice(slope);
        measure(NormalRows { numerator, denominator });
        let taps = self.taps(0..2 * self.radius + 1);
        let padded = padded.each_ref();
        let there = |k: usize| padded.map(|row| &row[k * self.spacing..][..grid.stride]);
        let there: Vec<_> = (0..taps.len()).map(there).collect();
        average_neighbours(&taps, &there, [phase, slope, sharpness], [out.phase, out.weight]);
    }

    /// Distance of the furthest neighbour in pixels.
    fn reach(&self) -> usize {
        self.spacing * self.radius
    }

    /// Half the distance, in cells, and the weight of the neighbours with these `numbers`. Neighbour number `radius` is the pixel
    /// itself.
    fn taps(&self, numbers: std::ops::Range<usize>) -> Vec<[f32; 2]> {
        let distance = |k: usize| self.spacing as f32 * (k as f32 - self.radius as f32);
        let half = 0.5 / self.scene.grid.step as f32;
        numbers.map(|k| [half * distance(k), (-0.5 * (distance(k) / self.sigma).powi(2)).exp()]).collect()
    }

    /// Averages the output of [`Self::along`] along columns. Rows of `information` receive the sums of the weights of
    /// the window, as many as they have room for.
    pub fn down<T: Default + Send>(
        &self,
        average: &Average<'_>,
        slots: &Slots<T>,
        rows: impl Fn(&mut T) -> &mut WindowRows + Sync,
        phase: &mut [f32],
        information: &mut [&mut [f32]],
    ) {
        let stride = self.scene.grid.stride;
        let out = phase.par_chunks_mut(ROWS * stride).zip(information.par_chunks_mut(ROWS));
        out.enumerate().for_each_init(
            || slots.take(),
            |slot, (block, (phase, information))| {
                let first = block * ROWS;
                let rows = rows(slot);
                self.slopes_down(first, phase.len() / stride, rows);
                let mut weight = std::mem::take(&mut rows.weight);
                weight.resize(stride, 0.0);
                for (i, (phase, information)) in phase.chunks_exact_mut(stride).zip(information).enumerate() {
                    self.row_down(average, first + i, i, rows, [phase, &mut weight]);
                    information.copy_from_slice(&weight[..information.len()]);
                }
                rows.weight = weight;
            },
        );
    }

    /// Sum of the squared weights divided by the sum of the weights, for a window that lies on one surface or is cut in
    /// half by an edge. The variance of the mean is this share times noise^2 divided by the information.
    pub fn share(&self) -> f32 {
        let taps = self.taps(0..2 * self.radius + 1);
        let [squares, sum] = [2, 1].map(|power| taps.iter().map(|[_, near]| near.powi(power)).sum::<f32>());
        (squares / sum).powi(2)
    }

    /// Computes the slopes of all rows that the average of `count` rows from `first` on needs.
    fn slopes_down(&self, first: usize, count: usize, rows: &mut WindowRows) {
        let (stride, reach) = (self.scene.grid.stride, self.reach());
        rows.no_step.resize(stride, 0.0);
        rows.slopes.resize((ROWS + 2 * reach) * stride, 0.0);
        for (k, line) in rows.slopes.chunks_exact_mut(stride).take(count + 2 * reach).enumerate() {
            let y = (first + k).saturating_sub(reach).min(self.scene.grid.height - 1);
            line.copy_from_slice(self.slopes.down(self.scene, y, &mut rows.maps));
        }
    }

    /// Averages row `y`, which has the number `index` in its block.
    fn row_down(
        &self,
        average: &Average<'_>,
        y: usize,
        index: usize,
        rows: &mut WindowRows,
        out: [&mut [f32]; 2],
    ) {
        let grid = self.scene.grid;
        self.sharpen(y, &mut rows.residuals, &mut rows.sharpness);
        let slope = |k: usize| &rows.slopes[(index + self.spacing * k) * grid.stride..][..grid.stride];
        // Only neighbours inside the image count.
        let [above, below] = [y, grid.height - 1 - y].map(|rows| (rows / self.spacing).min(self.radius));
        let inside = self.radius - above..self.radius + below + 1;
        let there = inside.clone().map(|k| {
            let row = y + self.spacing * k - self.reach();
            let [phase, weight] = [average.phase, average.weight].map(|plane| self.scene.row(plane, row));
            [phase, slope(k), &rows.no_step, weight]
        });
        let there: Vec<_> = there.collect();
        let here = [self.scene.row(average.phase, y), slope(self.radius), &rows.sharpness];
        average_neighbours(&self.taps(inside), &there, here, out);
    }

    /// Sharpness at every pixel of a row: 1 / the square of the greatest phase difference that counts as one surface.
    fn sharpen(&self, y: usize, maps: &mut RowMaps, sharpness: &mut Vec<f32>) {
        sharpness.clear();
        match self.residuals {
            None => sharpness.resize(self.scene.grid.stride, 0.0),
            Some(residuals) => sharpness.extend_from_slice(residuals.row(self.scene, y, maps)),
        }
        sharpen(self.modulation(y), self.noise, sharpness);
    }
}
