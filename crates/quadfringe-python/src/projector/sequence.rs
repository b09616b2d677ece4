//! Pattern sequences and images for flash, translated from Python values.

use super::errors::device_error;
use super::names;
use crate::arrays::expected;
use lightcrafter::Sequence;
use lightcrafter::command::{LutEntry, Timing};
use lightcrafter::flash::{FlashPattern, pack};
use lightcrafter::sequence::{Exposures, HEIGHT_PX, Source, WIDTH_PX, WORST_LOAD_US};
use numpy::PyUntypedArrayMethods;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyBytes;

/// One pattern of a sequence.
#[pyclass(frozen, eq, from_py_object, module = "quadfringe._core")]
#[derive(Clone, PartialEq)]
pub struct Pattern(LutEntry);

#[pymethods]
impl Pattern {
    #[new]
    #[pyo3(signature = (number, bit_depth, leds, *, trigger = "internal", invert = false, black_after = false,
        next_image = false, shares_exposure = false))]
    #[expect(clippy::too_many_arguments, reason = "the fields of the table")]
    fn new(
        number: u8,
        bit_depth: u8,
        leds: &str,
        trigger: &str,
        invert: bool,
        black_after: bool,
        next_image: bool,
        shares_exposure: bool,
    ) -> PyResult<Self> {
        let (trigger, leds) = (names::entry_trigger(trigger)?, names::leds(leds)?);
        let entry =
            LutEntry { trigger, number, bit_depth, leds, invert, black_after, next_image, shares_exposure };
        Ok(Self(entry))
    }

    fn __repr__(&self) -> String {
        format!("{:?}", self.0)
    }
}

/// Patterns with their exposures and their trigger.
#[pyclass(frozen, module = "quadfringe._core")]
pub struct PatternSequence(pub Sequence);

fn entries(patterns: Vec<Pattern>) -> Vec<LutEntry> {
    patterns.into_iter().map(|pattern| pattern.0).collect()
}

#[pymethods]
impl PatternSequence {
    #[new]
    #[pyo3(signature = (patterns, timings_us, *, trigger_mode, frame_rate_hz = None, images = None, load_us = None,
        repeat = true))]
    fn new(
        patterns: Vec<Pattern>,
        timings_us: Vec<(u32, u32)>,
        trigger_mode: &str,
        frame_rate_hz: Option<f64>,
        images: Option<Vec<u8>>,
        load_us: Option<u32>,
        repeat: bool,
    ) -> PyResult<Self> {
        let source = match (frame_rate_hz, images) {
            (Some(frame_rate_hz), None) => Source::Video { frame_rate_hz },
            (None, Some(images)) => Source::Flash { images, load_us: load_us.unwrap_or(WORST_LOAD_US) },
            _ => {
                return Err(PyValueError::new_err(
                    "expected frame_rate_hz (video) or images (flash), and one of them",
                ));
            }
        };
        let timing = |(exposure_us, period_us)| Timing { exposure_us, period_us };
        let exposures = match timings_us.as_slice() {
            [one] => Exposures::Fixed(timing(*one)),
            _ => Exposures::Each(timings_us.into_iter().map(timing).collect()),
        };
        let trigger_mode = names::trigger_mode(trigger_mode)?;
        let sequence = Sequence { source, trigger_mode, patterns: entries(patterns), exposures, repeat };
        sequence.check().map_err(device_error)?;
        Ok(Self(sequence))
    }

    /// Make a sequence that shows these patterns in every video frame.
    #[staticmethod]
    fn from_video(patterns: Vec<Pattern>, frame_rate_hz: f64, exposure_us: u32) -> PyResult<Self> {
        let sequence = Sequence::from_video(entries(patterns), frame_rate_hz, exposure_us);
        sequence.check().map_err(device_error)?;
        Ok(Self(sequence))
    }

    /// Make a sequence of the patterns of one flash image.
    #[staticmethod]
    fn from_flash(image: u8, patterns: Vec<Pattern>, exposure_us: u32) -> PyResult<Self> {
        let sequence = Sequence::from_flash(image, entries(patterns), exposure_us);
        sequence.check().map_err(device_error)?;
        Ok(Self(sequence))
    }

    fn __repr__(&self) -> String {
        format!("{:?}", self.0)
    }
}

/// The longest exposure that lets `count` patterns share a frame.
#[pyfunction]
pub fn exposure_in_frame_us(count: usize, bit_depth: u8, frame_rate_hz: f64) -> PyResult<u32> {
    lightcrafter::sequence::exposure_in_frame_us(count, bit_depth, frame_rate_hz).map_err(device_error)
}

/// Image, number and bit depth of a pattern in flash.
type Place = (usize, u8, u8);

/// BMP files of 24 bit, and image, number and bit depth of each pattern.
#[pyfunction]
pub fn pack_flash<'py>(
    py: Python<'py>,
    patterns: Vec<(Bound<'py, PyAny>, u8)>,
) -> PyResult<(Vec<Bound<'py, PyBytes>>, Vec<Place>)> {
    let arrays: PyResult<Vec<_>> =
        patterns.iter().map(|(array, _)| expected::<u8, 2>("pattern", array)).collect();
    let arrays = arrays?;
    let mut flat = Vec::with_capacity(arrays.len());
    for (array, (_, bit_depth)) in arrays.iter().zip(&patterns) {
        if array.shape() != [HEIGHT_PX, WIDTH_PX] {
            let message =
                format!("pattern: expected shape ({HEIGHT_PX}, {WIDTH_PX}), got {:?}", array.shape());
            return Err(PyValueError::new_err(message));
        }
        let values =
            array.as_slice().map_err(|_| PyValueError::new_err("pattern: expected a C-contiguous array"))?;
        flat.push(FlashPattern { values, bit_depth: *bit_depth });
    }
    let (files, places) = py.detach(|| pack(&flat)).map_err(device_error)?;
    let files = files.iter().map(|file| PyBytes::new(py, file)).collect();
    Ok((files, places.iter().map(|place| (place.image, place.number, place.bit_depth)).collect()))
}
