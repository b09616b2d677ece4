//! What the pixels of a cell have in common.

use crate::joint::params::energy::SPREAD_MAX_RAD;
use crate::joint::scene::{PhaseMap, Scene};
use multiversion::multiversion;

/// What the pixels of a cell show.
#[derive(Debug, Clone, Copy)]
pub(super) enum Surfaces {
    /// Some are not lit.
    None,
    /// Their phases lie close together.
    One,
    /// They do not.
    More,
}

pub(super) fn surfaces(scene: &Scene<'_>, map: PhaseMap<'_>, factor: usize, [y, x]: [usize; 2]) -> Surfaces {
    let (mut low, mut high, mut lit) = (f32::MAX, f32::MIN, true);
    for row in y * factor..(y + 1) * factor {
        let (phase, modulation) = (scene.row(map.phase, row), scene.row(map.modulation, row));
        for at in x * factor..(x + 1) * factor {
            (low, high) = (low.min(phase[at]), high.max(phase[at]));
            lit &= modulation[at] > 0.0;
        }
    }
    match lit {
        false => Surfaces::None,
        true if high - low < SPREAD_MAX_RAD * factor as f32 => Surfaces::One,
        true => Surfaces::More,
    }
}

/// Means of the pixels of `factor` rows and `factor` columns.
pub(super) fn mean<'a>(rows: impl Iterator<Item = &'a [f32]>, factor: usize, out: &mut [f32]) {
    out.fill(0.0);
    for row in rows {
        match factor {
            1 => add::<1>(row, out),
            2 => add::<2>(row, out),
            4 => add::<4>(row, out),
            _ => add::<8>(row, out),
        }
    }
}

/// Adds the share of a row in the means of squares of pixels.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2+fma"))]
fn add<const FACTOR: usize>(row: &[f32], out: &mut [f32]) {
    let share = 1.0 / (FACTOR * FACTOR) as f32;
    for (out, pixels) in out.iter_mut().zip(row.as_chunks::<FACTOR>().0) {
        *out += share * pixels.iter().sum::<f32>();
    }
}
