//! The albedo of pixels at an edge (J30).

use crate::joint::energy::FringeRows;
use crate::joint::params::albedo::CANDIDATES;
use crate::joint::params::uncertainty::EXPONENT_MAX;
use crate::parallel::exp::exp;
use crate::parallel::lanes::{LANES, Lanes, lanes, lanes_mut, take};
use multiversion::multiversion;

/// Moves the albedo of pixels at an edge to that of the cells on their side: to the mean of the cells around, weighted by the
/// probability of the light of the pixel if it had their albedo (J30). `waves` is the light of albedo 1, and `noise` the variance of
/// the intensity.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2+fma"))]
pub(super) fn choose(
    light: [&[f32]; 4],
    waves: [&[f32]; 4],
    fringes: &FringeRows,
    noise: f32,
    albedo: &mut [Vec<f32>; 4],
) {
    for at in 0..waves[0].len() / LANES {
        let [light, waves] = [light.map(lanes), waves.map(lanes)].map(|rows| take(&rows, at));
        let mean =
            mean_of_candidates(fringes, at * LANES, &weights(fringes, at * LANES, &light, &waves, noise));
        for (row, mean) in albedo.iter_mut().zip(mean) {
            let out = &mut lanes_mut(row)[at];
            for x in 0..LANES {
                // Far from all cells there is none.
                out[x] = if (out[x] > 0.0) & (mean[x] > 0.0) { mean[x] } else { out[x] };
            }
        }
    }
}

/// Albedo in channel `c` of candidate `k`, one of 3 x 3 cells row by row, for the pixels from `at` on.
#[inline(always)]
fn candidate(fringes: &FringeRows, at: usize, k: usize, c: usize) -> Lanes {
    let from = at + k % 3 * fringes.cell_px;
    *fringes.cells[k / 3][c][from..].first_chunk().expect("the row is longer than the image")
}

/// Squared distance of the light from that of an albedo.
#[inline(always)]
fn squared(light: Lanes, albedo: Lanes, waves: Lanes) -> Lanes {
    let mut found = [0.0; LANES];
    for x in 0..LANES {
        let rest = light[x] - albedo[x] * waves[x];
        found[x] = rest * rest;
    }
    found
}

/// Probabilities of the light with the albedo of each candidate, relative to the best one; 0 for cells that are not lit.
#[inline(always)]
fn weights(
    fringes: &FringeRows,
    at: usize,
    light: &[Lanes; 4],
    waves: &[Lanes; 4],
    noise: f32,
) -> [Lanes; CANDIDATES] {
    let scale = 0.5 / noise;
    let mut found = [[0.0; LANES]; CANDIDATES];
    let mut least = [f32::MAX; LANES];
    for (k, misfit) in found.iter_mut().enumerate() {
        let red = candidate(fringes, at, k, 0);
        let [a, b] =
            [squared(light[0], red, waves[0]), squared(light[1], candidate(fringes, at, k, 1), waves[1])];
        let c = squared(light[2], candidate(fringes, at, k, 2), waves[2]);
        let d = squared(light[3], candidate(fringes, at, k, 3), waves[3]);
        for x in 0..LANES {
            let sum = scale * (a[x] + b[x] + c[x] + d[x]);
            misfit[x] = if red[x] > 0.0 { sum } else { f32::MAX };
            least[x] = if misfit[x] < least[x] { misfit[x] } else { least[x] };
        }
    }
    for misfit in &mut found {
        for x in 0..LANES {
            let exponent = least[x] - misfit[x];
            let weight = exp(if exponent > -EXPONENT_MAX { exponent } else { -EXPONENT_MAX });
            misfit[x] = if misfit[x] < f32::MAX { weight } else { 0.0 };
        }
    }
    found
}

/// Weighted mean of the candidates; 0 where none is lit.
#[inline(always)]
fn mean_of_candidates(fringes: &FringeRows, at: usize, weights: &[Lanes; CANDIDATES]) -> [Lanes; 4] {
    let mut total = [1e-30; LANES];
    for weight in weights {
        for x in 0..LANES {
            total[x] += weight[x];
        }
    }
    let mut means = [[0.0; LANES]; 4];
    for (c, mean) in means.iter_mut().enumerate() {
        // One channel after the other: with all of them at once, the compiler gathers single numbers.
        let mut sum = [0.0; LANES];
        for (k, weight) in weights.iter().enumerate() {
            let albedo = candidate(fringes, at, k, c);
            for x in 0..LANES {
                sum[x] += weight[x] * albedo[x];
            }
        }
        for x in 0..LANES {
            mean[x] = sum[x] / total[x];
        }
    }
    means
}
