//! Background of a fringe image, row by row (system, section 3, step 2).

mod envelope;
mod moving_mean;
mod waves;

use crate::{Error, Result};
pub(crate) use envelope::coarsen;
use envelope::mean_envelope;
use moving_mean::{Sums, moving_mean};
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
            draw_background(&row, kind, period_px as f32, scratch, target);
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

/// Working memory of [`draw_background`].
#[derive(Debug, Default)]
pub(crate) struct Scratch {
    sums: Sums,
    envelope: envelope::Scratch,
}

/// Background of one row.
#[inline(always)]
pub(crate) fn draw_background(
    row: &[f32],
    kind: Background,
    period_px: f32,
    scratch: &mut Scratch,
    out: &mut [f32],
) {
    let Scratch { sums, envelope } = scratch;
    let drawn = match kind {
        Background::MeanEnvelope => mean_envelope(row, period_px, sums, envelope, out),
        Background::MovingMean => false,
    };
    if !drawn {
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
