//! What the pixels of a cell have in common.

use crate::joint::params::energy::SPREAD_MAX_RAD;
use crate::joint::scene::{PhaseMap, Scene};

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
    let share = 1.0 / (factor * factor) as f32;
    for row in rows {
        for (out, pixels) in out.iter_mut().zip(row.chunks_exact(factor)) {
            *out += share * pixels.iter().sum::<f32>();
        }
    }
}
