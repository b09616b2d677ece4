//! The mean envelope: half the sum of the envelopes through the fringe maxima and through the fringe minima.

use super::moving_mean::{Sums, moving_mean};
use super::waves::{Extremum, Waves};
use crate::parallel::Aligned;
use crate::stages::blocks::coarsen;
use crate::stages::params::{ENVELOPE_SAMPLES_PER_FRINGE, ENVELOPE_SMOOTHING};

/// Number of extrema that are refined together, as vectors.
const LANES: usize = 8;
/// Number of pixels that are drawn together; in most cases enough to reach from one extremum to the next.
const BLOCK: usize = 24;

/// Working memory of [`mean_envelope`].
#[derive(Debug, Default)]
pub(super) struct Scratch {
    coarse: Aligned<f32>,
    smooth: Aligned<f32>,
    middle: Aligned<f32>,
    waves: Waves,
    knots: Knots,
    levels: Vec<f32>,
    lines: Vec<Line>,
}

/// Extrema of a row; maxima and minima alternate.
#[derive(Debug, Default)]
struct Knots {
    at_px: Vec<f32>,
    value: Vec<f32>,
    extrema: Vec<Extremum>,
}

/// A straight line `level + i slope` from the end of the previous line to the pixel before `end`.
#[derive(Debug, Default, Clone, Copy)]
struct Line {
    level: f32,
    slope: f32,
    end: u32,
}

/// Background of `row`. Returns false if the row has no fringes.
///
/// The row is split where it crosses its moving mean. Each half wave between two crossings contains one extremum. To
/// find it, the row is averaged over 1, 2, 4, ... pixels, as many as leave [`ENVELOPE_SAMPLES_PER_FRINGE`] samples per
/// fringe.
#[inline(always)]
pub(super) fn mean_envelope(
    row: &[f32],
    period_px: f32,
    sums: &mut Sums,
    scratch: &mut Scratch,
    out: &mut [f32],
) -> bool {
    let step = coarseness(period_px, row.len());
    let period = period_px / step as f32;
    let Scratch { coarse, smooth, middle, waves, knots, levels, lines } = scratch;
    coarsen(row, step, coarse, smooth);
    let count = coarse.len();
    for buffer in [&mut *smooth, &mut *middle] {
        buffer.resize(Waves::padded(count));
    }
    moving_mean(coarse, ENVELOPE_SMOOTHING * period, sums, &mut smooth[..count]);
    moving_mean(coarse, period, sums, &mut middle[..count]);
    waves.find(smooth, middle, count);
    knots.find(waves, smooth, (ENVELOPE_SMOOTHING * period) as usize, step as f32);
    if knots.at_px.len() < 2 {
        return false;
    }
    find_levels(knots, levels);
    find_lines(knots, levels, lines);
    draw(lines, out);
    true
}

/// Number of pixels in a sample. A row has at least one sample, however long the period is.
fn coarseness(period_px: f32, row_px: usize) -> usize {
    let mut step = 1;
    while period_px >= 2.0 * ENVELOPE_SAMPLES_PER_FRINGE * step as f32 && 2 * step <= row_px {
        step *= 2;
    }
    step
}

impl Knots {
    /// Places and values of the extrema: the vertices of parabolas through each extremum and its two neighbours.
    #[inline(always)]
    fn find(&mut self, waves: &Waves, smooth: &[f32], shortest: usize, step: f32) {
        let Self { at_px, value, extrema } = self;
        waves.extrema(smooth, shortest, extrema);
        let count = extrema.len();
        let whole = count.next_multiple_of(LANES);
        // An extremum lies between two crossings and therefore has two neighbours; sample 1, the padding, has them too.
        extrema.resize(whole, Extremum { sample: 1, sign: 0.0 });
        at_px.resize(whole, 0.0);
        value.resize(whole, 0.0);
        let out = at_px.chunks_exact_mut(LANES).zip(value.chunks_exact_mut(LANES));
        for (extrema, (at_px, value)) in extrema.chunks_exact(LANES).zip(out) {
            let (mut left, mut top, mut right) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
            for (i, Extremum { sample, .. }) in extrema.iter().enumerate() {
                let near = &smooth[*sample as usize - 1..][..3];
                (left[i], top[i], right[i]) = (near[0], near[1], near[2]);
            }
            for (i, &Extremum { sample, sign }) in extrema.iter().enumerate() {
                let curvature = left[i] - 2.0 * top[i] + right[i];
                let bent = sign * curvature < 0.0;
                let across = left[i] - right[i];
                let shift = 0.5 * across / if bent { curvature } else { 1.0 };
                let shift = if bent { shift.clamp(-0.5, 0.5) } else { 0.0 };
                at_px[i] = (sample as i32 as f32 + shift + 0.5) * step - 0.5;
                value[i] = top[i] - 0.25 * across * shift;
            }
        }
        at_px.truncate(count);
        value.truncate(count);
    }
}

/// The background at each knot: half the sum of the value at the knot and the opposite envelope, which is a straight
/// line between the two neighbouring knots.
#[inline(always)]
fn find_levels(Knots { at_px, value, .. }: &Knots, levels: &mut Vec<f32>) {
    let last = value.len() - 1;
    levels.resize(value.len(), 0.0);
    levels[0] = 0.5 * (value[0] + value[1]);
    levels[last] = 0.5 * (value[last] + value[last - 1]);
    let places = at_px.iter().zip(&at_px[1..]).zip(&at_px[2..]);
    let values = value.iter().zip(&value[1..]).zip(&value[2..]);
    for ((level, ((x0, x1), x2)), ((v0, v1), v2)) in levels[1..].iter_mut().zip(places).zip(values) {
        let along = (x1 - x0) / (x2 - x0);
        *level = 0.5 * (v1 + v0 + (v2 - v0) * along);
    }
}

/// Straight lines between the background levels at the knots, constant before the first and after the last knot.
#[inline(always)]
fn find_lines(Knots { at_px, .. }: &Knots, levels: &[f32], lines: &mut Vec<Line>) {
    lines.resize(levels.len() + 1, Line::default());
    lines[0] = Line { level: levels[0], slope: 0.0, end: at_px[0] as u32 + 1 };
    let ends = at_px.iter().zip(&at_px[1..]).zip(levels.iter().zip(&levels[1..]));
    for (line, ((&x0, &x1), (l0, l1))) in lines[1..].iter_mut().zip(ends) {
        let slope = (l1 - l0) / (x1 - x0);
        let first = x0 as u32 + 1;
        *line = Line { level: l0 + slope * (first as f32 - x0), slope, end: x1 as u32 + 1 };
    }
    lines[levels.len()] = Line { level: levels[levels.len() - 1], slope: 0.0, end: u32::MAX };
}

/// Draws the lines one after another in whole blocks. A block may extend beyond the end of its line; the next line
/// overwrites the excess.
#[inline(always)]
fn draw(lines: &[Line], out: &mut [f32]) {
    let mut start = 0;
    for line in lines {
        let steps: [f32; BLOCK] = std::array::from_fn(|i| i as f32 * line.slope);
        let end = (line.end as usize).min(out.len());
        let mut level = line.level;
        let mut from = start;
        while from < end {
            match out[from..].first_chunk_mut::<BLOCK>() {
                Some(out) => *out = std::array::from_fn(|i| level + steps[i]),
                None => out[from..].iter_mut().zip(&steps).for_each(|(out, step)| *out = level + step),
            }
            level += BLOCK as f32 * line.slope;
            from += BLOCK;
        }
        start = end;
    }
}
