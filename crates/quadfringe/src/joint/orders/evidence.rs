//! What the pixels of a node see of their fringes: its phase, and sums that tell every order's misfit.

use super::matching::{Evidence, Seen};
use super::{Rows, SAMPLED_ROWS, SUMS, Wrapped};
use crate::joint::scene::Scene;
use crate::parallel::angle::{atan2, sin_cos, wrap, wrap_positive};
use crate::parallel::lanes::{LANES, Lanes, add, lanes, take};
use multiversion::multiversion;

/// What a pixel sees of a cosine, cut where noise or glare has taken over.
#[inline(always)]
pub(super) fn cosine(light: f32, albedo: f32, [a, b]: [f32; 2]) -> f32 {
    let scale = albedo * b;
    let seen = (light - albedo * a) / if scale > 1e-6 { scale } else { 1e-6 };
    let seen = if seen < 2.0 { seen } else { 2.0 };
    if seen > -2.0 { seen } else { -2.0 }
}

/// Albedo by what R and B see of a phase: they are never both dark.
#[inline(always)]
pub(super) fn albedo(phase: f32, [red, blue]: [f32; 2], [[a_r, b_r], [a_b, b_b]]: [[f32; 2]; 2]) -> f32 {
    let (s, c) = sin_cos(phase);
    let (r, b) = (a_r + b_r * c, a_b - b_b * s);
    let norm = r * r + b * b;
    (red * r + blue * b) / if norm > 1e-6 { norm } else { 1e-6 }
}

/// Wrapped phase of the nodes of one row: that of the lit pixel nearest to the middle of each cell.
#[inline(never)]
pub(super) fn node_phases(scene: &Scene<'_>, known: &Wrapped<'_>, row: usize, out: &mut [f32]) {
    let grid = scene.grid;
    let half = grid.step / 2;
    for (column, out) in out.iter_mut().enumerate() {
        let (cy, cx) = (row * grid.step + half, column * grid.step + half);
        let middle = cy.min(grid.height - 1) * grid.stride + cx;
        *out = wrap_positive(known.phase[middle]);
        if known.modulation[middle] > 0.0 {
            continue;
        }
        let mut nearest = usize::MAX;
        for y in row * grid.step..((row + 1) * grid.step).min(grid.height) {
            for x in column * grid.step..(column + 1) * grid.step {
                let far = y.abs_diff(cy).pow(2) + x.abs_diff(cx).pow(2);
                if far < nearest && known.modulation[y * grid.stride + x] > 0.0 {
                    (nearest, *out) = (far, wrap_positive(known.phase[y * grid.stride + x]));
                }
            }
        }
    }
}

/// Sums over the pixels of a row of nodes, into `rows.cells`; the first is the number of lit pixels.
#[inline(never)]
pub(super) fn gather(
    scene: &Scene<'_>,
    known: &Wrapped<'_>,
    ratios: [f32; 2],
    row: usize,
    nodes: &[f32],
    rows: &mut Rows,
) {
    let grid = scene.grid;
    let Rows { maps, node, sums, cells } = rows;
    node.clear();
    nodes.iter().for_each(|&phase| node.extend(std::iter::repeat_n(phase, grid.step)));
    sums.clear();
    sums.resize(grid.stride / LANES, [[0.0; LANES]; SUMS]);
    for y in grid.samples(row, SAMPLED_ROWS) {
        let fringes = known.fringes(scene, y, maps);
        let pixels = [known.phase, known.modulation, scene.usable].map(|plane| scene.row(plane, y));
        add_seen(node, pixels, scene.rows(y), fringes, ratios, sums);
    }
    for (k, line) in cells.iter_mut().enumerate() {
        line.resize(grid.columns, 0.0);
        grid.fold(k, sums, line);
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn add_seen(
    node: &[f32],
    pixels: [&[f32]; 3],
    light: [&[f32]; 4],
    fringes: [&[f32]; 8],
    ratios: [f32; 2],
    sums: &mut [[Lanes; SUMS]],
) {
    let (node, pixels) = (lanes(node), pixels.map(lanes));
    let (light, fringes) = (light.map(lanes), fringes.map(lanes));
    for (i, sums) in sums.iter_mut().enumerate() {
        let (node, [phase, modulation, usable]) = (node[i], take(&pixels, i));
        let (light, fringes) = (take(&light, i), take(&fringes, i));
        let mut terms = [[0.0; LANES]; SUMS];
        for x in 0..LANES {
            let lit = modulation[x] > 0.0;
            let weight = if lit { usable[x] } else { 0.0 };
            // Light counts a thousandth of a pixel, so that a node of saturated pixels is lit and knows nothing.
            terms[0][x] = if lit { weight + LIT } else { 0.0 };
            let own = node[x] + wrap(phase[x] - node[x]);
            let fringe = |c: usize| [fringes[2 * c][x], fringes[2 * c + 1][x]];
            let albedo = albedo(phase[x], [light[0][x], light[2][x]], [fringe(0), fringe(2)]);
            for c in 0..2 {
                let s = cosine(light[2 * c + 1][x], albedo, fringe(2 * c + 1));
                let (sine, cos) = sin_cos(ratios[c] * own);
                let values = [s * s, s * cos, s * sine, cos * cos - sine * sine, 2.0 * sine * cos];
                for k in 0..5 {
                    terms[1 + 5 * c + k][x] = weight * values[k];
                }
            }
        }
        add(sums, &terms);
    }
}

/// What a lit pixel counts at least.
const LIT: f32 = 1.0 / 1024.0;

pub(super) fn evidence(
    phase: f32,
    [g_p, g_q, ir_p, ir_q]: [f32; 4],
    cells: &[Vec<f32>; SUMS],
    x: usize,
) -> Evidence {
    let seen = |from: usize| Seen {
        square: cells[from][x],
        first: [cells[from + 1][x], cells[from + 2][x]],
        second: [cells[from + 3][x], cells[from + 4][x]],
    };
    Evidence {
        phase: Evidence::turns(phase),
        beats: [Evidence::turns(-atan2(g_q, g_p)), Evidence::turns(-atan2(ir_q, ir_p))],
        seen: [seen(1), seen(6)],
        pixels: cells[0][x].floor(),
        lit: cells[0][x] > 0.0,
    }
}
