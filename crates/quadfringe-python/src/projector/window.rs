//! The window on an HDMI output.

use super::backend::screen::{self, SIZE_PX};
use super::errors::device_error;
use crate::arrays::expected;
use numpy::PyUntypedArrayMethods;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use std::sync::{Mutex, PoisonError};

/// A borderless window that covers the output of a projector.
#[pyclass(frozen, module = "quadfringe._core")]
pub struct PatternWindow {
    window: Mutex<Option<screen::PatternWindow>>,
    output: String,
    size_px: (u32, u32),
    frame_rate_hz: Option<f64>,
}

#[pymethods]
impl PatternWindow {
    #[new]
    #[pyo3(signature = (output = None, size_px = None))]
    fn new(py: Python<'_>, output: Option<&str>, size_px: Option<(u32, u32)>) -> PyResult<Self> {
        let size_px = size_px.unwrap_or(SIZE_PX);
        let window =
            py.detach(|| screen::PatternWindow::open_sized(output, size_px)).map_err(device_error)?;
        let (name, frame_rate_hz) = (window.output().name.clone(), window.output().frame_rate_hz);
        Ok(Self { output: name, size_px, frame_rate_hz, window: Mutex::new(Some(window)) })
    }

    #[getter]
    fn size_px(&self) -> (u32, u32) {
        self.size_px
    }

    #[getter]
    fn frame_rate_hz(&self) -> Option<f64> {
        self.frame_rate_hz
    }

    #[getter]
    fn output(&self) -> &str {
        &self.output
    }

    fn show(&self, py: Python<'_>, image: &Bound<'_, PyAny>) -> PyResult<()> {
        let image = expected::<u8, 3>("image", image)?;
        let (width, height) = self.size_px;
        if image.shape() != [height as usize, width as usize, 3] {
            let message = format!("image: expected shape ({height}, {width}, 3), got {:?}", image.shape());
            return Err(PyValueError::new_err(message));
        }
        let bytes =
            image.as_slice().map_err(|_| PyValueError::new_err("image: expected a C-contiguous array"))?;
        py.detach(|| {
            let mut window = self.window.lock().unwrap_or_else(PoisonError::into_inner);
            match window.as_mut() {
                Some(window) => window.show(bytes).map_err(device_error),
                None => Err(PyValueError::new_err("the window is closed: open it again")),
            }
        })
    }

    fn close(&self, py: Python<'_>) {
        py.detach(|| drop(self.window.lock().unwrap_or_else(PoisonError::into_inner).take()));
    }

    fn __enter__(this: Py<Self>) -> Py<Self> {
        this
    }

    #[pyo3(signature = (*_exception))]
    fn __exit__(&self, py: Python<'_>, _exception: &Bound<'_, PyAny>) {
        self.close(py);
    }
}

/// One output, in the order that `outputs` documents.
type Row = (String, u32, u32, Option<f64>, Option<String>);

/// Name, width, height, frame rate in Hz, and why the output cannot show an image of this size, for every active output.
#[pyfunction]
#[pyo3(signature = (size_px = None))]
pub fn outputs(py: Python<'_>, size_px: Option<(u32, u32)>) -> PyResult<Vec<Row>> {
    let size_px = size_px.unwrap_or(SIZE_PX);
    let outputs = py.detach(screen::outputs).map_err(device_error)?;
    let row = |output: screen::Output| {
        let unfit = output.unfit_for(size_px);
        (output.name, output.size_px.0, output.size_px.1, output.frame_rate_hz, unfit)
    };
    Ok(outputs.into_iter().map(row).collect())
}
