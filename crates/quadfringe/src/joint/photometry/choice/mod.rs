//! Step 5: each pixel chooses a place to take offsets and amplitudes from. Near an edge of the texture, a
//! window mixes two albedos; a window further away, on the same side of the edge as the pixel, does not. Where the light does not
//! fit the offsets and amplitudes at the pixel, it takes offsets and amplitudes from a place nearby that explain the pixel and
//! its neighbours best.

mod rows;
#[cfg(test)]
mod tests;

use crate::joint::cells::{CellMaps, Grid};
use crate::joint::model::count as intensities;
use crate::joint::params::photometry::{PLACE_DISTANCE, PLACE_NOISES};
use crate::joint::params::tasks::PLACE_ROWS;
use crate::joint::scene::Scene;
use crate::parallel::lanes::LANES;
use crate::parallel::slots::Slots;
use multiversion::multiversion;
use rayon::prelude::*;
use rows::Rows;

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
/// Number of unknowns of a pixel, albedo and phase. The squared residual of its intensities has the expectation of their number
/// less this, in units of the variance of the noise.
const UNKNOWNS: f32 = 2.0;

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

    /// Chooses a place for every pixel, by how well the intensities fit with the best albedo and, to first order, the best
    /// phase.
    pub fn make(
        &mut self,
        maps: &CellMaps,
        scene: &Scene<'_>,
        ratios: [f32; 4],
        [phase, modulation]: [&[f32]; 2],
        noise: f32,
    ) {
        let (Self { places, stride, aside, slots }, grid) = (self, scene.grid);
        (*stride, *aside) =
            (grid.stride, (PLACE_DISTANCE * scene.period_px as f32).round().max(1.0) as usize);
        let aside = *aside as isize;
        places.clear();
        places.resize(grid.pixels(), 0);
        let least = PLACE_NOISES * (intensities(ratios) - UNKNOWNS) * noise * noise;
        places.par_chunks_mut(PLACE_ROWS * *stride).enumerate().for_each_init(
            || slots.take(),
            |rows, (block, places)| {
                let inside = |y: isize| y.clamp(0, grid.height as isize - 1) as usize;
                let (first, count) = ((block * PLACE_ROWS) as isize, places.len() / grid.stride);
                let rows = &mut **rows;
                let lines: Vec<usize> = (first - 1..=first + count as isize).map(inside).collect();
                rows.prepare(scene, &lines, phase, ratios);
                let from = |y: usize, down: isize| inside(y as isize + down * aside);
                let planes = [modulation, scene.usable];
                rows.measure(maps, scene, planes, &lines, |y| from(y, 0), &[0]);
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
                    rows.measure(maps, scene, planes, &lines, |y| from(y, down), &rights);
                    for k in 0..rights.len() {
                        rows.compare((first + k) as u8, k * lines.len(), grid, places);
                    }
                }
            },
        );
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
