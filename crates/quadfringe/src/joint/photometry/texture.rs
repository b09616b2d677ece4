//! Step 5 on textured surfaces: the albedo of every channel at every pixel.
//!
//! Offset and amplitude have a common albedo: `I_c = rho_c (1 + k_c cos)`. The contrast `k_c` is a property of the light and not
//! of the texture, so it varies slowly. Once the phase is known, each pixel determines the albedo of every channel, more
//! precisely where its fringe is bright. These albedos are averaged over the surrounding pixels that have the same albedo in all
//! channels within the noise, so that no window mixes two albedos (a bilateral mean; Tomasi and Manduchi, ICCV 1998).

use crate::joint::cells::{CellMaps, Grid, RowMaps, TaskWork};
use crate::joint::model::carriers;
use crate::joint::neighbours::binomial;
use crate::joint::params::photometry::{
    ALBEDO_ERROR, ALBEDO_EXCESS, ALBEDO_EXPECTED, ALBEDO_REACH, ALBEDO_STEPS, ALBEDO_WIDTH, CONTRAST_WIDTH,
};
use crate::joint::params::tasks::ROWS;
use crate::joint::scene::Scene;
use crate::joint::slopes::Slopes;
use crate::parallel::lanes::{LANES, lanes, lanes_mut, put, take};
use crate::parallel::slots::Slots;
use multiversion::multiversion;
use rayon::prelude::*;

/// Share of the variance of noise that remains after the mean over nine pixels by [`binomial`].
const MEAN_OF_NINE: f32 = 9.0 / 64.0;
/// Number of levels up to an albedo of 1; the greatest albedo is 2. The noise of a mean is much larger than a level.
const LEVELS: f32 = 32768.0;

/// Albedos of every pixel, and working maps.
#[derive(Debug)]
pub(super) struct PixelAlbedo {
    /// Albedos of R, G, B, IR in padded rows, in units of 1/[`LEVELS`].
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

/// For each channel, light times its model for an albedo of 1, and the square of the model; 0 for unlit pixels.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn project(
    contrasts: [&[f32]; 4],
    pixels: [&[f32]; 4],
    light: [&[f32]; 4],
    ratios: [f32; 3],
    out: [&mut [f32]; 8],
) {
    let (contrasts, pixels, light) = (contrasts.map(lanes), pixels.map(lanes), light.map(lanes));
    let mut out = out.map(lanes_mut);
    for i in 0..pixels[0].len() {
        let (contrasts, light) = (take(&contrasts, i), take(&light, i));
        let [phase, modulation, usable, loss] = take(&pixels, i);
        let mut found = [[0.0; LANES]; 8];
        for x in 0..LANES {
            let carriers = carriers(phase[x], ratios, loss[x]);
            let on = if modulation[x] > 0.0 { usable[x] } else { 0.0 };
            for c in 0..4 {
                let model = 1.0 + contrasts[c][x] * carriers.cosine[c];
                let model = if model > 0.0 { on * model } else { 0.0 };
                (found[c][x], found[4 + c][x]) = (model * light[c][x], model * model);
            }
        }
        put(&mut out, i, &found);
    }
}

/// Replaces a mean product by the albedo, and a mean square by the precision of this albedo.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn divide((on, noise): (f32, f32), [product, square]: [&mut [f32]; 2]) {
    let variance = MEAN_OF_NINE * noise * noise;
    for (albedo, precision) in product.iter_mut().zip(square) {
        let square = *precision;
        *albedo /= if square > 1e-4 { square } else { 1e-4 };
        *precision =
            on * square / (variance + square * (ALBEDO_ERROR * ALBEDO_ERROR * *albedo * *albedo + 1e-8));
    }
}

/// Writes the offsets, and replaces the contrasts by the amplitudes.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn apply(albedos: [&[u16]; 4], rows: [&mut [f32]; 8]) {
    let albedos = albedos.map(|row| row.as_chunks::<LANES>().0);
    let rows = rows.map(lanes_mut);
    for c in 0..4 {
        for (i, albedo) in albedos[c].iter().enumerate() {
            let albedo = albedo.map(|albedo| f32::from(albedo) * (1.0 / LEVELS));
            let mut modulation = rows[2 * c + 1][i];
            for x in 0..LANES {
                modulation[x] *= albedo[x];
            }
            (rows[2 * c][i], rows[2 * c + 1][i]) = (albedo, modulation);
        }
    }
}

/// Number of pixels that are averaged side by side. With more pixels the sums would not fit into registers.
const SIDE: usize = LANES / 2;

/// Averages albedos over the surrounding pixels that have the same albedo in all channels. `taps` are the indices in the `ring`
/// at which the other pixels begin, `pixel` is the index of the pixel itself.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn average(taps: &[(usize, f32)], pixel: usize, (ring, wide): (&[f32], usize), out: [&mut [u16]; 4]) {
    let out = out.map(|row| row.as_chunks_mut::<SIDE>().0);
    let at = |first: usize| -> [[f32; SIDE]; 8] {
        let rows = &ring[first..];
        std::array::from_fn(|k| *rows[k * wide..].first_chunk().expect("rows are padded"))
    };
    for i in 0..out[0].len() {
        let pixel = at(pixel + i * SIDE);
        let mut sums = [[0.0; SIDE]; 8];
        for &(first, near) in taps {
            sums = join(sums, near, pixel, at(first + i * SIDE));
        }
        for c in 0..4 {
            for x in 0..SIDE {
                let weight = sums[2 * c + 1][x];
                let albedo = sums[2 * c][x] / if weight > 1e-20 { weight } else { 1e-20 };
                out[c][i][x] = (LEVELS * albedo + 0.5) as u16;
            }
        }
    }
}

/// Adds other pixels, weighted by how well their albedos agree, to sums of weighted albedos and of weights.
#[inline(always)]
fn join(
    mut sums: [[f32; SIDE]; 8],
    near: f32,
    pixel: [[f32; SIDE]; 8],
    other: [[f32; SIDE]; 8],
) -> [[f32; SIDE]; 8] {
    let mut weight = [0.0; SIDE];
    for x in 0..SIDE {
        let mut apart = -ALBEDO_EXPECTED;
        for c in 0..4 {
            let (mine, theirs) = (pixel[2 * c + 1][x], other[2 * c + 1][x]);
            let precision = if mine < theirs { mine } else { theirs };
            let gap = pixel[2 * c][x] - other[2 * c][x];
            // The greater of two variances is about two thirds of their sum.
            apart += 0.7 * precision * gap * gap;
        }
        let excess = if apart > 0.0 { apart * (1.0 / ALBEDO_EXCESS) } else { 0.0 };
        let fits = if excess < 1.0 { 1.0 - excess } else { 0.0 };
        weight[x] = near * fits * fits;
    }
    for c in 0..4 {
        for x in 0..SIDE {
            let weight = weight[x] * other[2 * c + 1][x];
            sums[2 * c][x] += weight * other[2 * c][x];
            sums[2 * c + 1][x] += weight;
        }
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::super::edge::{ALBEDO, EDGE, Edge, RATIOS};
    use super::*;

    const CONTRASTS: [f32; 4] = [0.8, 0.7, 0.9, 0.6];
    const INKS: [[f32; 4]; 2] = [[0.5, 0.2, 0.6, 0.4], [0.3, 0.5, 0.2, 0.4]];

    /// The albedo found for a print of two inks that meet.
    struct Print {
        edge: Edge,
        albedo: PixelAlbedo,
    }

    impl Print {
        fn new(noise: f32, usable: impl Fn(usize) -> f32) -> Self {
            let texture = |ink: [f32; 4]| {
                std::array::from_fn(|k| ink[k / 2] * if k % 2 == 0 { 1.0 } else { CONTRASTS[k / 2] })
            };
            let edge = Edge::new(INKS.map(texture), noise);
            let usable: Vec<f32> = (0..edge.grid.pixels()).map(usable).collect();
            let (modulation, mut sums) = (edge.plane(0.2), CellMaps::default());
            let mut albedo = PixelAlbedo::default();
            let how = (RATIOS, &Slopes::flat(&edge.grid));
            let pixels = [edge.phase.as_slice(), &modulation];
            let cells = (&edge.grid, &edge.maps);
            albedo.measure(cells, &edge.scene(&usable), how, pixels, noise, &mut sums);
            Self { edge, albedo }
        }

        /// Offset and amplitude of a channel in row 30, divided by their true values.
        fn ratios(&self, c: usize, columns: impl Iterator<Item = usize>) -> Vec<[f32; 2]> {
            let mut maps = RowMaps::default();
            let rows = self.albedo.sample(&self.edge.grid, 30, &mut maps);
            let ratio = |x: usize, k: usize| rows[k][x] / (ALBEDO * self.edge.texture(x)[k]);
            columns.map(|x| [ratio(x, 2 * c), ratio(x, 2 * c + 1)]).collect()
        }
    }

    #[test]
    fn near_an_edge_every_pixel_has_the_albedo_of_its_side() {
        let print = Print::new(1e-3, |_| 1.0);
        for c in 0..4 {
            // In the two columns at the edge, a pixel and its neighbours see both inks.
            let columns = (20..236).filter(|x| !(EDGE - 1..=EDGE).contains(x));
            for (at, ratios) in print.ratios(c, columns).into_iter().enumerate() {
                assert!(ratios.iter().all(|ratio| (ratio - 1.0).abs() < 0.03), "{c} {at} {ratios:?}");
            }
        }
    }

    #[test]
    fn albedos_are_means_where_pixels_differ_by_noise() {
        let noise = 0.02;
        let print = Print::new(noise, |_| 1.0);
        for c in 0..4 {
            let errors = print.ratios(c, 24..108).into_iter().map(|[a, _]| (a - 1.0).powi(2));
            let rms = (errors.sum::<f32>() / 84.0).sqrt();
            // The albedo of one pixel has the relative error noise / light; the mean is over hundreds of pixels.
            assert!(rms < 0.25 * noise / (ALBEDO * INKS[0][c]), "{c} {rms}");
        }
    }

    #[test]
    fn unusable_pixels_take_the_albedo_around_them() {
        let hole = |i: usize| (28..33).contains(&(i / 256)) && (60..65).contains(&(i % 256));
        let print = Print::new(1e-3, |i| if hole(i) { 0.0 } else { 1.0 });
        for c in 0..4 {
            for [a, b] in print.ratios(c, 58..67) {
                assert!((a - 1.0).abs() < 0.02 && (b - 1.0).abs() < 0.02, "{c} {a} {b}");
            }
        }
    }
}
