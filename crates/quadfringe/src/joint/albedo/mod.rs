//! Step 11: the albedo of every pixel, which is its light without fringes.
//!
//! The energy gives albedo and contrast of cells of a few pixels. A pixel at an edge takes the albedo of the cells on its side
//! (J30). What then differs from its light is texture or noise. Texture is a relative change of all channels in common, then of each
//! alone, with variances that are estimated in blocks of pixels (empirical Bayes); the change of a pixel is its expectation (J31).

mod edges;
mod texture;

use super::energy::{Energy, FringeRows};
use super::infrared::{Waves, with_waves};
use super::model::absent;
use super::params::albedo::ROWS;
use super::scene::Scene;
use crate::parallel::lanes::{LANES, lanes, lanes_mut, put, take};
use crate::parallel::slots::Slots;
use edges::choose;
use multiversion::multiversion;
use rayon::prelude::*;
use texture::{Change, Row, Texture, add_texture, take_texture};

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
    texture: Vec<Texture>,
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
        let Self { rows: all, texture, .. } = self;
        let rows = &mut all[..rows];
        let blocks = rows[0].rest[0].len() / LANES;
        for change in [Change::Common, Change::Of(0), Change::Of(1), Change::Of(2), Change::Of(3)] {
            texture.clear();
            texture.resize(blocks, Texture::default());
            rows.iter().for_each(|row| add_texture(row, change, noise, texture));
            rows.iter_mut().for_each(|row| take_texture(row, change, noise, texture));
        }
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
        let out = signal.each_mut().map(Vec::as_mut_slice);
        with_waves!(scene, y, known.ratios, |waves| modulate(&pixels, waves, out));
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

/// Writes the light of albedo 1.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2+fma"))]
fn modulate<W: Waves>(pixels: &Pixels, waves: W, out: [&mut [f32]; 4]) {
    let (phase, contrast) = (lanes(pixels.phase), pixels.contrast.map(lanes));
    let mut out = out.map(lanes_mut);
    for (at, phase) in phase.iter().enumerate() {
        let (contrast, vector) = (take(&contrast, at), waves.vector(at));
        let mut light = [[0.0; LANES]; 4];
        for x in 0..LANES {
            let carriers = waves.carriers(&vector, x, phase[x]);
            (0..4).for_each(|c| light[c][x] = 1.0 + contrast[c][x] * carriers.cosine[c]);
        }
        put(&mut out, at, &light);
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
