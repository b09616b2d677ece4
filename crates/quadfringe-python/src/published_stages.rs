//! Further stages of the published decoder. The basic ones are in `stages`.

use crate::arrays::{expected, value_error};
use crate::device::FringeNumbers;
use crate::workers::detached;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyReadonlyArray2};
use pyo3::prelude::*;
use quadfringe::stages::{self, Absolute, Blocks, Fringes, Limits};

type Map<'py> = Bound<'py, PyArray2<f32>>;

fn map<'py>(name: &str, object: &Bound<'py, PyAny>) -> PyResult<PyReadonlyArray2<'py, f32>> {
    expected::<f32, 2>(name, object)
}

/// Fringe period along the rows in camera pixels, at least 3 and at most the width.
#[pyfunction]
fn row_period(py: Python<'_>, image: &Bound<'_, PyAny>) -> PyResult<f64> {
    let image = map("image", image)?;
    let view = image.as_array();
    detached(py, || stages::row_period_px(view))
}

/// Rows and columns of the blocks whose means the published decoder works on.
#[pyfunction]
fn block_size(green_period_px: f32, infrared_period_px: f32, width: usize) -> (usize, usize) {
    let blocks = Blocks::for_periods(green_period_px, infrared_period_px, width);
    (blocks.rows, blocks.columns)
}

/// Means over blocks of pixels.
#[pyfunction]
fn block_means<'py>(
    py: Python<'py>,
    image: &Bound<'py, PyAny>,
    rows: usize,
    columns: usize,
) -> PyResult<Map<'py>> {
    let image = map("image", image)?;
    let view = image.as_array();
    let found = detached(py, || stages::block_means(view, rows, columns))?.map_err(value_error)?;
    Ok(found.into_pyarray(py))
}

/// Image whose gaps (NaN) are filled with the last value to their left.
#[pyfunction]
fn fill_gaps<'py>(py: Python<'py>, image: &Bound<'py, PyAny>) -> PyResult<Map<'py>> {
    let image = map("image", image)?;
    let view = image.as_array();
    Ok(detached(py, || stages::fill_gaps(view))?.into_pyarray(py))
}

/// Modulation of red over that of blue for each row.
#[pyfunction]
fn modulation_ratio<'py>(
    py: Python<'py>,
    red: &Bound<'py, PyAny>,
    blue: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyArray1<f32>>> {
    let (red, blue) = (map("red", red)?, map("blue", blue)?);
    let (red, blue) = (red.as_array(), blue.as_array());
    let found = detached(py, || stages::modulation_ratio(red, blue))?.map_err(value_error)?;
    Ok(found.into_pyarray(py))
}

/// Phase and modulation at every pixel of two sets of block means, which share one Fourier transform.
#[pyfunction]
fn fourier_pair<'py>(
    py: Python<'py>,
    first: &Bound<'py, PyAny>,
    second: &Bound<'py, PyAny>,
    periods: [f64; 2],
    columns: usize,
    width: usize,
) -> PyResult<[(Map<'py>, Map<'py>); 2]> {
    let (first, second) = (map("first", first)?, map("second", second)?);
    let first = Fringes { means: first.as_array(), period: periods[0] };
    let second = Fringes { means: second.as_array(), period: periods[1] };
    let found = detached(py, || stages::fourier_pair(first, second, columns, width))?.map_err(value_error)?;
    Ok(found.map(|found| (found.phase_rad.into_pyarray(py), found.modulation.into_pyarray(py))))
}

/// Wrapped phase plus the whole turns that bring it nearest to an estimate of the absolute phase.
#[pyfunction]
fn nearest_turn<'py>(
    py: Python<'py>,
    wrapped_rad: &Bound<'py, PyAny>,
    estimate_rad: &Bound<'py, PyAny>,
) -> PyResult<Map<'py>> {
    let (wrapped, estimate) = (map("wrapped_rad", wrapped_rad)?, map("estimate_rad", estimate_rad)?);
    let (wrapped, estimate) = (wrapped.as_array(), estimate.as_array());
    let found = detached(py, || stages::nearest_turn(wrapped, estimate))?.map_err(value_error)?;
    Ok(found.into_pyarray(py))
}

/// Phase and quality without pixels of low modulation and phases of doubtful order.
#[pyfunction]
#[pyo3(signature = (phase_rad, margin, modulation, *, modulation_min, quality_min))]
fn discard_invalid<'py>(
    py: Python<'py>,
    phase_rad: &Bound<'py, PyAny>,
    margin: &Bound<'py, PyAny>,
    modulation: &Bound<'py, PyAny>,
    modulation_min: f32,
    quality_min: f32,
) -> PyResult<(Map<'py>, Map<'py>)> {
    let [phase, margin] = [map("phase_rad", phase_rad)?, map("margin", margin)?];
    let modulation = map("modulation", modulation)?;
    let (phase, margin) = (phase.as_array().to_owned(), margin.as_array().to_owned());
    let modulation = modulation.as_array();
    let limits = Limits { modulation_min, quality_min };
    let work = || stages::discard_invalid(&Absolute::new(phase, margin)?, modulation, limits);
    let found = detached(py, work)?.map_err(value_error)?;
    Ok((found.phase_rad.into_pyarray(py), found.quality.into_pyarray(py)))
}

/// Phase and projector column of the pixels that the projector image lights.
#[pyfunction]
fn columns_from_phase<'py>(
    py: Python<'py>,
    phase_rad: &Bound<'py, PyAny>,
    fringe_numbers: FringeNumbers,
    projector_width: usize,
) -> PyResult<(Map<'py>, Map<'py>)> {
    let encoding = fringe_numbers.encoding(projector_width, None).map_err(value_error)?;
    let phase = map("phase_rad", phase_rad)?;
    let view = phase.as_array();
    let found = detached(py, || stages::columns_from_phase(&encoding, view))?;
    Ok((found.phase_rad.into_pyarray(py), found.column_px.into_pyarray(py)))
}

/// Probability that the order of each pixel is wrong, from the margins of a whole shot.
#[pyfunction]
fn wrong_order_probability<'py>(py: Python<'py>, quality: &Bound<'py, PyAny>) -> PyResult<Map<'py>> {
    let quality = map("quality", quality)?;
    let view = quality.as_array();
    Ok(detached(py, || stages::wrong_order_probability(view))?.into_pyarray(py))
}

/// Add all functions of this file to the module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(row_period, module)?)?;
    module.add_function(wrap_pyfunction!(block_size, module)?)?;
    module.add_function(wrap_pyfunction!(block_means, module)?)?;
    module.add_function(wrap_pyfunction!(fill_gaps, module)?)?;
    module.add_function(wrap_pyfunction!(modulation_ratio, module)?)?;
    module.add_function(wrap_pyfunction!(fourier_pair, module)?)?;
    module.add_function(wrap_pyfunction!(nearest_turn, module)?)?;
    module.add_function(wrap_pyfunction!(discard_invalid, module)?)?;
    module.add_function(wrap_pyfunction!(columns_from_phase, module)?)?;
    module.add_function(wrap_pyfunction!(wrong_order_probability, module)?)?;
    Ok(())
}
