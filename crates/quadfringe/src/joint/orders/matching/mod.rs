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
        let rows =
            self.costs.par_chunks_mut(columns * labels).zip(self.sums.par_chunks_mut(columns * labels));
        let rows = rows.zip(self.nodes.par_chunks_mut(columns)).enumerate();
        let table = &self.labels;
        rows.for_each_init(
            || (Path::new(labels, jump), Vec::new()),
            |(path, known), (row, ((costs, sums), nodes))| {
                known.clear();
                evidence(row, known);
                for ((node, known), costs) in
                    nodes.iter_mut().zip(&*known).zip(costs.chunks_exact_mut(labels))
                {
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

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    const COLUMNS: usize = 96;
    const ROWS: usize = 64;

    /// A node that sees projector column `u`, with the beats of a perfect shot and one pixel of its own.
    fn node(code: &FringeCode, u: f64) -> Evidence {
        let [n1, n2, n3] = code.numbers();
        let turns = |n: f64| ((n * u / code.projector_width() as f64) * 65536.0).round() as i64 as u16;
        let wrapped = f64::from(turns(n1)) / 65536.0 * TAU;
        let seen = |n: f64| {
            let s = (TAU * n * u / code.projector_width() as f64).cos();
            let f = n / n1 * wrapped;
            let [square, first, second] =
                [[s * s, 0.0], [s * f.cos(), s * f.sin()], [(2.0 * f).cos(), (2.0 * f).sin()]];
            let round = |pair: [f64; 2]| pair.map(|v| v as f32);
            Seen { square: square[0] as f32, first: round(first), second: round(second) }
        };
        Evidence {
            phase: turns(n1),
            beats: [turns(n2 - n1), turns(n3 - n1)],
            seen: [seen(n2), seen(n3)],
            pixels: 1.0,
            lit: true,
        }
    }

    fn choose(code: &FringeCode, evidence: impl Fn(usize, usize) -> Evidence + Sync) -> Support {
        let mut support = Support::new(code);
        let row = |y: usize, out: &mut Vec<Evidence>| out.extend((0..COLUMNS).map(|x| evidence(x, y)));
        support.choose([ROWS, COLUMNS], 8.0, row);
        support
    }

    fn right(code: &FringeCode, column: f64, order: i16) -> bool {
        order == (column / code.period_px(0)).floor() as i16
    }

    #[test]
    fn every_order_of_a_field_and_of_a_step_is_right() {
        let code = FringeCode::optimum(36, 912).unwrap();
        let step =
            |x: usize, y: usize| if x < 50 { 9.3 * x as f64 + y as f64 } else { 300.2 + 5.1 * x as f64 };
        let found = choose(&code, |x, y| node(&code, step(x, y)));
        for i in 0..ROWS * COLUMNS {
            assert!(right(&code, step(i % COLUMNS, i / COLUMNS), found.order[i]), "{i}");
            assert!(found.margin[i] > 0.0 && found.misfit[i] < 0.05, "{i}");
        }
    }

    #[test]
    fn a_band_of_wrong_evidence_is_outvoted_and_says_so() {
        let code = FringeCode::optimum(36, 912).unwrap();
        let column = |x: usize| 400.0 + 1.7 * x as f64;
        let found = choose(&code, |x, y| {
            let mut node = node(&code, column(x));
            if (20..30).contains(&y) && (40..46).contains(&x) {
                node.beats = node.beats.map(|beat| beat.wrapping_add(12000));
                node.seen = node.seen.map(|seen| Seen { first: seen.first.map(|v| -v), ..seen });
            }
            node
        });
        for i in 0..ROWS * COLUMNS {
            assert!(right(&code, column(i % COLUMNS), found.order[i]), "{i}");
        }
        assert!(found.misfit[25 * COLUMNS + 43] > 0.6);
    }

    #[test]
    fn the_dark_carries_no_support() {
        let code = FringeCode::optimum(36, 912).unwrap();
        // Beyond the dark lies another surface, ten orders on.
        let column =
            |x: usize| 101.37 + 4.0 * x as f64 + if x >= 44 { 10.0 * code.period_px(0) } else { 0.0 };
        let found = choose(&code, |x, _| Evidence { lit: !(40..44).contains(&x), ..node(&code, column(x)) });
        for i in 0..ROWS * COLUMNS {
            let lit = !(40..44).contains(&(i % COLUMNS));
            assert!(!lit || right(&code, column(i % COLUMNS), found.order[i]), "{i}");
            assert!(lit || found.margin[i] == 0.0);
        }
    }

    #[test]
    fn own_pixels_tell_orders_that_beats_leave_open() {
        let code = FringeCode::optimum(36, 912).unwrap();
        let column = |x: usize, y: usize| 200.37 + 2.9 * x as f64 + 0.31 * y as f64;
        let found = choose(&code, |x, y| {
            let node = node(&code, column(x, y));
            Evidence { beats: node.beats.map(|beat| beat.wrapping_add(30000)), ..node }
        });
        let wrong =
            (0..ROWS * COLUMNS).filter(|&i| !right(&code, column(i % COLUMNS, i / COLUMNS), found.order[i]));
        assert_eq!(wrong.count(), 0);
    }
}
