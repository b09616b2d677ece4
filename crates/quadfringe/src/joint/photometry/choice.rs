//! Step 5 on textured surfaces: each pixel chooses a place to take offsets and amplitudes from. Near an edge of the texture, a
//! window mixes two albedos; a window further away, on the same side of the edge as the pixel, does not. Where the light does not
//! fit the offsets and amplitudes at the pixel, it takes offsets and amplitudes from a place nearby that explain the pixel and
//! its neighbours best.

use crate::joint::cells::{CellMaps, Grid, RowMaps};
use crate::joint::model::carriers;
use crate::joint::neighbours::binomial;
use crate::joint::params::photometry::{PLACE_BETTER, PLACE_DISTANCE, PLACE_GAIN_MIN, PLACE_NOISES};
use crate::joint::params::tasks::PLACE_ROWS;
use crate::joint::scene::Scene;
use crate::joint::slopes::Slopes;
use crate::parallel::lanes::{LANES, lanes, lanes_mut, put, take};
use crate::parallel::slots::Slots;
use multiversion::multiversion;
use rayon::prelude::*;

/// Places to take offsets and amplitudes from, in units of `PLACE_DISTANCE`: rows down, columns right. The first place is the
/// pixel itself; the others follow row by row.
const PLACES: [[isize; 2]; 17] = [
    [0, 0],
    [-2, -2],
    [-2, 0],
    [-2, 2],
    [-1, -1],
    [-1, 0],
    [-1, 1],
    [0, -2],
    [0, -1],
    [0, 1],
    [0, 2],
    [1, -1],
    [1, 0],
    [1, 1],
    [2, -2],
    [2, 0],
    [2, 2],
];
/// Expectation of the squared residual in units of the variance of the noise: four intensities minus the two unknowns
/// albedo and phase.
const RESIDUAL_BY_NOISE: f32 = 2.0;

/// The place that every pixel takes offsets and amplitudes from.
#[derive(Debug, Default)]
pub(super) struct Choice {
    /// Index into [`PLACES`] for each pixel, in padded rows of the scene of the fit. Empty if no pixel takes another
    /// place.
    places: Vec<u8>,
    stride: usize,
    aside: usize,
    slots: Slots<Rows>,
}

/// Rows of one task, including one above and one below its pixels, because residuals are averaged over neighbours.
#[derive(Debug, Default)]
struct Rows {
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

impl Choice {
    /// Every pixel takes the offsets and amplitudes at its position again.
    pub fn forget(&mut self) {
        self.places.clear();
    }

    /// Sets `usable` to 0 for the pixels of row `y` that have chosen another place.
    pub fn leave_out(&self, y: usize, usable: &mut [f32]) {
        if self.places.is_empty() {
            return;
        }
        for (usable, &place) in usable.iter_mut().zip(&self.places[y * self.stride..][..self.stride]) {
            *usable = if place == 0 { *usable } else { 0.0 };
        }
    }

    /// Chooses a place for every pixel, by how well the four intensities fit with the best albedo and, to first order, the best
    /// phase. Returns the share of the lit pixels that take another place.
    pub fn make(
        &mut self,
        (grid, maps): (&Grid, &CellMaps),
        scene: &Scene<'_>,
        how: ([f32; 3], &Slopes),
        [phase, modulation]: [&[f32]; 2],
        noise: f32,
    ) -> f32 {
        let Self { places, stride, aside, slots } = self;
        (*stride, *aside) =
            (grid.stride, (PLACE_DISTANCE * scene.period_px as f32).round().max(1.0) as usize);
        let aside = *aside as isize;
        places.clear();
        places.resize(grid.pixels(), 0);
        let least = PLACE_NOISES * RESIDUAL_BY_NOISE * noise * noise;
        places.par_chunks_mut(PLACE_ROWS * *stride).enumerate().for_each_init(
            || slots.take(),
            |rows, (block, places)| {
                let inside = |y: isize| y.clamp(0, grid.height as isize - 1) as usize;
                let (first, count) = ((block * PLACE_ROWS) as isize, places.len() / grid.stride);
                let rows = &mut **rows;
                let lines: Vec<usize> = (first - 1..=first + count as isize).map(inside).collect();
                rows.prepare(scene, &lines, phase, how);
                let from = |y: usize, down: isize| inside(y as isize + down * aside);
                let planes = [modulation, scene.usable];
                rows.measure((grid, maps), scene, planes, &lines, |y| from(y, 0), &[0]);
                let lights = lines[1..=count].iter().map(|&y| scene.row(modulation, y));
                if !rows.find_active(lights, grid.width, least) {
                    return;
                }
                let mut places_left = (1..PLACES.len()).peekable();
                while let Some(&first) = places_left.peek() {
                    let down = PLACES[first][0];
                    let rights: Vec<isize> =
                        std::iter::from_fn(|| places_left.next_if(|&place| PLACES[place][0] == down))
                            .map(|place| PLACES[place][1] * aside)
                            .collect();
                    rows.measure((grid, maps), scene, planes, &lines, |y| from(y, down), &rights);
                    for k in 0..rights.len() {
                        rows.compare((first + k) as u8, k * lines.len(), grid, places);
                    }
                }
            },
        );
        let chosen = count(places, |place| *place != 0);
        chosen as f32 / count(modulation, |light| *light > 0.0).max(1) as f32
    }

    /// Replaces offsets and amplitudes of row `y` where its pixels have chosen another place. The grid lies over the scene of the
    /// fit or over a finer image of it.
    pub fn apply(&self, grid: &Grid, maps: &CellMaps, y: usize, rows: &mut [&mut [f32]; 8]) {
        if self.places.is_empty() {
            return;
        }
        let places = &self.places[y * self.stride / grid.stride * self.stride..][..self.stride];
        apply(places, self.aside, (grid, maps), y, rows);
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn apply(
    places: &[u8],
    aside: usize,
    (grid, maps): (&Grid, &CellMaps),
    y: usize,
    rows: &mut [&mut [f32]; 8],
) {
    let factor = grid.stride / places.len();
    let aside = (aside * factor) as isize;
    let last = [grid.height - 1, grid.width - 1].map(|last| last as isize);
    for (group, places) in places.chunks(LANES).enumerate() {
        // In most vectors no pixel takes another place.
        if places.iter().fold(0, |any, place| any | place) == 0 {
            continue;
        }
        for (i, &place) in places.iter().enumerate().filter(|(_, place)| **place != 0) {
            let [down, right] = PLACES[usize::from(place)].map(|steps| steps * aside);
            let first = factor * (group * LANES + i);
            let from_row = (y as isize + down).clamp(0, last[0]) as usize;
            let from = (first as isize + right).clamp(0, last[1]) as f32 + 0.5 * (factor - 1) as f32;
            let found: [f32; 8] = maps.at(grid, from_row, from);
            for (row, value) in rows.iter_mut().zip(found) {
                row[first..first + factor].fill(value);
            }
        }
    }
}

impl Rows {
    fn prepare(
        &mut self,
        scene: &Scene<'_>,
        lines: &[usize],
        phase: &[f32],
        (ratios, slopes): ([f32; 3], &Slopes),
    ) {
        let stride = scene.grid.stride;
        let Self { maps, carriers, best, active, smooth, .. } = self;
        carriers.resize_with(lines.len(), Default::default);
        for (rows, &y) in carriers.iter_mut().zip(lines) {
            rows.iter_mut().for_each(|row| row.resize(stride, 0.0));
            carry(
                [scene.row(phase, y), slopes.loss(scene, y, maps)],
                ratios,
                rows.each_mut().map(Vec::as_mut_slice),
            );
        }
        best.resize_with(lines.len(), Vec::new);
        best.iter_mut().for_each(|row| row.resize(stride, 0.0));
        smooth.resize(stride, 0.0);
        active.clear();
        active.resize(stride / LANES, true);
    }

    /// Computes the squared residuals of the rows `lines` with offsets and amplitudes of the rows `from`, taken `rights`
    /// columns to the right.
    fn measure(
        &mut self,
        (grid, maps): (&Grid, &CellMaps),
        scene: &Scene<'_>,
        planes: [&[f32]; 2],
        lines: &[usize],
        from: impl Fn(usize) -> usize,
        rights: &[isize],
    ) {
        let Self { maps: rows, wide, carriers, squares, active, .. } = self;
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
    fn find_active<'a>(
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
    fn compare(&mut self, place: u8, first: usize, grid: &Grid, places: &mut [u8]) {
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

fn count<T: Sync>(values: &[T], which: impl Fn(&T) -> bool + Sync) -> usize {
    values.par_chunks(1 << 14).map(|values| values.iter().filter(|value| which(value)).count()).sum()
}

/// Extends a row by its end values: `reach` values before it, and after it until there are `stride + 2 reach` values.
fn widen(row: &[f32], reach: usize, stride: usize, out: &mut Vec<f32>) {
    out.clear();
    out.resize(reach, row[0]);
    out.extend_from_slice(row);
    out.resize(stride + 2 * reach, row[row.len() - 1]);
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn carry(pixels: [&[f32]; 2], ratios: [f32; 3], out: [&mut [f32]; 8]) {
    let pixels = pixels.map(lanes);
    let mut out = out.map(lanes_mut);
    for i in 0..pixels[0].len() {
        let [phase, loss] = take(&pixels, i);
        let mut found = [[0.0; LANES]; 8];
        for x in 0..LANES {
            let carriers = carriers(phase[x], ratios, loss[x]);
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

#[cfg(test)]
mod tests {
    use super::super::edge::{Edge, RATIOS};
    use super::*;

    /// The choice of the pixels, and the share of them that take another place.
    fn choose(edge: &Edge, noise: f32) -> (Choice, f32) {
        let (lit, modulation) = (edge.plane(1.0), edge.plane(0.2));
        let how = (RATIOS, &Slopes::flat(&edge.grid));
        let mut choice = Choice::default();
        let share =
            choice.make((&edge.grid, &edge.maps), &edge.scene(&lit), how, [&edge.phase, &modulation], noise);
        (choice, share)
    }

    /// Greatest difference from the texture of the pixel, with the values at its position and with the chosen ones. Pixels next
    /// to the edge are left out, because their neighbours belong to both textures.
    fn errors(edge: &Edge, choice: &Choice) -> [f32; 2] {
        let mut rows = RowMaps::default();
        let mut sampled = rows.sample_mut::<8>(&edge.grid, &edge.maps, 0, 30);
        let error = |rows: &[&mut [f32]; 8]| {
            let off = |x: usize, k: usize| (rows[k][x] - edge.texture(x)[k]).abs();
            (20..236)
                .filter(|x| !(127..130).contains(x))
                .flat_map(|x| (0..8).map(move |k| off(x, k)))
                .fold(0.0, f32::max)
        };
        let here = error(&sampled);
        choice.apply(&edge.grid, &edge.maps, 30, &mut sampled);
        [here, error(&sampled)]
    }

    #[test]
    fn pixels_near_an_edge_take_offsets_and_amplitudes_of_their_side() {
        let textures =
            [[0.5, 0.4, 0.2, 0.15, 0.6, 0.45, 0.4, 0.35], [0.3, 0.25, 0.5, 0.4, 0.2, 0.15, 0.4, 0.3]];
        let edge = Edge::new(textures, 0.0);
        let (choice, share) = choose(&edge, 1e-3);
        let [here, chosen] = errors(&edge, &choice);
        assert!(here > 0.1, "{here}");
        assert!(chosen < 0.02, "{chosen}");
        // At their position these pixels have a mixture of both textures, so they take no part in the next fit.
        let mut usable = vec![1.0; 256];
        choice.leave_out(30, &mut usable);
        let left_out: Vec<usize> = (0..256).filter(|&x| usable[x] == 0.0).collect();
        assert!(left_out.iter().all(|x| (112..144).contains(x)), "{left_out:?}");
        assert!(
            (118..138).filter(|x| !(127..130).contains(x)).all(|x| left_out.contains(&x)),
            "{left_out:?}"
        );
        assert!((0.04..0.13).contains(&share), "{share}");
    }

    #[test]
    fn residuals_that_noise_explains_move_no_pixel() {
        let textures = [[0.5, 0.4, 0.5, 0.4, 0.5, 0.4, 0.5, 0.4], [0.5, 0.4, 0.5, 0.4, 0.5, 0.4, 0.5, 0.39]];
        let edge = Edge::new(textures, 0.0);
        let (choice, share) = choose(&edge, 0.03);
        let [here, chosen] = errors(&edge, &choice);
        assert_eq!(here, chosen);
        assert_eq!(share, 0.0);
    }
}
