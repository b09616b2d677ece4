//! Continuation of the fringes beyond the ends of a row. The transform treats a row as a ring, and a jump from its end to
//! its beginning would leak into all frequencies.

use crate::stages::params::ROW_MIN;

/// Writes fringes into `tail` that continue the end of `row` and, with the weights `fade` (0 to 1), fade into fringes
/// that lead to its beginning.
///
/// Fringes are symmetric about an extremum. The row is mirrored at the extremum nearest to its end, so that value, slope
/// and phase continue. If it were mirrored at its end, the phase would jump.
#[inline(always)]
pub(super) fn extend(row: &[f32], period_px: f32, fade: &[f32], scratch: &mut Scratch, tail: &mut [f32]) {
    let n = row.len();
    let quarter = ((period_px / 4.0) as usize).clamp(1, n / ROW_MIN);
    let Scratch { edge, misses } = scratch;
    edge.resize(6 * quarter + 2, 0.0);
    reversed(row, edge);
    let after = mirror(edge, quarter, misses);
    let before = mirror(&row[..6 * quarter + 2], quarter, misses);
    reversed(&row[..n - 1 - after], tail);
    // The fringes that lead to the beginning of the row are written backwards from the far end of the tail.
    let beyond = tail.len().saturating_sub(n - 1 - before);
    for (value, weight) in tail[..beyond].iter_mut().zip(fade) {
        *value += weight * (row[n - 1] - *value);
    }
    let near = tail[beyond..].iter_mut().rev().zip(fade[beyond..].iter().rev());
    for ((value, weight), begin) in near.zip(&row[before + 1..]) {
        *value += weight * (begin - *value);
    }
}

/// Working memory of [`extend`].
#[derive(Debug, Default)]
pub(super) struct Scratch {
    edge: Vec<f32>,
    misses: Vec<f32>,
}

/// Copies the end of `source` in reverse order. If `source` is too short, its first sample fills the rest.
#[inline(always)]
fn reversed(source: &[f32], out: &mut [f32]) {
    let (known, beyond) = out.split_at_mut(source.len().min(out.len()));
    for (to, from) in known.iter_mut().zip(source.iter().rev()) {
        *to = *from;
    }
    beyond.fill(source[0]);
}

/// Twice the distance of an extremum from the end of a row, whose last sample is `edge[0]`. The extremum is the place
/// about which a quarter of a fringe is most symmetric. The search covers half a fringe and evaluates all places
/// together.
#[inline(always)]
fn mirror(edge: &[f32], quarter: usize, misses: &mut Vec<f32>) -> usize {
    misses.clear();
    misses.resize(4 * quarter + 2, 0.0);
    for (i, sample) in edge[..quarter].iter().enumerate() {
        for (miss, image) in misses.iter_mut().zip(&edge[2 * quarter - i..]) {
            *miss += (sample - image) * (sample - image);
        }
    }
    let (mut best, mut least) = (0, f32::INFINITY);
    for (place, &miss) in misses.iter().enumerate() {
        let better = miss < least;
        best = if better { place } else { best };
        least = if better { miss } else { least };
    }
    2 * quarter + best
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts::TAU;

    #[test]
    fn fringes_go_on_in_phase_at_both_ends() {
        for start in [0.0f32, 1.0, 2.0, 4.0] {
            let at = |x: f32| (TAU * x / 25.3 + start).cos();
            let row: Vec<f32> = (0..400).map(|x| at(x as f32)).collect();
            let fade: Vec<f32> = (0..60).map(|k| if k < 30 { 0.0 } else { 1.0 }).collect();
            let mut tail = [0.0; 60];
            extend(&row, 25.3, &fade, &mut Scratch::default(), &mut tail);
            for k in 0..30 {
                // An extremum is found to a quarter of a pixel, so the mirrored row is shifted by half a pixel at most.
                assert!((tail[k] - at(400.0 + k as f32)).abs() < 0.13, "{start} {k}");
                assert!((tail[59 - k] - at(-1.0 - k as f32)).abs() < 0.13, "{start} {k}");
            }
        }
    }
}
