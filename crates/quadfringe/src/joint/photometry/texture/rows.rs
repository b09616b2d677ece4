//! Loops over one row of pixels.

use crate::joint::model::carriers;
use crate::joint::params::photometry::{ALBEDO_ERROR, ALBEDO_EXCESS, ALBEDO_EXPECTED};
use crate::parallel::lanes::{LANES, lanes, lanes_mut, put, take};
use multiversion::multiversion;

/// Share of the variance of noise that remains after the mean over nine pixels by [`binomial`](crate::joint::neighbours::binomial).
const MEAN_OF_NINE: f32 = 9.0 / 64.0;
/// Number of levels up to an albedo of 1; the greatest albedo is 2. The noise of a mean is much larger than a level.
pub(super) const LEVELS: f32 = 32768.0;

/// For each channel, light times its model for an albedo of 1, and the square of the model; 0 for unlit pixels.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
pub(super) fn project(
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
pub(super) fn divide((on, noise): (f32, f32), [product, square]: [&mut [f32]; 2]) {
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
pub(super) fn apply(albedos: [&[u16]; 4], rows: [&mut [f32]; 8]) {
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
pub(super) fn average(
    taps: &[(usize, f32)],
    pixel: usize,
    (ring, wide): (&[f32], usize),
    out: [&mut [u16]; 4],
) {
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
