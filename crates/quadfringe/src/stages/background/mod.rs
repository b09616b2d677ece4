//! Background of a fringe image, row by row: the illumination without the fringes.
//!
//! A row is `a + b cos(Phi)` (S1). Its upper envelope is `a + b` and its lower one `a - b`, so half their sum is the
//! background `a`; a mean over one fringe period is `a` too, because the cosine averages to zero.

mod envelope;
mod moving_mean;
mod waves;

use super::params::PERIOD_MIN_PX;
use crate::{Error, Result};
use envelope::mean_envelope;
use moving_mean::{Sums, moving_mean};
use ndarray::{Array2, ArrayView2, Axis};
use rayon::prelude::*;

/// How the background of a row is estimated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Background {
    /// The published method: half the sum of the upper and the lower envelope of the row. The envelopes connect the
    /// fringe maxima and the fringe minima by straight lines.
    MeanEnvelope,
    /// Moving mean over one fringe period. It has half the noise and is exact for a linear background.
    #[default]
    MovingMean,
}

/// Background of every row of an image, `(rows, columns)` in the unit of the image.
///
/// `period_px` is the fringe period along the row in camera pixels. A row without fringes gets its moving mean with
/// either method. NaN spreads along its row.
///
/// # Errors
/// [`crate::Error::Value`] when the period is below 3 pixels or longer than a row.
///
/// ```
/// use ndarray::Array2;
/// use quadfringe::stages::{Background, background};
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
            row_background(&row, kind, period_px as f32, scratch, target);
        },
    );
    Ok(out)
}

pub(crate) fn check_period(period_px: f64, columns: usize) -> Result<()> {
    if (PERIOD_MIN_PX..=columns as f64).contains(&period_px) {
        return Ok(());
    }
    let expected = format!("a fringe period of {PERIOD_MIN_PX} to {columns} camera pixels");
    Err(Error::value("period_px", expected, period_px))
}

/// Working memory of [`row_background`].
#[derive(Debug, Default)]
pub(crate) struct Scratch {
    sums: Sums,
    envelope: envelope::Scratch,
}

/// Background of one row.
#[inline(always)]
pub(crate) fn row_background(
    row: &[f32],
    kind: Background,
    period_px: f32,
    scratch: &mut Scratch,
    out: &mut [f32],
) {
    let Scratch { sums, envelope } = scratch;
    let has_fringes = match kind {
        Background::MeanEnvelope => mean_envelope(row, period_px, sums, envelope, out),
        Background::MovingMean => false,
    };
    if !has_fringes {
        moving_mean(row, period_px, sums, out);
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
    fn a_flat_row_is_all_background() {
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
