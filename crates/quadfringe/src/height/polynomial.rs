//! Height as a polynomial of the phase difference, fitted for each pixel from planes at known heights (S6).

use ndarray::{Array2, Array3, ArrayView2, Axis};
use rayon::prelude::*;

use super::params::DEGREE_MAX;
use crate::error::{Error, Limit, Result};

/// A plane at a known height, for [`PolynomialHeight::fit`].
#[derive(Debug, Clone, Copy)]
pub struct HeightPlane<'a> {
    /// Height above the reference plane, mm.
    pub height_mm: f64,
    /// Absolute phase, `(rows, columns)`, rad; NaN is no data.
    pub phase_rad: ArrayView2<'a, f32>,
}

/// Phase difference and height of one pixel on one plane.
struct Sample {
    difference_rad: f64,
    height_mm: f64,
}

/// Per-pixel polynomial `h = sum_n a_n dphi^n`, where `dphi` is the phase minus the phase of the reference plane.
///
/// ```
/// use ndarray::Array2;
/// use quadfringe::height::{HeightPlane, PolynomialHeight};
/// let phase = |height_mm: f64| Array2::from_elem((2, 3), 0.2 * height_mm as f32);
/// let maps = [0.0, 10.0, 20.0].map(|height_mm| (height_mm, phase(height_mm)));
/// let planes: Vec<_> =
///     maps.iter().map(|(height_mm, map)| HeightPlane { height_mm: *height_mm, phase_rad: map.view() }).collect();
/// let height = PolynomialHeight::fit(maps[0].1.view(), &planes, 1)?;
/// let map = height.height_from_phase(Array2::from_elem((2, 3), 1.0f32).view())?;
/// assert!((map[[1, 2]] - 5.0).abs() < 1e-4);
/// # Ok::<(), quadfringe::error::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct PolynomialHeight {
    reference_rad: Array2<f32>,
    /// `(rows, columns, degree + 1)`, in mm / rad^n.
    coefficients: Array3<f64>,
}

impl PolynomialHeight {
    /// Least-squares fit of degree `degree` (1 to 6) to planes at known heights.
    ///
    /// A pixel that is NaN in the reference or has fewer than `degree + 1` planes with data has no polynomial, and its
    /// height is NaN.
    ///
    /// # Errors
    /// [`Error::Value`] when the degree is out of range, a height is not finite, there are fewer than `degree + 1`
    /// different heights, or the planes differ so little in phase that no pixel has a solution; [`Error::Shape`] when a
    /// map does not have the size of the reference.
    pub fn fit(
        reference_rad: ArrayView2<'_, f32>,
        planes: &[HeightPlane<'_>],
        degree: usize,
    ) -> Result<Self> {
        check_planes(reference_rad, planes, degree)?;
        let (rows, columns) = reference_rad.dim();
        let mut coefficients = Array3::from_elem((rows, columns, degree + 1), f64::NAN);
        coefficients.axis_iter_mut(Axis(0)).into_par_iter().enumerate().for_each(|(row, mut line)| {
            for column in 0..columns {
                let origin = f64::from(reference_rad[[row, column]]);
                let samples: Vec<_> = planes
                    .iter()
                    .map(|plane| Sample {
                        difference_rad: f64::from(plane.phase_rad[[row, column]]) - origin,
                        height_mm: plane.height_mm,
                    })
                    .filter(|sample| sample.difference_rad.is_finite())
                    .collect();
                if let Some(fitted) = fit_pixel(&samples, degree) {
                    line.row_mut(column).iter_mut().zip(fitted).for_each(|(c, f)| *c = f);
                }
            }
        });
        if coefficients.iter().all(|c| c.is_nan()) {
            let expected = "phases that differ from plane to plane on at least one pixel";
            let actual = "no pixel with a solution";
            return Err(Error::value("calibration planes", expected, actual));
        }
        Ok(Self { reference_rad: reference_rad.to_owned(), coefficients })
    }

    /// Restores an earlier fit from the phase of its reference plane and its [`PolynomialHeight::coefficients`].
    ///
    /// # Errors
    /// [`Error::Shape`] unless the coefficients have the shape `(rows, columns, degree + 1)`, with the rows and columns of the
    /// reference and a degree from 1 to 6.
    pub fn from_coefficients(reference_rad: Array2<f32>, coefficients: Array3<f64>) -> Result<Self> {
        let (rows, columns) = reference_rad.dim();
        let terms = coefficients.dim().2.clamp(2, DEGREE_MAX + 1);
        if coefficients.dim() != (rows, columns, terms) {
            return Err(Error::shape("coefficients", &[rows, columns, terms], coefficients.shape()));
        }
        Ok(Self { reference_rad, coefficients })
    }

    /// Absolute phase of the reference plane, rad.
    #[must_use]
    pub fn reference_rad(&self) -> &Array2<f32> {
        &self.reference_rad
    }

    /// The coefficients `a_n`, `(rows, columns, degree + 1)` in mm / rad^n, NaN where a pixel has none.
    #[must_use]
    pub fn coefficients(&self) -> &Array3<f64> {
        &self.coefficients
    }

    /// Height map in mm, float32, from an absolute phase map in rad; NaN where either has no data.
    ///
    /// # Errors
    /// [`Error::Shape`] when the map does not have the size of the calibration.
    pub fn height_from_phase(&self, phase_rad: ArrayView2<'_, f32>) -> Result<Array2<f32>> {
        if phase_rad.dim() != self.reference_rad.dim() {
            return Err(Error::shape("phase map", self.reference_rad.shape(), phase_rad.shape()));
        }
        let mut height = Array2::zeros(phase_rad.dim());
        height.axis_iter_mut(Axis(0)).into_par_iter().enumerate().for_each(|(row, mut line)| {
            for (column, out) in line.iter_mut().enumerate() {
                let at = [row, column];
                let difference = f64::from(phase_rad[at]) - f64::from(self.reference_rad[at]);
                let terms = self.coefficients.index_axis(Axis(0), row);
                let terms = terms.index_axis(Axis(0), column);
                *out = terms.iter().rev().fold(0.0, |sum, a| sum * difference + a) as f32;
            }
        });
        Ok(height)
    }
}

fn check_planes(reference_rad: ArrayView2<'_, f32>, planes: &[HeightPlane<'_>], degree: usize) -> Result<()> {
    if !(1..=DEGREE_MAX).contains(&degree) {
        let expected = format!("1 to {DEGREE_MAX}");
        return Err(Error::value("degree of the polynomial", expected, degree));
    }
    for (index, HeightPlane { height_mm, phase_rad: map }) in planes.iter().enumerate() {
        if !height_mm.is_finite() {
            return Err(Error::value("height of a plane (mm)", Limit::Finite, height_mm));
        }
        if map.dim() != reference_rad.dim() {
            let what = format!("phase map of plane {index}");
            return Err(Error::shape(what, reference_rad.shape(), map.shape()));
        }
    }
    let mut heights: Vec<f64> = planes.iter().map(|plane| plane.height_mm).collect();
    heights.sort_by(f64::total_cmp);
    heights.dedup_by(|a, b| (*a - *b).abs() < 1e-9);
    if heights.len() <= degree {
        let expected = format!("at least {} different heights for degree {degree}", degree + 1);
        return Err(Error::value("calibration planes", expected, heights.len()));
    }
    Ok(())
}

/// Least squares by modified Gram-Schmidt on the phase scaled to [-1, 1]; `None` if the phases do not determine it.
fn fit_pixel(samples: &[Sample], degree: usize) -> Option<[f64; DEGREE_MAX + 1]> {
    let terms = degree + 1;
    let scale = samples.iter().fold(0f64, |s, sample| s.max(sample.difference_rad.abs()));
    if samples.len() < terms || scale < 1e-9 {
        return None;
    }
    let power = |sample: &Sample, n: usize| (sample.difference_rad / scale).powi(n as i32);
    let mut basis: Vec<Vec<f64>> =
        (0..terms).map(|n| samples.iter().map(|sample| power(sample, n)).collect()).collect();
    let mut rest: Vec<f64> = samples.iter().map(|sample| sample.height_mm).collect();
    let mut upper = [[0.0; DEGREE_MAX + 1]; DEGREE_MAX + 1];
    let mut weights = [0.0; DEGREE_MAX + 1];
    for i in 0..terms {
        let before = samples.iter().map(|sample| power(sample, 2 * i)).sum::<f64>();
        let length = inner(&basis[i], &basis[i]).sqrt();
        if length < 1e-7 * before.sqrt() {
            return None;
        }
        upper[i][i] = length;
        basis[i].iter_mut().for_each(|q| *q /= length);
        let (done, ahead) = basis.split_at_mut(i + 1);
        for (j, column) in ahead.iter_mut().enumerate() {
            upper[i][i + 1 + j] = remove_component(&done[i], column);
        }
        weights[i] = remove_component(&done[i], &mut rest);
    }
    Some(solve_upper(&upper, weights, terms, scale))
}

/// Subtracts from `vector` its component along the unit vector `unit`, and returns the length of the component.
fn remove_component(unit: &[f64], vector: &mut [f64]) -> f64 {
    let part = inner(unit, vector);
    vector.iter_mut().zip(unit).for_each(|(v, u)| *v -= part * u);
    part
}

fn inner(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Back substitution, and conversion of the coefficients from the scaled phase to rad.
fn solve_upper(
    upper: &[[f64; DEGREE_MAX + 1]; DEGREE_MAX + 1],
    weights: [f64; DEGREE_MAX + 1],
    terms: usize,
    scale: f64,
) -> [f64; DEGREE_MAX + 1] {
    let mut solution = [0.0; DEGREE_MAX + 1];
    for i in (0..terms).rev() {
        let known: f64 = (i + 1..terms).map(|j| upper[i][j] * solution[j]).sum();
        solution[i] = (weights[i] - known) / upper[i][i];
    }
    for (n, value) in solution.iter_mut().enumerate() {
        *value /= scale.powi(n as i32);
    }
    solution
}

#[cfg(test)]
mod tests {
    use super::*;

    fn planes(heights: &[f64]) -> Vec<(f64, Array2<f32>)> {
        let phase = |h: f64| (0.3 * h + 1e-3 * h * h) as f32;
        heights.iter().map(|h| (*h, Array2::from_elem((3, 4), phase(*h)))).collect()
    }

    fn fitted(planes: &[(f64, Array2<f32>)], degree: usize) -> Result<PolynomialHeight> {
        let views: Vec<_> =
            planes.iter().map(|(h, p)| HeightPlane { height_mm: *h, phase_rad: p.view() }).collect();
        PolynomialHeight::fit(Array2::zeros((3, 4)).view(), &views, degree)
    }

    #[test]
    fn recovers_known_heights() {
        let planes = planes(&[-10.0, 0.0, 10.0, 20.0, 30.0, 40.0]);
        let height = fitted(&planes, 3).expect("enough planes");
        for (expected, phase) in &planes {
            let map = height.height_from_phase(phase.view()).expect("same size");
            assert!((f64::from(map[[2, 3]]) - expected).abs() < 0.02, "{map}");
        }
    }

    #[test]
    fn refuses_what_does_not_determine_it() {
        assert!(fitted(&planes(&[0.0, 10.0]), 2).is_err());
        assert!(fitted(&planes(&[0.0, 0.0, 10.0]), 2).is_err());
        assert!(fitted(&planes(&[0.0, 5.0, 10.0]), 0).is_err());
        assert!(fitted(&planes(&[0.0, f64::NAN]), 1).is_err());
        let flat: Vec<_> = (0..3).map(|i| (f64::from(i), Array2::zeros((3, 4)))).collect();
        assert!(fitted(&flat, 1).is_err());
        let wrong = vec![(0.0, Array2::zeros((3, 4))), (1.0, Array2::zeros((4, 4)))];
        assert!(matches!(fitted(&wrong, 1), Err(Error::Shape { .. })));
    }

    #[test]
    fn no_data_stays_no_data() {
        let mut planes = planes(&[0.0, 10.0, 20.0]);
        planes[1].1[[1, 1]] = f32::NAN;
        let height = fitted(&planes, 2).expect("other pixels have data");
        let map = height.height_from_phase(planes[2].1.view()).expect("same size");
        assert!(map[[1, 1]].is_nan() && map[[0, 0]].is_finite());
        assert!(height.height_from_phase(Array2::zeros((2, 2)).view()).is_err());
    }

    #[test]
    fn stored_coefficients_give_the_same_heights() {
        let planes = planes(&[0.0, 10.0, 20.0]);
        let height = fitted(&planes, 2).expect("enough planes");
        let (reference, terms) = (height.reference_rad().clone(), height.coefficients().clone());
        assert_eq!(PolynomialHeight::from_coefficients(reference.clone(), terms).expect("fits"), height);
        assert!(PolynomialHeight::from_coefficients(reference, Array3::zeros((3, 4, 1))).is_err());
    }
}
