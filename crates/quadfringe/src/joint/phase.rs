//! Step 6: the phase from all four channels. Once the order is known, every channel measures the same projector column.
//!
//! Each pixel takes a Gauss-Newton step of its phase under the model (S1), with the albedo eliminated. The steps are averaged
//! over a window that follows the surface.

use super::cells::RowMaps;
use super::infrared::{Waves, with_waves};
use super::model::{FringeRows, count, red_share};
use super::neighbours::{around, binomial};
use super::params::phase::{ALBEDO_MIN, ALBEDO_SHARE, UNLIT_WEIGHT};
use super::params::tasks::ROWS;
use super::photometry::Photometry;
use super::scene::{Scene, Scratch};
use super::window::{Average, AverageRow, NormalRows, Window, WindowRows};
use crate::parallel::lanes::{LANES, lanes, lanes_mut, put, take};
use crate::parallel::slots::Slots;
use multiversion::multiversion;
use rayon::prelude::*;

/// The phase fit, with the working rows of its tasks.
#[derive(Debug, Default)]
pub(super) struct PhaseFit {
    slots: Slots<Rows>,
}

/// Output of the fit other than the phase, as rows of the image. Rows of length 0 are not written.
pub(super) struct FitRows<'a> {
    /// Mean of the squared residuals of the channels, in linear light squared.
    pub squared_residual: Vec<&'a mut [f32]>,
    /// Modulation of R and B in linear light.
    pub modulation: Vec<&'a mut [f32]>,
    /// Sum of the weighted squared derivatives of the intensities in the window, in linear light squared per rad^2. The variance
    /// of the phase is noise^2 divided by it, times the share of the window ([`Window::share`]).
    pub information: Vec<&'a mut [f32]>,
}

impl FitRows<'_> {
    /// Rows of length 0, for a fit of the phase alone.
    pub fn none(height: usize) -> Self {
        let rows = || (0..height).map(|_| <&mut [f32]>::default()).collect();
        Self { squared_residual: rows(), modulation: rows(), information: rows() }
    }
}

/// Input of one fit.
#[derive(Clone, Copy)]
pub(super) struct PhaseModel<'a> {
    pub scene: &'a Scene<'a>,
    pub photometry: &'a Photometry,
    /// Fringe numbers divided by the first.
    pub ratios: [f32; 4],
    pub window: Window<'a>,
}

/// Sums over the four channels along one row, for the model `m` with an albedo of 1, its derivative `d` with respect to the phase
/// and the light `s`.
#[derive(Debug, Default)]
struct ModelRow {
    mm: Vec<f32>,
    md: Vec<f32>,
    dd: Vec<f32>,
    ms: Vec<f32>,
    ds: Vec<f32>,
    ss: Vec<f32>,
    /// Mean amplitude of R and B for an albedo of 1; that of R if there is no B.
    amplitude: Vec<f32>,
    /// The best-fitting albedo times `albedo_weight`.
    weighted_albedo: Vec<f32>,
    albedo_weight: Vec<f32>,
}

/// One row of pixels.
#[derive(Clone, Copy)]
struct PixelRows<'a> {
    phase: &'a [f32],
    modulation: &'a [f32],
}

/// Rows of one task.
#[derive(Debug, Default)]
struct Rows {
    maps: RowMaps,
    /// Ring buffer with the models of the rows above, at and below the present row.
    ring: [ModelRow; 3],
    smooth: SmoothAlbedo,
    spare: Vec<f32>,
    found: FoundRows,
    window: WindowRows,
}

/// Albedo and its weight, averaged over nine pixels.
#[derive(Debug, Default)]
struct SmoothAlbedo {
    weighted: Vec<f32>,
    weight: Vec<f32>,
}

/// Residuals and modulation of one row of pixels.
#[derive(Debug, Default)]
struct FoundRows {
    squared_residual: Vec<f32>,
    modulation: Vec<f32>,
}

impl PhaseFit {
    /// Takes one step of an absolute phase in rad, in place.
    pub fn step(
        &mut self,
        model: PhaseModel<'_>,
        phase: &mut [f32],
        Scratch { first, second }: Scratch<'_>,
        found: &mut FitRows<'_>,
    ) {
        let (grid, slots) = (model.scene.grid, &self.slots);
        let [average, weight] = [first, second].map(|plane| &mut plane[..grid.pixels()]);
        let FitRows { squared_residual, modulation, information } = found;
        let before = &*phase;
        let out = average
            .par_chunks_mut(grid.stride)
            .zip(weight.par_chunks_mut(grid.stride))
            .zip(squared_residual.par_iter_mut().zip(modulation.par_iter_mut()))
            .chunks(ROWS)
            .enumerate();
        // Rows are processed in blocks. Only the models of the two rows next to a block are computed twice.
        out.for_each_init(
            || slots.take(),
            |rows, (block, out)| {
                let (rows, first) = (&mut **rows, block * ROWS);
                rows.model(model, before, around(first, grid.height)[0], 0);
                rows.model(model, before, first, 1);
                for (i, ((phase, weight), (squared_residual, modulation))) in out.into_iter().enumerate() {
                    let y = first + i;
                    rows.model(model, before, around(y, grid.height)[2], (i + 2) % 3);
                    rows.average(model, before, y, i, AverageRow { phase, weight });
                    squared_residual.copy_from_slice(&rows.found.squared_residual[..squared_residual.len()]);
                    modulation.copy_from_slice(&rows.found.modulation[..modulation.len()]);
                }
            },
        );
        let average = Average { phase: average, weight };
        model.window.down(&average, slots, |rows| &mut rows.window, phase, information);
    }
}

impl Rows {
    /// Computes the model of row `y` into entry `at` of the ring buffer.
    fn model(&mut self, model: PhaseModel<'_>, phase: &[f32], y: usize, at: usize) {
        let PhaseModel { scene, photometry, ratios, window } = model;
        let fringes = photometry.sample(scene, y, &mut self.maps);
        let pixels = PixelRows { phase: scene.row(phase, y), modulation: window.modulation(y) };
        let out = &mut self.ring[at];
        with_waves!(scene, y, ratios, |waves| predict(&fringes, pixels, scene.rows(y), waves, out));
    }

    /// Computes the normal equations of row `y`, the row `i` of its block, and averages them along the row.
    fn average(&mut self, model: PhaseModel<'_>, before: &[f32], y: usize, i: usize, out: AverageRow<'_>) {
        let (scene, grid) = (model.scene, model.scene.grid);
        let Self { ring, smooth, spare, found, window, .. } = self;
        let FoundRows { squared_residual, modulation } = &mut *found;
        for row in [&mut smooth.weighted, &mut smooth.weight, squared_residual, modulation] {
            row.resize(grid.stride, 0.0);
        }
        let near = [0, 1, 2].map(|k| &ring[(i + k) % 3]);
        binomial(near.map(|row| row.weighted_albedo.as_slice()), grid.width, spare, &mut smooth.weighted);
        binomial(near.map(|row| row.albedo_weight.as_slice()), grid.width, spare, &mut smooth.weight);
        let lit = Lit { modulation: model.window.modulation(y), usable: scene.row(scene.usable, y) };
        let share = 1.0 / count(model.ratios);
        let measure = |normal: NormalRows<'_>| linearise(near[1], smooth, lit, share, normal, found);
        model.window.along(y, window, scene.row(before, y), measure, out);
    }
}

impl ModelRow {
    fn rows_mut(&mut self, length: usize) -> [&mut [f32]; 9] {
        let Self { mm, md, dd, ms, ds, ss, amplitude, weighted_albedo, albedo_weight } = self;
        [mm, md, dd, ms, ds, ss, amplitude, weighted_albedo, albedo_weight].map(|row| {
            row.resize(length, 0.0);
            row.as_mut_slice()
        })
    }
}

/// Which pixels of a row are lit and may take part.
#[derive(Clone, Copy)]
struct Lit<'a> {
    modulation: &'a [f32],
    usable: &'a [f32],
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn predict<W: Waves>(
    fringes: &FringeRows,
    pixels: PixelRows,
    light: [&[f32]; 4],
    waves: W,
    out: &mut ModelRow,
) {
    let mut out = out.rows_mut(pixels.phase.len()).map(lanes_mut);
    let pixels = [pixels.phase, pixels.modulation].map(lanes);
    let (offset, amplitude, light) =
        (fringes.offset.map(lanes), fringes.amplitude.map(lanes), light.map(lanes));
    for i in 0..pixels[0].len() {
        let (offset, amplitude, light) = (take(&offset, i), take(&amplitude, i), take(&light, i));
        let ([phase, lit], vector) = (take(&pixels, i), waves.vector(i));
        let mut found = [[0.0; LANES]; 9];
        for x in 0..LANES {
            let carriers = waves.carriers(&vector, x, phase[x]);
            let (mut mm, mut md, mut dd) = (1e-9f32, 0.0f32, 0.0f32);
            let (mut ms, mut ds, mut ss) = (0.0f32, 0.0f32, 0.0f32);
            for c in 0..4 {
                let (a, b, s) = (offset[c][x], amplitude[c][x], light[c][x]);
                let m = a + b * carriers.cosine[c];
                let (m, d) = (if m > 0.0 { m } else { 0.0 }, b * carriers.derivative[c]);
                mm += m * m;
                md += m * d;
                dd += d * d;
                ms += m * s;
                ds += d * s;
                ss += s * s;
            }
            let albedo = ms / mm;
            let albedo = if albedo > ALBEDO_MIN { albedo } else { ALBEDO_MIN };
            let weight = if lit[x] > 0.0 { 1.0 } else { UNLIT_WEIGHT };
            let mean = red_share(waves.ratios()) * (amplitude[0][x] + amplitude[2][x]);
            let values = [mm, md, dd, ms, ds, ss, mean, weight * albedo, weight];
            (0..9).for_each(|row| found[row][x] = values[row]);
        }
        put(&mut out, i, &found);
    }
}

/// Gauss-Newton terms of every pixel with the albedo eliminated, and the mean squared residual of the channels, of which each has
/// this `share`.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn linearise(
    model: &ModelRow,
    albedo: &SmoothAlbedo,
    lit: Lit,
    share: f32,
    normal: NormalRows,
    found: &mut FoundRows,
) {
    let sums = [&model.mm, &model.md, &model.dd, &model.ms, &model.ds, &model.ss, &model.amplitude];
    let sums = sums.map(|row| lanes(row));
    let (albedo, lit) =
        ([&albedo.weighted, &albedo.weight].map(|row| lanes(row)), [lit.modulation, lit.usable].map(lanes));
    let out = [normal.numerator, normal.denominator, &mut found.squared_residual, &mut found.modulation];
    let mut out = out.map(lanes_mut);
    for i in 0..albedo[0].len() {
        let [mm, md, dd, ms, ds, ss, amplitude] = take(&sums, i);
        let ([weighted, weight], [modulation, usable]) = (take(&albedo, i), take(&lit, i));
        let mut found = [[0.0; LANES]; 4];
        for x in 0..LANES {
            let albedo = weighted[x] / weight[x];
            let numerator = albedo * (ds[x] - albedo * md[x]);
            let square = ss[x] - albedo * (2.0 * ms[x] - albedo * mm[x]);
            // The part of a derivative that a change of the albedo also explains carries no information about the phase.
            let denominator = albedo * albedo * (dd[x] - ALBEDO_SHARE * md[x] * md[x] / mm[x]);
            let on = (modulation[x] > 0.0) & (usable[x] > 0.0);
            found[0][x] = if on { numerator } else { 0.0 };
            found[1][x] = if on { denominator } else { 0.0 };
            found[2][x] = if square > 0.0 { share * square } else { 0.0 };
            // Where light differs from any fringes, the fitted amplitude can be negative.
            let lit = (modulation[x] > 0.0) & (amplitude[x] > 0.0);
            found[3][x] = if lit { albedo * amplitude[x] } else { 0.0 };
        }
        put(&mut out, i, &found);
    }
}
