//! The priors: how much neighbouring cells differ in surface, brightness, colour and contrast.

use super::plane::{STRIDE, four, total, vectors};
use super::scales::PriorSums;
use super::tile::Tile;
use crate::joint::params::energy::{BEND_FREEDOM, BRIGHTNESS_FREEDOM, COLOUR_FREEDOM, CONTRAST_FREEDOM};
use crate::parallel::lanes::{LANES, Lanes};
use multiversion::multiversion;

/// Student's t as a weight: near 1 for differences as large as usual, small for rare large ones.
#[inline(always)]
fn student(freedom: f32, count: f32, square: f32) -> f32 {
    (freedom + count) / (freedom + square)
}

/// Sets all weights from the differences of the unknowns, and returns the sums from which the scales are estimated.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2+fma"))]
pub(super) fn weigh(tile: &mut Tile) -> PriorSums {
    let mut sums = PriorSums::default();
    for at in vectors() {
        bend(tile, at, &mut sums);
        for (k, step) in [1, STRIDE].into_iter().enumerate() {
            differences(tile, at, k, step, &mut sums);
        }
    }
    sums
}

#[inline(always)]
fn bend(tile: &mut Tile, at: usize, sums: &mut PriorSums) {
    let Tile { inside, unknown, weights, scales, .. } = tile;
    let p = |to: usize| unknown.phase.get(to);
    let i = |to: usize| inside.get(to);
    let (middle, left, right, above, below, corner) =
        (p(at), p(at - 1), p(at + 1), p(at - STRIDE), p(at + STRIDE), p(at + STRIDE + 1));
    let lit = i(at);
    let (lit_left, lit_right, lit_above, lit_below, lit_corner) =
        (i(at - 1), i(at + 1), i(at - STRIDE), i(at + STRIDE), i(at + STRIDE + 1));
    let (noise, inverse) = (scales.noise, 1.0 / scales.bend);
    let mut out = [[0.0; LANES]; 3];
    let [mut energy, mut count, mut mean] = [[0.0; LANES]; 3];
    for x in 0..LANES {
        let along = lit[x] * lit_left[x] * lit_right[x];
        let down = lit[x] * lit_above[x] * lit_below[x];
        let mixed = lit[x] * lit_right[x] * lit_below[x] * lit_corner[x];
        let xx = along * (left[x] - 2.0 * middle[x] + right[x]);
        let yy = down * (above[x] - 2.0 * middle[x] + below[x]);
        let xy = mixed * (middle[x] - right[x] - below[x] + corner[x]);
        let square = xx * xx + yy * yy + 2.0 * xy * xy;
        count[x] = (along + down + mixed) * (1.0 / 3.0);
        let student = student(BEND_FREEDOM, count[x], square * inverse);
        energy[x] = student * square;
        mean[x] = count[x] * student;
        let weight = student * inverse * noise;
        (out[0][x], out[1][x], out[2][x]) = (along * weight, down * weight, 2.0 * mixed * weight);
    }
    for (plane, out) in weights.bend.iter_mut().zip(out) {
        plane.set(at, out);
    }
    sums.bend.add(energy, count, mean);
}

/// Weights of the differences between the cells of a vector and those `step` places further on, in direction `k`.
#[inline(always)]
fn differences(tile: &mut Tile, at: usize, k: usize, step: usize, sums: &mut PriorSums) {
    let Tile { inside, unknown, weights, scales, .. } = tile;
    let (lit, next_lit) = (inside.get(at), inside.get(at + step));
    let albedo = four(&unknown.albedo, at);
    let next = four(&unknown.albedo, at + step);
    let (contrast, next_contrast) = (unknown.contrast.get(at), unknown.contrast.get(at + step));
    let noise = scales.noise;
    let inverse = [1.0 / scales.brightness, 1.0 / scales.colour, 1.0 / scales.contrast];
    let (mut out, mut energy, mut mean) = ([[0.0; LANES]; 3], [[0.0; LANES]; 3], [[0.0; LANES]; 3]);
    let mut both: Lanes = [0.0; LANES];
    for x in 0..LANES {
        both[x] = lit[x] * next_lit[x];
        let (mut sum, mut squares) = (0.0, 0.0);
        for c in 0..4 {
            let difference = next[c][x] - albedo[c][x];
            sum += difference;
            squares += difference * difference;
        }
        let turn = next_contrast[x] - contrast[x];
        let brightness = 0.25 * sum * sum;
        let colour = squares - brightness;
        let square = [brightness, if colour > 0.0 { colour } else { 0.0 }, turn * turn];
        let freedom = [BRIGHTNESS_FREEDOM, COLOUR_FREEDOM, CONTRAST_FREEDOM];
        let count = [0.5, 1.5, 0.5];
        for n in 0..3 {
            let student = both[x] * student(freedom[n], count[n], square[n] * inverse[n]);
            energy[n][x] = student * square[n];
            mean[n][x] = student;
            out[n][x] = student * inverse[n] * noise;
        }
    }
    weights.brightness[k].set(at, out[0]);
    weights.colour[k].set(at, out[1]);
    weights.contrast[k].set(at, out[2]);
    sums.brightness.add(energy[0], both, mean[0]);
    sums.colour.add(energy[1], both, mean[1]);
    sums.contrast.add(energy[2], both, mean[2]);
}

impl super::scales::Sums {
    #[inline(always)]
    fn add(&mut self, energy: Lanes, count: Lanes, mean: Lanes) {
        self.energy += total(energy);
        self.count += total(count);
        self.weight += total(mean);
    }
}
