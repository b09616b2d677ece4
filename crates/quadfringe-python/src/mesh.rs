//! Triangles and normals from points: `mesh_from_points`, `normals_from_points`.

use crate::arrays::{expected, value_error};
use crate::workers::detached;
use numpy::ndarray::Array2;
use numpy::{Element, IntoPyArray, PyArray2, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use quadfringe::mesh::{self, MeshOptions, Points};

/// Add the functions of this file to the module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(mesh_from_points, module)?)?;
    module.add_function(wrap_pyfunction!(normals_from_points, module)?)
}

/// The map of uncertainties, if there is one.
fn borrowed_map<'py>(map: Option<&Bound<'py, PyAny>>) -> PyResult<Option<PyReadonlyArray2<'py, f32>>> {
    map.map(|map| expected::<f32, 2>("uncertainty_mm", map)).transpose()
}

/// Vectors as an array with one row for each.
fn rows<T: Element, const N: usize>(py: Python<'_>, vectors: Vec<[T; N]>) -> Bound<'_, PyArray2<T>> {
    let shape = (vectors.len(), N);
    let flat = vectors.into_flattened();
    Array2::from_shape_vec(shape, flat).expect("N numbers for each vector").into_pyarray(py)
}

/// Triangles on the grid of pixels, with the pixel, point and normal of each vertex.
#[pyfunction]
#[pyo3(signature = (xyz_mm, uncertainty_mm=None, *, step=None, holes_px=None))]
pub fn mesh_from_points<'py>(
    py: Python<'py>,
    xyz_mm: &Bound<'py, PyAny>,
    uncertainty_mm: Option<&Bound<'py, PyAny>>,
    step: Option<usize>,
    holes_px: Option<usize>,
) -> PyResult<Bound<'py, PyDict>> {
    let xyz_mm = expected::<f32, 3>("xyz_mm", xyz_mm)?;
    let map = borrowed_map(uncertainty_mm)?;
    let points = Points { xyz_mm: xyz_mm.as_array(), uncertainty_mm: map.as_ref().map(|map| map.as_array()) };
    let default = MeshOptions::default();
    let options =
        MeshOptions { step: step.unwrap_or(default.step), holes_px: holes_px.unwrap_or(default.holes_px) };
    let found = detached(py, || mesh::mesh_from_points(&points, &options))?.map_err(value_error)?;
    let named = PyDict::new(py);
    named.set_item("pixels", rows(py, found.pixels))?;
    named.set_item("points_mm", rows(py, found.points_mm))?;
    named.set_item("normals", rows(py, found.normals))?;
    named.set_item("normal_uncertainty_rad", found.normal_uncertainty_rad.into_pyarray(py))?;
    named.set_item("filled", found.filled.into_pyarray(py))?;
    named.set_item("faces", rows(py, found.faces))?;
    Ok(named)
}

/// Normals of an image, and their uncertainty.
#[pyfunction]
#[pyo3(signature = (xyz_mm, uncertainty_mm=None))]
pub fn normals_from_points<'py>(
    py: Python<'py>,
    xyz_mm: &Bound<'py, PyAny>,
    uncertainty_mm: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let xyz_mm = expected::<f32, 3>("xyz_mm", xyz_mm)?;
    let map = borrowed_map(uncertainty_mm)?;
    let points = Points { xyz_mm: xyz_mm.as_array(), uncertainty_mm: map.as_ref().map(|map| map.as_array()) };
    let found = detached(py, || mesh::normals_from_points(&points))?.map_err(value_error)?;
    let named = PyDict::new(py);
    named.set_item("normals", found.normals.into_pyarray(py))?;
    named.set_item("uncertainty_rad", found.uncertainty_rad.into_pyarray(py))?;
    Ok(named)
}
