//! Step 4 near discontinuities: each pixel of a cell chooses among the orders that the cell and its neighbours propose.

use super::evidence::{albedo, albedo_known, observed_cosine};
use super::matching::Matching;
use super::wrapped::Wrapped;
use crate::joint::model::CellFringes;
use crate::joint::params::orders::PIXEL_COST_MAX;
use crate::joint::scene::Scene;
use crate::joint::slopes::Slopes;
use crate::parallel::angle::{round, sin_cos, wrap};
use std::f32::consts::{PI, TAU};

/// Greatest number of candidates: the order of the cell and the orders of its eight neighbours.
const CANDIDATES: usize = 9;

/// A cell, by row and column.
#[derive(Clone, Copy)]
pub(super) struct Cell {
    pub row: usize,
    pub column: usize,
}

/// The nodes of a scene after matching.
#[derive(Clone, Copy)]
pub(super) struct Nodes<'a> {
    /// Wrapped phase of every node.
    pub phase: &'a [f32],
    pub matching: &'a Matching,
    /// Fringe numbers of R, G, B, IR divided by the first.
    pub ratios: [f32; 4],
}

impl Nodes<'_> {
    /// Absolute phase of a node.
    pub fn absolute(&self, node: usize) -> f32 {
        self.phase[node] + TAU * f32::from(self.matching.order[node])
    }
}

/// Orders to choose from, in turns relative to the order of the cell; the first is 0.
pub(super) struct Candidates {
    turns: [f32; CANDIDATES],
    count: usize,
}

impl Candidates {
    /// Orders that a cell and its eight neighbours propose for the pixels of the cell.
    pub fn of(nodes: Nodes<'_>, scene: &Scene<'_>, slopes: &Slopes, Cell { row, column }: Cell) -> Self {
        let grid = scene.grid;
        let node = row * grid.columns + column;
        let mut found = Self { turns: [0.0; CANDIDATES], count: 1 };
        let lines = row.saturating_sub(1)..=(row + 1).min(grid.rows - 1);
        let here = nodes.absolute(node);
        for other_row in lines {
            for other_column in column.saturating_sub(1)..=(column + 1).min(grid.columns - 1) {
                let other = other_row * grid.columns + other_column;
                if other == node || !nodes.matching.is_lit(other) {
                    continue;
                }
                let gap = here - nodes.absolute(other);
                if gap.abs() < PI {
                    continue;
                }
                let [along, down] = slopes.at(other_row, other_column);
                let way =
                    along * (column as f32 - other_column as f32) + down * (row as f32 - other_row as f32);
                // The phase that the neighbour predicts at this node, relative to the phase of this node, in turns.
                found.add(-round((gap - way) / TAU));
            }
        }
        found
    }

    /// Whether there is more than one candidate.
    pub fn is_choice(&self) -> bool {
        self.count > 1
    }

    fn turns(&self) -> &[f32] {
        &self.turns[..self.count]
    }

    fn add(&mut self, turns: f32) {
        if !self.turns().contains(&turns) {
            self.turns[self.count] = turns;
            self.count += 1;
        }
    }
}

/// Decisions for the pixels of one cell.
#[derive(Debug, Default)]
pub(super) struct Block {
    /// Cost of every candidate at the pixels of the cell and of a rim of one pixel.
    costs: Vec<[f32; CANDIDATES]>,
    turns: Vec<f32>,
}

impl Block {
    /// The turns that pixel `i` of the cell has chosen.
    pub fn turns(&self, i: usize) -> f32 {
        self.turns[i]
    }

    /// Chooses for every pixel the candidate that agrees best with the cosines of G and IR that the pixel and its
    /// neighbours observe.
    pub fn decide(
        &mut self,
        nodes: Nodes<'_>,
        scene: &Scene<'_>,
        wrapped: &Wrapped<'_>,
        cell: Cell,
        candidates: &Candidates,
    ) {
        let grid = scene.grid;
        let (step, side) = (grid.step, grid.step + 2);
        let node = cell.row * grid.columns + cell.column;
        let (phase, whole) = (nodes.phase[node], nodes.absolute(node));
        let fringes = wrapped.cell(cell.row, cell.column);
        let predicted = Predicted { scene, fringes: &fringes, ratios: nodes.ratios };
        self.costs.clear();
        for i in 0..side * side {
            let y = (cell.row * step + i / side).saturating_sub(1).min(grid.height - 1);
            let x = (cell.column * step + i % side).saturating_sub(1).min(grid.width - 1);
            let at = y * grid.stride + x;
            let mut costs = [0.0; CANDIDATES];
            if wrapped.map.modulation[at] > 0.0 {
                let wrapped_phase = wrapped.map.phase[at];
                let absolute_phase = whole + wrap(wrapped_phase - phase);
                let pixel = Pixel { at, wrapped_phase, absolute_phase };
                add_costs(&pixel, &predicted, candidates.turns(), &mut costs);
            }
            self.costs.push(costs);
        }
        self.turns.clear();
        for i in 0..step * step {
            let (y, x) = (i / step, i % step);
            let sum =
                |k: usize| -> f32 { (0..9).map(|n| self.costs[(y + n / 3) * side + x + n % 3][k]).sum() };
            let best =
                (0..candidates.count).map(|k| (k, sum(k))).reduce(|a, b| if b.1 < a.1 { b } else { a });
            self.turns.push(best.map_or(0.0, |(k, _)| candidates.turns[k]));
        }
    }
}

/// One pixel, with its absolute phase by the order of its cell.
struct Pixel {
    /// Index into the planes of the scene.
    at: usize,
    wrapped_phase: f32,
    absolute_phase: f32,
}

/// What predicts the light of the pixels of a cell.
struct Predicted<'a> {
    scene: &'a Scene<'a>,
    fringes: &'a CellFringes,
    ratios: [f32; 4],
}

/// Adds for every candidate the squared differences between the observed and the predicted cosines of G and IR.
fn add_costs(pixel: &Pixel, predicted: &Predicted<'_>, turns: &[f32], costs: &mut [f32]) {
    let Predicted { scene, fringes: CellFringes { offset, amplitude }, ratios } = predicted;
    let light = scene.light.map(|plane| plane[pixel.at]);
    let red_blue = |values: &[f32; 4]| [values[0], values[2]];
    let albedo = albedo(
        pixel.wrapped_phase,
        red_blue(&light),
        red_blue(offset),
        red_blue(amplitude),
        albedo_known(*ratios),
    );
    for (c, ratio) in [1, 3].map(|c| (c, ratios[c])) {
        let seen = observed_cosine(light[c], albedo, offset[c], amplitude[c]);
        for (cost, turns) in costs.iter_mut().zip(turns) {
            let phase = pixel.absolute_phase + TAU * turns;
            let angle = if c == 3 { scene.infrared_phase(pixel.at, ratio, phase) } else { ratio * phase };
            let (_, predicted) = sin_cos(angle);
            *cost += (seen - predicted).powi(2).min(PIXEL_COST_MAX);
        }
    }
}
