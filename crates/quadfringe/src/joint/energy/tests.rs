//! The matrix of a step, the minimum of one tile, and the seams between tiles.

use super::blocks::bend_stiffness;
use super::cell_px;
use super::plane::{Column, Derivatives, Fields, Plane, Weights, place, total, vectors};
use super::preconditioner::{Preconditioner, move_along, prepare, turn};
use super::priors::weigh;
use super::restart::continue_through;
use super::scales::variance_share;
use super::solve::multiply;
use super::tile::Tile;
use super::value::{Given, add_energy};
use crate::joint::params::energy::SIDE;
use crate::parallel::lanes::LANES;

pub(super) const RATIOS: [f32; 4] = [1.0, 35.0 / 36.0, 1.0, 30.0 / 36.0];

/// A number in [-1, 1] for each place and seed.
pub(super) fn random(seed: usize, at: usize) -> f32 {
    let mut state = (seed * 7919 + at).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    state ^= state >> 29;
    state = state.wrapping_mul(0xBF58_476D_1CE4_E5B9);
    (state >> 40) as f32 / (1u32 << 23) as f32 - 1.0
}

/// A tile of a curved, two-coloured surface whose light has noise; the right half is twice as bright in R as in G.
pub(super) fn tile(noise: f32) -> (Tile, Plane) {
    let (mut tile, mut truth) = (Tile { ratios: RATIOS, ..Tile::default() }, Plane::default());
    for y in 0..SIDE {
        for x in 0..SIDE {
            let (u, v) = (x as f32 - 24.0, y as f32 - 24.0);
            let phase = 60.0 + 0.75 * u + 0.1 * v + 6e-4 * (u * u + v * v);
            let albedo = if x < SIDE / 2 { [0.5, 0.5, 0.5, 0.5] } else { [0.6, 0.3, 0.4, 0.5] };
            let turns = [phase, RATIOS[1] * phase, phase + std::f32::consts::FRAC_PI_2, RATIOS[3] * phase];
            truth.row_mut(y)[x] = phase;
            tile.start.row_mut(y)[x] = phase + 0.2 * phase.sin();
            for c in 0..4 {
                let light = albedo[c] * (1.0 + 0.6 * turns[c].cos());
                tile.light[c].row_mut(y)[x] = light + noise * random(c, y * SIDE + x);
            }
            (tile.usable.row_mut(y)[x], tile.inside.row_mut(y)[x]) = (1.0, 1.0);
        }
    }
    (tile, truth)
}

/// Errors of the phase of the cells of a tile, rad.
#[derive(Debug)]
pub(super) struct Errors {
    pub rms: f32,
    pub largest: f32,
}

pub(super) fn errors(tile: &Tile, truth: &Plane) -> Errors {
    let (mut squares, mut largest) = (0.0f32, 0.0f32);
    for y in 0..SIDE {
        for (found, truth) in tile.unknown.phase.row(y).iter().zip(truth.row(y)) {
            squares += (found - truth).powi(2);
            largest = largest.max((found - truth).abs());
        }
    }
    Errors { rms: (squares / (SIDE * SIDE) as f32).sqrt(), largest }
}

#[test]
fn the_minimum_finds_phase_and_contrast_through_an_edge_of_colour() {
    let (mut tile, truth) = tile(0.0);
    tile.minimise(1e-8, 1.0);
    let Errors { rms, largest } = errors(&tile, &truth);
    assert!(rms < 4e-3 && largest < 0.03, "{rms} {largest}");
    let contrast = tile.unknown.contrast.row(20)[12].exp();
    assert!((contrast - 0.6).abs() < 0.01, "{contrast}");
}

/// What the bending of a surface costs more with an island three radians off than without it. The island is cut off by torn cells,
/// to one of which a shadow is close if `shadow`; the light says nothing.
fn cost_of_an_island(shadow: bool) -> f64 {
    let (mut tile, truth) = tile(0.0);
    let mut island = Fields::default();
    island.phase.copy(&truth);
    tile.usable.clear();
    for y in 37..41 {
        for x in 29..47 {
            let inner = (38..40).contains(&y) && (30..46).contains(&x);
            island.phase.row_mut(y)[x] += if inner { 3.0 } else { 0.0 };
            if !inner {
                (tile.inside.row_mut(y)[x], tile.torn.row_mut(y)[x]) = (0.0, 1.0);
            }
        }
    }
    for y in (36..42).filter(|_| shadow) {
        (28..48).for_each(|x| tile.inside.row_mut(y)[x] = 0.0);
    }
    let smooth = Fields { phase: truth, ..Fields::default() };
    let [mut continued, mut near, mut spare, mut cost] = [(); 4].map(|()| Plane::default());
    let Tile { light, usable, inside, torn, ratios, infrared, scales, .. } = &tile;
    continue_through(inside, torn, &mut continued, [&mut near, &mut spare]);
    let given =
        Given { light, usable, inside, continued: &continued, ratios: *ratios, pair: false, infrared };
    add_energy(1.0, &given, &island, scales, &mut cost);
    add_energy(-1.0, &given, &smooth, scales, &mut cost);
    vectors().map(|at| total(cost.get(at))).sum()
}

#[test]
fn a_surface_continues_through_torn_cells_but_not_into_a_shadow() {
    let [open, shadow] = [false, true].map(cost_of_an_island);
    assert!(open > 500.0 && shadow.abs() < 1.0, "{open} {shadow}");
}

#[test]
fn a_tile_without_texture_has_one_start() {
    let (mut tile, _) = tile(0.0);
    for y in 0..SIDE {
        for x in 0..SIDE {
            let turns = [1.0, RATIOS[1], 1.0, RATIOS[3]].map(|ratio| ratio * tile.start.row(y)[x]);
            for c in 0..4 {
                let ahead = if c == 2 { std::f32::consts::FRAC_PI_2 } else { 0.0 };
                tile.light[c].row_mut(y)[x] = 0.5 * (1.0 + 0.6 * (turns[c] + ahead).cos());
            }
        }
    }
    tile.minimise(1e-8, 1.0);
    assert!(!tile.compared, "a second start was made");
}

#[test]
fn noise_is_estimated_and_averaged() {
    // Uniform noise in [-a, a] has the variance a^2 / 3.
    let (amplitude, least) = (0.03, 1e-8);
    let (mut tile, truth) = tile(amplitude);
    tile.minimise(least, 1.0);
    let rms = errors(&tile, &truth).rms;
    // A single cell would have 0.05 rad.
    assert!(rms < 0.02, "{rms}");
    let expected = amplitude * amplitude / 3.0;
    assert!((0.6..1.5).contains(&(tile.scales.misfit / expected)), "{} {expected}", tile.scales.misfit);
}

fn random_fields(seed: usize) -> Fields {
    let mut fields = Fields::default();
    for (n, plane) in fields.planes_mut().into_iter().enumerate() {
        for y in 0..SIDE {
            (0..SIDE).for_each(|x| plane.row_mut(y)[x] = random(10 * seed + n, place(x, y)));
        }
    }
    fields
}

fn scalar(a: &Fields, b: &Fields) -> f64 {
    vectors().map(|at| total(Column::of(a, at).times(&Column::of(b, at)))).sum()
}

/// Solves approximately for these fields, which the elimination changes; returns the scalar product of the fields and the solution.
fn precondition(prepared: &mut Preconditioner, fields: &mut Fields, out: &mut Fields) -> f64 {
    let [still, mut step, mut residual] = [(); 3].map(|()| Fields::default());
    let size = move_along(prepared, -1.0, &still, fields, &mut step, &mut residual);
    turn(prepared, &residual, 0.0, out);
    size
}

#[test]
fn the_preconditioner_is_symmetric_and_positive() {
    let (mut tile, _) = tile(0.03);
    tile.minimise(1e-6, 1.0);
    let Tile { derivatives, weights, preconditioner, .. } = &mut tile;
    let (first, second) = (random_fields(1), random_fields(2));
    let [mut one, mut two] = [Fields::default(), Fields::default()];
    prepare(preconditioner, derivatives, weights, RATIOS);
    let own = precondition(preconditioner, &mut random_fields(1), &mut one);
    prepare(preconditioner, derivatives, weights, RATIOS);
    precondition(preconditioner, &mut random_fields(2), &mut two);
    assert!((own - scalar(&first, &one)).abs() < 1e-4 * own, "{own}");
    let (forth, back) = (scalar(&second, &one), scalar(&first, &two));
    assert!(own > 0.0 && (forth - back).abs() < 1e-4 * own, "{forth} {back} {own}");
}

#[test]
fn the_preconditioner_inverts_columns_that_stand_alone() {
    let (mut tile, _) = tile(0.03);
    tile.minimise(1e-6, 1.0);
    let Tile { derivatives, weights, preconditioner, inside, .. } = &mut tile;
    // Neither columns nor the unknowns of a cell are coupled: R knows the phase, G and B their albedo, IR the contrast.
    let Weights { bend: [along, _, mixed], brightness, colour, contrast } = weights;
    for plane in [along, mixed, &mut brightness[0], &mut colour[0], &mut contrast[0]] {
        plane.clear();
    }
    brightness[1].copy(&colour[1]);
    let Derivatives { phase, albedo, contrast } = derivatives;
    let [red, _, _, infrared] = albedo;
    let unknown = phase[1..].iter_mut().chain(&mut contrast[..3]).chain([red, infrared]);
    unknown.for_each(Plane::clear);
    prepare(preconditioner, derivatives, weights, RATIOS);
    preconditioner.splines.clear();
    let expected = random_fields(3);
    let [mut product, mut found] = [Fields::default(), Fields::default()];
    multiply::<true>(derivatives, weights, inside, RATIOS, &expected, &mut product);
    precondition(preconditioner, &mut product, &mut found);
    for n in [0, 2, 3, 5] {
        let (found, expected) = (found.planes()[n], expected.planes()[n]);
        for y in 0..SIDE {
            for (found, expected) in found.row(y).iter().zip(expected.row(y)) {
                assert!((found - expected).abs() < 0.01, "{n}: {found} {expected}");
            }
        }
    }
}

#[test]
fn the_matrix_is_symmetric_and_positive() {
    let (mut tile, _) = tile(0.0);
    tile.minimise(1e-6, 1.0);
    weigh(&mut tile);
    let (first, second) = (random_fields(1), random_fields(2));
    let [mut one, mut two] = [Fields::default(), Fields::default()];
    let Tile { derivatives, weights, inside, .. } = &tile;
    let own = multiply::<true>(derivatives, weights, inside, RATIOS, &first, &mut one);
    assert!(own > 0.0);
    multiply::<true>(derivatives, weights, inside, RATIOS, &second, &mut two);
    let (forth, back) = (scalar(&second, &one), scalar(&first, &two));
    assert!((forth - back).abs() < 1e-4 * own, "{forth} {back} {own}");
}

#[test]
fn a_border_holds_a_cell_less_than_the_middle_but_holds_it() {
    let (mut tile, _) = tile(0.0);
    tile.inside.clear();
    (20..60).for_each(|y| tile.inside.row_mut(y)[20..60].fill(1.0));
    tile.unknown.phase.clear();
    weigh(&mut tile);
    let Tile { weights, .. } = &tile;
    let [middle, side, corner] = [(40, 40), (20, 40), (20, 20)].map(|(x, y)| {
        let at = place(x - x % LANES, y);
        bend_stiffness(weights, at)[x % LANES]
    });
    let weight = weights.bend[0].row(40)[40];
    assert!((middle / weight - 1.0).abs() < 1e-5 && weights.bend[0].row(40)[20] == 0.0);
    assert!(0.0 < corner && corner < side && side < middle, "{corner} {side} {middle}");
}

#[test]
fn cells_are_as_wide_as_the_fringes_allow() {
    let sides = [4.0, 7.9, 8.0, 20.3, 20.5, 33.0, 80.0].map(cell_px);
    assert_eq!(sides, [1, 1, 2, 2, 4, 4, 4]);
}

#[test]
fn the_variance_is_that_of_the_mean_squared_gain() {
    let exact = |relative: f64| -> f64 {
        let response = |n: usize| 2.0 - 2.0 * (std::f64::consts::PI * (n as f64 + 0.5) / 64.0).cos();
        let gain = |i: usize| 1.0 / (1.0 + relative * (response(i / 64) + response(i % 64)).powi(2));
        (0..4096).map(|i| gain(i).powi(2)).sum::<f64>() / 4096.0
    };
    for relative in [1e-3, 1e-2, 0.1, 1.0, 10.0, 100.0] {
        let share = f64::from(variance_share(2.0, 2.0 * relative as f32)) * 2.0;
        assert!((0.75..1.35).contains(&(share / exact(relative))), "{relative} {share} {}", exact(relative));
    }
}

#[test]
fn an_absent_channel_takes_no_part() {
    let (mut tile, truth) = tile(0.0);
    tile.ratios[3] = 0.0;
    tile.light[3].clear();
    tile.minimise(1e-8, 1.0);
    let Errors { rms, largest } = errors(&tile, &truth);
    assert!(rms < 4e-3 && largest < 0.03, "{rms} {largest}");
    assert!(tile.unknown.albedo[3].row(20).iter().all(|&log| log == 0.0));
    let mut found = super::tile::Found::default();
    tile.write(1e-6, &mut found);
    assert!(found.albedo[3].row(20).iter().all(|&albedo| albedo == 0.0));
    assert!((found.albedo[0].row(20)[12] - 0.5).abs() < 0.01, "{}", found.albedo[0].row(20)[12]);
}

/// Only the ridge determines a column of cells without light that touches no other cell, and rounding takes the ridge away.
#[test]
fn a_lone_column_of_cells_without_light_keeps_the_preconditioner_positive() {
    let (mut tile, _) = tile(0.0);
    tile.usable.clear();
    tile.inside.clear();
    (5..75).for_each(|y| tile.inside.row_mut(y)[40] = 1.0);
    for n in 1..200 {
        tile.scales.noise = 1e-4 * n as f32;
        weigh(&mut tile);
        tile.residual.clear();
        tile.residual.planes_mut().into_iter().for_each(|plane| plane.row_mut(40).fill(1.0));
        prepare(&mut tile.preconditioner, &tile.derivatives, &tile.weights, RATIOS);
        let size = precondition(&mut tile.preconditioner, &mut tile.residual, &mut tile.step);
        assert!(size.is_finite() && size > 0.0, "{n}: {size}");
    }
}
