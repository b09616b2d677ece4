//! Terms of the pixels in the normal equations, without the directions of albedo and phase.

use super::solve::{MATRIX, SUMS};
use crate::joint::infrared::Waves;
use crate::joint::model::{Wave, carriers, weights};
use crate::parallel::lanes::{LANES, Lanes, add, lanes, take};
use multiversion::multiversion;

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
pub(super) fn add_projected<W: Waves>(
    model: [&[f32]; 8],
    pixels: [&[f32]; 3],
    light: [&[f32]; 4],
    waves: W,
    limits: [f32; 2],
    sums: &mut [[Lanes; SUMS]],
) {
    let (model, pixels, light) = (model.map(lanes), pixels.map(lanes), light.map(lanes));
    for (i, sums) in sums.iter_mut().enumerate() {
        let (model, light) = (take(&model, i), take(&light, i));
        let [phase, modulation, usable] = take(&pixels, i);
        let (ratios, vector) = (waves.ratios(), waves.vector(i));
        let mut terms = [[0.0; LANES]; SUMS];
        for x in 0..LANES {
            let model: [f32; 8] = std::array::from_fn(|k| model[k][x]);
            let seen: [f32; 4] = std::array::from_fn(|c| light[c][x]);
            let pixel = [phase[x], modulation[x], usable[x]];
            let infrared = waves.infrared(&vector, x, phase[x]);
            let pixel_terms = project(model, pixel, seen, (ratios, infrared), limits);
            for k in 0..SUMS {
                terms[k][x] = pixel_terms[k];
            }
        }
        add(sums, &terms);
    }
}

/// Terms of one pixel in the normal equations. `trust` is the weight of the given phase relative to the information about it in
/// the light: the smaller it is, the more of an error of the phase is projected out (J12).
#[inline(always)]
fn project(
    model: [f32; 8],
    [phase, modulation, usable]: [f32; 3],
    seen: [f32; 4],
    (ratios, infrared): ([f32; 4], Wave),
    [misfit_max, trust]: [f32; 2],
) -> [f32; SUMS] {
    let (carriers, weights) = (carriers(phase, ratios, infrared), weights(ratios));
    let (mut m, mut d) = ([0.0f32; 4], [0.0f32; 4]);
    let (mut mm, mut md, mut dd, mut ms) = (1e-9f32, 0.0f32, 1e-9f32, 0.0f32);
    for c in 0..4 {
        let (a, b) = (model[2 * c], model[2 * c + 1]);
        (m[c], d[c]) = (a + b * carriers.cosine[c], b * carriers.derivative[c]);
        mm += m[c] * m[c];
        md += m[c] * d[c];
        dd += d[c] * d[c];
        ms += m[c] * seen[c];
    }
    dd += trust * mm;
    // Projection onto the part that neither m (albedo) nor d (phase) can explain.
    let determinant = mm * dd - md * md;
    let inverse = 1.0 / if determinant > 1e-12 { determinant } else { 1e-12 };
    let mut projector = [[0.0f32; 4]; 4];
    let mut rest = [0.0f32; 4];
    let mut misfit = 0.0f32;
    for c in 0..4 {
        let (along_m, along_d) = (dd * m[c] - md * d[c], mm * d[c] - md * m[c]);
        for k in 0..4 {
            let identity = if c == k { weights[c] } else { 0.0 };
            projector[c][k] = identity - (along_m * m[k] + along_d * d[k]) * inverse;
            rest[c] += projector[c][k] * seen[k];
        }
        misfit += rest[c] * seen[c];
    }
    let sound = (modulation > 0.0) & (misfit <= misfit_max * modulation * modulation);
    let weight = if sound { usable } else { 0.0 };
    let albedo = ms / mm;
    let (first, square) = (weight * albedo, weight * albedo * albedo);
    let mut terms = [0.0f32; SUMS];
    let mut at = 0;
    for c in 0..4 {
        for k in c..4 {
            let p = square * projector[c][k];
            let q = p * carriers.cosine[c];
            terms[at] = p;
            terms[at + 1] = p * carriers.cosine[k];
            // Products of a_c and b_c with a_k and b_k. The triangle below the diagonal is not stored.
            if k > c {
                terms[at + 2] = q;
                terms[at + 3] = q * carriers.cosine[k];
                at += 4;
            } else {
                terms[at + 2] = q * carriers.cosine[k];
                at += 3;
            }
        }
        terms[MATRIX + 2 * c] = first * rest[c];
        terms[MATRIX + 2 * c + 1] = first * rest[c] * carriers.cosine[c];
    }
    terms
}
