//! The priors: how much neighbouring cells differ in surface, brightness, colour and contrast.

use super::plane::{Column, Plane, STRIDE, row};
use super::scales::{PriorSums, Sums, unknowns};
use super::tile::Tile;
use crate::joint::model::count;
use crate::joint::params::energy::{BEND_FREEDOM, DIFFERENCE_FREEDOM, SIDE};
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
    for y in 0..SIDE {
        let mut terms = PriorSums::default();
        for at in row(y) {
            bend(tile, at, &mut terms);
            for (k, step) in [1, STRIDE].into_iter().enumerate() {
                differences(tile, at, k, step, &mut terms);
            }
        }
        sums.add(&terms);
    }
    sums
}

/// The bending of a vector of cells; 1 for each second difference that stays within the lit cells, else 0.
pub(super) struct Bending {
    along: Lanes,
    down: Lanes,
    mixed: Lanes,
    /// Number of second differences, in thirds.
    pub count: Lanes,
    /// Sum of their squares, rad^2.
    pub square: Lanes,
}

#[inline(always)]
pub(super) fn bending(inside: &Plane, phase: &Plane, at: usize) -> Bending {
    let p = |to: usize| phase.get(to);
    let i = |to: usize| inside.get(to);
    let (middle, left, right, above, below, corner) =
        (p(at), p(at - 1), p(at + 1), p(at - STRIDE), p(at + STRIDE), p(at + STRIDE + 1));
    let lit = i(at);
    let (lit_left, lit_right, lit_above, lit_below, lit_corner) =
        (i(at - 1), i(at + 1), i(at - STRIDE), i(at + STRIDE), i(at + STRIDE + 1));
    let [mut along, mut down, mut mixed, mut count, mut square] = [[0.0; LANES]; 5];
    for x in 0..LANES {
        along[x] = lit[x] * lit_left[x] * lit_right[x];
        down[x] = lit[x] * lit_above[x] * lit_below[x];
        mixed[x] = lit[x] * lit_right[x] * lit_below[x] * lit_corner[x];
        let xx = along[x] * (left[x] - 2.0 * middle[x] + right[x]);
        let yy = down[x] * (above[x] - 2.0 * middle[x] + below[x]);
        let xy = mixed[x] * (middle[x] - right[x] - below[x] + corner[x]);
        square[x] = xx * xx + yy * yy + 2.0 * xy * xy;
        count[x] = (along[x] + down[x] + mixed[x]) * (1.0 / 3.0);
    }
    Bending { along, down, mixed, count, square }
}

#[inline(always)]
fn bend(tile: &mut Tile, at: usize, sums: &mut PriorSums<Lanes>) {
    let Tile { inside, unknown, weights, scales, .. } = tile;
    let Bending { along, down, mixed, count, square } = bending(inside, &unknown.phase, at);
    let (noise, inverse) = (scales.noise, 1.0 / scales.bend);
    let mut out = [[0.0; LANES]; 3];
    let [mut energy, mut mean] = [[0.0; LANES]; 2];
    for x in 0..LANES {
        let student = student(BEND_FREEDOM, count[x], square[x] * inverse);
        energy[x] = student * square[x];
        mean[x] = count[x] * student;
        let weight = student * inverse * noise;
        (out[0][x], out[1][x], out[2][x]) = (along[x] * weight, down[x] * weight, 2.0 * mixed[x] * weight);
    }
    for (plane, out) in weights.bend.iter_mut().zip(out) {
        plane.set(at, out);
    }
    sums.bend.add_terms(energy, count, mean);
}

/// Squared differences of a vector of cells and their neighbours in brightness, colour and contrast. `share` is that of one channel
/// in the mean of all.
#[inline(always)]
pub(super) fn squares(here: &Column, there: &Column, share: f32) -> [Lanes; 3] {
    let mut out = [[0.0; LANES]; 3];
    for x in 0..LANES {
        let (mut sum, mut squares) = (0.0, 0.0);
        for c in 0..4 {
            let difference = there.albedo[c][x] - here.albedo[c][x];
            sum += difference;
            squares += difference * difference;
        }
        let turn = there.contrast[x] - here.contrast[x];
        let brightness = share * sum * sum;
        let colour = squares - brightness;
        (out[0][x], out[1][x]) = (brightness, if colour > 0.0 { colour } else { 0.0 });
        out[2][x] = turn * turn;
    }
    out
}

/// Weights of the differences between the cells of a vector and those `step` places further on, in direction `k`.
#[inline(always)]
fn differences(tile: &mut Tile, at: usize, k: usize, step: usize, sums: &mut PriorSums<Lanes>) {
    let Tile { inside, unknown, weights, scales, ratios, .. } = tile;
    let (lit, next_lit) = (inside.get(at), inside.get(at + step));
    let channels = count(*ratios);
    let (share, unknowns) = (1.0 / channels, unknowns(channels));
    let squares = squares(&Column::of(unknown, at), &Column::of(unknown, at + step), share);
    let noise = scales.noise;
    let inverse = [1.0 / scales.brightness, 1.0 / scales.colour, 1.0 / scales.contrast];
    let (mut out, mut energy, mut mean) = ([[0.0; LANES]; 3], [[0.0; LANES]; 3], [[0.0; LANES]; 3]);
    let mut both: Lanes = [0.0; LANES];
    for x in 0..LANES {
        both[x] = lit[x] * next_lit[x];
        for n in 0..3 {
            let student = both[x] * student(DIFFERENCE_FREEDOM, unknowns[n], squares[n][x] * inverse[n]);
            energy[n][x] = student * squares[n][x];
            mean[n][x] = student;
            out[n][x] = student * inverse[n] * noise;
        }
    }
    weights.brightness[k].set(at, out[0]);
    weights.colour[k].set(at, out[1]);
    weights.contrast[k].set(at, out[2]);
    sums.brightness.add_terms(energy[0], both, mean[0]);
    sums.colour.add_terms(energy[1], both, mean[1]);
    sums.contrast.add_terms(energy[2], both, mean[2]);
}

impl Sums<Lanes> {
    #[inline(always)]
    fn add_terms(&mut self, energy: Lanes, count: Lanes, weight: Lanes) {
        for x in 0..LANES {
            self.energy[x] += energy[x];
            self.count[x] += count[x];
            self.weight[x] += weight[x];
        }
    }
}
