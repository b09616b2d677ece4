//! Fringe orders by likelihood with spatial support.
//!
//! Every order of a pixel predicts the beats of G and of IR against R and B; the misfit, cut off so that a wrong beat
//! near an edge cannot shout, is its cost. Costs are aggregated along rows and columns as in semi-global matching
//! (Hirschmueller, IEEE TPAMI 30, 328 (2008)), with one change: where the wrapped phase jumps by a turn the order
//! changes for free, and only a change of the surface costs.

mod path;

use crate::FringeCode;
use multiversion::multiversion;
use ndarray::{Array3, ArrayViewMut2, Axis};
use path::Path;
use rayon::prelude::*;

/// Misfit (sum of squared beat errors over 2) beyond which evidence says nothing more: 0.1, both beats 0.3 rad off.
const CUT: i16 = 333;
/// Cost of any change of the surface, in units of [`CUT`].
const JUMP: i16 = 30 * CUT;
/// Cost of a change by one order.
const STEP: i16 = JUMP / 2;
/// Labels are padded to whole vectors.
const LANES: usize = 16;
/// A label outside the field.
const NEVER: i16 = 16000;
/// Columns that one task sweeps vertically.
const BLOCK: usize = 32;

/// What is known of one node before its neighbours are asked; angles in turns, 65536 to a turn.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Evidence {
    /// Wrapped phase of the first fringe number.
    pub phase: u16,
    /// Beats of G and IR against it, from a window: little noise, blurred at edges.
    pub beats: [u16; 2],
    /// Cosines of G and IR as seen at the node itself, 128 for 1: noisy, sharp; none in the first round.
    pub cosines: Option<[i16; 2]>,
    /// Whether there is light to judge by; a dark node stops all support.
    pub lit: bool,
}

impl Evidence {
    pub fn turns(angle_rad: f32) -> u16 {
        (angle_rad * (65536.0 / std::f32::consts::TAU)).round() as i32 as u16
    }
}

/// Order, margin and own cost of every node.
#[derive(Debug, Clone, Default)]
pub(crate) struct SupportMaps {
    pub order: Vec<i16>,
    /// Lead over the next best order, 1 for a lead that a change of surface would cost.
    pub margin: Vec<f32>,
    /// Misfit of the node's own beats at the chosen order, in [0, 1] of the cut.
    pub misfit: Vec<f32>,
}

/// The orders of one code and what they predict.
#[derive(Debug, Clone)]
pub(crate) struct Support {
    ratios: [f64; 2],
    /// Prediction of every label for a wrapped phase of 0, by beat.
    offsets: [Vec<u16>; 2],
    /// Extra cost of labels that leave the field, for a wrapped phase of 0 and of one turn.
    labels: usize,
    /// Greatest wrapped phase that the last order may have, least that the order before the first may have.
    last_turn: f64,
    first_turn: f64,
    last_label: usize,
}

impl Support {
    pub fn new(code: &FringeCode) -> Self {
        let n = code.numbers();
        let ratios = [n[1] / n[0] - 1.0, n[2] / n[0] - 1.0];
        let labels = (code.orders() + 2).div_ceil(LANES) * LANES;
        let per_column = n[0] / code.projector_width() as f64;
        let end = n[0] + 0.5 * per_column;
        let predict = |ratio: f64| {
            let turn = |label: usize| (ratio * (label as f64 - 1.0) * 65536.0).round() as i64 as u16;
            (0..labels).map(turn).collect()
        };
        Self {
            ratios,
            offsets: ratios.map(predict),
            labels,
            last_turn: end - end.floor(),
            first_turn: 1.0 - 1.5 * per_column,
            last_label: end.floor() as usize + 1,
        }
    }

    /// Choose the orders of `evidence`, row-major with `columns` nodes a row.
    pub fn choose(
        &self,
        evidence: &[Evidence],
        columns: usize,
        sums: &mut Array3<u16>,
        maps: &mut SupportMaps,
    ) {
        let rows = evidence.len() / columns;
        if sums.dim() != (rows, columns, self.labels) {
            *sums = Array3::zeros((rows, columns, self.labels));
        }
        self.sweep_rows(evidence, columns, sums);
        self.sweep_columns(evidence, columns, sums);
        self.read_out(evidence, columns, sums, maps);
    }

    fn sweep_rows(&self, evidence: &[Evidence], columns: usize, sums: &mut Array3<u16>) {
        sums.axis_iter_mut(Axis(0)).into_par_iter().zip(evidence.par_chunks(columns)).for_each_init(
            || Path::new(self.labels),
            |path, (mut row, nodes)| {
                path.restart();
                for x in 0..columns {
                    path.advance(
                        self,
                        &nodes[x],
                        &mut row.row_mut(x).into_slice().expect("labels are contiguous")[..],
                        true,
                    );
                }
                path.restart();
                for x in (0..columns).rev() {
                    path.advance(
                        self,
                        &nodes[x],
                        row.row_mut(x).into_slice().expect("labels are contiguous"),
                        false,
                    );
                }
            },
        );
    }

    fn sweep_columns(&self, evidence: &[Evidence], columns: usize, sums: &mut Array3<u16>) {
        let rows = evidence.len() / columns;
        sums.axis_chunks_iter_mut(Axis(1), BLOCK).into_par_iter().enumerate().for_each(
            |(block, mut part)| {
                let width = part.len_of(Axis(1));
                let mut paths: Vec<Path> = (0..width).map(|_| Path::new(self.labels)).collect();
                let mut visit = |y: usize, paths: &mut [Path]| {
                    let nodes = &evidence[y * columns + block * BLOCK..][..width];
                    let mut line: ArrayViewMut2<'_, u16> = part.index_axis_mut(Axis(0), y);
                    for (x, path) in paths.iter_mut().enumerate() {
                        let sum = line.row_mut(x).into_slice().expect("labels are contiguous");
                        path.advance(self, &nodes[x], sum, false);
                    }
                };
                (0..rows).for_each(|y| visit(y, &mut paths));
                paths.iter_mut().for_each(Path::restart);
                (0..rows).rev().for_each(|y| visit(y, &mut paths));
            },
        );
    }

    fn read_out(&self, evidence: &[Evidence], columns: usize, sums: &Array3<u16>, maps: &mut SupportMaps) {
        maps.order.resize(evidence.len(), 0);
        maps.margin.resize(evidence.len(), 0.0);
        maps.misfit.resize(evidence.len(), 0.0);
        let all = sums.as_slice().expect("sums are contiguous");
        let per_row = columns * self.labels;
        maps.order
            .par_chunks_mut(columns)
            .zip(maps.margin.par_chunks_mut(columns))
            .zip(maps.misfit.par_chunks_mut(columns))
            .zip(evidence.par_chunks(columns).zip(all.par_chunks(per_row)))
            .for_each_init(
                || vec![0i16; self.labels],
                |own, (((order, margin), misfit), (nodes, sums))| {
                    for (x, sums) in sums.chunks_exact(self.labels).enumerate() {
                        let (best, lead) = least(sums);
                        self.costs(&nodes[x], own);
                        order[x] = best as i16 - 1;
                        margin[x] = f32::from(lead) / f32::from(JUMP);
                        misfit[x] = f32::from(own[best]) / f32::from(CUT);
                    }
                },
            );
    }

    /// Cost of every label of a node.
    #[inline]
    fn costs(&self, node: &Evidence, out: &mut [i16]) {
        if !node.lit {
            out.fill(0);
            return;
        }
        let phase = f64::from(node.phase);
        let start = self.ratios.map(|ratio| (ratio * phase).round() as i64 as u16);
        let beats = [0, 1].map(|i| node.beats[i].wrapping_sub(start[i]));
        let [second, third] = &self.offsets;
        match node.cosines {
            None => beat_costs(beats, second, third, out),
            Some(seen) => {
                beat_costs(beats, second, third, out);
                let phases = start.map(|s| s.wrapping_add(node.phase));
                join_cosine_costs(phases, seen, second, third, out);
            }
        }
        let turn = phase / 65536.0;
        if turn < self.first_turn {
            out[0] = NEVER;
        }
        let end = self.last_label + usize::from(turn <= self.last_turn);
        if let Some(beyond) = out.get_mut(end..) {
            beyond.fill(NEVER);
        }
    }
}

/// Cost of every label by two beats, given what they are above those of order 0.
#[multiversion(targets("x86_64+avx2"))]
fn beat_costs(seen: [u16; 2], second: &[u16], third: &[u16], out: &mut [i16]) {
    for (cost, (&p, &q)) in out.iter_mut().zip(second.iter().zip(third)) {
        *cost = ((beat_miss(seen[0], p) + beat_miss(seen[1], q)) >> 4).min(CUT);
    }
}

/// The mean of that and the cost by two cosines, given the phases of order 0.
#[multiversion(targets("x86_64+avx2"))]
fn join_cosine_costs(phases: [u16; 2], seen: [i16; 2], second: &[u16], third: &[u16], out: &mut [i16]) {
    for (cost, (&p, &q)) in out.iter_mut().zip(second.iter().zip(third)) {
        let miss =
            cosine_miss(seen[0], phases[0].wrapping_add(p)) + cosine_miss(seen[1], phases[1].wrapping_add(q));
        *cost = (*cost + (miss >> 3).min(CUT)) >> 1;
    }
}

/// Squared distance of two beats, 127 for 45 degrees or more.
#[inline(always)]
fn beat_miss(seen: u16, predicted: u16) -> i16 {
    let error = (seen.wrapping_sub(predicted) as i16 >> 6).unsigned_abs().min(127) as i16;
    error * error
}

/// Squared distance of a cosine from that of a predicted phase, 128 for 1. The parabola through zeros and peaks is
/// within 0.06 of the cosine, less than noise and albedo leave.
#[inline(always)]
fn cosine_miss(seen: i16, predicted: u16) -> i16 {
    let from_zero = (16384 - i32::from((predicted as i16).unsigned_abs())) >> 7;
    let y = from_zero as i16;
    let cosine = (y * (256 - y.abs())) >> 7;
    let error = (seen - cosine).abs().min(127);
    error * error
}

/// Least sum and its lead over the next.
fn least(sums: &[u16]) -> (usize, u16) {
    let (mut best, mut first, mut second) = (0, u16::MAX, u16::MAX);
    for (label, &sum) in sums.iter().enumerate() {
        if sum < first {
            (best, second, first) = (label, first, sum);
        } else if sum < second {
            second = sum;
        }
    }
    (best, second - first)
}

#[cfg(test)]
mod tests {
    use super::*;

    const COLUMNS: usize = 96;
    const ROWS: usize = 64;

    /// Nodes of a surface at projector column `column(x, y)`, with the beats of a perfect shot.
    fn nodes(code: &FringeCode, column: impl Fn(usize, usize) -> f64) -> Vec<Evidence> {
        let turns =
            |n: f64, u: f64| ((n * u / code.projector_width() as f64) * 65536.0).round() as i64 as u16;
        let [n1, n2, n3] = code.numbers();
        (0..ROWS * COLUMNS)
            .map(|i| {
                let u = column(i % COLUMNS, i / COLUMNS);
                let beats = [turns(n2 - n1, u), turns(n3 - n1, u)];
                Evidence { phase: turns(n1, u), beats, cosines: None, lit: true }
            })
            .collect()
    }

    fn orders(code: &FringeCode, evidence: &[Evidence]) -> SupportMaps {
        let mut maps = SupportMaps::default();
        Support::new(code).choose(evidence, COLUMNS, &mut Array3::zeros((0, 0, 0)), &mut maps);
        maps
    }

    fn right(code: &FringeCode, column: f64, order: i16) -> bool {
        order == (column / code.period_px(0)).floor() as i16
    }

    #[test]
    fn every_order_of_a_field_and_of_a_step_is_right() {
        let code = FringeCode::optimum(36, 912).unwrap();
        let step =
            |x: usize, y: usize| if x < 50 { 9.3 * x as f64 + y as f64 } else { 300.2 + 5.1 * x as f64 };
        let maps = orders(&code, &nodes(&code, step));
        for i in 0..ROWS * COLUMNS {
            assert!(right(&code, step(i % COLUMNS, i / COLUMNS), maps.order[i]), "{i}");
            assert!(maps.margin[i] > 0.0 && maps.misfit[i] < 0.05);
        }
    }

    #[test]
    fn a_band_of_wrong_evidence_is_outvoted_and_says_so() {
        let code = FringeCode::optimum(36, 912).unwrap();
        let column = |x: usize, _: usize| 400.0 + 1.7 * x as f64;
        let mut evidence = nodes(&code, column);
        for y in 20..30 {
            for x in 40..46 {
                let beats = &mut evidence[y * COLUMNS + x].beats;
                *beats = beats.map(|b| b.wrapping_add(12000));
            }
        }
        let maps = orders(&code, &evidence);
        for i in 0..ROWS * COLUMNS {
            assert!(right(&code, column(i % COLUMNS, 0), maps.order[i]), "{i}");
        }
        assert!(maps.misfit[25 * COLUMNS + 43] > 0.9);
    }

    #[test]
    fn the_dark_carries_no_support() {
        let code = FringeCode::optimum(36, 912).unwrap();
        let column = |x: usize, _: usize| 101.37 + 4.0 * x as f64;
        let mut evidence = nodes(&code, column);
        for (i, node) in evidence.iter_mut().enumerate() {
            node.lit = !(40..44).contains(&(i % COLUMNS));
            if i % COLUMNS >= 44 {
                // Beyond the dark lies another surface, ten orders on, with beats of its own.
                let shift =
                    |beat: u16, n: f64| beat.wrapping_add((10.0 * n / 36.0 * 65536.0).round() as i64 as u16);
                node.beats = [shift(node.beats[0], -1.0), shift(node.beats[1], -6.0)];
            }
        }
        let maps = orders(&code, &evidence);
        for i in 0..ROWS * COLUMNS {
            let there =
                column(i % COLUMNS, 0) + if i % COLUMNS >= 44 { 10.0 * code.period_px(0) } else { 0.0 };
            assert!(!evidence[i].lit || right(&code, there, maps.order[i]), "{i}");
            assert!(evidence[i].lit || maps.margin[i] == 0.0);
        }
    }

    #[test]
    fn cosines_tell_orders_that_beats_leave_open() {
        let code = FringeCode::optimum(36, 912).unwrap();
        let column = |x: usize, y: usize| 200.37 + 2.9 * x as f64 + 0.31 * y as f64;
        let mut evidence = nodes(&code, column);
        for (i, node) in evidence.iter_mut().enumerate() {
            let u = column(i % COLUMNS, i / COLUMNS);
            let seen = |n: f64| ((std::f64::consts::TAU * n * u / 912.0).cos() * 128.0) as i16;
            node.beats = node.beats.map(|b| b.wrapping_add(30000));
            node.cosines = Some([seen(35.0), seen(30.0)]);
        }
        let maps = orders(&code, &evidence);
        let wrong =
            (0..ROWS * COLUMNS).filter(|&i| !right(&code, column(i % COLUMNS, i / COLUMNS), maps.order[i]));
        assert_eq!(wrong.count(), 0);
    }
}
