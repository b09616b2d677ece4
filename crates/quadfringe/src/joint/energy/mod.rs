//! Step 6: phase, albedo and contrast as the minimum of one energy (J16), on cells of a few pixels.
//!
//! The data term is the squared difference between the light and the model (S1). Four priors say how much neighbouring cells
//! differ in surface, brightness, colour and contrast. How much that is, and how large the noise is, is estimated from the shot
//! itself, tile by tile. Tiles overlap and are independent of each other, so the result does not depend on the threads.

mod average;
mod bias;
mod blocks;
mod cells;
mod data;
mod descent;
mod disagreement;
mod gaps;
mod layout;
mod pixels;
mod plane;
mod preconditioner;
mod priors;
mod quadric;
mod restart;
mod scales;
mod solve;
mod splines;
mod start;
mod tile;
mod value;
mod variance;

use super::params::energy::{CELL_MAX_PX, CELLS_PER_PERIOD_MIN, SMALL_CELLS_PER_PERIOD_MIN};
use super::scene::{Pixels, Scene};
use crate::parallel::slots::Slots;
use cells::{CellFit, Cells};
use layout::Axis;
use pixels::{Surface, Surfaces};
use plane::Plane;
use rayon::prelude::*;
use tile::{Found, Tile};

/// The minimiser, with its working memory.
#[derive(Debug, Default)]
pub(super) struct Energy {
    cells: Cells,
    tiles: Vec<Found>,
    surfaces: Surfaces,
    slots: Slots<Tile>,
}

/// What the shot is known to be.
#[derive(Debug, Clone, Copy)]
pub(super) struct Prior {
    /// Fringe numbers divided by the first.
    pub ratios: [f32; 4],
    /// Standard deviation of the intensity of a pixel, in linear light.
    pub noise: f32,
    /// Relief narrower by this factor is kept than the shot suggests (J36).
    pub detail: f32,
}

impl Energy {
    /// Corrects the absolute phase of the lit pixels of a scene, in place. Where the minimum lies far from the phase at the start,
    /// one of the two is wrong. The modulation becomes 0 there, so that step 8 treats such pixels and their neighbours as it treats
    /// the border of a shadow; their reason is a misfit.
    pub fn minimise(&mut self, scene: &Scene<'_>, prior: Prior, pixels: &mut Pixels) {
        let factor = cell_px(scene.period_px);
        self.cells.average(scene, pixels.map(), factor);
        let Self { cells, tiles, surfaces, slots } = self;
        let [rows, columns] = [cells.height, cells.width].map(Axis::new);
        let across = columns.origins.len();
        tiles.resize_with(rows.origins.len() * across, Found::default);
        let variance = (prior.noise / factor as f32).powi(2);
        // Tiles with texture take several times as long as others, so threads share them one by one.
        tiles.par_iter_mut().with_max_len(1).enumerate().for_each_init(
            || slots.take(),
            |tile, (n, found)| {
                found.inside.clear();
                if cells.load([rows.origins[n / across], columns.origins[n % across]], tile) {
                    tile.ratios = prior.ratios;
                    tile.minimise(variance, prior.detail);
                    tile.write(variance, found);
                }
            },
        );
        let tiles = &*tiles;
        let shares = |y, x| shares(tiles, &rows, &columns, [y, x]);
        surfaces.find(cells, |y, x| surface(shares(y, x)));
        cells.replace(|y, x| blend(shares(y, x)));
        surfaces.write(scene, cells, pixels);
    }

    /// Albedo and contrast along row `y` of the scene.
    pub fn fringes<'a>(&self, scene: &Scene<'_>, y: usize, rows: &'a mut FringeRows) -> &'a FringeRows {
        self.cells.fringes(scene, y, rows);
        rows
    }

    /// Writes the mean albedo of R and B along row `y` of the scene, 0 where there is no lit cell.
    pub fn brightness(&self, scene: &Scene<'_>, y: usize, rows: &mut Rows, out: &mut Vec<f32>) {
        self.cells.brightness(scene, y, rows, out);
    }

    /// Writes for each of the `width` pixels of row `y` whether the cells around it lie on one surface (J44).
    pub fn on_one_surface(&self, y: usize, width: usize, out: &mut Vec<bool>) {
        out.clear();
        out.extend(self.surfaces.marks(y).take(width));
    }

    /// Mean square of the correction of the last scene, rad^2.
    pub fn correction(&self) -> f32 {
        self.cells.correction()
    }

    /// Variance of the phase along row `y` of the scene, rad^2; 0 where there is no lit cell.
    pub fn variance<'a>(&self, scene: &Scene<'_>, y: usize, rows: &'a mut cells::Rows) -> &'a [f32] {
        self.cells.variance(scene, y, rows)
    }
}

pub(super) use cells::{FringeRows, Rows};

/// Side of the cells in pixels: the largest power of two that resolves the fringes.
fn cell_px(period_px: f64) -> usize {
    let mut side = if period_px >= 2.0 * SMALL_CELLS_PER_PERIOD_MIN { 2 } else { 1 };
    while 2 * side <= CELL_MAX_PX && period_px >= CELLS_PER_PERIOD_MIN * (2 * side) as f64 {
        side *= 2;
    }
    side
}

/// A tile at one of its cells.
struct Share<'a> {
    found: &'a Found,
    at: [usize; 2],
    weight: f32,
}

impl Share<'_> {
    fn value(&self, plane: &Plane) -> f32 {
        plane.row(self.at[0])[self.at[1]]
    }
}

/// The tiles that have found something at a cell.
fn shares<'a>(
    tiles: &'a [Found],
    rows: &'a Axis,
    columns: &'a Axis,
    [y, x]: [usize; 2],
) -> impl Iterator<Item = Share<'a>> {
    rows.around(y).flat_map(move |row| {
        columns.around(x).map(move |column| {
            let found = &tiles[row.tile * columns.origins.len() + column.tile];
            let at = [row.inner, column.inner];
            Share { found, at, weight: row.weight * column.weight * found.inside.row(at[0])[at[1]] }
        })
    })
}

/// Blends the surfaces of the tiles at one cell; none outside the lit cells.
fn surface<'a>(shares: impl Iterator<Item = Share<'a>>) -> Option<Surface> {
    let (mut sum, mut surface) = (0.0, Surface::default());
    for share in shares {
        let Share { found, weight, .. } = share;
        sum += weight;
        surface.correction += weight * share.value(&found.correction);
        surface.bend += weight * found.bend;
    }
    (sum > 0.0).then(|| Surface { correction: surface.correction / sum, bend: surface.bend / sum })
}

/// Blends the tiles at one cell; none outside the lit cells.
fn blend<'a>(shares: impl Iterator<Item = Share<'a>>) -> Option<CellFit> {
    let (mut sum, mut fit) = (0.0, CellFit::default());
    for share in shares {
        let Share { found, weight, .. } = share;
        sum += weight;
        fit.correction += weight * share.value(&found.correction);
        fit.variance += weight * share.value(&found.variance);
        for c in 0..4 {
            fit.albedo[c] += weight * share.value(&found.albedo[c]);
            fit.contrast[c] += weight * found.channel_contrast[c] * share.value(&found.contrast);
        }
    }
    (sum > 0.0).then(|| fit.divided_by(sum))
}

#[cfg(test)]
mod start_tests;
#[cfg(test)]
mod tests;
