//! Fringe orders by likelihood with spatial support.
//!
//! Every order of a node predicts the beats of G and of IR against R and B, and the cosines that its pixels see in G and
//! IR; the misfit, cut off so that a wrong beat near an edge cannot shout, is its cost. Costs are aggregated along rows
//! and columns as in semi-global matching (Hirschmueller, IEEE TPAMI 30, 328 (2008)), with one change: where the wrapped
//! phase jumps by a turn the order changes for free, and only a change of the surface costs.

mod labels;
mod sweep;

use labels::Labels;
pub(crate) use labels::{Evidence, Seen};

use crate::FringeCode;
use multiversion::multiversion;
use rayon::prelude::*;
use sweep::{Path, across, sweep_back, sweep_on};

/// Misfit beyond which evidence says nothing more: both beats 0.3 rad off, or cosines 0.3 off (root mean square).
const CUT: i16 = 333;
/// Labels are padded to whole vectors.
const LANES: usize = 16;
/// A label outside the field.
const NEVER: i16 = 16000;
/// Columns that one task sweeps vertically.
const BLOCK: usize = 16;

/// A node as the sweeps see it.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Node {
    /// Wrapped phase of the first fringe number, 65536 to a turn.
    pub phase: u16,
    /// Whether there is light to judge by; a dark node stops all support.
    pub lit: bool,
}

/// Orders of a shot, and what they were chosen by.
#[derive(Debug, Clone)]
pub(crate) struct Support {
    labels: Labels,
    columns: usize,
    pub nodes: Vec<Node>,
    costs: Vec<i16>,
    sums: Vec<u16>,
    /// Order of every node.
    pub order: Vec<i16>,
    /// Lead over the next best order, 1 for a lead that a change of surface would cost.
    pub margin: Vec<f32>,
    /// Misfit of the node's own evidence at the chosen order, in [0, 1] of the cut.
    pub misfit: Vec<f32>,
}

impl Support {
    pub fn new(code: &FringeCode) -> Self {
        Self {
            labels: Labels::new(code),
            columns: 0,
            nodes: Vec::new(),
            costs: Vec::new(),
            sums: Vec::new(),
            order: Vec::new(),
            margin: Vec::new(),
            misfit: Vec::new(),
        }
    }

    /// Choose the orders of `rows` x `columns` nodes; `evidence` writes what is known of a row of them. Any change of the
    /// surface costs as much as `jump_nodes` nodes in a row that contradict; a change by one order costs half of that.
    pub fn choose(
        &mut self,
        [rows, columns]: [usize; 2],
        jump_nodes: f64,
        evidence: impl Fn(usize, &mut Vec<Evidence>) + Sync,
    ) {
        let (nodes, labels) = (rows * columns, self.labels.count());
        let jump = (jump_nodes.clamp(1.0, 30.0) * f64::from(CUT)) as i16;
        self.columns = columns;
        self.nodes.resize(nodes, Node::default());
        self.costs.resize(nodes * labels, 0);
        self.sums.resize(nodes * labels, 0);
        let rows = self.costs.par_chunks_mut(columns * labels).zip(self.sums.par_chunks_mut(columns * labels));
        let rows = rows.zip(self.nodes.par_chunks_mut(columns)).enumerate();
        let table = &self.labels;
        rows.for_each_init(
            || (Path::new(labels, jump), Vec::new()),
            |(path, known), (row, ((costs, sums), nodes))| {
                known.clear();
                evidence(row, known);
                for ((node, known), costs) in nodes.iter_mut().zip(&*known).zip(costs.chunks_exact_mut(labels)) {
                    *node = known.node();
                    table.costs(known, costs);
                }
                path.restart();
                sweep_on(path, nodes, costs, sums);
                path.restart();
                sweep_back(path, nodes, costs, sums);
            },
        );
        self.sweep_columns(labels, jump);
        self.read_out(labels, jump);
    }

    fn sweep_columns(&mut self, labels: usize, jump: i16) {
        let Self { nodes, costs, sums, columns, .. } = self;
        let (columns, rows) = (*columns, nodes.len() / *columns);
        let mut blocks: Vec<Vec<&mut [u16]>> = Vec::new();
        blocks.resize_with(columns.div_ceil(BLOCK), || Vec::with_capacity(rows));
        for row in sums.chunks_exact_mut(columns * labels) {
            for (block, part) in blocks.iter_mut().zip(row.chunks_mut(BLOCK * labels)) {
                block.push(part);
            }
        }
        let (nodes, costs) = (&*nodes, &*costs);
        blocks.into_par_iter().enumerate().for_each(|(block, mut part)| {
            let first = block * BLOCK;
            let width = BLOCK.min(columns - first);
            let mut paths: Vec<Path> = (0..width).map(|_| Path::new(labels, jump)).collect();
            let mut visit = |row: usize, paths: &mut [Path]| {
                let at = row * columns + first;
                let costs = &costs[at * labels..][..width * labels];
                across(paths, &nodes[at..at + width], costs, part[row]);
            };
            (0..rows).for_each(|row| visit(row, &mut paths));
            paths.iter_mut().for_each(Path::restart);
            (0..rows).rev().for_each(|row| visit(row, &mut paths));
        });
    }

    fn read_out(&mut self, labels: usize, jump: i16) {
        let columns = self.columns;
        self.order.resize(self.nodes.len(), 0);
        self.margin.resize(self.nodes.len(), 0.0);
        self.misfit.resize(self.nodes.len(), 0.0);
        let out = self.order.par_chunks_mut(columns).zip(self.margin.par_chunks_mut(columns));
        let out = out.zip(self.misfit.par_chunks_mut(columns));
        let known = self.sums.par_chunks(columns * labels).zip(self.costs.par_chunks(columns * labels));
        out.zip(known).for_each(|(((order, margin), misfit), (sums, costs))| {
            let nodes = sums.chunks_exact(labels).zip(costs.chunks_exact(labels));
            for (x, (sums, costs)) in nodes.enumerate() {
                let (best, lead) = least(sums);
                order[x] = best as i16 - 1;
                margin[x] = f32::from(lead) / f32::from(jump);
                misfit[x] = f32::from(costs[best]) / f32::from(CUT);
            }
        });
    }
}

/// Least sum and its lead over the next.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn least(sums: &[u16]) -> (usize, u16) {
    let mut lanes = [u16::MAX; LANES];
    for block in sums.as_chunks::<LANES>().0 {
        for k in 0..LANES {
            lanes[k] = if block[k] < lanes[k] { block[k] } else { lanes[k] };
        }
    }
    let first = lanes.iter().copied().fold(u16::MAX, u16::min);
    let best = sums.iter().position(|&sum| sum == first).unwrap_or(0);
    let mut second = [u16::MAX; LANES];
    for (block, sums) in sums.as_chunks::<LANES>().0.iter().enumerate() {
        for k in 0..LANES {
            let sum = if block * LANES + k == best { u16::MAX } else { sums[k] };
            second[k] = if sum < second[k] { sum } else { second[k] };
        }
    }
    (best, second.iter().copied().fold(u16::MAX, u16::min) - first)
}
