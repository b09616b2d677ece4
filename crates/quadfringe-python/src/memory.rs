//! Memory of the maps that go to Python. It is reused once Python has dropped them, because the system needs longer to
//! provide fresh memory than the kernel needs to fill it.

use ndarray::{Array, Array1, Dimension, Ix2, Ix3, ShapeError};
use numpy::PyArray;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use quadfringe::Decoded;
use std::sync::{Arc, Mutex, PoisonError};

/// Largest number of maps kept for later shots: those of two shots.
const WAITING: usize = 16;

/// Which of the optional maps a decoder gives.
#[derive(Clone, Copy)]
pub struct Optional {
    /// Points and the uncertainty of their depth, in place of the uncertainty of the phase.
    pub points: bool,
    pub albedo: bool,
}

/// Maps kept for the next shot.
#[derive(Default)]
pub struct Memory {
    waiting: Mutex<Vec<Array1<f32>>>,
}

impl Memory {
    /// Maps for the kernel to fill, in memory of earlier shots. The kernel allocates those for which no memory is left.
    pub fn maps(&self, [rows, columns]: [usize; 2], Optional { points, albedo }: Optional) -> Decoded {
        let map = || self.take(Ix2(rows, columns)).unwrap_or_default();
        let mut maps = Decoded::default();
        maps.phase_rad = map();
        maps.column_px = map();
        maps.modulation = map();
        maps.quality = map();
        maps.wrong_order_probability = map();
        if points {
            maps.uncertainty_mm = self.take(Ix2(rows, columns));
            maps.xyz_mm = self.take(Ix3(rows, columns, 3));
        } else {
            maps.uncertainty_rad = self.take(Ix2(rows, columns));
        }
        if albedo {
            maps.albedo = self.take(Ix3(rows, columns, 4));
        }
        maps
    }

    /// Memory of an earlier shot, if there is an array of this size.
    fn take<D: Dimension>(&self, shape: D) -> Option<Array<f32, D>> {
        let mut waiting = self.waiting.lock().unwrap_or_else(PoisonError::into_inner);
        // The latest comes first, because part of it may still be in a cache.
        let fitting = waiting.iter().rposition(|values| values.len() == shape.size())?;
        let values = waiting.remove(fitting);
        values.into_shape_with_order(shape).ok()
    }

    /// Lend an array to Python. Its memory comes back when the last NumPy array that shows it is gone.
    pub fn lend<'py, D: Dimension>(
        self: &Arc<Self>,
        py: Python<'py>,
        array: Array<f32, D>,
    ) -> PyResult<Bound<'py, PyArray<f32, D>>> {
        let shape = array.raw_dim();
        let count = array.len();
        let values = array.into_shape_with_order(count).map_err(wrong_layout)?;
        let loan = Bound::new(py, Loan { values, owner: Arc::clone(self) })?;
        let view = loan.get().values.view().into_shape_with_order(shape).map_err(wrong_layout)?;
        // SAFETY: the array keeps the loan alive. The loan never moves or changes its values, and nobody else has access.
        #[expect(
            unsafe_code,
            reason = "no safe call lends memory to NumPy and notices when the array is gone"
        )]
        Ok(unsafe { PyArray::borrow_from_array(&view, loan.clone().into_any()) })
    }

    /// Lend the maps of a decoded measurement to Python, by name.
    pub fn named<'py>(self: &Arc<Self>, py: Python<'py>, decoded: Decoded) -> PyResult<Bound<'py, PyDict>> {
        let named = PyDict::new(py);
        named.set_item("phase_rad", self.lend(py, decoded.phase_rad)?)?;
        named.set_item("column_px", self.lend(py, decoded.column_px)?)?;
        named.set_item("modulation", self.lend(py, decoded.modulation)?)?;
        named.set_item("quality", self.lend(py, decoded.quality)?)?;
        named.set_item("wrong_order_probability", self.lend(py, decoded.wrong_order_probability)?)?;
        let uncertain =
            [("uncertainty_rad", decoded.uncertainty_rad), ("uncertainty_mm", decoded.uncertainty_mm)];
        for (name, map) in uncertain {
            if let Some(map) = map {
                named.set_item(name, self.lend(py, map)?)?;
            }
        }
        if let Some(xyz_mm) = decoded.xyz_mm {
            named.set_item("xyz_mm", self.lend(py, xyz_mm)?)?;
        }
        if let Some(albedo) = decoded.albedo {
            named.set_item("albedo", self.lend(py, albedo)?)?;
        }
        let reasons = decoded.reason.mapv(|reason| reason as u8);
        named.set_item("reason", PyArray::from_owned_array(py, reasons))?;
        Ok(named)
    }

    fn give_back(&self, values: Array1<f32>) {
        let mut waiting = self.waiting.lock().unwrap_or_else(PoisonError::into_inner);
        if waiting.len() < WAITING {
            waiting.push(values);
        }
    }
}

/// The error of a map that is not contiguous. The kernel makes no such map, so a caller never sees this error.
fn wrong_layout(error: ShapeError) -> PyErr {
    PyRuntimeError::new_err(format!("a map of the kernel is not contiguous: {error}"))
}

/// Memory lent to Python: the base of a NumPy array.
#[pyclass(frozen, module = "quadfringe._core")]
struct Loan {
    values: Array1<f32>,
    owner: Arc<Memory>,
}

impl Drop for Loan {
    fn drop(&mut self) {
        self.owner.give_back(std::mem::take(&mut self.values));
    }
}
