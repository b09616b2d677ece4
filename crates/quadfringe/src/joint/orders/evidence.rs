//! Step 4: the evidence of the nodes. A node has a phase, beats from the local fit, and sums over its pixels, from which the cost
//! of every order follows.

use super::matching::{CosineSums, NodeEvidence};
use super::wrapped::Wrapped;
use crate::joint::cells::RowMaps;
use crate::joint::infrared::{Waves, with_waves};
use crate::joint::local_fit::Beats;
use crate::joint::model::{CellFringes, FringeRows, has_quadrature};
use crate::joint::params::local_fit::CONTRAST_MIN;
use crate::joint::params::orders::{ALBEDO_KNOWN, LIT_WEIGHT, OBSERVED_COSINE_MAX};
use crate::joint::params::pyramid::SAMPLED_ROWS;
use crate::joint::scene::{PixelRow, Scene};
use crate::parallel::angle::{atan2, sin_cos, wrap, wrap_positive};
use crate::parallel::lanes::{LANES, Lanes, add, lanes, take};
use multiversion::multiversion;

/// Number of sums over the pixels of a node: the number of pixels, then s^2, s cos f, s sin f, cos 2f, sin 2f for G and
/// for IR.
const SUMS: usize = 11;

/// The fringe numbers of an encoding.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ratios {
    /// Fringe numbers divided by the first.
    pub ratios: [f32; 4],
    /// Phase of the middle order at a wrapped phase of 0.
    pub middle_rad: f32,
}

/// Working rows of one task.
#[derive(Debug, Default)]
pub(super) struct EvidenceRows {
    maps: [RowMaps; 2],
    node_phase: Vec<f32>,
    sums: Vec<[Lanes; SUMS]>,
    cells: [Vec<f32>; SUMS],
}

/// The cosine of a channel that a pixel observes, limited where noise or glare dominates.
#[inline(always)]
pub(super) fn observed_cosine(light: f32, albedo: f32, offset: f32, amplitude: f32) -> f32 {
    let scale = albedo * amplitude;
    let seen = (light - albedo * offset) / if scale > 1e-6 { scale } else { 1e-6 };
    let seen = if seen < OBSERVED_COSINE_MAX { seen } else { OBSERVED_COSINE_MAX };
    if seen > -OBSERVED_COSINE_MAX { seen } else { -OBSERVED_COSINE_MAX }
}

/// Albedo of a pixel from R and B at a phase; the two are never both dark. The arrays hold values of R and B. R alone may be
/// dark: the less it shows, the closer the albedo is to that of the surroundings, which is 1. `known` is the weight of the
/// surroundings ([`albedo_known`]).
#[inline(always)]
pub(super) fn albedo(phase: f32, light: [f32; 2], offset: [f32; 2], amplitude: [f32; 2], known: f32) -> f32 {
    let (s, c) = sin_cos(phase);
    let (r, b) = (offset[0] + amplitude[0] * c, offset[1] - amplitude[1] * s);
    let known = known * offset[0] * offset[0];
    let norm = r * r + b * b + known;
    (light[0] * r + light[1] * b + known) / if norm > 1e-6 { norm } else { 1e-6 }
}

/// Weight of the albedo of the surroundings, relative to that of the light of R: none for R and B in quadrature.
#[inline(always)]
pub(super) fn albedo_known(ratios: [f32; 4]) -> f32 {
    if has_quadrature(ratios) { 0.0 } else { ALBEDO_KNOWN }
}

/// Wrapped phase of the nodes of one row, in [0, 2 pi): the phase of the lit pixel that is nearest to the middle of the
/// cell.
#[inline(never)]
pub(super) fn node_phases(scene: &Scene<'_>, wrapped: &Wrapped<'_>, row: usize, out: &mut [f32]) {
    let grid = scene.grid;
    let half = grid.step / 2;
    for (column, out) in out.iter_mut().enumerate() {
        let (cy, cx) = (row * grid.step + half, column * grid.step + half);
        let middle = cy.min(grid.height - 1) * grid.stride + cx;
        *out = wrap_positive(wrapped.map.phase[middle]);
        if wrapped.map.modulation[middle] > 0.0 {
            continue;
        }
        let mut nearest = usize::MAX;
        for y in row * grid.step..((row + 1) * grid.step).min(grid.height) {
            for x in column * grid.step..(column + 1) * grid.step {
                let far = y.abs_diff(cy).pow(2) + x.abs_diff(cx).pow(2);
                if far < nearest && wrapped.map.modulation[y * grid.stride + x] > 0.0 {
                    (nearest, *out) = (far, wrap_positive(wrapped.map.phase[y * grid.stride + x]));
                }
            }
        }
    }
}

/// Appends the evidence of a row of nodes, whose wrapped phases are `nodes`, to `out`.
#[inline(never)]
pub(super) fn row_evidence(
    scene: &Scene<'_>,
    wrapped: &Wrapped<'_>,
    ratios: Ratios,
    row: usize,
    nodes: &[f32],
    rows: &mut EvidenceRows,
    out: &mut Vec<NodeEvidence>,
) {
    gather(scene, wrapped, ratios, row, nodes, rows);
    let beats = wrapped.fit.beats(row);
    let (grid, half) = (scene.grid, scene.grid.step / 2);
    let middle = (row * grid.step + half).min(grid.height - 1) * grid.stride + half;
    out.extend((0..nodes.len()).map(|x| {
        let infrared = scene.pair.map(|pair| pair.at(middle + x * grid.step));
        let weights =
            Weights { beats: weights(wrapped.fit.cell(row, x)), cosines: weights(wrapped.cell(row, x)) };
        NodeEvidence { infrared, ..evidence(nodes[x], &beats, &rows.cells, x, weights) }
    }));
}

/// Computes the sums over the pixels of each node of a row into `rows.cells`. The first sum is the number of usable lit
/// pixels, plus the small weight of all lit pixels.
fn gather(
    scene: &Scene<'_>,
    wrapped: &Wrapped<'_>,
    ratios: Ratios,
    row: usize,
    nodes: &[f32],
    rows: &mut EvidenceRows,
) {
    let grid = scene.grid;
    let EvidenceRows { maps, node_phase, sums, cells } = rows;
    node_phase.clear();
    nodes.iter().for_each(|&phase| node_phase.extend(std::iter::repeat_n(phase, grid.step)));
    sums.clear();
    sums.resize(grid.stride / LANES, [[0.0; LANES]; SUMS]);
    for y in grid.samples(row, SAMPLED_ROWS) {
        let fringes = wrapped.fringes(scene, y, maps);
        let pixels = scene.pixel_row(wrapped.map, y);
        with_waves!(scene, y, ratios.ratios, |waves| {
            let origin_rad = waves.origin_rad(ratios.middle_rad);
            add_cosines(node_phase, &pixels, scene.rows(y), &fringes, waves, origin_rad, sums);
        });
    }
    for (k, line) in cells.iter_mut().enumerate() {
        line.resize(grid.columns, 0.0);
        grid.fold(k, sums, line);
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn add_cosines<W: Waves>(
    node_phase: &[f32],
    pixels: &PixelRow,
    light: [&[f32]; 4],
    fringes: &FringeRows,
    waves: W,
    origin_rad: f32,
    sums: &mut [[Lanes; SUMS]],
) {
    let pixels = [node_phase, pixels.phase, pixels.modulation, pixels.usable].map(lanes);
    let (light, offset, amplitude) =
        (light.map(lanes), fringes.offset.map(lanes), fringes.amplitude.map(lanes));
    for (i, sums) in sums.iter_mut().enumerate() {
        let [node, phase, modulation, usable] = take(&pixels, i);
        let (light, offset, amplitude) = (take(&light, i), take(&offset, i), take(&amplitude, i));
        let (ratios, vector) = (waves.ratios(), waves.vector(i));
        let mut terms = [[0.0; LANES]; SUMS];
        for x in 0..LANES {
            let lit = modulation[x] > 0.0;
            let weight = if lit { usable[x] } else { 0.0 };
            // Saturated lit pixels have a small weight: a node with only such pixels counts as lit without evidence.
            terms[0][x] = if lit { weight + LIT_WEIGHT } else { 0.0 };
            let unwrapped = node[x] + wrap(phase[x] - node[x]);
            let [light_rb, offset_rb, amplitude_rb] =
                [&light, &offset, &amplitude].map(|rows| [rows[0][x], rows[2][x]]);
            let albedo = albedo(phase[x], light_rb, offset_rb, amplitude_rb, albedo_known(ratios));
            let angles = [ratios[1] * unwrapped, waves.infrared(&vector, x, unwrapped + origin_rad).phase];
            for beat in 0..2 {
                let c = 2 * beat + 1;
                let s = observed_cosine(light[c][x], albedo, offset[c][x], amplitude[c][x]);
                let (sine, cos) = sin_cos(angles[beat]);
                let values = [s * s, s * cos, s * sine, cos * cos - sine * sine, 2.0 * sine * cos];
                for k in 0..5 {
                    terms[1 + 5 * beat + k][x] = weight * values[k];
                }
            }
        }
        add(sums, &terms);
    }
}

/// Weights of the evidence of G and IR at a node, in [0, 1].
#[derive(Debug, Clone, Copy)]
struct Weights {
    beats: [f32; 2],
    cosines: [f32; 2],
}

/// Weights of G and IR with these offsets and amplitudes. Where fringes of two surfaces cancel in a window, or where a channel is in
/// shadow, its phase is that of the noise.
fn weights(CellFringes { offset, amplitude }: CellFringes) -> [f32; 2] {
    [1, 3].map(|c| (amplitude[c] / (CONTRAST_MIN * offset[c]).max(1e-6)).clamp(0.0, 1.0).powi(2))
}

/// Evidence of node `x` of a row.
fn evidence(
    phase: f32,
    beats: &Beats<'_>,
    cells: &[Vec<f32>; SUMS],
    x: usize,
    weights: Weights,
) -> NodeEvidence {
    let pixels = cells[0][x].floor();
    let cosines = |beat: usize| {
        let (weight, from) = (weights.cosines[beat], 1 + 5 * beat);
        let [square, cos, sin, cos_twice, sin_twice] = [0, 1, 2, 3, 4].map(|k| weight * cells[from + k][x]);
        CosineSums { pixels: weight * pixels, square, first: [cos, sin], second: [cos_twice, sin_twice] }
    };
    let beat = |c: usize| NodeEvidence::turns(-atan2(beats.sine[c][x], beats.cosine[c][x]));
    NodeEvidence {
        phase: NodeEvidence::turns(phase),
        beats: [beat(0), beat(1)],
        weights: weights.beats,
        cosines: [cosines(0), cosines(1)],
        pixels,
        lit: cells[0][x] > 0.0,
        infrared: None,
    }
}
