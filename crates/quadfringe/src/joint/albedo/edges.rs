//! The albedo of pixels at an edge (J30).

use crate::joint::energy::FringeRows;
use crate::joint::params::albedo::{CANDIDATES, EXPONENT_MAX};
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

/// Albedo of candidate `k` for the pixels from `at` on: 3 x 3 cells, row by row.
#[inline(always)]
fn candidate(fringes: &FringeRows, at: usize, k: usize) -> [Lanes; 4] {
    let from = at + k % 3 * fringes.cell_px;
    let rows = &fringes.cells[k / 3];
    std::array::from_fn(|c| *rows[c][from..].first_chunk().expect("the row is longer than the image"))
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
        let albedo = candidate(fringes, at, k);
        for c in 0..4 {
            for x in 0..LANES {
                let rest = light[c][x] - albedo[c][x] * waves[c][x];
                misfit[x] += scale * rest * rest;
            }
        }
        for x in 0..LANES {
            misfit[x] = if albedo[0][x] > 0.0 { misfit[x] } else { f32::MAX };
            least[x] = if misfit[x] < least[x] { misfit[x] } else { least[x] };
        }
    }
    for misfit in &mut found {
        for x in 0..LANES {
            let weight = exp((least[x] - misfit[x]).max(-EXPONENT_MAX));
            misfit[x] = if misfit[x] < f32::MAX { weight } else { 0.0 };
        }
    }
    found
}

/// Weighted mean of the candidates; 0 where none is lit.
#[inline(always)]
fn mean_of_candidates(fringes: &FringeRows, at: usize, weights: &[Lanes; CANDIDATES]) -> [Lanes; 4] {
    let (mut sums, mut total) = ([[0.0; LANES]; 4], [1e-30; LANES]);
    for (k, weight) in weights.iter().enumerate() {
        let albedo = candidate(fringes, at, k);
        for x in 0..LANES {
            total[x] += weight[x];
        }
        for c in 0..4 {
            for x in 0..LANES {
                sums[c][x] += weight[x] * albedo[c][x];
            }
        }
    }
    for sum in &mut sums {
        for x in 0..LANES {
            sum[x] /= total[x];
        }
    }
    sums
}
