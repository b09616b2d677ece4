//! The energy of every cell (J16): the data, and the priors of the differences that begin at the cell. Second differences that
//! reach a torn cell count by themselves.

use super::data::{Cells, Line, predict, predicted};
use super::plane::{Column, Fields, Plane, STRIDE, vectors};
use super::priors::{bending, squares};
use super::scales::{Scales, unknowns};
use crate::joint::model::{count, weights};
use crate::joint::params::energy::{BEND_FREEDOM, DIFFERENCE_FREEDOM};
use crate::parallel::exp::{exp, ln_1p};
use crate::parallel::lanes::{LANES, Lanes};
use multiversion::multiversion;

/// What a tile was given, as in [`Tile`](super::tile::Tile).
pub(super) struct Given<'a> {
    pub light: &'a [Plane; 4],
    pub usable: &'a Plane,
    pub inside: &'a Plane,
    /// 1 for lit cells, and for torn ones through which the surface may continue.
    pub continued: &'a Plane,
    pub ratios: [f32; 4],
    pub pair: bool,
    pub infrared: &'a [Plane; 2],
}

/// Adds `sign` times the energy of the cells for these unknowns and scales.
pub(super) fn add_energy(sign: f32, given: &Given<'_>, unknown: &Fields, scales: &Scales, out: &mut Plane) {
    if given.pair {
        add::<true>(sign, given, unknown, scales, out);
    } else {
        add::<false>(sign, given, unknown, scales, out);
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2+fma"))]
fn add<const PAIR: bool>(sign: f32, given: &Given<'_>, unknown: &Fields, scales: &Scales, out: &mut Plane) {
    let (inside, channels) = (given.inside, count(given.ratios));
    for at in vectors() {
        let here = Column::of(unknown, at);
        let data = data::<PAIR>(given, &here, scales, at);
        let [bend, all] = [inside, given.continued].map(|cells| bending(cells, &unknown.phase, at));
        let mut sum = [0.0; LANES];
        for x in 0..LANES {
            let (count, rest) = (all.count[x] - bend.count[x], all.square[x] - bend.square[x]);
            let torn = if rest > 0.0 { rest } else { 0.0 };
            sum[x] = data[x]
                + student(BEND_FREEDOM, bend.count[x], bend.square[x] / scales.bend)
                + student(BEND_FREEDOM, count, torn / scales.bend);
        }
        for there in [at + 1, at + STRIDE] {
            let lit = [inside.get(at), inside.get(there)];
            let squares = squares(&here, &Column::of(unknown, there), 1.0 / channels);
            differences(lit, squares, unknowns(channels), scales, &mut sum);
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
fn data<const PAIR: bool>(given: &Given<'_>, here: &Column, scales: &Scales, at: usize) -> Lanes {
    let (usable, half, ratios) = (given.usable.get(at), 0.5 / scales.noise, given.ratios);
    let present = weights(ratios);
    let (mut out, mut modulation) = ([0.0; LANES], [0.0; LANES]);
    for x in 0..LANES {
        modulation[x] = exp(here.contrast[x]);
    }
    for c in 0..4 {
        let (albedo, light) = (here.albedo[c], given.light[c].get(at));
        let cells = Cells { phase: here.phase, modulation, usable, albedo, light };
        let ratio = ratios[c];
        let kept = scales.channel_contrast[c];
        let model = if PAIR && c == 3 {
            predicted::<_, false, false>(&cells, Line::at(given.infrared, at), kept, 1.0)
        } else {
            predict(&cells, c, ratio, kept, present[c])
        };
        let rest = model.rest;
        for x in 0..LANES {
            out[x] += half * rest[x] * rest[x];
        }
    }
    out
}

/// Negative logarithm of the density of Student's t, without its constant, for `count` variables.
#[inline(always)]
fn student(freedom: f32, count: f32, square: f32) -> f32 {
    0.5 * (freedom + count) * ln_1p(square / freedom)
}

/// Adds the priors of the differences between two neighbours.
#[inline(always)]
fn differences(lit: [Lanes; 2], squares: [Lanes; 3], unknowns: [f32; 3], scales: &Scales, out: &mut Lanes) {
    let inverse = [1.0 / scales.brightness, 1.0 / scales.colour, 1.0 / scales.contrast];
    for n in 0..3 {
        for x in 0..LANES {
            out[x] +=
                lit[0][x] * lit[1][x] * student(DIFFERENCE_FREEDOM, unknowns[n], squares[n][x] * inverse[n]);
        }
    }
}
