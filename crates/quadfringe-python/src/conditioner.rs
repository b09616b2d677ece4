//! The photometric calibration of a shot, from keyword arguments.

use pyo3::prelude::*;
use quadfringe::condition::Sample;
use quadfringe::{Conditioner, Response, Shot};

/// The response of a channel: offset, exponent and knee.
#[derive(Clone, Copy)]
pub struct ResponseNumbers(pub Response);

impl<'a, 'py> FromPyObject<'a, 'py> for ResponseNumbers {
    type Error = PyErr;

    fn extract(numbers: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        let (offset, exponent, knee) = numbers.extract()?;
        Ok(Self(Response { offset, exponent, knee }))
    }
}

/// The shot with this full scale, or with the greatest value of its type if none is given.
pub fn scaled<T: Sample>(shot: Shot<'_, T>, full_scale: Option<f32>) -> quadfringe::Result<Shot<'_, T>> {
    match full_scale {
        Some(full_scale) => shot.with_full_scale(full_scale),
        None => Ok(shot),
    }
}

/// The kernel's conditioner. The defaults of absent arguments describe an ideal camera.
pub fn conditioner_of(
    dark: Option<[f32; 4]>,
    response: Option<[ResponseNumbers; 4]>,
    crosstalk: Option<[[f64; 4]; 4]>,
    projector_response: Option<[ResponseNumbers; 4]>,
    ir_registration: Option<[[f64; 3]; 2]>,
) -> Conditioner {
    let mut conditioner = Conditioner::default();
    conditioner.dark = dark.unwrap_or(conditioner.dark);
    conditioner.response = response.map_or(conditioner.response, |four| four.map(|numbers| numbers.0));
    conditioner.crosstalk = crosstalk.unwrap_or(conditioner.crosstalk);
    conditioner.projector_response =
        projector_response.map_or(conditioner.projector_response, |four| four.map(|numbers| numbers.0));
    conditioner.ir_registration = ir_registration.unwrap_or(conditioner.ir_registration);
    conditioner
}
