//! The orders of a scene: a node on every cell, and the pixels beside edges one by one.

mod evidence;
mod matching;

use crate::joint::cells::RowMaps;
use crate::joint::local_fit::LocalFit;
use crate::joint::photometry::Backgrounds;
use crate::joint::scene::Scene;
use crate::joint::slopes::Slopes;
use crate::joint::uncertainty::CostOdds;
use crate::parallel::angle::{round, sin_cos, wrap};
use crate::parallel::lanes::Lanes;
use crate::parallel::slots::Slots;
use crate::{Channel, FringeCode};
use evidence::{albedo, cosine, evidence, gather, node_phases};
use matching::Support;
use rayon::prelude::*;
use std::f32::consts::{PI, TAU};

/// A change of the surface costs as much as contradictions over so many fringe periods.
const JUMP_PERIODS: f64 = 1.25;
/// Rows of pixels that speak for a node.
const SAMPLED_ROWS: usize = 4;
/// Squared misfit of a pixel's cosines beyond which a candidate order is simply wrong there.
const MISS_MAX: f32 = 1.0;
/// The own order and those of eight neighbours.
const CANDIDATES: usize = 9;
/// Sums over the pixels of a node: pixels, then s^2, s cos f, s sin f, cos 2f, sin 2f of G and of IR.
const SUMS: usize = 11;

/// Evidence and orders of one shot.
pub(in crate::joint) struct Orders {
    support: Support,
    /// Wrapped phase of every node.
    phase: Vec<f32>,
    /// Fringe numbers of G and IR over that of R and B.
    ratios: [f32; 2],
    slots: Slots<Rows>,
    blocks: Slots<Block>,
}

/// What the pixels know before orders are chosen.
#[derive(Clone, Copy)]
pub(in crate::joint) struct Wrapped<'a> {
    /// Wrapped phase of R and B.
    pub phase: &'a [f32],
    /// 0 where there is no light.
    pub modulation: &'a [f32],
    pub fit: &'a LocalFit,
    /// Where backgrounds and modulations come from; before the first choice of orders, from the fit.
    pub backgrounds: Option<&'a Backgrounds>,
    pub slopes: &'a Slopes,
}

impl Wrapped<'_> {
    /// Background and modulation of R, G, B, IR at row `y`.
    fn fringes<'b>(&self, scene: &Scene<'_>, y: usize, maps: &'b mut [RowMaps; 2]) -> [&'b [f32]; 8] {
        match self.backgrounds {
            None => self.fit.fringes(scene, y, maps),
            Some(backgrounds) => backgrounds.sample(scene, y, &mut maps[0]),
        }
    }

    /// The same at the middle of a cell.
    fn cell(&self, scene: &Scene<'_>, row: usize, column: usize) -> [[f32; 2]; 4] {
        match self.backgrounds {
            None => self.fit.cell(row, column),
            Some(backgrounds) => backgrounds.cell(scene, row, column),
        }
    }
}

/// Rows of one task.
#[derive(Debug, Default)]
struct Rows {
    maps: [RowMaps; 2],
    node: Vec<f32>,
    sums: Vec<[Lanes; SUMS]>,
    cells: [Vec<f32>; SUMS],
}

impl Orders {
    pub fn new(code: &FringeCode) -> Self {
        let n = code.numbers();
        let ratios = [Channel::G, Channel::Ir].map(|c| (n[c.phase_index()] / n[0]) as f32);
        Self {
            support: Support::new(code),
            phase: Vec::new(),
            ratios,
            slots: Slots::default(),
            blocks: Slots::default(),
        }
    }

    /// Choose the orders of a wrapped phase; `absolute` receives it with them.
    pub fn choose(&mut self, scene: &Scene<'_>, known: &Wrapped<'_>, absolute: &mut [f32]) {
        let grid = scene.grid;
        self.phase.resize(grid.rows * grid.columns, 0.0);
        self.phase
            .par_chunks_mut(grid.columns)
            .enumerate()
            .for_each(|(row, phase)| node_phases(scene, known, row, phase));
        let (phase, ratios, slots) = (&self.phase, self.ratios, &self.slots);
        self.support.choose([grid.rows, grid.columns], jump_nodes(scene), |row, out| {
            let mut rows = slots.take();
            let nodes = &phase[row * grid.columns..][..grid.columns];
            gather(scene, known, ratios, row, nodes, &mut rows);
            let beats = known.fit.beats(row);
            out.extend(
                (0..grid.columns).map(|x| evidence(nodes[x], beats.map(|beat| beat[x]), &rows.cells, x)),
            );
        });
        let this = &*self;
        absolute.par_chunks_mut(grid.step * grid.stride).enumerate().for_each_init(
            || self.blocks.take(),
            |block, (row, absolute)| {
                for column in 0..grid.columns {
                    this.write(scene, known, [row, column], block, absolute);
                }
            },
        );
    }

    /// Lead of the order chosen at every node of a row, and the misfit of what its own pixels see, both in [0, 1].
    pub fn verdict(&self, scene: &Scene<'_>, row: usize) -> impl Iterator<Item = (f32, f32, bool)> {
        let at = row * scene.grid.columns..(row + 1) * scene.grid.columns;
        let known = self.support.margin[at.clone()].iter().zip(&self.support.misfit[at.clone()]);
        known
            .zip(&self.support.nodes[at])
            .map(|((margin, misfit), node)| (margin.min(1.0), *misfit, node.lit))
    }

    /// Probability for every node that its order is another one. Evidence comes from the window of the local fit, which is so
    /// many nodes wide as an equal weight for each would make it.
    pub fn another(&self, scene: &Scene<'_>, out: &mut Vec<f32>) {
        let grid = scene.grid;
        let lit = (0..grid.rows).flat_map(|row| self.verdict(scene, row)).filter(|(_, _, lit)| *lit);
        let together = scene.cells(2.0 * PI.sqrt() * LocalFit::WINDOW);
        let odds = CostOdds::new(lit.map(|(_, misfit, _)| misfit), jump_nodes(scene) as f32, together);
        out.resize(grid.rows * grid.columns, 0.0);
        out.par_chunks_mut(grid.columns).enumerate().for_each(|(row, out)| {
            let nodes = out.iter_mut().zip(self.verdict(scene, row));
            nodes.for_each(|(out, (lead, misfit, _))| *out = odds.another(lead, misfit));
        });
    }

    fn absolute(&self, at: usize) -> f32 {
        self.phase[at] + TAU * f32::from(self.support.order[at])
    }

    /// Absolute phase of the pixels of one cell.
    #[inline(never)]
    fn write(
        &self,
        scene: &Scene<'_>,
        known: &Wrapped<'_>,
        [row, column]: [usize; 2],
        block: &mut Block,
        absolute: &mut [f32],
    ) {
        let grid = scene.grid;
        let node = row * grid.columns + column;
        let (phase, whole) = (self.phase[node], self.absolute(node));
        let candidates = self.candidates(scene, known.slopes, [row, column]);
        let first = row * grid.step * grid.stride + column * grid.step;
        if candidates.count > 1 {
            block.decide(self, scene, known, [row, column], &candidates);
        }
        for (dy, line) in absolute.chunks_exact_mut(grid.stride).enumerate() {
            let wrapped = &known.phase[first + dy * grid.stride..][..grid.step];
            let line = &mut line[column * grid.step..][..grid.step];
            for (x, (out, &own)) in line.iter_mut().zip(wrapped).enumerate() {
                let turns = if candidates.count > 1 { block.turns[dy * grid.step + x] } else { 0.0 };
                *out = whole + wrap(own - phase) + TAU * turns;
            }
        }
    }

    /// Orders that a cell and its eight neighbours propose for the pixels of the cell, in turns beside its own.
    fn candidates(&self, scene: &Scene<'_>, slopes: &Slopes, [row, column]: [usize; 2]) -> Candidates {
        let grid = scene.grid;
        let node = row * grid.columns + column;
        let mut found = Candidates { turns: [0.0; CANDIDATES], count: 1 };
        let lines = row.saturating_sub(1)..=(row + 1).min(grid.rows - 1);
        let own = self.absolute(node);
        // Where all orders agree and no phase turns over there is nothing to ask.
        for other_row in lines {
            for other_column in column.saturating_sub(1)..=(column + 1).min(grid.columns - 1) {
                let other = other_row * grid.columns + other_column;
                if other == node || !self.support.nodes[other].lit {
                    continue;
                }
                let gap = own - self.absolute(other);
                if gap.abs() < 2.0 {
                    continue;
                }
                let [along, down] = slopes.at(other_row, other_column);
                let way =
                    along * (column as f32 - other_column as f32) + down * (row as f32 - other_row as f32);
                // What the neighbour expects here, as turns beside what this node has.
                let turns = -round((gap - way) / TAU);
                found.add(turns);
            }
        }
        found
    }
}

/// Nodes in a row whose contradiction costs as much as a change of the surface.
fn jump_nodes(scene: &Scene<'_>) -> f64 {
    JUMP_PERIODS * scene.period_px / scene.grid.step as f64
}

/// Turns beside the order of the own node; the first is 0.
struct Candidates {
    turns: [f32; CANDIDATES],
    count: usize,
}

impl Candidates {
    fn add(&mut self, turns: f32) {
        if !self.turns[..self.count].contains(&turns) {
            self.turns[self.count] = turns;
            self.count += 1;
        }
    }
}

/// Decisions for the pixels of one cell.
#[derive(Debug, Default)]
struct Block {
    misses: Vec<[f32; CANDIDATES]>,
    turns: Vec<f32>,
}

impl Block {
    /// Give every pixel the candidate that explains what it and its neighbours see in G and IR best.
    fn decide(
        &mut self,
        orders: &Orders,
        scene: &Scene<'_>,
        known: &Wrapped<'_>,
        [row, column]: [usize; 2],
        candidates: &Candidates,
    ) {
        let grid = scene.grid;
        let (step, side) = (grid.step, grid.step + 2);
        let node = row * grid.columns + column;
        let (phase, whole) = (orders.phase[node], orders.absolute(node));
        let fringes = known.cell(scene, row, column);
        self.misses.clear();
        for i in 0..side * side {
            let y = (row * step + i / side).saturating_sub(1).min(grid.height - 1);
            let x = (column * step + i % side).saturating_sub(1).min(grid.width - 1);
            let at = y * grid.stride + x;
            let mut misses = [0.0; CANDIDATES];
            if known.modulation[at] > 0.0 {
                let own = whole + wrap(known.phase[at] - phase);
                let light = scene.light.map(|plane| plane[at]);
                let albedo = albedo(known.phase[at], [light[0], light[2]], [fringes[0], fringes[2]]);
                for (c, ratio) in [1, 3].into_iter().zip(orders.ratios) {
                    let seen = cosine(light[c], albedo, fringes[c]);
                    for (miss, turns) in misses.iter_mut().zip(&candidates.turns[..candidates.count]) {
                        let (_, predicted) = sin_cos(ratio * (own + TAU * turns));
                        *miss += (seen - predicted).powi(2).min(MISS_MAX);
                    }
                }
            }
            self.misses.push(misses);
        }
        self.turns.clear();
        for i in 0..step * step {
            let (y, x) = (i / step, i % step);
            let sum =
                |k: usize| -> f32 { (0..9).map(|n| self.misses[(y + n / 3) * side + x + n % 3][k]).sum() };
            let best =
                (0..candidates.count).map(|k| (k, sum(k))).reduce(|a, b| if b.1 < a.1 { b } else { a });
            self.turns.push(best.map_or(0.0, |(k, _)| candidates.turns[k]));
        }
    }
}
