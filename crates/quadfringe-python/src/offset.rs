//! By which angle fringes lie off a known phase, in tiles of pixels.

use crate::arrays::{expected, value_error};
use crate::workers::detached;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyReadonlyArray2};
use pyo3::prelude::*;
use quadfringe::stages;

/// By which angle in rad fringes lie off a phase, (tiles,), in linear light and phase (tiles, pixels).
#[pyfunction]
#[pyo3(signature = (light, phase_rad, brightness = None))]
pub fn fringe_offsets<'py>(
    py: Python<'py>,
    light: &Bound<'py, PyAny>,
    phase_rad: &Bound<'py, PyAny>,
    brightness: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let maps = [expected::<f32, 2>("light", light)?, expected::<f32, 2>("phase_rad", phase_rad)?];
    let brightness = brightness.map(|brightness| expected::<f32, 2>("brightness", brightness)).transpose()?;
    let [light, phase] = maps.each_ref().map(PyReadonlyArray2::as_array);
    let brightness = brightness.as_ref().map(PyReadonlyArray2::as_array);
    let found = detached(py, || stages::fringe_offsets(light, phase, brightness))?.map_err(value_error)?;
    Ok(found.into_pyarray(py))
}

/// The albedo that all channels have in common, up to a factor, from R and B and their phase, (tiles, pixels).
#[pyfunction]
pub fn shared_brightness<'py>(
    py: Python<'py>,
    red: &Bound<'py, PyAny>,
    blue: &Bound<'py, PyAny>,
    phase_rad: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyArray2<f32>>> {
    let maps = [
        expected::<f32, 2>("red", red)?,
        expected::<f32, 2>("blue", blue)?,
        expected::<f32, 2>("phase_rad", phase_rad)?,
    ];
    let [red, blue, phase] = maps.each_ref().map(PyReadonlyArray2::as_array);
    let found = detached(py, || stages::shared_brightness(red, blue, phase))?.map_err(value_error)?;
    Ok(found.into_pyarray(py))
}
