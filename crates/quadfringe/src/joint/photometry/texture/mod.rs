//! Step 5 on textured surfaces: the albedo of every channel at every pixel.
//!
//! Offset and amplitude have a common albedo: `I_c = rho_c (1 + k_c cos)`. The contrast `k_c` is a property of the light and not
//! of the texture, so it varies slowly. Once the phase is known, each pixel determines the albedo of every channel, more
//! precisely where its fringe is bright. These albedos are averaged over the surrounding pixels that have the same albedo in all
//! channels within the noise, so that no window mixes two albedos (a bilateral mean; Tomasi and Manduchi, ICCV 1998).

mod rows;
#[cfg(test)]
mod tests;

use crate::joint::cells::{CellMaps, Grid, RowMaps, TaskWork};
use crate::joint::neighbours::binomial;
use crate::joint::params::photometry::{ALBEDO_REACH, ALBEDO_STEPS, ALBEDO_WIDTH, CONTRAST_WIDTH};
use crate::joint::params::tasks::ROWS;
use crate::joint::scene::Scene;
use crate::joint::slopes::Slopes;
use crate::parallel::slots::Slots;
use rayon::prelude::*;
use rows::{apply, average, divide, project};

/// Albedos of every pixel, and working maps.
#[derive(Debug)]
pub(super) struct PixelAlbedo {
    /// Albedos of R, G, B, IR in padded rows, in units of 1/[`LEVELS`](rows::LEVELS).
    planes: [Vec<u16>; 4],
    /// Length of these rows; 0 if the pixels take offsets and amplitudes of their cells.
    stride: usize,
    /// For every channel 1 and its contrast.
    contrasts: CellMaps,
    slots: Slots<TaskWork<Rows>>,
}

impl Default for PixelAlbedo {
    fn default() -> Self {
        Self { planes: Default::default(), stride: 0, contrasts: CellMaps::new(8), slots: Slots::default() }
    }
}

/// Rows of one task.
#[derive(Debug, Default)]
struct Rows {
    maps: RowMaps,
    losses: RowMaps,
    /// Light times its model, and the square of the model, of three rows.
    models: [[Vec<f32>; 8]; 3],
    spare: Vec<f32>,
    /// Ring buffer with albedo and precision of four channels, padded on both sides, for all rows within the reach of
    /// the mean.
    ring: Vec<f32>,
    /// Indices in the ring buffer at which the pixels of the mean begin, and their weights.
    places: Vec<(usize, f32)>,
}

/// Another pixel of the mean: rows down and columns right from the first pixel, and its weight.
type Tap = ([usize; 2], f32);

impl PixelAlbedo {
    /// Discards the albedos; the pixels take offsets and amplitudes of their cells.
    pub fn forget(&mut self) {
        self.stride = 0;
    }

    /// Whether the albedo of the pixels of `scene` is known.
    pub fn is_known(&self, scene: &Scene<'_>) -> bool {
        self.stride == scene.grid.stride
    }

    /// Offsets and amplitudes of row `y`: albedo, and albedo times contrast, where the contrasts are interpolated on
    /// `grid`.
    pub fn sample<'a>(&self, grid: &Grid, y: usize, maps: &'a mut RowMaps) -> [&'a mut [f32]; 8] {
        let mut rows = maps.sample_mut::<8>(grid, &self.contrasts, 0, y);
        let albedos = self.planes.each_ref().map(|plane| &plane[y * grid.stride..][..grid.stride]);
        apply(albedos, rows.each_mut().map(|row| &mut **row));
        rows
    }

    /// Estimates the albedo, given a phase (rad) and a modulation. The contrasts come from `fringes` (offset and amplitude of
    /// each channel); the intensities have the standard deviation `noise`.
    pub fn measure(
        &mut self,
        (grid, fringes): (&Grid, &CellMaps),
        scene: &Scene<'_>,
        (ratios, slopes): ([f32; 3], &Slopes),
        [phase, modulation]: [&[f32]; 2],
        noise: f32,
        sums: &mut CellMaps,
    ) {
        self.contrast(grid, fringes, scene, sums);
        let Self { planes, stride, contrasts, slots } = self;
        *stride = grid.stride;
        let (taps, reach) = taps(scene.period_px as f32);
        let (wide, kept, rows) = (grid.stride + 2 * reach, 2 * reach + 1, ROWS.max(2 * reach));
        planes.iter_mut().for_each(|plane| plane.resize(grid.pixels(), 0));
        let [red, green, blue, infrared] =
            planes.each_mut().map(|plane| plane.par_chunks_mut(rows * grid.stride));
        red.zip(green).zip(blue.zip(infrared)).enumerate().for_each_init(
            || slots.take(),
            |slot, (block, ((red, green), (blue, infrared)))| {
                let Rows { maps, losses, models, spare, ring, places } = &mut slot.rows;
                let mut out = [red, green, blue, infrared].map(|rows| rows.chunks_mut(grid.stride));
                let (first, count) = ((block * rows) as isize, out[0].len());
                ring.clear();
                ring.resize(8 * wide * kept, 0.0);
                let mut model = |y: isize, out: &mut [Vec<f32>; 8]| {
                    let y = y.clamp(0, grid.height as isize - 1) as usize;
                    out.iter_mut().for_each(|row| row.resize(grid.stride, 0.0));
                    let model = maps.sample::<8>(grid, contrasts, 0, y);
                    let contrasts = [1, 3, 5, 7].map(|k| model[k]);
                    let [phase, modulation] = [phase, modulation].map(|plane| scene.row(plane, y));
                    let pixels =
                        [phase, modulation, scene.row(scene.usable, y), slopes.loss(scene, y, losses)];
                    project(contrasts, pixels, scene.rows(y), ratios, out.each_mut().map(Vec::as_mut_slice));
                };
                let from = first - reach as isize;
                model(from - 1, &mut models[0]);
                model(from, &mut models[1]);
                for i in 0..count + 2 * reach {
                    let y = from + i as isize;
                    model(y + 1, &mut models[(i + 2) % 3]);
                    let known = &mut ring[8 * wide * (i % kept)..][..8 * wide];
                    // Beyond the border there are no pixels, so the weight is 0.
                    let on = if (0..grid.height as isize).contains(&y) { 1.0 } else { 0.0 };
                    for c in 0..4 {
                        let (albedo, precision) = known[2 * c * wide..][..2 * wide].split_at_mut(wide);
                        let mut inner = [albedo, precision].map(|row| &mut row[reach..reach + grid.width]);
                        for (k, mean) in [c, 4 + c].into_iter().zip(&mut inner) {
                            let near = [0, 1, 2].map(|j| models[(i + j) % 3][k].as_slice());
                            binomial(near, grid.width, spare, mean);
                        }
                        divide((on, noise), inner);
                    }
                    if i >= 2 * reach {
                        let rows = out.each_mut().map(|rows| rows.next().expect("as many as were counted"));
                        let place = |[down, right]: [usize; 2]| 8 * wide * ((i + 1 + down) % kept) + right;
                        places.clear();
                        places.extend(taps.iter().map(|&(steps, near)| (place(steps), near)));
                        average(places, place([reach, reach]), (ring, wide), rows);
                    }
                }
            },
        );
    }

    /// Contrasts of the light: amplitude divided by offset, in which the albedo cancels.
    fn contrast(&mut self, grid: &Grid, fringes: &CellMaps, scene: &Scene<'_>, sums: &mut CellMaps) {
        let Self { contrasts, slots, .. } = self;
        grid.smooth::<8, Rows>(
            CONTRAST_WIDTH * scene.period_px as f32 / grid.step as f32,
            slots,
            sums,
            contrasts,
            |row, k| Some(fringes.line(row, k)),
            |_, sums, out| {
                let columns = sums[0].len();
                for (pair, out) in sums.chunks_exact(2).zip(out.chunks_exact_mut(2 * columns)) {
                    let (whole, contrast) = out.split_at_mut(columns);
                    whole.fill(1.0);
                    for (contrast, (b, a)) in contrast.iter_mut().zip(pair[1].iter().zip(pair[0])) {
                        *contrast = b / a.max(1e-6);
                    }
                }
            },
        );
    }
}

/// The pixels of the mean, relative to its middle, and the distance of the furthest.
fn taps(period_px: f32) -> (Vec<Tap>, usize) {
    let spacing = (ALBEDO_REACH * period_px / ALBEDO_STEPS as f32).round().max(1.0) as usize;
    let sigma = ALBEDO_WIDTH * period_px;
    let line = || 0..=2 * ALBEDO_STEPS;
    let all = line().flat_map(|down| line().map(move |right| [down, right]));
    let near = all.filter_map(|steps| {
        let square = steps.map(|s| (s as f32 - ALBEDO_STEPS as f32).powi(2)).iter().sum::<f32>();
        let weight = (-0.5 * square * (spacing as f32 / sigma).powi(2)).exp();
        (square <= (ALBEDO_STEPS * ALBEDO_STEPS) as f32).then(|| (steps.map(|s| s * spacing), weight))
    });
    (near.collect(), spacing * ALBEDO_STEPS)
}
