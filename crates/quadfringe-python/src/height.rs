//! Conversion of absolute phase to millimetres outside the decoder: `PolynomialHeight`, `xyz_from_column`.

use crate::arrays::{expected, value_error};
use crate::device::Device;
use crate::workers::detached;
use numpy::{IntoPyArray, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray2, ToPyArray};
use pyo3::prelude::*;
use quadfringe::height::{self, Triangulator};

/// Add the class and the function of this file to the module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<PolynomialHeight>()?;
    module.add_function(wrap_pyfunction!(xyz_from_column, module)?)
}

/// Height as a polynomial of phase for each pixel.
#[pyclass(frozen, module = "quadfringe._core")]
pub struct PolynomialHeight(height::PolynomialHeight);

#[pymethods]
impl PolynomialHeight {
    /// Make one from the phase of the reference plane and the coefficients that `coefficients` returned.
    #[new]
    fn new(reference_rad: &Bound<'_, PyAny>, coefficients: &Bound<'_, PyAny>) -> PyResult<Self> {
        let reference_rad = expected::<f32, 2>("reference_rad", reference_rad)?.to_owned_array();
        let coefficients = expected::<f64, 3>("coefficients", coefficients)?.to_owned_array();
        height::PolynomialHeight::from_coefficients(reference_rad, coefficients)
            .map(Self)
            .map_err(value_error)
    }

    /// Fit the polynomials to planes at known heights.
    #[staticmethod]
    fn fit(
        py: Python<'_>,
        reference_rad: &Bound<'_, PyAny>,
        heights_mm: Vec<f64>,
        phases_rad: Vec<Bound<'_, PyAny>>,
        degree: usize,
    ) -> PyResult<Self> {
        let reference = expected::<f32, 2>("reference_rad", reference_rad)?;
        let phases: PyResult<Vec<_>> =
            phases_rad.iter().map(|map| expected::<f32, 2>("phases_rad", map)).collect();
        let phases = phases?;
        let maps = phases.iter().map(PyReadonlyArray2::as_array);
        let planes = heights_mm.into_iter().zip(maps);
        let planes: Vec<_> =
            planes.map(|(height_mm, phase_rad)| height::HeightPlane { height_mm, phase_rad }).collect();
        let reference = reference.as_array();
        detached(py, || height::PolynomialHeight::fit(reference, &planes, degree))?
            .map(Self)
            .map_err(value_error)
    }

    /// (H, W) float32 rad.
    fn reference_rad<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f32>> {
        self.0.reference_rad().to_pyarray(py)
    }

    /// (H, W, degree + 1) float64, mm / rad^n.
    fn coefficients<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray3<f64>> {
        self.0.coefficients().to_pyarray(py)
    }

    /// Height map, (H, W) float32 mm.
    fn height_from_phase<'py>(
        &self,
        py: Python<'py>,
        phase_rad: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let phase_rad = expected::<f32, 2>("phase_rad", phase_rad)?;
        let view = phase_rad.as_array();
        let found = detached(py, || self.0.height_from_phase(view))?.map_err(value_error)?;
        Ok(found.into_pyarray(py))
    }
}

/// Points of a map of projector columns, (H, W, 3) float32 mm.
#[pyfunction]
pub fn xyz_from_column<'py>(
    py: Python<'py>,
    column_px: &Bound<'py, PyAny>,
    camera: &Device,
    projector: &Device,
) -> PyResult<Bound<'py, PyArray3<f32>>> {
    let column_px = expected::<f32, 2>("column_px", column_px)?;
    let view = column_px.as_array();
    let found =
        detached(py, || Triangulator::new(&camera.0, &projector.0)?.xyz_mm(view))?.map_err(value_error)?;
    Ok(found.into_pyarray(py))
}
