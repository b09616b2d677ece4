//! NumPy arrays, borrowed for the kernel without a copy. An array of the wrong type is an error that names its argument.

use numpy::ndarray::{ArrayView2, Dim, Dimension, Ix};
use numpy::{Element, PyArray, PyArrayMethods, PyReadonlyArray, PyUntypedArray, PyUntypedArrayMethods};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;

/// The images of a shot, in the kernel's order.
pub const CHANNELS: [&str; 4] = ["red", "green", "blue", "ir"];

/// The images of a shot without infrared.
pub const COLOURS: [&str; 3] = ["red", "green", "blue"];

/// The images of a shot of a Bayer chip.
pub const BAYER_IMAGES: [&str; 2] = ["raw", "ir"];

/// The image of a shot of a Bayer chip without infrared.
pub const RAW: [&str; 1] = ["raw"];

/// Every error of the kernel is a ValueError, because it concerns a value from the caller.
pub fn value_error(error: quadfringe::Error) -> PyErr {
    PyValueError::new_err(error.to_string())
}

/// Borrow `object` as an array of this type and number of axes; `None` if it is something else.
pub fn borrowed<'py, T: Element, const N: usize>(
    object: &Bound<'py, PyAny>,
) -> PyResult<Option<PyReadonlyArray<'py, T, Dim<[Ix; N]>>>>
where
    Dim<[Ix; N]>: Dimension,
{
    let Ok(array) = object.cast::<PyArray<T, Dim<[Ix; N]>>>() else {
        return Ok(None);
    };
    let borrowed = array.try_readonly().map_err(|error| PyValueError::new_err(error.to_string()))?;
    Ok(Some(borrowed))
}

/// Borrow `object` as an array of this type and number of axes, or raise TypeError with the expected and the actual array.
pub fn expected<'py, T: Element, const N: usize>(
    name: &str,
    object: &Bound<'py, PyAny>,
) -> PyResult<PyReadonlyArray<'py, T, Dim<[Ix; N]>>>
where
    Dim<[Ix; N]>: Dimension,
{
    borrowed(object)?.ok_or_else(|| {
        let dtype = T::get_dtype(object.py());
        wrong_array(name, &format!("a {N}D {dtype} array"), object)
    })
}

/// The TypeError that names the argument, the expected and the actual array.
pub fn wrong_array(name: &str, expected: &str, object: &Bound<'_, PyAny>) -> PyErr {
    let actual = match object.cast::<PyUntypedArray>() {
        Ok(array) => format!("a {}D {} array", array.ndim(), array.dtype()),
        Err(_) => object.get_type().to_string(),
    };
    PyTypeError::new_err(format!("{name}: expected {expected}, got {actual}"))
}

/// CRC-32 (that of zlib) of the bytes of an image in the order of its rows, with the processor's CRC instructions.
#[pyfunction]
pub fn crc32(py: Python<'_>, image: &Bound<'_, PyAny>) -> PyResult<u32> {
    let bytes = expected::<u8, 2>("image", image)?;
    let rows = bytes.as_array();
    Ok(py.detach(|| {
        let mut sum = crc32fast::Hasher::new();
        for row in rows.rows() {
            match row.to_slice() {
                Some(row) => sum.update(row),
                None => sum.update(&row.to_vec()),
            }
        }
        sum.finalize()
    }))
}

/// Images of one type, borrowed from NumPy.
pub enum Images<'py, const COUNT: usize> {
    /// 8 bit.
    U8([PyReadonlyArray<'py, u8, Dim<[Ix; 2]>>; COUNT]),
    /// 9 to 16 bit.
    U16([PyReadonlyArray<'py, u16, Dim<[Ix; 2]>>; COUNT]),
    /// Fractions of full scale.
    F32([PyReadonlyArray<'py, f32, Dim<[Ix; 2]>>; COUNT]),
}

impl<'py, const COUNT: usize> Images<'py, COUNT> {
    /// Borrow images; the first decides the type that the others must have.
    pub fn borrow(names: [&str; COUNT], objects: [&Bound<'py, PyAny>; COUNT]) -> PyResult<Self> {
        if borrowed::<u8, 2>(objects[0])?.is_some() {
            all(names, objects).map(Self::U8)
        } else if borrowed::<u16, 2>(objects[0])?.is_some() {
            all(names, objects).map(Self::U16)
        } else if borrowed::<f32, 2>(objects[0])?.is_some() {
            all(names, objects).map(Self::F32)
        } else {
            let kinds = "a 2D uint8, uint16 or float32 array";
            Err(wrong_array(names[0], kinds, objects[0]))
        }
    }
}

/// Views of borrowed images for the kernel.
pub fn views<'a, T: Element, const COUNT: usize>(
    images: &'a [PyReadonlyArray<'_, T, Dim<[Ix; 2]>>; COUNT],
) -> [ArrayView2<'a, T>; COUNT] {
    images.each_ref().map(|image| image.as_array())
}

fn all<'py, T: Element, const COUNT: usize>(
    names: [&str; COUNT],
    objects: [&Bound<'py, PyAny>; COUNT],
) -> PyResult<[PyReadonlyArray<'py, T, Dim<[Ix; 2]>>; COUNT]> {
    let mut found = Vec::with_capacity(COUNT);
    for (name, object) in names.into_iter().zip(objects) {
        found.push(expected::<T, 2>(name, object)?);
    }
    Ok(found.try_into().unwrap_or_else(|_| unreachable!("one array for each name")))
}
