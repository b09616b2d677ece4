//! Step 8: the orders of regions (J38). A node of the matching sees a window. Where a region is narrower than that, or its light is
//! not that of a fringe pattern at all, every node of it can be as wrong as it is sure.
//!
//! In a region the phase continues from pixel to pixel, so that all of it has the right order or is wrong by the same number of turns.
//! G and IR are fitted by an offset and an amplitude in every tile of the region, for every number of turns, both in proportion to the
//! brightness of R and B, which no order changes. The squared residuals of the tiles around say which number explains the light, how
//! much better than all others, and whether any does.

mod scores;
mod sums;
mod verdict;

use super::connected::Regions;
use super::params::regions::{ROW_STEP, SHARED_PX, TILE_MIN_PX, TILE_SIDE};
use super::scene::Scene;
use crate::encoding::{Channel, FourChannel};
use crate::parallel::slots::Slots;
use rayon::prelude::*;
use scores::{Choice, Scorer, Shifts};
use std::f32::consts::TAU;
use std::ops::Range;
use sums::{Brightness, RowTerms, Sums};
use verdict::Verdict;

/// The orders of the regions of a shot, with working memory.
#[derive(Debug)]
pub(super) struct RegionOrders {
    /// Fringe numbers divided by the first.
    ratios: [f32; 4],
    /// Phases of R in rad that the projector shows.
    range_rad: [f32; 2],
    /// Pixels along a side of a tile.
    tile_px: usize,
    regions: Regions,
    lit: Vec<u8>,
    bands: Vec<Band>,
    /// What was found first, and with it at last, by row of tiles, tile, and part.
    chosen: Vec<Vec<Vec<Choice>>>,
    found: Vec<Vec<Vec<Verdict>>>,
    slots: Slots<RowTerms>,
}

/// A row of tiles.
#[derive(Debug, Default)]
struct Band {
    /// The parts of regions in every tile.
    tiles: Vec<Vec<Part>>,
    /// Scores of all parts, one after the other.
    scores: Vec<f32>,
}

/// The part of a region in one tile.
#[derive(Debug)]
struct Part {
    region: u32,
    sums: Sums,
    /// The phase at one of its pixels.
    phase: f32,
    /// Index of its first score.
    scores: usize,
}

impl RegionOrders {
    pub fn new(code: &FourChannel) -> Self {
        Self {
            ratios: code.ratios(),
            range_rad: code.columns_px.map(|column| code.phase_rad(Channel::R, column) as f32),
            tile_px: TILE_MIN_PX,
            regions: Regions::default(),
            lit: Vec::new(),
            bands: Vec::new(),
            chosen: Vec::new(),
            found: Vec::new(),
            slots: Slots::default(),
        }
    }

    /// Judges the order of every lit pixel, and adds whole turns to the phase of regions whose light another order explains better;
    /// `noise` is the standard deviation of the light.
    pub fn settle(
        &mut self,
        scene: &Scene<'_>,
        noise: f32,
        brightness: &impl Brightness,
        modulation: &[f32],
        phase: &mut [f32],
    ) {
        self.found.iter_mut().flatten().for_each(Vec::clear);
        // A wrong order of a pair of projectors shifts IR by another angle at every pixel.
        if scene.pair.is_some() {
            return;
        }
        let grid = scene.grid;
        self.tile_px = ((TILE_SIDE * scene.period_px).round() as usize).max(TILE_MIN_PX);
        self.lit.resize(grid.pixels(), 0);
        let lit = self.lit.par_chunks_mut(grid.stride).zip(modulation.par_chunks(grid.stride));
        lit.for_each(|(lit, modulation)| {
            lit.iter_mut().zip(modulation).for_each(|(lit, modulation)| *lit = u8::from(*modulation > 0.0));
        });
        self.regions.find(grid, &self.lit, phase);
        let shared = (SHARED_PX / scene.factor as f32).max(1.0).powi(2) / ROW_STEP as f32;
        let scorer = Scorer::new(self.ratios, self.range_rad, noise, shared);
        self.measure(scene, &scorer, brightness, phase);
        self.choose(&scorer);
        self.judge(&scorer);
        self.look_around();
        let this = &*self;
        phase.par_chunks_mut(grid.stride).enumerate().filter(|(y, _)| this.is_wrong(*y)).for_each(
            |(y, phase)| {
                this.parts(y, |pixels, found| {
                    phase[pixels].iter_mut().for_each(|phase| *phase += TAU * found.turns);
                });
            },
        );
    }

    /// Whether a part in the tiles of row `y` lacks turns.
    fn is_wrong(&self, y: usize) -> bool {
        self.found.get(y / self.tile_px).into_iter().flatten().flatten().any(|found| found.turns != 0.0)
    }

    /// Calls `act` with the pixels and the verdict of every part that row `y` crosses.
    pub fn parts(&self, y: usize, mut act: impl FnMut(Range<usize>, &Verdict)) {
        let Some(tiles) = self.found.get(y / self.tile_px) else {
            return;
        };
        for run in self.regions.row(y) {
            let region = self.regions.of(run);
            for InTile { column, pixels } in tiles_of(run.from as usize..run.to as usize, self.tile_px) {
                if let Some(found) = tiles[column].iter().find(|found| found.region == region) {
                    act(pixels, found);
                }
            }
        }
    }

    /// Adds up the light of every part, and scores it.
    fn measure(&mut self, scene: &Scene<'_>, scorer: &Scorer, brightness: &impl Brightness, phase: &[f32]) {
        let (grid, tile_px, ratios) = (scene.grid, self.tile_px, self.ratios);
        let Self { regions, bands, slots, .. } = self;
        let regions = &*regions;
        bands.resize_with(grid.height.div_ceil(tile_px), Band::default);
        bands.par_iter_mut().enumerate().for_each_init(
            || slots.take(),
            |terms, (band, Band { tiles, scores })| {
                tiles.resize_with(grid.width.div_ceil(tile_px), Vec::new);
                tiles.iter_mut().for_each(Vec::clear);
                let rows = (band * tile_px..((band + 1) * tile_px).min(grid.height)).step_by(ROW_STEP);
                for y in rows.filter(|&y| !regions.row(y).is_empty()) {
                    terms.fill(scene, y, ratios, phase, brightness);
                    for run in regions.row(y) {
                        let region = regions.of(run);
                        for InTile { column, pixels } in tiles_of(run.from as usize..run.to as usize, tile_px)
                        {
                            let at = y * grid.stride + pixels.start;
                            let part = part_of(&mut tiles[column], region, phase[at]);
                            terms.add(pixels, &mut part.sums);
                        }
                    }
                }
                scores.clear();
                for part in tiles.iter_mut().flatten() {
                    part.scores = scores.len();
                    scorer.append(&part.sums, part.phase, scores);
                }
            },
        );
    }

    /// Chooses the number of turns of every part by the scores of the parts of its region around it.
    fn choose(&mut self, scorer: &Scorer) {
        let Self { bands, chosen, .. } = self;
        let bands = &*bands;
        chosen.resize_with(bands.len(), Vec::new);
        chosen.par_iter_mut().enumerate().for_each_init(Vec::new, |sum, (row, chosen)| {
            let tiles = &bands[row].tiles;
            chosen.resize_with(tiles.len(), Vec::new);
            for (column, (chosen, parts)) in chosen.iter_mut().zip(tiles).enumerate() {
                chosen.clear();
                chosen.extend(parts.iter().map(|part| {
                    scorer.start(sum);
                    for [y, x] in around(row, column, bands.len(), tiles.len()) {
                        let near = bands[y].tiles[x].iter().filter(|near| near.region == part.region);
                        near.for_each(|near| scorer.add(&bands[y].scores[near.scores..], sum));
                    }
                    scorer.choose(sum, &bands[row].scores[part.scores..], part.phase)
                }));
            }
        });
    }

    /// Adds what no number of turns explains, with the choices of the parts around.
    fn judge(&mut self, scorer: &Scorer) {
        let Self { bands, chosen, found, .. } = self;
        let (bands, chosen) = (&*bands, &*chosen);
        found.resize_with(bands.len(), Vec::new);
        found.par_iter_mut().enumerate().for_each_init(Shifts::default, |shifts, (row, found)| {
            let tiles = &bands[row].tiles;
            found.resize_with(tiles.len(), Vec::new);
            for (column, (found, parts)) in found.iter_mut().zip(tiles).enumerate() {
                found.clear();
                found.extend(parts.iter().zip(&chosen[row][column]).map(|(part, choice)| {
                    *shifts = Shifts::default();
                    for [y, x] in around(row, column, bands.len(), tiles.len()) {
                        let near = bands[y].tiles[x].iter().zip(&chosen[y][x]);
                        let near = near.filter(|(near, _)| near.region == part.region);
                        near.for_each(|(near, choice)| {
                            scorer.add_shifts(&bands[y].scores[near.scores..], choice.turns, shifts);
                        });
                    }
                    let Choice { turns, lead } = *choice;
                    let contradiction = scorer.contradiction(shifts);
                    Verdict { region: part.region, turns, lead, contradiction, around: 0.0 }
                }));
            }
        });
    }

    /// Takes the greatest evidence for the order of every part from the parts of its region around it. Near its border a part may be too
    /// small to have any.
    fn look_around(&mut self) {
        for row in 0..self.found.len() {
            for column in 0..self.found[row].len() {
                for part in 0..self.found[row][column].len() {
                    let Verdict { region, turns, .. } = self.found[row][column][part];
                    let near = around(row, column, self.found.len(), self.found[row].len());
                    let near = near.flat_map(|[y, x]| &self.found[y][x]);
                    let alike = near.filter(|near| near.region == region && near.turns == turns);
                    let most = alike.map(Verdict::evidence).fold(0.0, f32::max);
                    self.found[row][column][part].around = most;
                }
            }
        }
    }
}

/// A tile and those around it.
fn around(row: usize, column: usize, rows: usize, columns: usize) -> impl Iterator<Item = [usize; 2]> {
    let near = |at: usize, count: usize| at.saturating_sub(1)..(at + 2).min(count);
    near(row, rows).flat_map(move |y| near(column, columns).map(move |x| [y, x]))
}

/// Adjacent pixels of a row in the tile of this column.
struct InTile {
    column: usize,
    pixels: Range<usize>,
}

/// The tiles that pixels of a row cross.
fn tiles_of(pixels: Range<usize>, tile_px: usize) -> impl Iterator<Item = InTile> {
    (pixels.start / tile_px..pixels.end.div_ceil(tile_px)).map(move |column| InTile {
        column,
        pixels: pixels.start.max(column * tile_px)..pixels.end.min((column + 1) * tile_px),
    })
}

/// The part of a region in a tile.
fn part_of(tile: &mut Vec<Part>, region: u32, phase: f32) -> &mut Part {
    let at = tile.iter().position(|part| part.region == region).unwrap_or_else(|| {
        tile.push(Part { region, sums: Sums::default(), phase, scores: 0 });
        tile.len() - 1
    });
    &mut tile[at]
}

#[cfg(test)]
mod tests;
