//! Comparison of places for some rows of pixels: squared residuals with the offsets and amplitudes of each place.

use crate::joint::cells::{CellMaps, Grid, RowMaps};
use crate::joint::infrared::{Waves, with_waves};
use crate::joint::neighbours::binomial;
use crate::joint::params::photometry::{PLACE_BETTER, PLACE_GAIN_MIN};
use crate::joint::scene::Scene;
use crate::parallel::lanes::{LANES, lanes, lanes_mut, put, take};
use multiversion::multiversion;

/// Rows of one task, including one above and one below its pixels, because residuals are averaged over neighbours.
#[derive(Debug, Default)]
pub(super) struct Rows {
    maps: RowMaps,
    /// Offsets and amplitudes of one row, extended on both sides up to the furthest place.
    wide: [Vec<f32>; 8],
    /// Cosines and derivatives of the four channels.
    carriers: Vec<[Vec<f32>; 8]>,
    /// Squared residuals with the offsets and amplitudes of the places of one row, one place after the other.
    squares: Vec<Vec<f32>>,
    /// Squared residual below which another place is taken.
    best: Vec<Vec<f32>>,
    /// The vectors of pixels that compare places.
    active: Vec<bool>,
    smooth: Vec<f32>,
    spare: Vec<f32>,
}

impl Rows {
    pub fn prepare(&mut self, scene: &Scene<'_>, lines: &[usize], phase: &[f32], ratios: [f32; 4]) {
        let stride = scene.grid.stride;
        let Self { carriers, best, active, smooth, .. } = self;
        carriers.resize_with(lines.len(), Default::default);
        for (rows, &y) in carriers.iter_mut().zip(lines) {
            rows.iter_mut().for_each(|row| row.resize(stride, 0.0));
            let out = rows.each_mut().map(Vec::as_mut_slice);
            with_waves!(scene, y, ratios, |waves| carry(scene.row(phase, y), waves, out));
        }
        best.resize_with(lines.len(), Vec::new);
        best.iter_mut().for_each(|row| row.resize(stride, 0.0));
        smooth.resize(stride, 0.0);
        active.clear();
        active.resize(stride / LANES, true);
    }

    /// Computes the squared residuals of the rows `lines` with offsets and amplitudes of the rows `from`, taken `rights`
    /// columns to the right.
    pub fn measure(
        &mut self,
        maps: &CellMaps,
        scene: &Scene<'_>,
        planes: [&[f32]; 2],
        lines: &[usize],
        from: impl Fn(usize) -> usize,
        rights: &[isize],
    ) {
        let (Self { maps: rows, wide, carriers, squares, active, .. }, grid) = (self, scene.grid);
        let reach = rights.iter().map(|right| right.unsigned_abs()).max().unwrap_or(0);
        squares.resize_with(squares.len().max(rights.len() * lines.len()), Vec::new);
        for (i, &y) in lines.iter().enumerate() {
            let model: [&[f32]; 8] = rows.sample(grid, maps, 0, from(y));
            wide.iter_mut()
                .zip(model)
                .for_each(|(wide, row)| widen(&row[..grid.width], reach, grid.stride, wide));
            let carriers = carriers[i].each_ref().map(Vec::as_slice);
            let lit = planes.map(|plane| scene.row(plane, y));
            for (k, right) in rights.iter().enumerate() {
                let first = reach.saturating_add_signed(*right);
                let model = wide.each_ref().map(|row| &row[first..first + grid.stride]);
                let out = &mut squares[k * lines.len() + i];
                out.resize(grid.stride, 0.0);
                squared_residuals(model, carriers, scene.rows(y), lit, active, out);
            }
        }
    }

    /// Finds the vectors that compare places: those whose mean squared residual exceeds `least` plus a share of the squared
    /// modulation, and their neighbours. Returns whether there are any. `lights` are the rows of the modulation.
    pub fn find_active<'a>(
        &mut self,
        lights: impl Iterator<Item = &'a [f32]> + Clone,
        width: usize,
        least: f32,
    ) -> bool {
        let Self { squares, best, active, spare, smooth, .. } = self;
        let exceeds = |group: usize| {
            let pixels = LANES * group..LANES * (group + 1);
            let here = squares[1..].iter().zip(lights.clone()).flat_map(|(row, light)| {
                row[pixels.clone()].iter().zip(&light[pixels.clone()]).filter(|(here, _)| **here > 0.0)
            });
            let excess = here.map(|(here, light)| here - least - (PLACE_GAIN_MIN * light).powi(2));
            excess.sum::<f32>() > 0.0
        };
        let much: Vec<bool> = (0..active.len()).map(exceeds).collect();
        for (i, active) in active.iter_mut().enumerate() {
            *active = much[i.saturating_sub(1)..(i + 2).min(much.len())].contains(&true);
        }
        for (i, (best, light)) in best.iter_mut().zip(lights).enumerate() {
            binomial([&squares[i], &squares[i + 1], &squares[i + 2]], width, spare, smooth);
            for (best, (here, light)) in best.iter_mut().zip(smooth.iter().zip(light)) {
                *best = PLACE_BETTER * here - (PLACE_GAIN_MIN * light).powi(2);
            }
        }
        much.contains(&true)
    }

    /// Takes `place`, whose squared residuals begin at index `first`, for the pixels where it is better than every
    /// place before.
    pub fn compare(&mut self, place: u8, first: usize, grid: &Grid, places: &mut [u8]) {
        let Self { squares, best, spare, smooth, .. } = self;
        for (i, (places, best)) in places.chunks_mut(grid.stride).zip(best).enumerate() {
            let near = [0, 1, 2].map(|k| squares[first + i + k].as_slice());
            binomial(near, grid.width, spare, smooth);
            take_better(place, &smooth[..grid.width], best, places);
        }
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn take_better(place: u8, square: &[f32], best: &mut [f32], places: &mut [u8]) {
    for ((square, best), chosen) in square.iter().zip(best).zip(places) {
        let better = *square < *best;
        *best = best.min(*square);
        *chosen = if better { place } else { *chosen };
    }
}

/// Extends a row by its end values: `reach` values before it, and after it until there are `stride + 2 reach` values.
fn widen(row: &[f32], reach: usize, stride: usize, out: &mut Vec<f32>) {
    out.clear();
    out.resize(reach, row[0]);
    out.extend_from_slice(row);
    out.resize(stride + 2 * reach, row[row.len() - 1]);
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn carry<W: Waves>(phase: &[f32], waves: W, out: [&mut [f32]; 8]) {
    let phase = lanes(phase);
    let mut out = out.map(lanes_mut);
    for (i, phase) in phase.iter().enumerate() {
        let vector = waves.vector(i);
        let mut found = [[0.0; LANES]; 8];
        for x in 0..LANES {
            let carriers = waves.carriers(&vector, x, phase[x]);
            for c in 0..4 {
                (found[c][x], found[4 + c][x]) = (carriers.cosine[c], carriers.derivative[c]);
            }
        }
        put(&mut out, i, &found);
    }
}

/// Squared residual after the best albedo and a small change of the phase. It is 0 for unlit pixels, and the greatest number in
/// vectors that do not compare places.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn squared_residuals(
    model: [&[f32]; 8],
    carriers: [&[f32]; 8],
    light: [&[f32]; 4],
    lit: [&[f32]; 2],
    active: &[bool],
    out: &mut [f32],
) {
    let (model, carriers) = (model.map(lanes), carriers.map(lanes));
    let (light, lit) = (light.map(lanes), lit.map(lanes));
    for (i, out) in lanes_mut(out).iter_mut().enumerate() {
        if !active[i] {
            *out = [f32::MAX; LANES];
            continue;
        }
        let (model, carriers) = (take(&model, i), take(&carriers, i));
        let (light, lit) = (take(&light, i), take(&lit, i));
        let mut found = [0.0; LANES];
        for x in 0..LANES {
            let (mut mm, mut md, mut dd) = (1e-9f32, 0.0f32, 1e-9f32);
            let (mut ms, mut ds, mut ss) = (0.0f32, 0.0f32, 0.0f32);
            for c in 0..4 {
                let (a, b) = (model[2 * c][x], model[2 * c + 1][x]);
                let (m, d, s) = (a + b * carriers[c][x], b * carriers[4 + c][x], light[c][x]);
                mm += m * m;
                md += m * d;
                dd += d * d;
                ms += m * s;
                ds += d * s;
                ss += s * s;
            }
            let (here, across) = (dd - md * md / mm, ds - md * ms / mm);
            let rest = ss - ms * ms / mm - across * across / if here > 1e-9 { here } else { 1e-9 };
            let on = (lit[0][x] > 0.0) & (lit[1][x] > 0.0);
            found[x] = if on & (rest > 0.0) { rest } else { 0.0 };
        }
        *out = found;
    }
}
