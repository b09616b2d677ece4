//! Smooth parts of the phase on the coarse level: pixels that lie with their neighbours on one lit surface.

use super::cells::Grid;
use super::neighbours::around;
use super::params::validity::SAME_SURFACE_RAD;
use super::scene::PhaseMap;
use multiversion::multiversion;
use rayon::prelude::*;

/// Writes 1 into `discontinuities` for every pixel that does not lie on one lit surface with its eight neighbours. For
/// all other pixels it writes their modulation into `smooth_modulation`. The remaining entries of both maps become 0.
pub(super) fn mark_discontinuities(
    grid: &Grid,
    map: PhaseMap<'_>,
    discontinuities: &mut [f32],
    smooth_modulation: &mut [f32],
) {
    let out = discontinuities.par_chunks_mut(grid.stride).zip(smooth_modulation.par_chunks_mut(grid.stride));
    out.enumerate().for_each(|(y, (discontinuities, smooth_modulation))| {
        let near = around(y, grid.height);
        let [phase, modulation] =
            [map.phase, map.modulation].map(|plane| near.map(|y| &plane[y * grid.stride..][..grid.stride]));
        let near = NearRows { phase, modulation };
        mark_row(&near, grid.width, discontinuities, smooth_modulation);
    });
}

/// The rows above, at and below a row of pixels.
struct NearRows<'a> {
    phase: [&'a [f32]; 3],
    modulation: [&'a [f32]; 3],
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn mark_row(near: &NearRows, width: usize, discontinuities: &mut [f32], smooth_modulation: &mut [f32]) {
    discontinuities.fill(1.0);
    smooth_modulation.fill(0.0);
    let n = width - 2;
    let [a, b, c] = near.phase.map(|row| [0, 1, 2].map(|k| &row[k..k + n]));
    let lit = near.modulation.map(|row| [0, 1, 2].map(|k| &row[k..k + n]));
    let (discontinuities, smooth) = (&mut discontinuities[1..=n], &mut smooth_modulation[1..=n]);
    for x in 0..n {
        let twice = 2.0 * b[1][x];
        let bend = |p: f32, q: f32| (p + q - twice).abs();
        let upper = |p: f32, q: f32| if p > q { p } else { q };
        let lower = |p: f32, q: f32| if p < q { p } else { q };
        let straight = upper(bend(b[0][x], b[2][x]), bend(a[1][x], c[1][x]));
        let diagonal = upper(bend(a[0][x], c[2][x]), bend(a[2][x], c[0][x]));
        let dark = lit.map(|row| lower(lower(row[0][x], row[1][x]), row[2][x]));
        let least = lower(lower(dark[0], dark[1]), dark[2]);
        let whole = (upper(straight, diagonal) < SAME_SURFACE_RAD) & (least > 0.0);
        (discontinuities[x], smooth[x]) = if whole { (0.0, lit[1][1][x]) } else { (1.0, 0.0) };
    }
}
