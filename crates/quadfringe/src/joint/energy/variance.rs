//! Variance of the phase at the minimum (U13), (U14), (U17), (U18), (U19).

use super::bias::{Minimum, Work, bias};
use super::blocks::{bend_stiffness, phase_information};
use super::disagreement::disagreement;
use super::plane::{Fields, Plane, vectors};
use super::scales::variance_share;
use super::start::smooth;
use super::tile::Tile;
use crate::joint::params::uncertainty::{
    CELL_INFORMATION_MIN, CORRECTION_LEFT, CORRECTION_LEFT_COMPARED, EXCESS_LEFT,
};
use crate::parallel::lanes::LANES;
use multiversion::multiversion;

/// Writes the variance of the phase of every cell, rad^2; `noise` is that of the intensity of a cell. Changes the product and the direction.
pub(super) fn variance(tile: &mut Tile, noise: f32, out: &mut Plane) {
    disagreement(tile, out);
    add_variance(tile, noise, out);
}

/// Share of the squared correction that counts as variance.
fn correction_left(tile: &Tile) -> f32 {
    if tile.compared { CORRECTION_LEFT_COMPARED } else { CORRECTION_LEFT }
}

/// Adds the variance by noise, by the residuals, by the correction, by the bias and by other minima.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2+fma"))]
fn add_variance(tile: &mut Tile, noise: f32, out: &mut Plane) {
    gather(tile);
    let Tile { inside, scales, weights, product, residual, direction, .. } = tile;
    let Fields { phase: information, contrast: spare, albedo: [corrections, pull, known, biases] } = product;
    let work = Work { pull, known, spare: &mut *spare };
    let minimum =
        Minimum { gradient: &residual.phase, information, bend: &direction.phase, noise: scales.misfit };
    bias(&minimum, work, biases);
    // A saturated cell has no information by itself; its neighbours determine it.
    smooth(information, spare);
    average_lit(corrections, inside, [pull, spare]);
    let excess = EXCESS_LEFT * (scales.misfit - noise).max(0.0);
    for at in vectors() {
        let (known, square, bend) = (information.get(at), corrections.get(at), weights.bend[0].get(at));
        let (biased, mut variance) = (biases.get(at), out.get(at));
        for x in 0..LANES {
            let known = if known[x] > CELL_INFORMATION_MIN { known[x] } else { CELL_INFORMATION_MIN };
            let by_noise = scales.misfit * variance_share(known, bend[x]);
            variance[x] += by_noise + excess / known + square[x] + biased[x];
        }
        out.set(at, variance);
    }
}

/// Writes information and squared corrections of the cells into the product, and the weights of the bending that hold them into the
/// direction.
#[inline(always)]
fn gather(tile: &mut Tile) {
    let left = correction_left(tile);
    let Tile { inside, start, unknown, derivatives, weights, product, direction, ratios, spread, .. } = tile;
    let Fields { phase: information, albedo: [corrections, ..], .. } = product;
    for at in vectors() {
        information.set(at, phase_information(derivatives, weights, *ratios, at));
        direction.phase.set(at, bend_stiffness(weights, at));
        let (phase, start, lit) = (unknown.phase.get(at), start.get(at), inside.get(at));
        let mut square = spread.get(at);
        for x in 0..LANES {
            square[x] = lit[x] * (square[x] + left * (phase[x] - start[x]) * (phase[x] - start[x]));
        }
        corrections.set(at, square);
    }
}

/// Averages a plane that is 0 outside the lit cells over the lit cells around each cell.
#[inline(always)]
fn average_lit(plane: &mut Plane, inside: &Plane, [lit, spare]: [&mut Plane; 2]) {
    lit.copy(inside);
    for plane in [&mut *plane, &mut *lit] {
        (0..2).for_each(|_| smooth(plane, spare));
    }
    for at in vectors() {
        let (sum, mut mean) = (lit.get(at), plane.get(at));
        for x in 0..LANES {
            mean[x] = if sum[x] > 0.0 { mean[x] / sum[x] } else { 0.0 };
        }
        plane.set(at, mean);
    }
}
