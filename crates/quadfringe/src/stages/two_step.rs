//! Two-step phase shifting on R and B (system (S2)).

use crate::parallel::angle::atan2;
use crate::{Error, Result};
use ndarray::{Array2, ArrayView2, Zip};

/// Wrapped phase in rad from R = cos(Phi) and B = cos(Phi + pi/2), both `(rows, columns)` with their backgrounds taken
/// away and their modulations made equal: Phi = atan2(-B, R) (S2).
///
/// # Errors
/// [`Error::Shape`] when the two differ in size.
///
/// ```
/// use ndarray::arr2;
/// use quadfringe::stages::two_step;
/// let phase = two_step(arr2(&[[0.0f32]]).view(), arr2(&[[-1.0f32]]).view())?;
/// assert!((phase[[0, 0]] - std::f32::consts::FRAC_PI_2).abs() < 1e-6);
/// # Ok::<(), quadfringe::Error>(())
/// ```
pub fn two_step(red: ArrayView2<'_, f32>, blue: ArrayView2<'_, f32>) -> Result<Array2<f32>> {
    if red.dim() != blue.dim() {
        return Err(Error::shape("blue fringes", red.shape(), blue.shape()));
    }
    let mut phase = Array2::zeros(red.raw_dim());
    Zip::from(&mut phase).and(red).and(blue).par_for_each(|p, &r, &b| *p = atan2(-b, r));
    Ok(phase)
}
