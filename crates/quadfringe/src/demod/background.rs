//! Background of a fringe image, row by row (system, section 3, step 2).

use crate::{Error, Result};
use ndarray::{Array2, ArrayView2, Axis};
use rayon::prelude::*;

/// How the background of a row is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Background {
    /// Half the sum of the upper and the lower envelope, drawn straight through the fringe maxima and minima of the
    /// row: the published way.
    MeanEnvelope,
    /// Moving mean over one fringe period: blind to the carrier, half as noisy, exact for a linear background.
    #[default]
    MovingMean,
}

/// Background of every row of an image, `(rows, columns)` in the unit of the image.
///
/// `period_px` is the fringe period along the row in camera pixels.
///
/// # Errors
/// [`crate::Error::Value`] when the period is below 3 pixels or longer than a row.
///
/// ```
/// use ndarray::Array2;
/// use quadfringe::demod::{Background, background};
/// let image = Array2::from_shape_fn((2, 240), |(_, x)| 0.5 + 0.3 * (x as f32 * 0.3).cos());
/// let found = background(image.view(), Background::MeanEnvelope, 20.94)?;
/// assert!((found[[1, 120]] - 0.5).abs() < 0.02);
/// # Ok::<(), quadfringe::Error>(())
/// ```
pub fn background(image: ArrayView2<'_, f32>, kind: Background, period_px: f64) -> Result<Array2<f32>> {
    let (rows, columns) = image.dim();
    check_period(period_px, columns)?;
    let mut out = Array2::zeros((rows, columns));
    out.axis_iter_mut(Axis(0)).into_par_iter().zip(image.axis_iter(Axis(0))).for_each_init(
        Scratch::default,
        |scratch, (mut target, row)| {
            let row = row.to_vec();
            let target = target.as_slice_mut().expect("a fresh array is contiguous");
            background_row(&row, kind, period_px as f32, scratch, target);
        },
    );
    Ok(out)
}

pub(crate) fn check_period(period_px: f64, columns: usize) -> Result<()> {
    if (3.0..=columns as f64).contains(&period_px) {
        return Ok(());
    }
    let expected = format!("a fringe period of 3 to {columns} camera pixels");
    Err(Error::value("period_px", expected, period_px))
}

/// Working memory of [`background_row`].
#[derive(Debug, Default, Clone)]
pub(crate) struct Scratch {
    sums: Vec<f64>,
    smooth: Vec<f32>,
    middle: Vec<f32>,
    extrema: Vec<(usize, bool)>,
}

/// Background of one row into `out`.
pub(crate) fn background_row(
    row: &[f32],
    kind: Background,
    period_px: f32,
    scratch: &mut Scratch,
    out: &mut [f32],
) {
    match kind {
        Background::MovingMean => moving_mean(row, period_px, &mut scratch.sums, out),
        Background::MeanEnvelope => mean_envelope(row, period_px, scratch, out),
    }
}

/// Mean over `width` (not rounded to whole pixels), narrowing to what there is at the ends of the row, in whole
/// periods' stead: a window that leaves the row is moved back inside.
fn moving_mean(row: &[f32], width: f32, sums: &mut Vec<f64>, out: &mut [f32]) {
    sums.clear();
    sums.push(0.0);
    let mut sum = 0.0;
    sums.extend(row.iter().map(|&v| {
        sum += f64::from(v);
        sum
    }));
    let half = f64::from(width) / 2.0;
    let last = row.len() as f64;
    let integral = |at: f64| {
        let i = (at as usize).min(row.len() - 1);
        sums[i] + (at - i as f64) * f64::from(row[i])
    };
    for (x, value) in out.iter_mut().enumerate() {
        let middle = (x as f64 + 0.5).clamp(half.min(last / 2.0), (last - half).max(last / 2.0));
        let (from, to) = ((middle - half).max(0.0), (middle + half).min(last));
        *value = ((integral(to) - integral(from)) / (to - from)) as f32;
    }
}

/// Half the sum of the straight-line envelopes through maxima and minima. A row is split where it crosses its moving
/// mean; each side of a crossing holds one extremum, found on the slightly smoothed row so that noise adds none.
fn mean_envelope(row: &[f32], period_px: f32, scratch: &mut Scratch, out: &mut [f32]) {
    let n = row.len();
    scratch.smooth.resize(n, 0.0);
    scratch.middle.resize(n, 0.0);
    moving_mean(row, period_px / 5.0, &mut scratch.sums, &mut scratch.smooth);
    moving_mean(row, period_px, &mut scratch.sums, &mut scratch.middle);
    find_extrema(&scratch.smooth, &scratch.middle, (period_px / 5.0) as usize, &mut scratch.extrema);
    out.fill(0.0);
    for upper in [true, false] {
        let mut knots = scratch.extrema.iter().filter(|e| e.1 == upper).map(|e| e.0).peekable();
        if knots.peek().is_none() {
            out.iter_mut().zip(&scratch.middle).for_each(|(o, m)| *o += 0.5 * m);
            continue;
        }
        add_envelope(&scratch.smooth, knots, out);
    }
}

/// Place and kind (true for a maximum) of one extremum a half wave; half waves shorter than `shortest` are noise.
fn find_extrema(smooth: &[f32], middle: &[f32], shortest: usize, extrema: &mut Vec<(usize, bool)>) {
    extrema.clear();
    let above = |x: usize| smooth[x] > middle[x];
    let mut start = 0;
    for x in 1..=smooth.len() {
        if x < smooth.len() && above(x) == above(start) {
            continue;
        }
        let upper = above(start);
        let better = |a: &usize, b: &usize| {
            let order = smooth[*a].total_cmp(&smooth[*b]);
            if upper { order } else { order.reverse() }
        };
        // A half wave cut by the end of the row has no extremum of its own.
        let whole = start > 0 && x < smooth.len();
        if whole && x - start > shortest {
            extrema.extend((start..x).max_by(better).map(|at| (at, upper)));
        }
        start = x;
    }
}

/// Add half of the polyline through the knots, level beyond the first and the last.
fn add_envelope(smooth: &[f32], knots: impl Iterator<Item = usize>, out: &mut [f32]) {
    let mut previous: Option<usize> = None;
    for knot in knots {
        let from = previous.unwrap_or(0);
        let (left, right) = (smooth[previous.unwrap_or(knot)], smooth[knot]);
        let step = 1.0 / (knot - from).max(1) as f32;
        for x in from..knot {
            out[x] += 0.5 * (left + (right - left) * (x - from) as f32 * step);
        }
        previous = Some(knot);
    }
    if let Some(from) = previous {
        out[from..].iter_mut().for_each(|o| *o += 0.5 * smooth[from]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fringes(slope: f32) -> Array2<f32> {
        Array2::from_shape_fn((1, 512), |(_, x)| {
            let x = x as f32;
            0.5 + slope * (x - 256.0) + 0.3 * (x * std::f32::consts::TAU / 25.3 + 0.4).cos()
        })
    }

    #[test]
    fn both_ways_find_a_sloping_background() {
        let image = fringes(3e-4);
        for (kind, bound) in [(Background::MovingMean, 2e-3), (Background::MeanEnvelope, 8e-3)] {
            let found = background(image.view(), kind, 25.3).unwrap();
            let worst = (40..472)
                .map(|x| (found[[0, x]] - 0.5 - 3e-4 * (x as f32 - 256.0)).abs())
                .fold(0.0, f32::max);
            assert!(worst < bound, "{kind:?} {worst}");
        }
    }

    #[test]
    fn a_flat_row_is_its_own_background() {
        let image = Array2::from_elem((1, 64), 0.25f32);
        for kind in [Background::MovingMean, Background::MeanEnvelope] {
            let found = background(image.view(), kind, 16.0).unwrap();
            assert!(found.iter().all(|v| (v - 0.25).abs() < 1e-6));
        }
    }

    #[test]
    fn a_period_beyond_the_row_is_refused() {
        let image = Array2::<f32>::zeros((1, 64));
        assert!(background(image.view(), Background::MovingMean, 65.0).is_err());
        assert!(background(image.view(), Background::MovingMean, f64::NAN).is_err());
    }
}
