//! The start: contrast and albedo that explain the light with the phase as it is.

use super::data::{Line, Turns};
use super::plane::{Plane, STRIDE, total, vectors};
use super::tile::Tile;
use crate::joint::model::{count, weights};
use crate::joint::params::energy::{ALBEDO_LIMITS, CONTRAST_START_LIMITS, START_ROUNDS};
use crate::parallel::angle::sin_cos;
use crate::parallel::exp::{exp, ln};
use crate::parallel::lanes::{LANES, Lanes};
use multiversion::multiversion;

/// Estimates, for each channel, the contrast of the light in the tile and the albedo of every cell, alternating. The cells around a
/// cell determine the `share` of its albedo: the larger, the less errors of the phase matter, and the less sharp the edges are.
pub(super) fn contrast_and_albedo(tile: &mut Tile, share: f32) {
    tile.scales.channel_contrast = [1.0; 4];
    let mut contrast = [1.0; 4];
    let present = weights(tile.ratios);
    for c in 0..4 {
        if present[c] == 0.0 {
            tile.unknown.albedo[c].clear();
            continue;
        }
        if c == 3 && tile.pair {
            carrier(tile, c, |tile, at| Line::at(&tile.infrared, at));
        } else {
            let ratio = tile.ratios[c];
            carrier(tile, c, |_, _| ratio);
        }
        for round in 0..START_ROUNDS {
            contrast[c] = contrast_of(tile, c, round == 0);
            albedo(tile, c, contrast[c], share);
        }
    }
    // The logarithm of the contrast of a channel that is absent is 0.
    let mean = contrast.iter().map(|value| value.ln()).sum::<f32>() / count(tile.ratios);
    tile.scales.channel_contrast = contrast.map(|value| value / mean.exp());
    for at in vectors() {
        tile.unknown.contrast.set(at, tile.inside.get(at).map(|inside| inside * mean));
    }
}

/// Writes the carrier of a channel into a working plane.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2+fma"))]
fn carrier<T: Turns, F: Fn(&Tile, usize) -> T>(tile: &mut Tile, channel: usize, turns: F) {
    for at in vectors() {
        let (phase, turns) = (tile.unknown.phase.get(at), turns(tile, at));
        let mut out = [0.0; LANES];
        for x in 0..LANES {
            let (sine, cosine) = sin_cos(turns.angle(x, phase[x]));
            out[x] = if channel == 2 { -sine } else { cosine };
        }
        tile.product.phase.set(at, out);
    }
}

/// Contrast of the light of a channel by least squares over the tile, with an albedo of 1 or with that found before.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2+fma"))]
fn contrast_of(tile: &Tile, channel: usize, even: bool) -> f32 {
    let mut sums = [0.0; 5];
    for at in vectors() {
        let (light, usable) = (tile.light[channel].get(at), tile.usable.get(at));
        let (carrier, log) = (tile.product.phase.get(at), tile.unknown.albedo[channel].get(at));
        let mut terms = [[0.0; LANES]; 5];
        for x in 0..LANES {
            let albedo = usable[x] * if even { 1.0 } else { exp(log[x]) };
            let fringe = albedo * carrier[x];
            terms[0][x] = albedo * albedo;
            terms[1][x] = albedo * fringe;
            terms[2][x] = fringe * fringe;
            terms[3][x] = albedo * light[x];
            terms[4][x] = fringe * light[x];
        }
        sums.iter_mut().zip(terms).for_each(|(sum, terms)| *sum += total(terms));
    }
    let [ss, sc, cc, sy, cy] = sums;
    let ratio = (ss * cy - sc * sy) / (cc * sy - sc * cy).max(1e-12);
    (ratio as f32).clamp(CONTRAST_START_LIMITS[0], CONTRAST_START_LIMITS[1])
}

/// Logarithm of the albedo by least squares over a cell, and with the weight `share` over the cells around it.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2+fma"))]
fn albedo(tile: &mut Tile, channel: usize, contrast: f32, share: f32) {
    let Tile { light, usable, inside, unknown, product, .. } = tile;
    let [carrier, numerator, denominator, around, spare, _] = product.planes_mut();
    for at in vectors() {
        let (light, usable, carrier) = (light[channel].get(at), usable.get(at), carrier.get(at));
        let (mut over, mut under) = ([0.0; LANES], [0.0; LANES]);
        for x in 0..LANES {
            let model = usable[x] * (1.0 + contrast * carrier[x]);
            (over[x], under[x]) = (model * light[x], model * model);
        }
        numerator.set(at, over);
        denominator.set(at, under);
    }
    for sums in [&mut *numerator, &mut *denominator] {
        around.copy(sums);
        smooth(around, spare);
        mix(sums, around, share);
    }
    for at in vectors() {
        let (over, under, inside) = (numerator.get(at), denominator.get(at), inside.get(at));
        let mut out = [0.0; LANES];
        for x in 0..LANES {
            let albedo = over[x] / (under[x] + 1e-3);
            out[x] = inside[x] * ln(albedo.clamp(ALBEDO_LIMITS[0], ALBEDO_LIMITS[1]));
        }
        unknown.albedo[channel].set(at, out);
    }
}

/// Replaces the `share` of a plane by that of another.
#[inline(always)]
fn mix(plane: &mut Plane, other: &Plane, share: f32) {
    for at in vectors() {
        let (mut out, other) = (plane.get(at), other.get(at));
        for x in 0..LANES {
            out[x] += share * (other[x] - out[x]);
        }
        plane.set(at, out);
    }
}

/// Averages a plane with the weights [1 4 6 4 1] / 16 in both directions.
#[inline(always)]
pub(super) fn smooth(plane: &mut Plane, spare: &mut Plane) {
    filter(plane, spare, [1.0 / 16.0, 1.0 / 4.0, 3.0 / 8.0]);
}

/// Sums five neighbours in both directions, with weights for the outer ones, the next ones and the middle.
#[inline(always)]
pub(super) fn filter(plane: &mut Plane, spare: &mut Plane, [outer, next, middle]: [f32; 3]) {
    let five = |from: &Plane, at: usize, step: usize| -> Lanes {
        let taps = [at - 2 * step, at - step, at, at + step, at + 2 * step].map(|at| from.get(at));
        let mut out = [0.0; LANES];
        for x in 0..LANES {
            out[x] =
                (taps[0][x] + taps[4][x]) * outer + (taps[1][x] + taps[3][x]) * next + taps[2][x] * middle;
        }
        out
    };
    for at in vectors() {
        spare.set(at, five(plane, at, 1));
    }
    for at in vectors() {
        plane.set(at, five(spare, at, STRIDE));
    }
}
