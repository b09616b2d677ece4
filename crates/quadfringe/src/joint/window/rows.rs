//! Loops of the window over one row of pixels.

use crate::joint::params::phase::{REACH_RAD, REACH_SIGMAS};
use crate::parallel::lanes::{LANES, Lanes, lanes, lanes_mut, put, take};
use multiversion::multiversion;
use std::f32::consts::TAU;

/// Turns mean squared residuals into the sharpness of [`Window::sharpen`](super::Window).
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
pub(super) fn sharpen(modulation: &[f32], noise: f32, squares: &mut [f32]) {
    for (square, &modulation) in squares.iter_mut().zip(modulation) {
        let light = if modulation > 1e-6 { modulation } else { 1e-6 };
        let missed = if *square > noise * noise { *square } else { noise * noise };
        let reach = REACH_SIGMAS * REACH_SIGMAS * missed / (light * light);
        let reach = if reach > REACH_RAD * REACH_RAD { reach } else { REACH_RAD * REACH_RAD };
        *square = 1.0 / if reach < TAU * TAU { reach } else { TAU * TAU };
    }
}

/// Weight of a neighbour whose phase differs by `d` from the phase that the slope predicts.
#[inline(always)]
fn fit(d: f32, sharpness: f32) -> f32 {
    let miss = 1.0 - d * d * sharpness;
    let fits = if miss > 0.0 { miss } else { 0.0 };
    fits * fits
}

/// Averages over neighbours, weighted by how well they fit. `there` holds phase, slope and normal equations at each of them. The
/// predicted phase difference of two pixels is the mean of their slopes times their distance, which is exact for a surface of
/// constant curvature.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
pub(super) fn average_neighbours(
    taps: &[[f32; 2]],
    there: &[[&[f32]; 4]],
    here: [&[f32]; 3],
    out: [&mut [f32]; 2],
) {
    let here = here.map(lanes);
    let mut out = out.map(lanes_mut);
    for i in 0..here[0].len() {
        let [phase, slope, sharpness] = take(&here, i);
        let mut sums = [[0.0; LANES]; 2];
        for (&[half, near], there) in taps.iter().zip(there) {
            let [other, other_slope, numerator, denominator]: [&Lanes; 4] = there.map(|row| &lanes(row)[i]);
            for x in 0..LANES {
                let d = other[x] - phase[x] - (slope[x] + other_slope[x]) * half;
                let weight = near * fit(d, sharpness[x]);
                let known = weight * denominator[x];
                sums[0][x] += weight * numerator[x] + known * d;
                sums[1][x] += known;
            }
        }
        let mut found = [phase, sums[1]];
        for x in 0..LANES {
            found[0][x] += sums[0][x] / if sums[1][x] > 1e-20 { sums[1][x] } else { 1e-20 };
        }
        put(&mut out, i, &found);
    }
}
