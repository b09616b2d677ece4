//! Step 12: the albedo of every pixel, which is its light without fringes.
//!
//! The energy gives albedo and contrast of cells of a few pixels. A pixel at an edge takes the albedo of the cells on its side
//! (J30). What then differs from its light is texture or noise. Texture is a relative change of all channels in common and one of
//! each channel, with variances that are estimated in blocks of pixels (empirical Bayes); the change of a pixel is its expectation
//! (J31).

mod edges;
mod texture;

use super::energy::{Energy, FringeRows};
use super::infrared::{Waves, with_waves};
use super::model::absent;
use super::params::albedo::ROWS;
use super::scene::Scene;
use crate::parallel::angle::sin_cos;
use crate::parallel::lanes::{LANES, lanes, lanes_mut, put, take};
use crate::parallel::slots::Slots;
use edges::choose;
use multiversion::multiversion;
use rayon::prelude::*;
use texture::{Row, Texture, add_common, add_single, take_common, take_single};

/// The estimator, with its working memory.
#[derive(Debug, Default)]
pub(super) struct Albedo {
    slots: Slots<Work>,
}

/// What is known of the pixels.
#[derive(Clone, Copy)]
pub(super) struct Known<'a> {
    /// Absolute phase in rad.
    pub phase: &'a [f32],
    /// Not 0 for pixels that are returned.
    pub valid: &'a [u8],
    /// Fringe numbers divided by the first.
    pub ratios: [f32; 4],
    /// Standard deviation of the intensity of a pixel, in linear light.
    pub noise: f32,
}

/// The rows of a block.
#[derive(Debug, Default)]
struct Work {
    fringes: FringeRows,
    rows: [Row; ROWS],
    common: Vec<Texture>,
    single: Vec<Texture>,
}

impl Albedo {
    /// Writes the albedo of the pixels, four channels side by side; NaN where there is no phase, or no cell of the energy, and for an
    /// infrared channel that is absent.
    pub fn write(&self, scene: &Scene<'_>, energy: &Energy, known: Known<'_>, out: &mut [f32]) {
        let width = scene.grid.width;
        out.par_chunks_mut(4 * width * ROWS).enumerate().for_each_init(
            || self.slots.take(),
            |work, (block, out)| {
                let first = block * ROWS;
                let rows = out.len() / (4 * width);
                let Work { fringes, rows: all, .. } = &mut **work;
                fringes.clear();
                for (row, y) in all[..rows].iter_mut().zip(first..) {
                    row.predict(scene, y, energy.fringes(scene, y, fringes), known);
                }
                work.refine(rows, known.noise * known.noise);
                for (y, out) in out.chunks_exact_mut(4 * width).enumerate() {
                    let valid = scene.row(known.valid, first + y);
                    work.rows[y].write(valid, absent(known.ratios), out);
                }
            },
        );
    }
}

impl Work {
    /// Adds the expected texture to the albedo of the cells; `noise` is the variance of the intensity.
    fn refine(&mut self, rows: usize, noise: f32) {
        let Self { rows: all, common, single, .. } = self;
        let rows = &mut all[..rows];
        let blocks = rows[0].rest[0].len() / LANES;
        for sums in [&mut *common, &mut *single] {
            sums.clear();
            sums.resize(blocks, Texture::default());
        }
        rows.iter().for_each(|row| add_common(row, noise, common));
        rows.iter_mut().for_each(|row| take_common(row, noise, common));
        rows.iter().for_each(|row| add_single(row, noise, single));
        rows.iter_mut().for_each(|row| take_single(row, noise, single));
    }
}

impl Row {
    fn predict(&mut self, scene: &Scene<'_>, y: usize, fringes: &FringeRows, known: Known<'_>) {
        let Self { albedo, signal, rest } = self;
        for c in 0..4 {
            albedo[c].clone_from(&fringes.albedo[c]);
            [&mut albedo[c], &mut signal[c], &mut rest[c]]
                .into_iter()
                .for_each(|row| row.resize(scene.grid.stride, 0.0));
        }
        let contrast = fringes.contrast.each_ref().map(Vec::as_slice);
        let pixels =
            Pixels { phase: scene.row(known.phase, y), usable: scene.row(scene.usable, y), contrast };
        let waves = signal.each_mut().map(Vec::as_mut_slice);
        let [red, green, blue, infrared] = waves;
        let [first, second, fourth, _] = known.ratios;
        modulate(&pixels, [first, second, fourth], [red, green, blue]);
        with_waves!(scene, y, known.ratios, |waves| modulate_infrared(&pixels, waves, infrared));
        let waves = signal.each_ref().map(Vec::as_slice);
        choose(scene.rows(y), waves, fringes, known.noise * known.noise, albedo);
        for (c, light) in scene.rows(y).into_iter().enumerate() {
            predict_row(light, pixels.usable, &albedo[c], [&mut signal[c], &mut rest[c]]);
        }
    }

    /// Without four channels, the infrared albedo is NaN: its place is `absent`, or that of B, which is alone and has the place
    /// of infrared.
    fn write(&self, valid: &[u8], absent: Option<usize>, out: &mut [f32]) {
        let [red, green, blue, infrared] = &self.albedo;
        let hole = if absent.is_none() { 0.0 } else { f32::NAN };
        let [blue, infrared] = if absent == Some(2) { [infrared, blue] } else { [blue, infrared] };
        for (x, out) in out.chunks_exact_mut(4).enumerate() {
            let known = valid[x] != 0 && red[x] > 0.0;
            let pixel = [red[x], green[x], blue[x], infrared[x] + hole];
            out.copy_from_slice(&if known { pixel } else { [f32::NAN; 4] });
        }
    }
}

/// A row of pixels.
struct Pixels<'a> {
    phase: &'a [f32],
    usable: &'a [f32],
    contrast: [&'a [f32]; 4],
}

/// Writes the light of albedo 1 in R, G and B; the fringes of B are a quarter period ahead.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2+fma"))]
fn modulate(pixels: &Pixels, ratios: [f32; 3], out: [&mut [f32]; 3]) {
    let Pixels { phase, contrast, .. } = pixels;
    for (c, out) in out.into_iter().enumerate() {
        let known = [lanes(phase), lanes(contrast[c])];
        for (at, out) in lanes_mut(out).iter_mut().enumerate() {
            let [phase, contrast] = take(&known, at);
            for x in 0..LANES {
                let (sine, cosine) = sin_cos(ratios[c] * phase[x]);
                out[x] = 1.0 + contrast[x] * if c == 2 { -sine } else { cosine };
            }
        }
    }
}

/// The same in IR.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2+fma"))]
fn modulate_infrared<W: Waves>(pixels: &Pixels, waves: W, out: &mut [f32]) {
    let known = [lanes(pixels.phase), lanes(pixels.contrast[3])];
    for (at, out) in lanes_mut(out).iter_mut().enumerate() {
        let [phase, contrast] = take(&known, at);
        let vector = waves.vector(at);
        for x in 0..LANES {
            let (_, cosine) = sin_cos(waves.infrared(&vector, x, phase[x]).phase);
            out[x] = 1.0 + contrast[x] * cosine;
        }
    }
}

/// Replaces the light of albedo 1 in `out` by the light that the albedo predicts, and writes what differs from it.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2+fma"))]
fn predict_row(light: &[f32], usable: &[f32], albedo: &[f32], out: [&mut [f32]; 2]) {
    let known = [light, usable, albedo].map(lanes);
    let mut out = out.map(lanes_mut);
    for at in 0..known[0].len() {
        let ([light, usable, albedo], mut signal, mut rest) = (take(&known, at), out[0][at], [0.0; LANES]);
        for x in 0..LANES {
            // Far from all cells there is no albedo, and the light is no texture.
            let counts = if albedo[x] > 0.0 { usable[x] } else { 0.0 };
            signal[x] *= counts * albedo[x];
            rest[x] = counts * light[x] - signal[x];
        }
        put(&mut out, at, &[signal, rest]);
    }
}
