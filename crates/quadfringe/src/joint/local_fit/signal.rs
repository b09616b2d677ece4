//! Step 3: the signals that the carrier is fitted to: R, or the ratio of R and B (J40).

use super::normal::Normal;
use crate::joint::params::local_fit::TINT_STEP_MAX;
use crate::joint::scene::Scene;
use crate::parallel::lanes::{LANES, Lanes, add, lanes, lanes_mut, put, take};
use multiversion::multiversion;
use std::f32::consts::FRAC_1_SQRT_2;

/// What is fitted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Signal {
    /// The light of R.
    Red,
    /// `(R - g B) / (R + g B)`, with the ratio `g` of the albedos of both.
    Ratio,
}

/// Sums of one cell, of the weight `w` times products of `c` and `s`, cosine and sine of the wave, and of the signal.
pub(super) mod sum {
    pub use crate::joint::local_fit::normal::wave_sum::{C, CC, CS, S, W};
    /// The signal, the signal times `c` and times `s`, and its square.
    pub const SIGNAL: usize = crate::joint::local_fit::normal::wave_sum::COUNT;
    pub const SQUARE: usize = SIGNAL + 3;
    /// `R + g B`.
    pub const TOTAL: usize = SIGNAL + 4;
    pub const COUNT: usize = SIGNAL + 5;
}

/// Maps of a fit: the coefficients of cosine and sine; of a ratio also `g`, the contrast over the square root of 2, the mean
/// of `R + g B`, and the variance of such fringes over that of the ratio.
pub(super) mod fit {
    pub const P: usize = 0;
    pub const RATIO: usize = 2;
    /// The maps of a fit that others follow.
    pub const FOLLOWED: usize = 3;
    pub const PURITY: usize = 5;
    pub const COUNT: usize = 6;
}

/// `g` along a row.
#[derive(Clone, Copy)]
pub(super) enum Gain<'a> {
    Everywhere(f32),
    Row(&'a [f32]),
}

/// Turns R in place into the ratio, and writes `R + g B`.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
pub(super) fn ratio(gain: Gain, blue: &[f32], signal: &mut [f32], total: &mut [f32]) {
    let (blue, mut out) = (lanes(blue), [lanes_mut(signal), lanes_mut(total)]);
    for i in 0..out[0].len() {
        let gain = match gain {
            Gain::Everywhere(gain) => [gain; LANES],
            Gain::Row(row) => lanes(row)[i],
        };
        let (red, blue) = (out[0][i], blue[i]);
        let mut found = [[0.0; LANES]; 2];
        for x in 0..LANES {
            let blue = gain[x] * blue[x];
            let sum = red[x] + blue;
            (found[0][x], found[1][x]) =
                (((red[x] - blue) / if sum > 1e-6 { sum } else { 1e-6 }).clamp(-1.0, 1.0), sum);
        }
        put(&mut out, i, &found);
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
pub(super) fn add_signal(
    usable: &[f32],
    wave: [&[f32]; 2],
    [signal, total]: [&[f32]; 2],
    sums: &mut [[Lanes; sum::COUNT]],
) {
    let rows = [usable, wave[0], wave[1], signal, total].map(lanes);
    for (i, sums) in sums.iter_mut().enumerate() {
        let [w, cos, sin, signal, total] = take(&rows, i);
        let mut terms = [w; sum::COUNT];
        for x in 0..LANES {
            let (c, s) = (w[x] * cos[x], w[x] * sin[x]);
            (terms[sum::C][x], terms[sum::S][x]) = (c, s);
            (terms[sum::CC][x], terms[sum::CS][x]) = (c * cos[x], c * sin[x]);
            terms[sum::SIGNAL][x] = w[x] * signal[x];
            (terms[sum::SIGNAL + 1][x], terms[sum::SIGNAL + 2][x]) = (c * signal[x], s * signal[x]);
            terms[sum::SQUARE][x] = w[x] * signal[x] * signal[x];
            terms[sum::TOTAL][x] = w[x] * total[x];
        }
        add(sums, &terms);
    }
}

/// The maps of a row of cells from their sums; `gain` is the `g` of the signal.
pub(super) fn solve_row(sums: [&[f32]; sum::COUNT], gain: impl Fn(usize) -> f32, out: &mut [f32]) {
    let columns = sums[0].len();
    for i in 0..columns {
        let normal = Normal::new([sum::W, sum::C, sum::S, sum::CC, sum::CS].map(|k| sums[k][i]));
        let [offset, p, q] = normal.solve([0, 1, 2].map(|k| sums[sum::SIGNAL + k][i]));
        let offset = offset.clamp(-TINT_STEP_MAX, TINT_STEP_MAX);
        // The harmonic n of e sin(x) / (1 + e cos(x)) has an amplitude of 2 t^n, with e = 2 t / (1 + t^2).
        let squared = 0.25 * (p * p + q * q);
        let depth = (2.0 * squared.sqrt() / (1.0 + squared)).min(FRAC_1_SQRT_2);
        let [signal, square, total] =
            [sum::SIGNAL, sum::SQUARE, sum::TOTAL].map(|k| sums[k][i] / sums[sum::W][i].max(1e-6));
        let variance = (square - signal * signal).max(1e-6);
        let purity = 2.0 * squared / (1.0 - squared).max(0.1) / variance;
        let found = [p, q, gain(i) * (1.0 + offset) / (1.0 - offset), depth, total, purity];
        out.chunks_exact_mut(columns).zip(found).for_each(|(line, value)| line[i] = value);
    }
}

/// `R + g B` over its mean and over what the fringes make of it.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
pub(super) fn albedo(maps: [&[f32]; 3], phasor: [&[f32]; 2], light: [&[f32]; 4], out: &mut [f32]) {
    let rows = [maps[0], maps[1], maps[2], phasor[0], phasor[1], light[0], light[2]].map(lanes);
    for (i, out) in lanes_mut(out).iter_mut().enumerate() {
        let [gain, depth, mean, cos, sin, red, blue] = take(&rows, i);
        for x in 0..LANES {
            let fringe = 1.0 + depth[x] * FRAC_1_SQRT_2 * (cos[x] - sin[x]);
            let albedo = (red[x] + gain[x] * blue[x]) / (mean[x] * fringe + 1e-6);
            let albedo = if albedo > 1e-3 { albedo } else { 1e-3 };
            out[x] = if albedo < 1e3 { albedo } else { 1e3 };
        }
    }
}

/// Ratio of the light of R to that of B; 1 without light.
pub(super) fn gain(scene: &Scene<'_>) -> f32 {
    let sum =
        |plane: &[f32]| plane.iter().zip(scene.usable).map(|(light, usable)| light * usable).sum::<f32>();
    let [red, _, blue, _] = scene.light;
    (sum(red) + 1e-6) / (sum(blue) + 1e-6)
}

/// Unit vector across the fringes, along a row and along a column, in the direction in which the phase grows. Of R and B in
/// quadrature, the sum of `B dR - R dB` over whole fringes goes with the change of the phase, whatever albedo they share.
pub(super) fn direction_in_quadrature(scene: &Scene<'_>) -> [f32; 2] {
    let (grid, [red, _, blue, _]) = (scene.grid, scene.light);
    let mut sums = [0.0f64; 2];
    for y in 1..grid.height.saturating_sub(1) {
        for x in 1..grid.width.saturating_sub(1) {
            let i = y * grid.stride + x;
            for (sum, step) in sums.iter_mut().zip([1, grid.stride]) {
                let usable = scene.usable[i - step] * scene.usable[i] * scene.usable[i + step];
                let (red_change, blue_change) =
                    (red[i + step] - red[i - step], blue[i + step] - blue[i - step]);
                *sum += f64::from(usable * (red_change * blue[i] - red[i] * blue_change));
            }
        }
    }
    let length = sums[0].hypot(sums[1]).max(f64::MIN_POSITIVE);
    sums.map(|sum| (sum / length) as f32)
}

/// Unit vector across the fringes, along a row and along a column, in the half-plane in which the phase grows along a row: the
/// principal axis of the gradients of R less G, in which the outline of objects and their albedo nearly cancel.
pub(super) fn direction(scene: &Scene<'_>) -> [f32; 2] {
    let grid = scene.grid;
    let [red, green, ..] = scene.light;
    let step = ((scene.period_px / 8.0).round() as usize).max(1);
    let sum = |plane: &[f32]| plane.iter().sum::<f32>();
    let gain = sum(red) / sum(green).max(f32::MIN_POSITIVE);
    let at = |i: usize| red[i] - gain * green[i];
    let [mut xx, mut xy, mut yy] = [0.0f64; 3];
    for y in step..grid.height.saturating_sub(step) {
        for x in step..grid.width.saturating_sub(step) {
            let i = y * grid.stride + x;
            let across = f64::from(at(i + step) - at(i - step));
            let down = f64::from(at(i + step * grid.stride) - at(i - step * grid.stride));
            (xx, xy, yy) = (xx + across * across, xy + across * down, yy + down * down);
        }
    }
    let (sine, cosine) = (0.5 * (2.0 * xy).atan2(xx - yy)).sin_cos();
    [cosine as f32, sine as f32]
}
