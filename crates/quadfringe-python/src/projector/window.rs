//! The window on an HDMI output.

use super::errors::device_error;
use crate::arrays::expected;
use lightcrafter::sequence::{HEIGHT_PX, WIDTH_PX};
use numpy::PyUntypedArrayMethods;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use std::sync::{Mutex, PoisonError};

/// A borderless window that covers the output of a projector.
#[pyclass(frozen, module = "quadfringe._core")]
pub struct PatternWindow {
    window: Mutex<Option<lightcrafter::window::PatternWindow>>,
    output: String,
}

#[pymethods]
impl PatternWindow {
    #[new]
    #[pyo3(signature = (output = None))]
    fn new(py: Python<'_>, output: Option<&str>) -> PyResult<Self> {
        let window = py.detach(|| lightcrafter::window::PatternWindow::open(output)).map_err(device_error)?;
        Ok(Self { output: window.output().name.clone(), window: Mutex::new(Some(window)) })
    }

    #[getter]
    fn output(&self) -> &str {
        &self.output
    }

    fn show(&self, py: Python<'_>, image: &Bound<'_, PyAny>) -> PyResult<()> {
        let image = expected::<u8, 3>("image", image)?;
        if image.shape() != [HEIGHT_PX, WIDTH_PX, 3] {
            let message =
                format!("image: expected shape ({HEIGHT_PX}, {WIDTH_PX}, 3), got {:?}", image.shape());
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

/// Name, width, height, frame rate in Hz, and why the output cannot show a pattern, for every active output.
#[pyfunction]
pub fn outputs(py: Python<'_>) -> PyResult<Vec<Row>> {
    let outputs = py.detach(lightcrafter::window::outputs).map_err(device_error)?;
    let row = |output: lightcrafter::window::Output| {
        let unfit = output.unfit();
        (output.name, output.size_px.0, output.size_px.1, output.frame_rate_hz, unfit)
    };
    Ok(outputs.into_iter().map(row).collect())
}
