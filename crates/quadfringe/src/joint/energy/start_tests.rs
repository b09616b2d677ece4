//! The second and the third start.

use super::plane::{Plane, total, vectors};
use super::start::contrast_and_albedo;
use super::tests::{Errors, RATIOS, errors, random, tile};
use super::tile::Tile;
use crate::joint::params::energy::{OUTER_STEPS, SIDE};

const NOISE: f32 = 1e-6;

/// A tile, and its true phase.
struct Case {
    tile: Tile,
    truth: Plane,
}

/// A tile with an albedo (channel, row, column), whose phase at the start is off by `error` (row, column).
fn case(error: impl Fn(usize, usize) -> f32, albedo: impl Fn(usize, usize, usize) -> f32) -> Case {
    let (mut tile, truth) = tile(0.0);
    for y in 0..SIDE {
        for x in 0..SIDE {
            let phase = truth.row(y)[x];
            tile.start.row_mut(y)[x] = phase + error(y, x);
            let turns = [phase, RATIOS[1] * phase, phase + std::f32::consts::FRAC_PI_2, RATIOS[3] * phase];
            for c in 0..4 {
                let noise = 0.005 * random(c, y * SIDE + x);
                tile.light[c].row_mut(y)[x] = albedo(c, y, x) * (1.0 + 0.6 * turns[c].cos()) + noise;
            }
        }
    }
    Case { tile, truth }
}

/// A white tile with a word in dark ink, whose phase at the start is 2 rad off wherever there is ink.
fn printed() -> Case {
    let ink = |y, x| (30..40).contains(&y) && (30..50).contains(&x) && (x / 3 + y / 4) % 2 == 0;
    case(
        |y, x| if ink(y, x) { 2.0 } else { 0.0 },
        |c, y, x| if ink(y, x) { [0.05, 0.06, 0.05, 0.2][c] } else { 0.5 },
    )
}

/// A tile with a photograph in each channel, whose phase at the start has ripples of 1.3 rad.
fn photographed() -> Case {
    case(
        |y, x| 1.3 * (0.5 * x as f32).sin() * (0.4 * y as f32).cos(),
        |c, y, x| 0.4 * (0.8 * random(c + 4, y / 3 * SIDE + x / 3)).exp(),
    )
}

/// Root mean square of the error of the phase, in rad, after the first start alone.
fn first_error(Case { mut tile, truth }: Case) -> f32 {
    tile.unknown.phase.copy(&tile.start);
    contrast_and_albedo(&mut tile, 1.0);
    tile.descend(NOISE, tile.scales.bend, OUTER_STEPS);
    errors(&tile, &truth).rms
}

/// Checks that more starts leave a wrong minimum, with at most these errors.
fn check_more_starts(made: fn() -> Case, most: &Errors) {
    let first = first_error(made());
    let Case { mut tile, truth } = made();
    tile.minimise(NOISE, 1.0);
    let last = errors(&tile, &truth);
    let spread = vectors().map(|at| total(tile.spread.get(at))).sum::<f64>();
    let better = last.rms < most.rms && last.rms < 0.5 * first && last.largest < most.largest;
    assert!(first > 0.02 && better && spread > 0.0, "{first} {last:?} {spread}");
}

#[test]
fn more_starts_leave_a_wrong_minimum_in_a_print() {
    check_more_starts(printed, &Errors { rms: 0.005, largest: 0.02 });
}

#[test]
fn more_starts_remove_the_ripples_of_a_photograph() {
    check_more_starts(photographed, &Errors { rms: 0.01, largest: 0.1 });
}
