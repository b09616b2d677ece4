//! Two-step phase shifting on R and B (S2).
//!
//! R and B carry the same fringes a quarter period apart. Without their backgrounds and with equal modulation they are
//! `R = b cos(Phi)` and `B = b cos(Phi + pi/2) = -b sin(Phi)`, so `Phi = atan2(-B, R)` at every pixel, and
//! `b = sqrt(R^2 + B^2)`.

use crate::parallel::angle::{atan2, coarse_atan2};
use crate::{Error, Result};
use ndarray::{Array1, Array2, ArrayView2, Axis, Zip};

/// Wrapped phase in rad, `(rows, columns)`, from R and B without their backgrounds and with equal modulation (S2).
///
/// The error of the arctangent is at most 4e-7 rad. NaN in, NaN out; the phase is 0 where both are 0.
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
    pixel_by_pixel(red, blue, |red, blue| atan2(-blue, red))
}

/// Like [`two_step`], with a shorter arctangent whose error is at most 1.3e-5 rad.
///
/// The published decoder uses it where a phase only selects fringe orders.
///
/// # Errors
/// [`Error::Shape`] when the two differ in size.
///
/// ```
/// use ndarray::arr2;
/// use quadfringe::stages::two_step_coarse;
/// let phase = two_step_coarse(arr2(&[[0.0f32]]).view(), arr2(&[[-1.0f32]]).view())?;
/// assert!((phase[[0, 0]] - std::f32::consts::FRAC_PI_2).abs() < 2e-5);
/// # Ok::<(), quadfringe::Error>(())
/// ```
pub fn two_step_coarse(red: ArrayView2<'_, f32>, blue: ArrayView2<'_, f32>) -> Result<Array2<f32>> {
    pixel_by_pixel(red, blue, |red, blue| coarse_atan2(-blue, red))
}

/// Modulation, `(rows, columns)` in the unit of the images, from R and B without their backgrounds and with equal
/// modulation: `sqrt(R^2 + B^2)`. NaN in, NaN out.
///
/// # Errors
/// [`Error::Shape`] when the two differ in size.
///
/// ```
/// use ndarray::arr2;
/// use quadfringe::stages::modulation;
/// let found = modulation(arr2(&[[0.3f32]]).view(), arr2(&[[-0.4f32]]).view())?;
/// assert!((found[[0, 0]] - 0.5).abs() < 1e-6);
/// # Ok::<(), quadfringe::Error>(())
/// ```
pub fn modulation(red: ArrayView2<'_, f32>, blue: ArrayView2<'_, f32>) -> Result<Array2<f32>> {
    pixel_by_pixel(red, blue, |red, blue| (red * red + blue * blue).sqrt())
}

/// Modulation of R divided by the modulation of B for each row, from R and B without their backgrounds. Multiplied by
/// this factor, B has the modulation of R. The factor is the ratio of the root mean squares along the row.
///
/// # Errors
/// [`Error::Shape`] when the two differ in size.
///
/// ```
/// use ndarray::Array2;
/// use quadfringe::stages::modulation_ratio;
/// let red = Array2::from_shape_fn((1, 80), |(_, x)| 0.4 * (x as f32 * std::f32::consts::TAU / 20.0).cos());
/// let blue = Array2::from_shape_fn((1, 80), |(_, x)| -0.2 * (x as f32 * std::f32::consts::TAU / 20.0).sin());
/// assert!((modulation_ratio(red.view(), blue.view())?[0] - 2.0).abs() < 1e-4);
/// # Ok::<(), quadfringe::Error>(())
/// ```
pub fn modulation_ratio(red: ArrayView2<'_, f32>, blue: ArrayView2<'_, f32>) -> Result<Array1<f32>> {
    check(red, blue)?;
    let rows = red.axis_iter(Axis(0)).zip(blue.axis_iter(Axis(0)));
    Ok(rows.map(|(red, blue)| row_modulation_ratio(&red.to_vec(), &blue.to_vec())).collect())
}

/// [`modulation_ratio`] for one row.
#[inline(always)]
pub(crate) fn row_modulation_ratio(red: &[f32], blue: &[f32]) -> f32 {
    (power(red) / power(blue).max(f32::MIN_POSITIVE)).sqrt()
}

/// Sum of squares in eight partial sums, so that the loop vectorises.
#[inline(always)]
fn power(row: &[f32]) -> f32 {
    let mut sums = [0.0f32; 8];
    let (blocks, rest) = row.as_chunks::<8>();
    for block in blocks {
        sums.iter_mut().zip(block).for_each(|(sum, value)| *sum += value * value);
    }
    sums.iter_mut().zip(rest).for_each(|(sum, value)| *sum += value * value);
    sums.iter().sum()
}

fn pixel_by_pixel(
    red: ArrayView2<'_, f32>,
    blue: ArrayView2<'_, f32>,
    of_pixel: impl Fn(f32, f32) -> f32 + Sync + Send,
) -> Result<Array2<f32>> {
    check(red, blue)?;
    let mut out = Array2::zeros(red.raw_dim());
    Zip::from(&mut out).and(red).and(blue).par_for_each(|out, &red, &blue| *out = of_pixel(red, blue));
    Ok(out)
}

fn check(red: ArrayView2<'_, f32>, blue: ArrayView2<'_, f32>) -> Result<()> {
    if red.dim() == blue.dim() {
        return Ok(());
    }
    Err(Error::shape("blue fringes", red.shape(), blue.shape()))
}
