//! Each error of the driver as a Python exception of the fitting type.

use lightcrafter::Error;
use pyo3::exceptions::{
    PyConnectionError, PyFileNotFoundError, PyOSError, PyPermissionError, PyTimeoutError, PyValueError,
};
use pyo3::prelude::*;

/// ValueError for a wrong argument, OSError and its subclasses for a failure of the device.
pub fn device_error(error: Error) -> PyErr {
    let message = error.to_string();
    match error {
        Error::Value { .. } | Error::Ambiguous { .. } | Error::Output { .. } => {
            PyValueError::new_err(message)
        }
        Error::NotFound { .. } => PyFileNotFoundError::new_err(message),
        Error::AccessDenied { .. } => PyPermissionError::new_err(message),
        Error::Timeout { .. } | Error::Stuck { .. } => PyTimeoutError::new_err(message),
        Error::Disconnected { .. } => PyConnectionError::new_err(message),
        _ => PyOSError::new_err(message),
    }
}
