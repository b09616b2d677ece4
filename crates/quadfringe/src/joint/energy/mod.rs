//! Step 6: phase, albedo and contrast as the minimum of one energy (J16), on cells of a few pixels.
//!
//! The data term is the squared difference between the light and the model (S1). Four priors say how much neighbouring cells
//! differ in surface, brightness, colour and contrast. How much that is, and how large the noise is, is estimated from the shot
//! itself, tile by tile. Tiles overlap and are independent of each other, so the result does not depend on the threads.

mod cells;
mod data;
mod descent;
mod exp;
mod plane;
mod preconditioner;
mod priors;
mod scales;
mod solve;
mod start;
mod tile;

use super::params::energy::{
    BLENDED, CELL_MAX_PX, CELLS_PER_PERIOD_MIN, DISCARDED, SIDE, SMALL_CELLS_PER_PERIOD_MIN,
};
use super::scene::{PhaseMap, Scene};
use crate::parallel::slots::Slots;
use cells::Cells;
use plane::Plane;
use rayon::prelude::*;
use tile::{Found, MARGIN, STEP, Tile};

/// The minimiser, with its working memory.
#[derive(Debug, Default)]
pub(super) struct Energy {
    cells: Cells,
    tiles: Vec<Found>,
    slots: Slots<Tile>,
}

/// What the shot is known to be.
#[derive(Debug, Clone, Copy)]
pub(super) struct Prior {
    /// Fringe numbers divided by the first.
    pub ratios: [f32; 3],
    /// Standard deviation of the intensity of a pixel, in linear light.
    pub noise: f32,
}

impl Energy {
    /// Corrects the absolute phase of the lit pixels of a scene, in place.
    pub fn minimise(&mut self, scene: &Scene<'_>, prior: Prior, phase: &mut [f32], modulation: &[f32]) {
        let factor = cell_px(scene.period_px);
        self.cells.average(scene, PhaseMap { phase, modulation }, factor);
        let Self { cells, tiles, slots } = self;
        let [rows, across] = [cells.height, cells.width].map(|side| side.div_ceil(STEP));
        tiles.resize_with(rows * across, Found::default);
        let variance = (prior.noise / factor as f32).powi(2);
        tiles.par_iter_mut().enumerate().for_each_init(
            || slots.take(),
            |tile, (n, found)| {
                found.inside.clear();
                if cells.load([n / across, n % across], tile) {
                    tile.ratios = prior.ratios;
                    tile.minimise(variance);
                    tile.write(found);
                }
            },
        );
        let tiles = &*tiles;
        cells.replace(|y, x| blend(tiles, across, y, x));
        cells.correct(scene, phase);
    }

    /// Variance of the phase by noise along row `y` of the scene, rad^2; 0 where there is no lit cell.
    pub fn variance<'a>(&self, scene: &Scene<'_>, y: usize, rows: &'a mut cells::Rows) -> &'a [f32] {
        self.cells.variance(scene, y, rows)
    }
}

pub(super) use cells::Rows;

/// Side of the cells in pixels: the largest power of two that resolves the fringes.
fn cell_px(period_px: f64) -> usize {
    let mut side = if period_px >= 2.0 * SMALL_CELLS_PER_PERIOD_MIN { 2 } else { 1 };
    while 2 * side <= CELL_MAX_PX && period_px >= CELLS_PER_PERIOD_MIN * (2 * side) as f64 {
        side *= 2;
    }
    side
}

/// Blends the tiles at one cell: correction and variance, none outside the lit cells.
fn blend(tiles: &[Found], columns: usize, y: usize, x: usize) -> Option<[f32; 2]> {
    let mut sums = [0.0; 3];
    for row in around(y, tiles.len() / columns) {
        for column in around(x, columns) {
            let (inner_y, inner_x) = (y + MARGIN - row * STEP, x + MARGIN - column * STEP);
            let found = &tiles[row * columns + column];
            let value = |plane: &Plane| plane.row(inner_y)[inner_x];
            let weight = ramp(inner_y) * ramp(inner_x) * value(&found.inside);
            sums[0] += weight;
            sums[1] += weight * value(&found.correction);
            sums[2] += weight * value(&found.variance);
        }
    }
    let [weight, correction, variance] = sums;
    (weight > 0.0).then(|| [correction / weight, variance / weight])
}

/// The tiles along one direction that contain a cell.
fn around(place: usize, tiles: usize) -> std::ops::RangeInclusive<usize> {
    let first = (place + MARGIN).saturating_sub(SIDE - 1).div_ceil(STEP);
    first..=((place + MARGIN) / STEP).min(tiles - 1)
}

/// Weight of a tile at a place in it: 0 in the discarded cells, rising to 1 over the blended ones. The weights of two tiles that
/// overlap add up to 1.
fn ramp(place: usize) -> f32 {
    let inner = place.min(SIDE - 1 - place);
    ((inner as f32 + 0.5 - DISCARDED as f32) / BLENDED as f32).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests;
