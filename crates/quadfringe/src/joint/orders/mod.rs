//! Step 4: the fringe orders of a scene (S4). Every cell is a node with one order; near discontinuities each pixel
//! chooses its order.

mod candidates;
mod evidence;
mod matching;
mod surfaces;
mod wrapped;

pub(in crate::joint) use wrapped::Wrapped;

use super::params::local_fit;
use super::params::orders::{JUMP_NODES_MAX, JUMP_NODES_MIN, JUMP_PERIODS};
use super::scene::Scene;
use super::slopes::Slopes;
use super::uncertainty::{NodeVerdict, WrongOrderModel};
use crate::encoding::FourChannel;
use crate::parallel::angle::wrap;
use crate::parallel::slots::Slots;
use candidates::{Block, Candidates, Cell, Nodes};
use evidence::{EvidenceRows, Ratios, node_phases, row_evidence};
use matching::Matching;
use rayon::prelude::*;
use std::f32::consts::{PI, TAU};
use surfaces::Surfaces;

/// Evidence and orders of one shot.
pub(super) struct Orders {
    matching: Matching,
    /// Wrapped phase of every node.
    phase: Vec<f32>,
    surfaces: Surfaces,
    /// Fringe numbers of G and IR divided by the fringe number of R and B.
    ratios: [f32; 4],
    slots: Slots<EvidenceRows>,
    blocks: Slots<Block>,
}

impl Orders {
    pub fn new(code: &FourChannel) -> Self {
        Self {
            matching: Matching::new(code),
            phase: Vec::new(),
            surfaces: Surfaces::default(),
            ratios: code.ratios(),
            slots: Slots::default(),
            blocks: Slots::default(),
        }
    }

    /// Chooses the orders of a wrapped phase. `absolute` receives the absolute phase.
    pub fn choose(&mut self, scene: &Scene<'_>, wrapped: &Wrapped<'_>, absolute: &mut [f32]) {
        let grid = scene.grid;
        self.phase.resize(grid.rows * grid.columns, 0.0);
        self.phase
            .par_chunks_mut(grid.columns)
            .enumerate()
            .for_each(|(row, phase)| node_phases(scene, wrapped, row, phase));
        let (phase, slots) = (&self.phase, &self.slots);
        let ratios = Ratios { ratios: self.ratios, middle_rad: self.matching.middle_rad() };
        self.matching.choose([grid.rows, grid.columns], jump_nodes(scene), |row, out| {
            let nodes = &phase[row * grid.columns..][..grid.columns];
            row_evidence(scene, wrapped, ratios, row, nodes, &mut slots.take(), out);
        });
        self.settle_surfaces(scene, wrapped.slopes);
        let this = &*self;
        absolute.par_chunks_mut(grid.step * grid.stride).enumerate().for_each_init(
            || self.blocks.take(),
            |block, (row, absolute)| {
                for column in 0..grid.columns {
                    this.write(scene, wrapped, Cell { row, column }, block, absolute);
                }
            },
        );
    }

    /// Gives doubtful surfaces the order with which they continue their neighbours.
    fn settle_surfaces(&mut self, scene: &Scene<'_>, slopes: &Slopes) {
        let mut surfaces = std::mem::take(&mut self.surfaces);
        self.wrong_order_probability(scene, &mut surfaces.wrong);
        let (nodes, columns) = (self.nodes(), scene.grid.columns);
        surfaces.find(scene.grid, |from, to| {
            let [one, other] = [from, to].map(|[row, column]| row * columns + column);
            let axis = usize::from(from[0] != to[0]);
            let way = || 0.5 * (slopes.at(from[0], from[1])[axis] + slopes.at(to[0], to[1])[axis]);
            let lit = nodes.matching.is_lit(one) && nodes.matching.is_lit(other);
            lit.then(|| nodes.absolute(other) - nodes.absolute(one) - way())
        });
        surfaces.settle(shared_nodes(scene), &mut self.matching.order);
        self.surfaces = surfaces;
    }

    /// How certain the order of every node of a row is.
    pub fn verdicts(&self, scene: &Scene<'_>, row: usize) -> impl Iterator<Item = NodeVerdict> {
        let nodes = row * scene.grid.columns..(row + 1) * scene.grid.columns;
        nodes.map(|node| NodeVerdict {
            lead: self.matching.lead[node].min(1.0),
            order_cost: self.matching.order_cost[node],
            lit: self.matching.is_lit(node),
        })
    }

    /// Wrong-order probability of every node.
    pub fn wrong_order_probability(&self, scene: &Scene<'_>, out: &mut Vec<f32>) {
        let grid = scene.grid;
        let lit = (0..grid.rows).flat_map(|row| self.verdicts(scene, row)).filter(|verdict| verdict.lit);
        let model = WrongOrderModel::new(lit, jump_nodes(scene) as f32, shared_nodes(scene));
        out.resize(grid.rows * grid.columns, 0.0);
        out.par_chunks_mut(grid.columns).enumerate().for_each(|(row, out)| {
            let nodes = out.iter_mut().zip(self.verdicts(scene, row));
            nodes.for_each(|(out, verdict)| *out = model.probability(verdict));
        });
        for (out, &moved) in out.iter_mut().zip(&self.surfaces.moved) {
            *out = if moved > 0.0 { moved } else { *out };
        }
    }

    fn nodes(&self) -> Nodes<'_> {
        Nodes { phase: &self.phase, matching: &self.matching, ratios: self.ratios }
    }

    /// Writes the absolute phase of the pixels of one cell.
    #[inline(never)]
    fn write(
        &self,
        scene: &Scene<'_>,
        wrapped: &Wrapped<'_>,
        cell: Cell,
        block: &mut Block,
        absolute: &mut [f32],
    ) {
        let grid = scene.grid;
        let node = cell.row * grid.columns + cell.column;
        let nodes = self.nodes();
        let (phase, whole) = (nodes.phase[node], nodes.absolute(node));
        let candidates = Candidates::of(nodes, scene, wrapped.slopes, cell);
        let first = cell.row * grid.step * grid.stride + cell.column * grid.step;
        if candidates.is_choice() {
            block.decide(nodes, scene, wrapped, cell, &candidates);
        }
        for (dy, line) in absolute.chunks_exact_mut(grid.stride).enumerate() {
            let pixels = &wrapped.map.phase[first + dy * grid.stride..][..grid.step];
            let line = &mut line[cell.column * grid.step..][..grid.step];
            for (x, (out, &pixel)) in line.iter_mut().zip(pixels).enumerate() {
                let turns = if candidates.is_choice() { block.turns(dy * grid.step + x) } else { 0.0 };
                *out = whole + wrap(pixel - phase) + TAU * turns;
            }
        }
    }
}

/// Number of nodes in a row whose contradicting evidence costs as much as a change of surface (J11).
fn jump_nodes(scene: &Scene<'_>) -> f64 {
    (JUMP_PERIODS * scene.period_px / scene.grid.step as f64).clamp(JUMP_NODES_MIN, JUMP_NODES_MAX)
}

/// Number of nodes in a row whose evidence comes from the same window of the local fit. It is the width of a window with equal weights
/// that averages noise as much as the Gaussian window does.
fn shared_nodes(scene: &Scene<'_>) -> f32 {
    scene.cells(2.0 * PI.sqrt() * local_fit::WINDOW).max(1.0)
}

#[cfg(test)]
mod tests {
    use super::super::cells::Grid;
    use super::*;

    #[test]
    fn the_jump_price_scales_with_the_period_between_its_bounds() {
        let grid = Grid::new([96, 256], 4.0);
        let scene =
            |period_px| Scene { light: [&[]; 4], usable: &[], grid: &grid, period_px, factor: 1, pair: None };
        let prices = [1.0, 16.0, 32.0, 1000.0].map(|period_px| jump_nodes(&scene(period_px)));
        assert_eq!(prices, [JUMP_NODES_MIN, 5.0, 10.0, JUMP_NODES_MAX]);
    }
}
