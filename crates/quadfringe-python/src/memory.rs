//! Memory of the maps that go to Python, used again once Python has dropped them: to find fresh memory takes the system
//! longer than the kernel needs to fill it.

use ndarray::{Array, Array1, Dimension, Ix2, Ix3};
use numpy::PyArray;
use pyo3::prelude::*;
use quadfringe::Decoded;
use std::sync::{Arc, Mutex, PoisonError};

/// Most maps that wait for a shot: those of two shots.
const WAITING: usize = 16;

/// Maps that wait for the next shot.
#[derive(Default)]
pub struct Memory {
    waiting: Mutex<Vec<Array1<f32>>>,
}

impl Memory {
    /// Maps for the kernel to fill, in memory of earlier shots; the kernel replaces those that are left empty.
    pub fn maps(&self, [rows, columns]: [usize; 2], calibrated: bool) -> Decoded {
        let map = || self.take(Ix2(rows, columns)).unwrap_or_default();
        let mut maps = Decoded::default();
        maps.phase_rad = map();
        maps.column_px = map();
        maps.modulation = map();
        maps.quality = map();
        maps.wrong_order_probability = map();
        if calibrated {
            maps.uncertainty_mm = self.take(Ix2(rows, columns));
            maps.xyz_mm = self.take(Ix3(rows, columns, 3));
        } else {
            maps.uncertainty_rad = self.take(Ix2(rows, columns));
        }
        maps
    }

    /// An array left over from another shot.
    fn take<D: Dimension>(&self, shape: D) -> Option<Array<f32, D>> {
        let mut waiting = self.waiting.lock().unwrap_or_else(PoisonError::into_inner);
        // The latest first: some of it may still be in a cache.
        let fitting = waiting.iter().rposition(|values| values.len() == shape.size())?;
        let values = waiting.remove(fitting);
        Some(values.into_shape_with_order(shape).expect("as many values as the shape has"))
    }

    /// Lend an array to Python; its memory comes back when the last NumPy array that looks at it is gone.
    pub fn lend<'py, D: Dimension>(
        self: &Arc<Self>,
        py: Python<'py>,
        array: Array<f32, D>,
    ) -> PyResult<Bound<'py, PyArray<f32, D>>> {
        let shape = array.raw_dim();
        let count = array.len();
        let values = array.into_shape_with_order(count).expect("maps are contiguous");
        let loan = Bound::new(py, Loan { values, owner: Arc::clone(self) })?;
        let view =
            loan.get().values.view().into_shape_with_order(shape).expect("as many values as the shape has");
        // SAFETY: the array keeps the loan alive, which neither moves, changes nor shows its values to anyone else.
        #[expect(unsafe_code, reason = "the only way to a NumPy array that tells when it is gone")]
        Ok(unsafe { PyArray::borrow_from_array(&view, loan.clone().into_any()) })
    }

    fn give_back(&self, values: Array1<f32>) {
        let mut waiting = self.waiting.lock().unwrap_or_else(PoisonError::into_inner);
        if waiting.len() < WAITING {
            waiting.push(values);
        }
    }
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
