//! Costs of the orders of a node: the squared difference between the evidence and the predictions of each order.

use super::evidence::{CosineSums, NodeEvidence};
use super::sweep::{IMPOSSIBLE, LANES};
use crate::encoding::FourChannel;
use crate::joint::infrared::{TERMS, wave};
use crate::joint::params::orders::{COSINE_UNIT, COSINE_UNIT_WITHOUT_INFRARED, COST_MAX, WEIGHT_ONE};
use crate::parallel::angle::{round, sin_cos};
use multiversion::multiversion;
use std::f64::consts::TAU;

/// Predictions of every order. Orders are numbered as labels: label 1 is order 0, label 0 the order before the field.
#[derive(Debug, Clone)]
pub(super) struct CostTable {
    /// Turns of the beats of G and IR in one turn of the first phase.
    beat_ratios: [f64; 2],
    /// Whether there is a third phase, of IR or of B alone; without it only G counts.
    third: bool,
    /// Beats of G and IR for every label at a wrapped phase of 0.
    beats: [Vec<u16>; 2],
    /// Phase difference of G and IR between every label and order 0.
    rotations: [Rotations; 2],
    /// The middle order.
    middle: usize,
    /// Greatest wrapped phase, in turns, that the last order may have.
    last_turn: f64,
    /// Least wrapped phase, in turns, that the order before the first may have.
    first_turn: f64,
    first_label: usize,
    last_label: usize,
    count: usize,
}

/// Cosine and sine of an angle and of twice the angle, for every label.
#[derive(Debug, Clone, Default)]
struct Rotations {
    cos: Vec<f32>,
    sin: Vec<f32>,
    cos_twice: Vec<f32>,
    sin_twice: Vec<f32>,
}

/// The same for IR at one node of a calibrated pair.
#[derive(Debug, Default)]
pub(super) struct Infrared {
    beats: Vec<u16>,
    /// Phase difference between every label and the middle order.
    rotations: Rotations,
}

impl Infrared {
    /// Predicts every label at a wrapped phase in rad.
    fn predict(&mut self, terms: [f32; TERMS], phase: f32, middle_rad: f32, count: usize) {
        let Self { beats, rotations: Rotations { cos, sin, cos_twice, sin_twice } } = self;
        beats.resize(count, 0);
        for line in [&mut *cos, &mut *sin, &mut *cos_twice, &mut *sin_twice] {
            line.resize(count, 0.0);
        }
        predict(terms, [phase, middle_rad], beats, [cos, sin, cos_twice, sin_twice]);
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn predict(terms: [f32; TERMS], [wrapped, middle]: [f32; 2], beats: &mut [u16], rotations: [&mut [f32]; 4]) {
    let (middle, unit) = (wave(terms, wrapped + middle).phase, 65536.0 / std::f32::consts::TAU);
    let beats = beats.as_chunks_mut::<LANES>().0;
    let [cos, sin, cos_twice, sin_twice] = rotations.map(|line| line.as_chunks_mut::<LANES>().0);
    for (b, beats) in beats.iter_mut().enumerate() {
        for k in 0..LANES {
            // Label 1 is order 0.
            let phase = wrapped + std::f32::consts::TAU * ((b * LANES + k) as f32 - 1.0);
            let infrared = wave(terms, phase).phase;
            beats[k] = round((infrared - phase) * unit) as i32 as u16;
            let (s, c) = sin_cos(infrared - middle);
            (cos[b][k], sin[b][k]) = (c, s);
            (cos_twice[b][k], sin_twice[b][k]) = (c * c - s * s, 2.0 * s * c);
        }
    }
}

impl CostTable {
    pub fn new(code: &FourChannel) -> Self {
        let n = code.numbers();
        let beat_ratios = [n[1] / n[0] - 1.0, n[2] / n[0] - 1.0];
        let count = (code.orders() + 2).div_ceil(LANES) * LANES;
        let per_column = n[0] / code.projector_width as f64;
        let [first_px, last_px] = code.columns_px;
        let (from, to) = (first_px * per_column, n[0] - (code.projector_width as f64 - last_px) * per_column);
        let (begin, end) = (from - 1.5 * per_column, to + 0.5 * per_column);
        let before = begin.floor().max(-1.0);
        let labels = || (0..count).map(|label| label as f64 - 1.0);
        let beats =
            beat_ratios.map(|ratio| labels().map(|k| (ratio * k * 65536.0).round() as i64 as u16).collect());
        let rotations = beat_ratios.map(|ratio| {
            let angle = |k: f64| TAU * (ratio * k).rem_euclid(1.0);
            Rotations {
                cos: labels().map(|k| angle(k).cos() as f32).collect(),
                sin: labels().map(|k| angle(k).sin() as f32).collect(),
                cos_twice: labels().map(|k| (2.0 * angle(k)).cos() as f32).collect(),
                sin_twice: labels().map(|k| (2.0 * angle(k)).sin() as f32).collect(),
            }
        });
        Self {
            beat_ratios,
            third: code.has_third(),
            beats,
            rotations,
            middle: (0.5 * n[0]) as usize,
            last_turn: end - end.floor(),
            first_turn: begin - before,
            first_label: (before + 1.0) as usize,
            last_label: end.floor() as usize + 1,
            count,
        }
    }

    /// Number of labels including padding to whole vectors.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Phase of the middle order at a wrapped phase of 0, rad.
    pub fn middle_rad(&self) -> f32 {
        self.middle as f32 * std::f32::consts::TAU
    }

    /// Cost of every label of a node: the mean of the cost by beats and the cost by cosines. `infrared` is working memory.
    pub fn costs(&self, node: &NodeEvidence, infrared: &mut Infrared, out: &mut [i16]) {
        if !node.lit {
            out.fill(0);
            return;
        }
        let phase = f64::from(node.phase);
        let predicted = self.beat_ratios.map(|ratio| (ratio * phase).round() as i64 as u16);
        // Without usable pixels, the cost by cosines is 0 for all labels.
        let unit = if self.third { COSINE_UNIT } else { COSINE_UNIT_WITHOUT_INFRARED };
        let seen = Seen {
            beats: [0, 1].map(|i| node.beats[i].wrapping_sub(predicted[i])),
            weights: node.weights.map(|weight| (f32::from(WEIGHT_ONE) * weight) as i16),
            cosines: &node.cosines,
            scale: if node.pixels > 0.0 { unit / node.pixels } else { 0.0 },
        };
        let [green_beats, infrared_beats] = &self.beats;
        let [green_rotations, infrared_rotations] = &self.rotations;
        let coaxial = ([green_beats, infrared_beats], [green_rotations, infrared_rotations]);
        if let Some(terms) = node.infrared {
            let wrapped = node.phase as f32 * (std::f32::consts::TAU / 65536.0);
            infrared.predict(terms, wrapped, self.middle_rad(), self.count);
            let rows = [green_rotations, &infrared.rotations];
            let seen = Seen { beats: [seen.beats[0], node.beats[1]], ..seen };
            costs::<2>(seen, [green_beats, &infrared.beats], rows, out);
        } else if self.third {
            costs::<2>(seen, coaxial.0, coaxial.1, out);
        } else {
            costs::<1>(seen, coaxial.0, coaxial.1, out);
        }
        let turn = phase / 65536.0;
        let start = self.first_label + usize::from(turn < self.first_turn);
        out[..start].fill(IMPOSSIBLE);
        let end = self.last_label + usize::from(turn <= self.last_turn);
        if let Some(beyond) = out.get_mut(end..) {
            beyond.fill(IMPOSSIBLE);
        }
    }
}

/// What a node sees in G and IR.
#[derive(Clone, Copy)]
struct Seen<'a> {
    /// The beats minus those predicted for order 0.
    beats: [u16; 2],
    /// Weights of the beats, in units of 1 / [`WEIGHT_ONE`].
    weights: [i16; 2],
    cosines: &'a [CosineSums; 2],
    /// Converts a sum of squared differences of cosines to the unit of the costs.
    scale: f32,
}

/// Computes the costs of all labels by `CHANNELS` of G and IR.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn costs<const CHANNELS: usize>(
    seen: Seen,
    predicted: [&Vec<u16>; 2],
    rotations: [&Rotations; 2],
    out: &mut [i16],
) {
    let blocks = out.len() / LANES;
    let offsets = predicted.map(|map| &map.as_chunks::<LANES>().0[..blocks]);
    let rotations = rotations.map(|Rotations { cos, sin, cos_twice, sin_twice }| {
        [cos, sin, cos_twice, sin_twice].map(|map| &map.as_chunks::<LANES>().0[..blocks])
    });
    for (b, out) in out.as_chunks_mut::<LANES>().0.iter_mut().enumerate() {
        let mut square = [0.0f32; LANES];
        for (sums, [c, s, c2, s2]) in seen.cosines.iter().zip(&rotations).take(CHANNELS) {
            let still = sums.square + 0.5 * sums.pixels;
            for k in 0..LANES {
                let first = sums.first[0] * c[b][k] - sums.first[1] * s[b][k];
                let second = sums.second[0] * c2[b][k] - sums.second[1] * s2[b][k];
                square[k] += still - 2.0 * first + 0.5 * second;
            }
        }
        for k in 0..LANES {
            let scaled = seen.scale * square[k];
            let by_cosines =
                (if scaled < f32::from(COST_MAX) { scaled } else { f32::from(COST_MAX) }) as i32 as i16;
            let mut by_beats = 0;
            for c in 0..CHANNELS {
                let cost = beat_cost(seen.beats[c], offsets[c][b][k]);
                by_beats += ((cost >> 4) * seen.weights[c]) / WEIGHT_ONE;
            }
            let by_beats = if by_beats < COST_MAX { by_beats } else { COST_MAX };
            out[k] = (by_beats + by_cosines) >> 1;
        }
    }
}

/// Squared difference of two beats. The difference is limited to 127, which is 45 degrees.
#[inline(always)]
fn beat_cost(observed: u16, predicted: u16) -> i16 {
    let error = (observed.wrapping_sub(predicted) as i16 >> 6).unsigned_abs();
    let error = (if error < 127 { error } else { 127 }) as i16;
    error * error
}
