//! The stages one by one, for teaching and debugging. All images are (H, W) float32.

use crate::arrays::{BAYER_IMAGES, CHANNELS, COLOURS, Images, RAW, expected, value_error, views};
use crate::conditioner::{ResponseNumbers, conditioner_of, scaled};
use crate::device::{FringeNumbers, unknown};
use crate::workers::detached;
use ndarray::Array2;
use numpy::{IntoPyArray, PyArray2, PyReadonlyArray2, PyReadonlyArray3};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use quadfringe::condition::{self, ResponseEstimate, Sample};
use quadfringe::stages::{self, Background, Band, Phases};
use quadfringe::{BayerPattern, Conditioner, Shot};

type Map<'py> = Bound<'py, PyArray2<f32>>;

fn map<'py>(name: &str, object: &Bound<'py, PyAny>) -> PyResult<PyReadonlyArray2<'py, f32>> {
    expected::<f32, 2>(name, object)
}

/// The channels as linear light, by name.
#[pyfunction]
#[pyo3(signature = (red, green, blue, ir = None, *, full_scale = None, dark = None, response = None, crosstalk = None,
    projector_response = None, ir_registration = None))]
#[expect(clippy::too_many_arguments, reason = "keyword arguments of Python")]
pub fn linear_light<'py>(
    py: Python<'py>,
    red: &Bound<'py, PyAny>,
    green: &Bound<'py, PyAny>,
    blue: &Bound<'py, PyAny>,
    ir: Option<&Bound<'py, PyAny>>,
    full_scale: Option<f32>,
    dark: Option<[f32; 4]>,
    response: Option<[ResponseNumbers; 4]>,
    crosstalk: Option<[[f64; 4]; 4]>,
    projector_response: Option<[ResponseNumbers; 4]>,
    ir_registration: Option<[[f64; 3]; 2]>,
) -> PyResult<Bound<'py, PyDict>> {
    let known = (full_scale, conditioner_of(dark, response, crosstalk, projector_response, ir_registration));
    let Some(ir) = ir else {
        let planes = match &Images::borrow(COLOURS, [red, green, blue])? {
            Images::U8(three) => linearise(py, views(three), Shot::rgb, &known),
            Images::U16(three) => linearise(py, views(three), Shot::rgb, &known),
            Images::F32(three) => linearise(py, views(three), Shot::rgb, &known),
        }?;
        return light_by_name(py, &COLOURS, planes);
    };
    let planes = match &Images::borrow(CHANNELS, [red, green, blue, ir])? {
        Images::U8(four) => linearise(py, views(four), Shot::new, &known),
        Images::U16(four) => linearise(py, views(four), Shot::new, &known),
        Images::F32(four) => linearise(py, views(four), Shot::new, &known),
    }?;
    light_by_name(py, &CHANNELS, planes)
}

/// The four channels at every pixel as linear light, by name, from a raw mosaic and an infrared image.
#[pyfunction]
#[pyo3(signature = (raw, bayer, ir = None, *, full_scale = None, dark = None, response = None, crosstalk = None,
    projector_response = None, ir_registration = None))]
#[expect(clippy::too_many_arguments, reason = "keyword arguments of Python")]
pub fn linear_light_bayer<'py>(
    py: Python<'py>,
    raw: &Bound<'py, PyAny>,
    bayer: &str,
    ir: Option<&Bound<'py, PyAny>>,
    full_scale: Option<f32>,
    dark: Option<[f32; 4]>,
    response: Option<[ResponseNumbers; 4]>,
    crosstalk: Option<[[f64; 4]; 4]>,
    projector_response: Option<[ResponseNumbers; 4]>,
    ir_registration: Option<[[f64; 3]; 2]>,
) -> PyResult<Bound<'py, PyDict>> {
    let pattern = BayerPattern::from_name(bayer).map_err(value_error)?;
    let known = (full_scale, conditioner_of(dark, response, crosstalk, projector_response, ir_registration));
    let Some(ir) = ir else {
        let planes = match &Images::borrow(RAW, [raw])? {
            Images::U8(one) => linearise(py, views(one), |[raw]| Shot::bayer_rgb(raw, pattern), &known),
            Images::U16(one) => linearise(py, views(one), |[raw]| Shot::bayer_rgb(raw, pattern), &known),
            Images::F32(one) => linearise(py, views(one), |[raw]| Shot::bayer_rgb(raw, pattern), &known),
        }?;
        return light_by_name(py, &COLOURS, planes);
    };
    let planes = match &Images::borrow(BAYER_IMAGES, [raw, ir])? {
        Images::U8(two) => linearise(py, views(two), |[raw, ir]| Shot::bayer(raw, pattern, ir), &known),
        Images::U16(two) => linearise(py, views(two), |[raw, ir]| Shot::bayer(raw, pattern, ir), &known),
        Images::F32(two) => linearise(py, views(two), |[raw, ir]| Shot::bayer(raw, pattern, ir), &known),
    }?;
    light_by_name(py, &CHANNELS, planes)
}

fn linearise<'a, T: Sample, I: Send>(
    py: Python<'_>,
    images: I,
    shot: impl FnOnce(I) -> quadfringe::Result<Shot<'a, T>> + Send,
    (full_scale, conditioner): &(Option<f32>, Conditioner),
) -> PyResult<[Array2<f32>; 4]> {
    let work = || condition::linearise(&scaled(shot(images)?, *full_scale)?, conditioner);
    detached(py, work)?.map_err(value_error)
}

/// The planes of these channels by name.
fn light_by_name<'py>(
    py: Python<'py>,
    channels: &[&str],
    planes: [Array2<f32>; 4],
) -> PyResult<Bound<'py, PyDict>> {
    let named = PyDict::new(py);
    for (name, plane) in channels.iter().zip(planes) {
        named.set_item(name, plane.into_pyarray(py))?;
    }
    Ok(named)
}

/// Background of every row.
#[pyfunction]
#[pyo3(signature = (image, period_px, *, kind = None))]
pub fn background<'py>(
    py: Python<'py>,
    image: &Bound<'py, PyAny>,
    period_px: f64,
    kind: Option<&str>,
) -> PyResult<Map<'py>> {
    let image = map("image", image)?;
    let (view, kind) = (image.as_array(), background_named(kind)?);
    let found = detached(py, || stages::background(view, kind, period_px))?.map_err(value_error)?;
    Ok(found.into_pyarray(py))
}

/// Fringe period in camera pixels along rows and along columns; infinite in a direction without a carrier.
#[pyfunction]
pub fn carrier(py: Python<'_>, image: &Bound<'_, PyAny>) -> PyResult<(f64, f64)> {
    let image = map("image", image)?;
    let view = image.as_array();
    let found = detached(py, || stages::carrier(view))?;
    Ok((found.row_px, found.column_px))
}

/// Wrapped phase from R and B, after their backgrounds are removed and their modulations are made equal.
#[pyfunction]
#[pyo3(signature = (red, blue, *, coarse = false))]
pub fn two_step<'py>(
    py: Python<'py>,
    red: &Bound<'py, PyAny>,
    blue: &Bound<'py, PyAny>,
    coarse: bool,
) -> PyResult<Map<'py>> {
    let (red, blue) = (map("red", red)?, map("blue", blue)?);
    let (red, blue) = (red.as_array(), blue.as_array());
    let phase = if coarse { stages::two_step_coarse } else { stages::two_step };
    let found = detached(py, || phase(red, blue))?.map_err(value_error)?;
    Ok(found.into_pyarray(py))
}

/// Wrapped phase of an image with fringes along its rows, by a Fourier filter.
#[pyfunction]
#[pyo3(signature = (image, period_px, *, band = None, kind = None))]
pub fn fourier<'py>(
    py: Python<'py>,
    image: &Bound<'py, PyAny>,
    period_px: f64,
    band: Option<&str>,
    kind: Option<&str>,
) -> PyResult<Map<'py>> {
    let image = map("image", image)?;
    let (view, band, kind) = (image.as_array(), band_named(band)?, background_named(kind)?);
    let found = detached(py, || stages::fourier(view, band, kind, period_px))?.map_err(value_error)?;
    Ok(found.into_pyarray(py))
}

/// Absolute phase and order margin from three wrapped phases, point by point.
#[pyfunction]
pub fn unwrap<'py>(
    py: Python<'py>,
    first: &Bound<'py, PyAny>,
    second: &Bound<'py, PyAny>,
    third: &Bound<'py, PyAny>,
    fringe_numbers: FringeNumbers,
    projector_width: usize,
) -> PyResult<(Map<'py>, Map<'py>)> {
    let encoding = fringe_numbers.encoding(projector_width, None).map_err(value_error)?;
    let maps = [map("first", first)?, map("second", second)?, map("third", third)?];
    let views = Phases::from_array(maps.each_ref().map(PyReadonlyArray2::as_array));
    let found = detached(py, || stages::unwrap(&encoding, views))?.map_err(value_error)?;
    Ok((found.phase_rad.into_pyarray(py), found.margin.into_pyarray(py)))
}

/// Wrapped phase, background and modulation from a stack of equal steps over one period, (steps, H, W).
#[pyfunction]
pub fn n_step<'py>(py: Python<'py>, stack: &Bound<'py, PyAny>) -> PyResult<(Map<'py>, Map<'py>, Map<'py>)> {
    let stack = expected::<f32, 3>("stack", stack)?;
    let view = stack.as_array();
    let found = detached(py, || stages::n_step(view))?.map_err(value_error)?;
    let maps = [found.phase_rad, found.background, found.modulation];
    let [phase, background, modulation] = maps.map(|map| map.into_pyarray(py));
    Ok((phase, background, modulation))
}

/// Response of a channel from N-step stacks, each (steps, H, W), fractions of full scale.
#[pyfunction]
pub fn estimate_response<'py>(
    py: Python<'py>,
    stacks: Vec<Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let stacks: PyResult<Vec<_>> = stacks.iter().map(|stack| expected::<f32, 3>("stack", stack)).collect();
    let stacks = stacks?;
    let views: Vec<_> = stacks.iter().map(PyReadonlyArray3::as_array).collect();
    let found = detached(py, || condition::estimate_response(&views))?.map_err(value_error)?;
    figures_of(py, &found)
}

/// Response of each channel from one shot and its phase, by name. A channel for which none was found is left out.
#[pyfunction]
#[pyo3(signature = (red, green, blue, ir, phase_rad, fringe_numbers, projector_width, *, columns_px = None))]
#[expect(clippy::too_many_arguments, reason = "four channels, their phase and their fringes")]
pub fn estimate_response_of_shot<'py>(
    py: Python<'py>,
    red: &Bound<'py, PyAny>,
    green: &Bound<'py, PyAny>,
    blue: &Bound<'py, PyAny>,
    ir: Option<&Bound<'py, PyAny>>,
    phase_rad: &Bound<'py, PyAny>,
    fringe_numbers: FringeNumbers,
    projector_width: usize,
    columns_px: Option<[f64; 2]>,
) -> PyResult<Bound<'py, PyDict>> {
    let encoding = fringe_numbers.encoding(projector_width, columns_px).map_err(value_error)?;
    // Without infrared its plane is not read.
    let light = [map("red", red)?, map("green", green)?, map("blue", blue)?, map("ir", ir.unwrap_or(green))?];
    let phase = map("phase_rad", phase_rad)?;
    let (views, phase) = (light.each_ref().map(PyReadonlyArray2::as_array), phase.as_array());
    let work = || condition::estimate_response_of_shot(views, phase, &encoding);
    let found = detached(py, work)?.map_err(value_error)?;
    let named = PyDict::new(py);
    for (name, estimate) in CHANNELS.into_iter().zip(found) {
        if let Some(estimate) = estimate {
            named.set_item(name, figures_of(py, &estimate)?)?;
        }
    }
    Ok(named)
}

fn figures_of<'py>(py: Python<'py>, found: &ResponseEstimate) -> PyResult<Bound<'py, PyDict>> {
    let named = PyDict::new(py);
    named.set_item("offset", found.response.offset)?;
    named.set_item("exponent", found.response.exponent)?;
    named.set_item("knee", found.response.knee)?;
    named.set_item("two_step_rms_before_rad", found.two_step_rms_before_rad)?;
    named.set_item("two_step_rms_after_rad", found.two_step_rms_after_rad)?;
    named.set_item("pixels", found.pixels)?;
    named.set_item("exponent_sd", found.exponent_sd)?;
    named.set_item("second_harmonic_before", found.second_harmonic_before)?;
    named.set_item("second_harmonic_after", found.second_harmonic_after)?;
    Ok(named)
}

fn background_named(name: Option<&str>) -> PyResult<Background> {
    match name {
        None => Ok(Background::default()),
        Some("mean_envelope") => Ok(Background::MeanEnvelope),
        Some("moving_mean") => Ok(Background::MovingMean),
        Some(name) => Err(unknown("background", name, "mean_envelope or moving_mean")),
    }
}

fn band_named(name: Option<&str>) -> PyResult<Band> {
    match name {
        None => Ok(Band::default()),
        Some("traditional") => Ok(Band::Traditional),
        Some("improved") => Ok(Band::Improved),
        Some(name) => Err(unknown("band", name, "traditional or improved")),
    }
}
