//! Absolute phase from wrapped phase and fringe order.
//!
//! A wrapped phase differs from the absolute phase by whole turns. An estimate of the absolute phase with an error below
//! half a turn gives their number: `Phi = phi + 2 pi round((estimate - phi) / 2 pi)`.

use crate::parallel::angle::round;
use crate::{Error, Result};
use ndarray::{Array2, ArrayView2, Zip};
use std::f32::consts::TAU;

/// Absolute phase and the margin of its order, each `(rows, columns)`; NaN is no data.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Absolute {
    /// Phase of the first fringe number in rad, 0 at projector column 0.
    pub phase_rad: Array2<f32>,
    /// Margin of the order up to 1: 1 when all phases agree, 0 when another order agrees as well.
    pub margin: Array2<f32>,
}

impl Absolute {
    /// Combines two maps of equal size.
    ///
    /// # Errors
    /// [`Error::Shape`] when the maps differ in size.
    pub fn new(phase_rad: Array2<f32>, margin: Array2<f32>) -> Result<Self> {
        if phase_rad.dim() != margin.dim() {
            return Err(Error::shape("margin", phase_rad.shape(), margin.shape()));
        }
        Ok(Self { phase_rad, margin })
    }
}

/// Adds whole turns to a wrapped phase until it is nearest to an estimate of the absolute phase; both in rad and
/// `(rows, columns)`. NaN in, NaN out.
///
/// # Errors
/// [`Error::Shape`] when the maps differ in size.
///
/// ```
/// use ndarray::array;
/// use quadfringe::stages::nearest_turn;
/// let absolute = nearest_turn(array![[1.0f32]].view(), array![[13.0f32]].view())?;
/// assert!((absolute[[0, 0]] - (1.0 + 2.0 * std::f32::consts::TAU)).abs() < 1e-5);
/// # Ok::<(), quadfringe::Error>(())
/// ```
pub fn nearest_turn(
    wrapped_rad: ArrayView2<'_, f32>,
    estimate_rad: ArrayView2<'_, f32>,
) -> Result<Array2<f32>> {
    if wrapped_rad.dim() != estimate_rad.dim() {
        return Err(Error::shape(
            "estimate of the absolute phase",
            wrapped_rad.shape(),
            estimate_rad.shape(),
        ));
    }
    let pixels = Zip::from(wrapped_rad).and(estimate_rad);
    Ok(pixels.par_map_collect(|&wrapped, &estimate| with_turns_of(estimate, wrapped)))
}

/// [`nearest_turn`] for one pixel.
#[inline(always)]
pub(crate) fn with_turns_of(estimate: f32, wrapped: f32) -> f32 {
    wrapped + TAU * round((estimate - wrapped) * (1.0 / TAU))
}
