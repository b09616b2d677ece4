//! Step 4: fringe orders by semi-global matching (S4).
//!
//! Every order of a node predicts the beats of G and IR against R and B, and the cosines that the pixels of the node observe in G
//! and IR. The cost of the order is half the disagreement of the beats plus half the disagreement of the cosines. Both are
//! truncated, so that one wrong beat near a discontinuity cannot outweigh the neighbourhood. Costs are summed along rows and
//! columns as in semi-global matching (Hirschmueller, IEEE TPAMI 30, 328 (2008)), with one change: where the wrapped phase jumps
//! by a turn, the order changes without cost; only a change of surface has a price.

mod costs;
mod evidence;
mod sweep;

pub(super) use evidence::{CosineSums, NodeEvidence};

use crate::encoding::FourChannel;
use crate::joint::params::orders::COST_MAX;
use crate::joint::params::tasks::SWEEP_COLUMNS;
use costs::{CostTable, Infrared};
use multiversion::multiversion;
use rayon::prelude::*;
use sweep::{LANES, Node, Path, across, sweep_back, sweep_on};

/// The matching of a shot: the orders of its nodes, and their certainty.
#[derive(Debug, Clone)]
pub(super) struct Matching {
    table: CostTable,
    columns: usize,
    nodes: Vec<Node>,
    /// Costs of every label of every node, and their sums over the sweeps.
    costs: Vec<i16>,
    sums: Vec<u16>,
    /// Order of every node.
    pub order: Vec<i16>,
    /// Cost of the second cheapest order minus cost of the cheapest, in units of the jump price.
    pub lead: Vec<f32>,
    /// Cost of the chosen order by the evidence of the node alone, as a share of the greatest cost, in [0, 1].
    pub order_cost: Vec<f32>,
}

impl Matching {
    pub fn new(code: &FourChannel) -> Self {
        Self {
            table: CostTable::new(code),
            columns: 0,
            nodes: Vec::new(),
            costs: Vec::new(),
            sums: Vec::new(),
            order: Vec::new(),
            lead: Vec::new(),
            order_cost: Vec::new(),
        }
    }

    /// Phase of the middle order at a wrapped phase of 0, rad.
    pub fn middle_rad(&self) -> f32 {
        self.table.middle_rad()
    }

    /// Whether a node is lit.
    pub fn is_lit(&self, node: usize) -> bool {
        self.nodes[node].lit
    }

    /// Chooses the orders of `rows` x `columns` nodes. `evidence` appends the evidence of a row of nodes. A change of surface
    /// costs as much as `jump_nodes` contradicting nodes in a row, a change by one order half as much.
    pub fn choose(
        &mut self,
        [rows, columns]: [usize; 2],
        jump_nodes: f64,
        evidence: impl Fn(usize, &mut Vec<NodeEvidence>) + Sync,
    ) {
        let (nodes, labels) = (rows * columns, self.table.count());
        let jump = (jump_nodes * f64::from(COST_MAX)) as i16;
        self.columns = columns;
        self.nodes.resize(nodes, Node::default());
        self.costs.resize(nodes * labels, 0);
        self.sums.resize(nodes * labels, 0);
        let rows =
            self.costs.par_chunks_mut(columns * labels).zip(self.sums.par_chunks_mut(columns * labels));
        let rows = rows.zip(self.nodes.par_chunks_mut(columns)).enumerate();
        let table = &self.table;
        rows.for_each_init(
            || (Path::new(labels, jump), Vec::new(), Infrared::default()),
            |(path, known, infrared), (row, ((costs, sums), nodes))| {
                known.clear();
                evidence(row, known);
                for ((node, known), costs) in
                    nodes.iter_mut().zip(&*known).zip(costs.chunks_exact_mut(labels))
                {
                    *node = known.node();
                    table.costs(known, infrared, costs);
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
        blocks.resize_with(columns.div_ceil(SWEEP_COLUMNS), || Vec::with_capacity(rows));
        for row in sums.chunks_exact_mut(columns * labels) {
            for (block, part) in blocks.iter_mut().zip(row.chunks_mut(SWEEP_COLUMNS * labels)) {
                block.push(part);
            }
        }
        let (nodes, costs) = (&*nodes, &*costs);
        blocks.into_par_iter().enumerate().for_each(|(block, mut part)| {
            let first = block * SWEEP_COLUMNS;
            let width = SWEEP_COLUMNS.min(columns - first);
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
        self.lead.resize(self.nodes.len(), 0.0);
        self.order_cost.resize(self.nodes.len(), 0.0);
        let out = self.order.par_chunks_mut(columns).zip(self.lead.par_chunks_mut(columns));
        let out = out.zip(self.order_cost.par_chunks_mut(columns));
        let known = self.sums.par_chunks(columns * labels).zip(self.costs.par_chunks(columns * labels));
        out.zip(known).for_each(|(((order, lead), order_cost), (sums, costs))| {
            let nodes = sums.chunks_exact(labels).zip(costs.chunks_exact(labels));
            for (x, (sums, costs)) in nodes.enumerate() {
                let cheapest = cheapest(sums);
                // Label 1 is order 0.
                order[x] = cheapest.label as i16 - 1;
                lead[x] = f32::from(cheapest.lead) / f32::from(jump);
                order_cost[x] = f32::from(costs[cheapest.label]) / f32::from(COST_MAX);
            }
        });
    }
}

/// The label with the least sum of costs, and the distance to the second least sum.
#[derive(Debug, Clone, Copy)]
struct Cheapest {
    label: usize,
    lead: u16,
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn cheapest(sums: &[u16]) -> Cheapest {
    let mut lanes = [u16::MAX; LANES];
    for block in sums.as_chunks::<LANES>().0 {
        for k in 0..LANES {
            lanes[k] = if block[k] < lanes[k] { block[k] } else { lanes[k] };
        }
    }
    let first = lanes.iter().copied().fold(u16::MAX, u16::min);
    let label = sums.iter().position(|&sum| sum == first).unwrap_or(0);
    let mut second = [u16::MAX; LANES];
    for (block, sums) in sums.as_chunks::<LANES>().0.iter().enumerate() {
        for k in 0..LANES {
            let sum = if block * LANES + k == label { u16::MAX } else { sums[k] };
            second[k] = if sum < second[k] { sum } else { second[k] };
        }
    }
    Cheapest { label, lead: second.iter().copied().fold(u16::MAX, u16::min) - first }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::encoding::Encoding;
    use std::f64::consts::TAU;

    const COLUMNS: usize = 96;
    const ROWS: usize = 64;

    /// A node with a single pixel that sees projector column `u`, with the beats of a perfect shot.
    fn node(code: &FourChannel, u: f64) -> NodeEvidence {
        let [n1, n2, n3] = code.numbers();
        let turns = |n: f64| ((n * u / code.projector_width as f64) * 65536.0).round() as i64 as u16;
        let wrapped = f64::from(turns(n1)) / 65536.0 * TAU;
        let seen = |n: f64| {
            let s = (TAU * n * u / code.projector_width as f64).cos();
            let f = n / n1 * wrapped;
            let [square, first, second] =
                [[s * s, 0.0], [s * f.cos(), s * f.sin()], [(2.0 * f).cos(), (2.0 * f).sin()]];
            let round = |pair: [f64; 2]| pair.map(|v| v as f32);
            CosineSums { pixels: 1.0, square: square[0] as f32, first: round(first), second: round(second) }
        };
        NodeEvidence {
            phase: turns(n1),
            beats: [turns(n2 - n1), turns(n3 - n1)],
            weights: [1.0; 2],
            cosines: [seen(n2), seen(n3)],
            pixels: 1.0,
            lit: true,
            infrared: None,
        }
    }

    fn choose(code: &FourChannel, evidence: impl Fn(usize, usize) -> NodeEvidence + Sync) -> Matching {
        let mut matching = Matching::new(code);
        let row = |y: usize, out: &mut Vec<NodeEvidence>| out.extend((0..COLUMNS).map(|x| evidence(x, y)));
        matching.choose([ROWS, COLUMNS], 8.0, row);
        matching
    }

    fn right(code: &FourChannel, column: f64, order: i16) -> bool {
        order == (column / code.period_px()).floor() as i16
    }

    #[test]
    fn every_order_of_a_field_and_of_a_step_is_right() {
        let code = FourChannel::of(Encoding::optimum(36, 912));
        let step =
            |x: usize, y: usize| if x < 50 { 9.3 * x as f64 + y as f64 } else { 300.2 + 5.1 * x as f64 };
        let found = choose(&code, |x, y| node(&code, step(x, y)));
        for i in 0..ROWS * COLUMNS {
            assert!(right(&code, step(i % COLUMNS, i / COLUMNS), found.order[i]), "{i}");
            assert!(found.lead[i] > 0.0 && found.order_cost[i] < 0.05, "{i}");
        }
    }

    #[test]
    fn neighbours_outvote_a_band_of_wrong_evidence_and_its_cost_shows_it() {
        let code = FourChannel::of(Encoding::optimum(36, 912));
        let column = |x: usize| 400.0 + 1.7 * x as f64;
        let found = choose(&code, |x, y| {
            let mut node = node(&code, column(x));
            if (20..30).contains(&y) && (40..46).contains(&x) {
                node.beats = node.beats.map(|beat| beat.wrapping_add(12000));
                node.cosines = node.cosines.map(|seen| CosineSums { first: seen.first.map(|v| -v), ..seen });
            }
            node
        });
        for i in 0..ROWS * COLUMNS {
            assert!(right(&code, column(i % COLUMNS), found.order[i]), "{i}");
        }
        assert!(found.order_cost[25 * COLUMNS + 43] > 0.6);
    }

    #[test]
    fn dark_nodes_pass_no_costs_on() {
        let code = FourChannel::of(Encoding::optimum(36, 912));
        // Beyond the dark nodes lies another surface, ten orders higher.
        let column = |x: usize| 101.37 + 4.0 * x as f64 + if x >= 44 { 10.0 * code.period_px() } else { 0.0 };
        let found =
            choose(&code, |x, _| NodeEvidence { lit: !(40..44).contains(&x), ..node(&code, column(x)) });
        for i in 0..ROWS * COLUMNS {
            let lit = !(40..44).contains(&(i % COLUMNS));
            assert!(!lit || right(&code, column(i % COLUMNS), found.order[i]), "{i}");
            assert!(lit || found.lead[i] == 0.0);
        }
    }

    #[test]
    fn a_channel_without_contrast_has_no_say() {
        let code = FourChannel::of(Encoding::optimum(36, 912));
        let column = |x: usize| 200.37 + 2.9 * x as f64;
        let orders_with = |weight: f32| {
            let found = choose(&code, |x, _| {
                let mut node = node(&code, column(x));
                node.weights[1] = weight;
                node.beats[1] = node.beats[1].wrapping_add(9000);
                node.cosines[1] = CosineSums::default();
                node
            });
            (0..ROWS * COLUMNS).filter(|&i| right(&code, column(i % COLUMNS), found.order[i])).count()
        };
        assert_eq!(orders_with(0.0), ROWS * COLUMNS);
        assert!(orders_with(1.0) < ROWS * COLUMNS);
    }

    #[test]
    fn cosines_of_pixels_decide_where_beats_are_wrong() {
        let code = FourChannel::of(Encoding::optimum(36, 912));
        let column = |x: usize, y: usize| 200.37 + 2.9 * x as f64 + 0.31 * y as f64;
        let found = choose(&code, |x, y| {
            let node = node(&code, column(x, y));
            NodeEvidence { beats: node.beats.map(|beat| beat.wrapping_add(30000)), ..node }
        });
        let wrong =
            (0..ROWS * COLUMNS).filter(|&i| !right(&code, column(i % COLUMNS, i / COLUMNS), found.order[i]));
        assert_eq!(wrong.count(), 0);
    }
}
