//! The orders of one code and what they predict.

use super::{CUT, LANES, NEVER, Node};
use crate::FringeCode;
use multiversion::multiversion;
use std::f64::consts::TAU;

/// Squared misfit of cosines of 1 in units of the costs.
const COSINE_UNIT: f32 = 2048.0;

/// What is known of one node before its neighbours are asked; angles in turns, 65536 to a turn.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Evidence {
    /// Wrapped phase of the first fringe number.
    pub phase: u16,
    /// Beats of G and IR against it, from a window: little noise, blurred at edges.
    pub beats: [u16; 2],
    /// What the pixels of the node itself see in G and in IR: noisy, sharp.
    pub seen: [Seen; 2],
    /// Pixels that were asked what they see.
    pub pixels: f32,
    /// Whether there is light to judge by.
    pub lit: bool,
}

/// Sums over the pixels of a node: `s`, the cosine seen in one channel, against the phase `f` that order 0 predicts.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Seen {
    /// Sum of s^2.
    pub square: f32,
    /// Sums of s cos f and s sin f.
    pub first: [f32; 2],
    /// Sums of cos 2f and sin 2f.
    pub second: [f32; 2],
}

impl Evidence {
    pub fn turns(angle_rad: f32) -> u16 {
        (angle_rad * (65536.0 / std::f32::consts::TAU)).round() as i32 as u16
    }

    pub fn node(&self) -> Node {
        Node { phase: self.phase, lit: self.lit }
    }
}

/// Every order of a code as a label, with what it predicts; label 1 is order 0.
#[derive(Debug, Clone)]
pub(crate) struct Labels {
    ratios: [f64; 2],
    /// Beats of every label for a wrapped phase of 0.
    beats: [Vec<u16>; 2],
    /// Per channel: cosine and sine of the phase that a label adds to that of order 0, and of twice that phase.
    turns: [[Vec<f32>; 4]; 2],
    /// Greatest wrapped phase that the last order may have, least that the order before the first may have.
    last_turn: f64,
    first_turn: f64,
    last_label: usize,
    count: usize,
}

impl Labels {
    pub fn new(code: &FringeCode) -> Self {
        let n = code.numbers();
        let ratios = [n[1] / n[0] - 1.0, n[2] / n[0] - 1.0];
        let count = (code.orders() + 2).div_ceil(LANES) * LANES;
        let per_column = n[0] / code.projector_width() as f64;
        let end = n[0] + 0.5 * per_column;
        let labels = || (0..count).map(|label| label as f64 - 1.0);
        let beats =
            ratios.map(|ratio| labels().map(|k| (ratio * k * 65536.0).round() as i64 as u16).collect());
        let turns = ratios.map(|ratio| {
            let angle = |k: f64| TAU * (ratio * k).rem_euclid(1.0);
            [
                labels().map(|k| angle(k).cos() as f32).collect(),
                labels().map(|k| angle(k).sin() as f32).collect(),
                labels().map(|k| (2.0 * angle(k)).cos() as f32).collect(),
                labels().map(|k| (2.0 * angle(k)).sin() as f32).collect(),
            ]
        });
        Self {
            ratios,
            beats,
            turns,
            last_turn: end - end.floor(),
            first_turn: 1.0 - 1.5 * per_column,
            last_label: end.floor() as usize + 1,
            count,
        }
    }

    /// Number of labels, padded to whole vectors.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Cost of every label of a node: the mean of what its beats and its own cosines say.
    pub fn costs(&self, node: &Evidence, out: &mut [i16]) {
        if !node.lit {
            out.fill(0);
            return;
        }
        let phase = f64::from(node.phase);
        let start = self.ratios.map(|ratio| (ratio * phase).round() as i64 as u16);
        let beats = [0, 1].map(|i| node.beats[i].wrapping_sub(start[i]));
        // Without pixels of its own a node is as far off as can be with every label.
        let scale = if node.pixels > 0.0 { COSINE_UNIT / node.pixels } else { 0.0 };
        costs(beats, &node.seen, scale, node.pixels, [&self.beats[0], &self.beats[1]], &self.turns, out);
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

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn costs(
    beats: [u16; 2],
    seen: &[Seen; 2],
    scale: f32,
    pixels: f32,
    offsets: [&[u16]; 2],
    turns: &[[Vec<f32>; 4]; 2],
    out: &mut [i16],
) {
    let blocks = out.len() / LANES;
    let offsets = offsets.map(|map| &map.as_chunks::<LANES>().0[..blocks]);
    let turns = turns.each_ref().map(|maps| maps.each_ref().map(|map| &map.as_chunks::<LANES>().0[..blocks]));
    for (b, out) in out.as_chunks_mut::<LANES>().0.iter_mut().enumerate() {
        let mut miss = [0.0f32; LANES];
        for (seen, [c, s, c2, s2]) in seen.iter().zip(&turns) {
            let still = seen.square + 0.5 * pixels;
            for k in 0..LANES {
                let first = seen.first[0] * c[b][k] - seen.first[1] * s[b][k];
                let second = seen.second[0] * c2[b][k] - seen.second[1] * s2[b][k];
                miss[k] += still - 2.0 * first + 0.5 * second;
            }
        }
        for k in 0..LANES {
            let scaled = scale * miss[k];
            let own = (if scaled < f32::from(CUT) { scaled } else { f32::from(CUT) }) as i32 as i16;
            let beat = (beat_miss(beats[0], offsets[0][b][k]) + beat_miss(beats[1], offsets[1][b][k])) >> 4;
            let beat = if beat < CUT { beat } else { CUT };
            out[k] = (beat + own) >> 1;
        }
    }
}

/// Squared distance of two beats, 127 for 45 degrees or more.
#[inline(always)]
fn beat_miss(seen: u16, predicted: u16) -> i16 {
    let error = (seen.wrapping_sub(predicted) as i16 >> 6).unsigned_abs();
    let error = (if error < 127 { error } else { 127 }) as i16;
    error * error
}
