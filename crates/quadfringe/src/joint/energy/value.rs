//! The energy of every cell (J16): the data, and the priors of the differences that begin at the cell.

use super::exp::{exp, ln_1p};
use super::plane::{Column, Fields, Plane, STRIDE, vectors};
use super::scales::Scales;
use super::tile::Tile;
use crate::joint::params::energy::{BEND_FREEDOM, BRIGHTNESS_FREEDOM, COLOUR_FREEDOM, CONTRAST_FREEDOM};
use crate::parallel::angle::sin_cos;
use crate::parallel::lanes::{LANES, Lanes};
use multiversion::multiversion;

/// Adds `sign` times the energy of the cells of a tile for the given unknowns and scales.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2+fma"))]
pub(super) fn add_energy(sign: f32, tile: &Tile, unknown: &Fields, scales: &Scales, out: &mut Plane) {
    for at in vectors() {
        let here = Column::of(unknown, at);
        let (data, bend) =
            (data(tile, &here, scales, at), bend(&tile.inside, &unknown.phase, scales.bend, at));
        let mut sum = [0.0; LANES];
        for x in 0..LANES {
            sum[x] = data[x] + bend[x];
        }
        for there in [at + 1, at + STRIDE] {
            let lit = [tile.inside.get(at), tile.inside.get(there)];
            differences(lit, &here, &Column::of(unknown, there), scales, &mut sum);
        }
        let mut all = out.get(at);
        for x in 0..LANES {
            all[x] += sign * sum[x];
        }
        out.set(at, all);
    }
}

/// Half the squared residuals over the variance of the noise.
#[inline(always)]
fn data(tile: &Tile, here: &Column, scales: &Scales, at: usize) -> Lanes {
    let (usable, half) = (tile.usable.get(at), 0.5 / scales.noise);
    let mut out = [0.0; LANES];
    for c in 0..4 {
        let ratio = [tile.ratios[0], tile.ratios[1], tile.ratios[0], tile.ratios[2]][c];
        let light = tile.light[c].get(at);
        for x in 0..LANES {
            let (sine, cosine) = sin_cos(ratio * here.phase[x]);
            let carrier = if c == 2 { -sine } else { cosine };
            let fringe = exp(here.contrast[x]) * scales.channel_contrast[c] * carrier;
            let rest = light[x] - exp(here.albedo[c][x]) * (1.0 + fringe);
            out[x] += usable[x] * half * rest * rest;
        }
    }
    out
}

/// Negative logarithm of the density of Student's t, without its constant, for `count` variables.
#[inline(always)]
fn student(freedom: f32, count: f32, square: f32) -> f32 {
    0.5 * (freedom + count) * ln_1p(square / freedom)
}

#[inline(always)]
fn bend(inside: &Plane, phase: &Plane, variance: f32, at: usize) -> Lanes {
    let p = [at - 1, at, at + 1, at - STRIDE, at + STRIDE, at + STRIDE + 1].map(|at| phase.get(at));
    let lit = [at - 1, at, at + 1, at - STRIDE, at + STRIDE, at + STRIDE + 1].map(|at| inside.get(at));
    let ([left, middle, right, above, below, corner], inverse) = (p, 1.0 / variance);
    let mut out = [0.0; LANES];
    for x in 0..LANES {
        let along = lit[0][x] * lit[1][x] * lit[2][x];
        let down = lit[1][x] * lit[3][x] * lit[4][x];
        let mixed = lit[1][x] * lit[2][x] * lit[4][x] * lit[5][x];
        let xx = along * (left[x] - 2.0 * middle[x] + right[x]);
        let yy = down * (above[x] - 2.0 * middle[x] + below[x]);
        let xy = mixed * (middle[x] - right[x] - below[x] + corner[x]);
        let count = (along + down + mixed) * (1.0 / 3.0);
        out[x] = student(BEND_FREEDOM, count, (xx * xx + yy * yy + 2.0 * xy * xy) * inverse);
    }
    out
}

/// Adds the priors of the differences between two neighbours in brightness, colour and contrast.
#[inline(always)]
fn differences(lit: [Lanes; 2], here: &Column, there: &Column, scales: &Scales, out: &mut Lanes) {
    let inverse = [1.0 / scales.brightness, 1.0 / scales.colour, 1.0 / scales.contrast];
    for x in 0..LANES {
        let (mut sum, mut squares) = (0.0, 0.0);
        for c in 0..4 {
            let difference = there.albedo[c][x] - here.albedo[c][x];
            sum += difference;
            squares += difference * difference;
        }
        let turn = there.contrast[x] - here.contrast[x];
        let brightness = 0.25 * sum * sum;
        let colour = squares - brightness;
        let colour = if colour > 0.0 { colour } else { 0.0 };
        out[x] += lit[0][x]
            * lit[1][x]
            * (student(BRIGHTNESS_FREEDOM, 0.5, brightness * inverse[0])
                + student(COLOUR_FREEDOM, 1.5, colour * inverse[1])
                + student(CONTRAST_FREEDOM, 0.5, turn * turn * inverse[2]));
    }
}
