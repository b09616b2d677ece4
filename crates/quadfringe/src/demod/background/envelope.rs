//! Half the sum of the envelopes through the fringe maxima and the fringe minima.

use super::moving_mean::{Sums, moving_mean};

/// Fewest samples a fringe is looked at with: an extremum lies between them on a parabola.
const SAMPLES_PER_FRINGE: f32 = 8.0;
/// Share of a fringe that is averaged over so that noise adds no extrema, and that a half wave must exceed.
const SMOOTH: f32 = 0.2;

/// Working memory of [`mean_envelope`].
#[derive(Debug, Default, Clone)]
pub(super) struct Scratch {
    coarse: Vec<f32>,
    smooth: Vec<f32>,
    middle: Vec<f32>,
    crossings: Vec<u32>,
    knots: Vec<Knot>,
    levels: Vec<f32>,
}

/// An extremum; maxima and minima alternate.
#[derive(Debug, Clone, Copy)]
struct Knot {
    at_px: f32,
    value: f32,
    upper: bool,
}

/// Background of `row` into `out`; false when the row has no fringes to draw envelopes through.
///
/// A row is split where it crosses its moving mean; each side of a crossing holds one extremum. They are looked for on
/// sums of 1, 2, 4, ... pixels, as many as leave a fringe `SAMPLES_PER_FRINGE` samples.
#[inline(always)]
pub(super) fn mean_envelope(
    row: &[f32],
    period_px: f32,
    sums: &mut Sums,
    scratch: &mut Scratch,
    out: &mut [f32],
) -> bool {
    let step = coarseness(period_px);
    coarsen(row, step, &mut scratch.coarse);
    let period = period_px / step as f32;
    for buffer in [&mut scratch.smooth, &mut scratch.middle] {
        buffer.resize(scratch.coarse.len(), 0.0);
    }
    moving_mean(&scratch.coarse, SMOOTH * period, sums, &mut scratch.smooth);
    moving_mean(&scratch.coarse, period, sums, &mut scratch.middle);
    find_crossings(&scratch.smooth, &scratch.middle, &mut scratch.crossings);
    find_knots(scratch, (SMOOTH * period) as usize, step as f32);
    if scratch.knots.len() < 2 {
        return false;
    }
    find_levels(&scratch.knots, &mut scratch.levels);
    draw(&scratch.knots, &scratch.levels, out);
    true
}

fn coarseness(period_px: f32) -> usize {
    let mut step = 1;
    while period_px >= 2.0 * SAMPLES_PER_FRINGE * step as f32 {
        step *= 2;
    }
    step
}

/// Means of `step` (a power of two) pixels.
#[inline(always)]
fn coarsen(row: &[f32], step: usize, out: &mut Vec<f32>) {
    out.clear();
    match step {
        1 => out.extend_from_slice(row),
        2 => out.extend(row.chunks_exact(2).map(|v| 0.5 * (v[0] + v[1]))),
        4 => out.extend(row.chunks_exact(4).map(|v| 0.25 * (v[0] + v[1] + v[2] + v[3]))),
        _ => out.extend(row.chunks_exact(step).map(|v| v.iter().sum::<f32>() / step as f32)),
    }
}

/// First samples of the half waves but the first. The place is written every time and kept where there is a crossing:
/// crossings come too irregularly for a processor to guess.
#[inline(always)]
fn find_crossings(smooth: &[f32], middle: &[f32], crossings: &mut Vec<u32>) {
    crossings.resize(smooth.len(), 0);
    let mut count = 0;
    let mut before = smooth[0] > middle[0];
    for (i, (s, m)) in smooth.iter().zip(middle).enumerate() {
        let above = s > m;
        crossings[count] = i as u32;
        count += usize::from(above != before);
        before = above;
    }
    crossings.truncate(count);
}

/// One extremum for each half wave longer than `shortest`; shorter ones are noise within their neighbours. A half wave
/// cut by the end of the row has no extremum of its own.
#[inline(always)]
fn find_knots(scratch: &mut Scratch, shortest: usize, step: f32) {
    let Scratch { smooth, middle, crossings, knots, .. } = scratch;
    knots.clear();
    for pair in crossings.windows(2) {
        let (from, to) = (pair[0] as usize, pair[1] as usize);
        if to - from <= shortest {
            continue;
        }
        let upper = smooth[from] > middle[from];
        let knot = extremum(smooth, from, to, upper, step);
        match knots.last_mut() {
            Some(last) if last.upper == upper => {
                if (knot.value > last.value) == upper {
                    *last = knot;
                }
            }
            _ => knots.push(knot),
        }
    }
}

/// The greatest (`upper`) or least sample of a half wave, and the top of the parabola through it and its neighbours.
#[inline(always)]
fn extremum(smooth: &[f32], from: usize, to: usize, upper: bool, step: f32) -> Knot {
    let sign = if upper { 1.0 } else { -1.0 };
    let (mut best, mut most) = (from, sign * smooth[from]);
    for (i, value) in smooth[from..to].iter().enumerate() {
        let value = sign * value;
        let better = value > most;
        best = if better { from + i } else { best };
        most = if better { value } else { most };
    }
    // A half wave between two crossings touches neither end of the row.
    let (left, top, right) = (smooth[best - 1], smooth[best], smooth[best + 1]);
    let curvature = left - 2.0 * top + right;
    let bent = curvature * sign < 0.0;
    let shift = if bent { (0.5 * (left - right) / curvature).clamp(-0.5, 0.5) } else { 0.0 };
    Knot {
        at_px: (best as f32 + 0.5 + shift) * step - 0.5,
        value: top - 0.25 * (left - right) * shift,
        upper,
    }
}

/// The background at each knot: half its own envelope and half the other, which is straight between the neighbours.
#[inline(always)]
fn find_levels(knots: &[Knot], levels: &mut Vec<f32>) {
    let end = |own: Knot, other: Knot| 0.5 * (own.value + other.value);
    levels.clear();
    levels.push(end(knots[0], knots[1]));
    levels.extend(knots.windows(3).map(|k| {
        let along = (k[1].at_px - k[0].at_px) / (k[2].at_px - k[0].at_px);
        0.5 * (k[1].value + k[0].value + (k[2].value - k[0].value) * along)
    }));
    let last = knots.len() - 1;
    levels.push(end(knots[last], knots[last - 1]));
}

/// Straight lines through the levels at the knots, level beyond the first and the last.
#[inline(always)]
fn draw(knots: &[Knot], levels: &[f32], out: &mut [f32]) {
    let n = out.len();
    let mut start = (knots[0].at_px as usize + 1).min(n);
    out[..start].fill(levels[0]);
    for (k, l) in knots.windows(2).zip(levels.windows(2)) {
        let end = (k[1].at_px as usize + 1).min(n);
        let slope = (l[1] - l[0]) / (k[1].at_px - k[0].at_px);
        let first = l[0] + slope * (start as f32 - k[0].at_px);
        ramp(first, slope, end - start, &mut out[start..]);
        start = end;
    }
    out[start..].fill(levels[levels.len() - 1]);
}

/// `first + i slope` over `count` pixels, in whole blocks: the next line overwrites what is too much.
#[inline(always)]
fn ramp(first: f32, slope: f32, count: usize, out: &mut [f32]) {
    const BLOCK: usize = 8;
    let steps: [f32; BLOCK] = std::array::from_fn(|i| i as f32 * slope);
    let stop = out.len().min(count.next_multiple_of(BLOCK));
    let mut at = first;
    let mut blocks = out[..stop].chunks_exact_mut(BLOCK);
    for block in &mut blocks {
        for (value, step) in block.iter_mut().zip(steps) {
            *value = at + step;
        }
        at += BLOCK as f32 * slope;
    }
    for (value, step) in blocks.into_remainder().iter_mut().zip(steps) {
        *value = at + step;
    }
}
