//! More starts. Texture spoils the phase at the first start, and the minimum that is found from there can be a wrong one.
//!
//! The second start is the surface that bends least through the cells without texture (J29): at the edges of a print the phase is
//! off by up to a radian. The third is the lower minimum of the two, with cells of the other one where that is better. Both have new
//! albedos, and a surface that is stiff again and loosens once more (J43). A tile keeps the minimum with the lowest energy.

use super::plane::{Derivatives, Fields, Plane, STRIDE, Weights, total, vectors};
use super::scales::Scales;
use super::solve::solve;
use super::start::{contrast_and_albedo, filter};
use super::tile::Tile;
use super::value::{Given, add_energy};
use crate::joint::model::count;
use crate::joint::params::energy::{GAIN_MIN, SAME_RAD, SCALE_LIMITS, SIDE, SURROUNDINGS_SHARE, TEXTURE_MIN};
use crate::parallel::lanes::{LANES, Lanes};
use multiversion::multiversion;

/// Taps of sums over three and over five neighbours.
const THREE: [f32; 3] = [0.0, 1.0, 1.0];
const FIVE: [f32; 3] = [1.0; 3];

impl Tile {
    /// Minimises once more from two other starts, if there is texture, and keeps the lowest energy; `noise` as in `minimise`.
    pub(super) fn restart(&mut self, noise: f32) {
        self.compared = has_texture(self);
        if !self.compared {
            return;
        }
        // White surfaces never take this memory.
        let mut kept = self.first.take().unwrap_or_default();
        for (to, from) in kept.planes_mut().into_iter().zip(self.unknown.planes()) {
            to.copy(from);
        }
        let differs = self.bridge(&kept);
        let Self { inside, torn, lit, product, .. } = self;
        continue_through(inside, torn, lit, [&mut product.phase, &mut product.contrast]);
        if differs {
            self.start_again(&mut kept, noise);
        }
        let mixed = self.start_again(&mut kept, noise);
        let scales = self.scales;
        if mixed && excess(self, &kept, &scales, &[scales]) < 0.0 {
            std::mem::swap(&mut self.unknown, &mut kept);
        }
        self.first = Some(kept);
    }

    /// Minimises from the present phase, and keeps the lower of the minimum found and the kept one, as in `keep_lower`.
    fn start_again(&mut self, kept: &mut Fields, noise: f32) -> bool {
        let scales = self.scales;
        self.scales = Scales { noise, misfit: 1.0, bend: SCALE_LIMITS[0].powi(2), ..scales };
        contrast_and_albedo(self, SURROUNDINGS_SHARE);
        self.descend(noise, self.scales.bend, 1);
        keep_lower(self, kept, &scales)
    }

    /// Moves the phase to the surface that bends least through the cells without texture, around the cells where it differs; gives
    /// whether there are any.
    fn bridge(&mut self, first: &Fields) -> bool {
        let Self { inside, lit, derivatives, weights, residual, ratios, scales, .. } = self;
        lit.copy(inside);
        hold_by_phase(inside, *ratios, first, scales.noise, derivatives);
        bend_everywhere(scales.noise / scales.bend, weights);
        residual.clear();
        // The surface continues through cells without light.
        vectors().for_each(|at| inside.set(at, [1.0; LANES]));
        solve(self);
        std::mem::swap(&mut self.inside, &mut self.lit);
        take_step(self)
    }
}

/// Squared difference of the logarithms of the albedo between a cell and its neighbours: the largest of the four, each the mean of
/// the channels, of which each has this `share`.
#[inline(always)]
fn texture(inside: &Plane, albedo: &[Plane; 4], share: f32, at: usize) -> Lanes {
    let lit = inside.get(at);
    let mut most = [0.0; LANES];
    for there in [at - 1, at + 1, at - STRIDE, at + STRIDE] {
        let also = inside.get(there);
        let mut sum = [0.0; LANES];
        for plane in albedo {
            let (here, next) = (plane.get(at), plane.get(there));
            for x in 0..LANES {
                sum[x] += share * lit[x] * also[x] * (next[x] - here[x]).powi(2);
            }
        }
        for x in 0..LANES {
            most[x] = if sum[x] > most[x] { sum[x] } else { most[x] };
        }
    }
    most
}

/// Whether there is an edge of the albedo that may have spoilt the phase at the start.
fn has_texture(tile: &Tile) -> bool {
    let share = 1.0 / count(tile.ratios);
    vectors().any(|at| {
        texture(&tile.inside, &tile.unknown.albedo, share, at)
            .iter()
            .any(|&found| found > TEXTURE_MIN * TEXTURE_MIN)
    })
}

/// Sets the derivatives as if the phase were measured in every cell, the less certainly the more texture there is.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2+fma"))]
fn hold_by_phase(
    inside: &Plane,
    ratios: [f32; 4],
    first: &Fields,
    noise: f32,
    derivatives: &mut Derivatives,
) {
    let share = 1.0 / count(ratios);
    let Derivatives { phase, albedo, contrast } = derivatives;
    phase.iter_mut().chain(albedo).chain(contrast).for_each(Plane::clear);
    for at in vectors() {
        let (lit, texture) = (inside.get(at), texture(inside, &first.albedo, share, at));
        let mut out = [0.0; LANES];
        for x in 0..LANES {
            out[x] = lit[x] * (noise / (SAME_RAD * SAME_RAD + texture[x])).sqrt();
        }
        phase[0].set(at, out);
    }
}

/// Gives all second differences within the tile the same weight, and all first differences none.
fn bend_everywhere(weight: f32, weights: &mut Weights) {
    let Weights { bend: [along, down, mixed], brightness, colour, contrast } = weights;
    brightness.iter_mut().chain(colour).chain(contrast).for_each(Plane::clear);
    for y in 0..SIDE {
        let (last, inner) = (y == SIDE - 1, y > 0 && y < SIDE - 1);
        along.row_mut(y).fill(weight);
        (along.row_mut(y)[0], along.row_mut(y)[SIDE - 1]) = (0.0, 0.0);
        down.row_mut(y).fill(if inner { weight } else { 0.0 });
        mixed.row_mut(y).fill(if last { 0.0 } else { 2.0 * weight });
        mixed.row_mut(y)[SIDE - 1] = 0.0;
    }
}

/// Moves the phase to the bridging surface in torn cells and around cells where it differs; returns whether there are any.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2+fma"))]
fn take_step(tile: &mut Tile) -> bool {
    let Tile { inside, torn, unknown, step, product, .. } = tile;
    let [around, spare, ..] = product.planes_mut();
    let mut cells = 0.0;
    for at in vectors() {
        let differs = farther(step.phase.get(at), [0.0; LANES], inside.get(at));
        cells += total(differs);
        around.set(at, differs);
    }
    filter(around, spare, FIVE);
    for at in vectors() {
        let (around, step, mut phase) = (around.get(at), step.phase.get(at), unknown.phase.get(at));
        let torn = torn.get(at);
        for x in 0..LANES {
            phase[x] += if around[x] + torn[x] > 0.5 { step[x] } else { 0.0 };
        }
        unknown.phase.set(at, phase);
    }
    cells > 0.0
}

/// Writes 1 for lit cells, and for torn ones without an unlit cell around them. A torn cell that no shadow borders may be torn by
/// texture, and then the surface continues through it.
pub(super) fn continue_through(
    inside: &Plane,
    torn: &Plane,
    out: &mut Plane,
    [near, spare]: [&mut Plane; 2],
) {
    for at in vectors() {
        let (inside, torn) = (inside.get(at), torn.get(at));
        let mut known = [0.0; LANES];
        for x in 0..LANES {
            known[x] = inside[x] + torn[x];
        }
        near.set(at, known);
    }
    filter(near, spare, THREE);
    for at in vectors() {
        let (inside, torn, near) = (inside.get(at), torn.get(at), near.get(at));
        let mut cells = inside;
        for x in 0..LANES {
            cells[x] += if near[x] > 8.5 { torn[x] } else { 0.0 };
        }
        out.set(at, cells);
    }
}

/// 1 for lit cells in which two phases differ.
#[inline(always)]
fn farther(one: Lanes, other: Lanes, lit: Lanes) -> Lanes {
    let mut out = [0.0; LANES];
    for x in 0..LANES {
        out[x] = if (one[x] - other[x]).abs() > SAME_RAD { lit[x] } else { 0.0 };
    }
    out
}

/// Keeps the lower of two minima: the kept one, with the given scales, and the present one. The present unknowns become a mixture: the
/// lower minimum, with the cells of the other one around which that has a much lower energy. Gives whether there are such cells.
fn keep_lower(tile: &mut Tile, kept: &mut Fields, scales: &Scales) -> bool {
    let found = tile.scales;
    let mut sign = 1.0;
    if excess(tile, kept, scales, &[*scales, found]) > 0.0 {
        std::mem::swap(&mut tile.unknown, kept);
        sign = -1.0;
    } else {
        tile.scales = *scales;
    }
    mix_minima(tile, kept, sign)
}

/// Writes the energy of the kept unknowns less that of the present ones into the first plane of the product, and gives its sum. Both
/// have the contrasts of the channels that belong to them, the kept ones those of `kept_scales`. The energies are sums over all `scales`.
fn excess(tile: &mut Tile, kept: &Fields, kept_scales: &Scales, scales: &[Scales]) -> f64 {
    let Tile { light, usable, inside, lit: continued, ratios, pair, infrared, .. } = tile;
    let given = Given { light, usable, inside, continued, ratios: *ratios, pair: *pair, infrared };
    let excess = &mut tile.product.phase;
    excess.clear();
    for scales in scales {
        let of = |owner: &Scales| Scales { channel_contrast: owner.channel_contrast, ..*scales };
        add_energy(1.0, &given, kept, &of(kept_scales), excess);
        add_energy(-1.0, &given, &tile.unknown, &of(&tile.scales), excess);
    }
    vectors().map(|at| total(excess.get(at))).sum()
}

/// Turns the present unknowns into the kept ones, except in cells around which they differ and have a much lower energy; gives whether
/// there are any. Adds to the spread where neither energy is much lower. The excess of the kept ones stands in the first plane of the
/// product, times `sign`.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2+fma"))]
fn mix_minima(tile: &mut Tile, kept: &Fields, sign: f32) -> bool {
    let Tile { inside, unknown, product, spread, .. } = tile;
    let [excess, around, spare, ..] = product.planes_mut();
    for at in vectors() {
        around.set(at, farther(kept.phase.get(at), unknown.phase.get(at), inside.get(at)));
    }
    filter(around, spare, THREE);
    for at in vectors() {
        let (mut counted, around) = (excess.get(at), around.get(at));
        for x in 0..LANES {
            counted[x] *= if around[x] > 0.5 { sign } else { 0.0 };
        }
        excess.set(at, counted);
    }
    filter(excess, spare, FIVE);
    add_spread(excess, [&kept.phase, &unknown.phase], spread);
    let mut mixed = 0.0;
    for at in vectors() {
        let (excess, mut around) = (excess.get(at), around.get(at));
        for x in 0..LANES {
            around[x] = if around[x] > 0.5 && excess[x] > GAIN_MIN { 1.0 } else { 0.0 };
        }
        mixed += total(around);
        spare.set(at, around);
    }
    for (kept, unknown) in kept.planes().into_iter().zip(unknown.planes_mut()) {
        for at in vectors() {
            let (other, kept, mut out) = (spare.get(at), kept.get(at), unknown.get(at));
            for x in 0..LANES {
                out[x] = if other[x] > 0.5 { out[x] } else { kept[x] };
            }
            unknown.set(at, out);
        }
    }
    mixed > 0.0
}

/// Adds half the squared difference of two phases where neither has a much lower energy (U19).
#[inline(always)]
fn add_spread(excess: &Plane, phases: [&Plane; 2], spread: &mut Plane) {
    for at in vectors() {
        let (excess, mut out) = (excess.get(at), spread.get(at));
        let [one, other] = phases.map(|phase| phase.get(at));
        for x in 0..LANES {
            let half = 0.5 * (one[x] - other[x]) * (one[x] - other[x]);
            out[x] += if excess[x].abs() < GAIN_MIN { half } else { 0.0 };
        }
        spread.set(at, out);
    }
}
