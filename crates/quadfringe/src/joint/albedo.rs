//! Step 12: the albedo of every pixel, which is its light without fringes.
//!
//! The energy gives albedo and contrast of cells of a few pixels. A pixel at an edge takes the albedo of the cells on its side
//! (J30). What then differs from its light is texture or noise. Texture is a relative change of all channels in common and one of
//! each channel, with variances that are estimated in blocks of pixels (empirical Bayes); the change of a pixel is its expectation
//! (J31).

use super::energy::{Energy, FringeRows};
use super::params::albedo::{CANDIDATES, EXPONENT_MAX, ROWS};
use super::scene::Scene;
use crate::parallel::angle::sin_cos;
use crate::parallel::exp::exp;
use crate::parallel::lanes::{LANES, Lanes, lanes, lanes_mut, put, take};
use crate::parallel::slots::Slots;
use multiversion::multiversion;
use rayon::prelude::*;

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
    pub ratios: [f32; 3],
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

/// One row of pixels, R, G, B, IR.
#[derive(Debug, Default)]
struct Row {
    albedo: [Vec<f32>; 4],
    /// The light that the albedo of the cells predicts; 0 where the pixel takes no part.
    signal: [Vec<f32>; 4],
    /// Light less the prediction.
    rest: [Vec<f32>; 4],
}

/// Sums that determine the variance of the texture in a block of `ROWS` rows and as many columns as a vector has.
#[derive(Debug, Default, Clone, Copy)]
struct Texture {
    /// Squared correlation of rest and signal, less that of noise.
    excess: f32,
    /// Squared power of the signal.
    power: f32,
}

impl Texture {
    fn variance(self) -> f32 {
        if self.power > 0.0 { (self.excess / self.power).max(0.0) } else { 0.0 }
    }
}

impl Albedo {
    /// Writes the albedo of the pixels, four channels side by side; NaN where there is no phase, or no cell of the energy.
    pub fn write(&self, scene: &Scene<'_>, energy: &Energy, known: Known<'_>, out: &mut [f32]) {
        let width = scene.grid.width;
        out.par_chunks_mut(4 * width * ROWS).enumerate().for_each_init(
            || self.slots.take(),
            |work, (block, out)| {
                let first = block * ROWS;
                let rows = out.len() / (4 * width);
                let Work { fringes, rows: all, .. } = &mut **work;
                for (row, y) in all[..rows].iter_mut().zip(first..) {
                    row.predict(scene, y, energy.fringes(scene, y, fringes), known);
                }
                work.refine(rows, known.noise * known.noise);
                for (y, out) in out.chunks_exact_mut(4 * width).enumerate() {
                    let valid = scene.row(known.valid, first + y);
                    work.rows[y].write(valid, out);
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
        let [first, green, infrared] = known.ratios;
        let contrast = fringes.contrast.each_ref().map(Vec::as_slice);
        let pixels =
            Pixels { phase: scene.row(known.phase, y), usable: scene.row(scene.usable, y), contrast };
        let waves = signal.each_mut().map(Vec::as_mut_slice);
        modulate(&pixels, [first, green, first, infrared], waves);
        let waves = signal.each_ref().map(Vec::as_slice);
        choose(scene.rows(y), waves, fringes, known.noise * known.noise, albedo);
        for (c, light) in scene.rows(y).into_iter().enumerate() {
            predict_row(light, pixels.usable, &albedo[c], [&mut signal[c], &mut rest[c]]);
        }
    }

    fn write(&self, valid: &[u8], out: &mut [f32]) {
        let [red, green, blue, infrared] = &self.albedo;
        for (x, out) in out.chunks_exact_mut(4).enumerate() {
            let known = valid[x] != 0 && red[x] > 0.0;
            let pixel = [red[x], green[x], blue[x], infrared[x]];
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

/// Writes the light of albedo 1 in four channels; the fringes of B are a quarter period ahead.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2+fma"))]
fn modulate(pixels: &Pixels, ratios: [f32; 4], out: [&mut [f32]; 4]) {
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

/// Moves the albedo of pixels at an edge to that of the cells on their side: to the mean of the cells around, weighted by the
/// probability of the light of the pixel if it had their albedo (J30). `noise` is the variance of the intensity.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2+fma"))]
fn choose(
    light: [&[f32]; 4],
    waves: [&[f32]; 4],
    fringes: &FringeRows,
    noise: f32,
    albedo: &mut [Vec<f32>; 4],
) {
    let scale = 0.5 / noise;
    for at in 0..waves[0].len() / LANES {
        let [light, waves] = [light.map(lanes), waves.map(lanes)].map(|rows| take(&rows, at));
        let candidate = |k: usize| -> [Lanes; 4] {
            let from = at * LANES + k % 3 * fringes.cell_px;
            let rows = &fringes.cells[k / 3];
            std::array::from_fn(|c| *rows[c][from..].first_chunk().expect("the row is longer than the image"))
        };
        let mut misfits = [[0.0; LANES]; CANDIDATES];
        let mut least = [f32::MAX; LANES];
        for (k, misfit) in misfits.iter_mut().enumerate() {
            let albedo = candidate(k);
            for c in 0..4 {
                for x in 0..LANES {
                    let rest = light[c][x] - albedo[c][x] * waves[c][x];
                    misfit[x] += rest * rest;
                }
            }
            for x in 0..LANES {
                misfit[x] = if albedo[0][x] > 0.0 { scale * misfit[x] } else { f32::MAX };
                least[x] = if misfit[x] < least[x] { misfit[x] } else { least[x] };
            }
        }
        let (mut sums, mut weights) = ([[0.0; LANES]; 4], [0.0; LANES]);
        for (k, misfit) in misfits.iter().enumerate() {
            let albedo = candidate(k);
            for x in 0..LANES {
                let weight =
                    if misfit[x] < f32::MAX { exp((least[x] - misfit[x]).max(-EXPONENT_MAX)) } else { 0.0 };
                weights[x] += weight;
                for c in 0..4 {
                    sums[c][x] += weight * albedo[c][x];
                }
            }
        }
        for c in 0..4 {
            let out = &mut lanes_mut(&mut albedo[c])[at];
            for x in 0..LANES {
                out[x] = if (weights[x] > 0.0) & (out[x] > 0.0) { sums[c][x] / weights[x] } else { out[x] };
            }
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

/// Correlation of rest and signal over the four channels, and power of the signal.
#[inline(always)]
fn correlation(row: &Row, at: usize) -> [Lanes; 2] {
    let [mut cross, mut power] = [[0.0; LANES]; 2];
    for c in 0..4 {
        let [signal, rest] = take(&[lanes(&row.signal[c]), lanes(&row.rest[c])], at);
        for x in 0..LANES {
            cross[x] += signal[x] * rest[x];
            power[x] += signal[x] * signal[x];
        }
    }
    [cross, power]
}

/// Adds what a row tells of the texture that the channels have in common.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2+fma"))]
fn add_common(row: &Row, noise: f32, blocks: &mut [Texture]) {
    for (at, block) in blocks.iter_mut().enumerate() {
        let [cross, power] = correlation(row, at);
        for x in 0..LANES {
            block.excess += cross[x] * cross[x] - noise * power[x];
            block.power += power[x] * power[x];
        }
    }
}

/// Moves the expected common texture of a row from the rest to the albedo.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2+fma"))]
fn take_common(row: &mut Row, noise: f32, blocks: &[Texture]) {
    for (at, block) in blocks.iter().enumerate() {
        let ([cross, power], variance) = (correlation(row, at), block.variance());
        let mut change = [0.0; LANES];
        for x in 0..LANES {
            change[x] = variance * cross[x] / (noise + variance * power[x]);
        }
        for c in 0..4 {
            let signal = lanes(&row.signal[c])[at];
            let (rest, albedo) =
                (&mut lanes_mut(&mut row.rest[c])[at], &mut lanes_mut(&mut row.albedo[c])[at]);
            for x in 0..LANES {
                rest[x] -= change[x] * signal[x];
                albedo[x] *= 1.0 + change[x];
            }
        }
    }
}

/// Adds what a row tells of the texture of single channels.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2+fma"))]
fn add_single(row: &Row, noise: f32, blocks: &mut [Texture]) {
    for c in 0..4 {
        let rows = [lanes(&row.signal[c]), lanes(&row.rest[c])];
        for (at, block) in blocks.iter_mut().enumerate() {
            let [signal, rest] = take(&rows, at);
            for x in 0..LANES {
                let (cross, power) = (signal[x] * rest[x], signal[x] * signal[x]);
                block.excess += cross * cross - noise * power;
                block.power += power * power;
            }
        }
    }
}

/// Adds the expected texture of single channels to the albedo of a row.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2+fma"))]
fn take_single(row: &mut Row, noise: f32, blocks: &[Texture]) {
    for c in 0..4 {
        let rows = [lanes(&row.signal[c]), lanes(&row.rest[c])];
        for (at, (albedo, block)) in lanes_mut(&mut row.albedo[c]).iter_mut().zip(blocks).enumerate() {
            let ([signal, rest], variance) = (take(&rows, at), block.variance());
            for x in 0..LANES {
                let change = variance * signal[x] * rest[x] / (noise + variance * signal[x] * signal[x]);
                albedo[x] *= 1.0 + change;
            }
        }
    }
}
