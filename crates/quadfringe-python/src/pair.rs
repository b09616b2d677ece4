//! The calibrated pair of projectors: `predeform`, `PairTable`.

use crate::arrays::{expected, value_error};
use crate::device::{Device, layout_named};
use crate::workers::detached;
use numpy::{IntoPyArray, PyArray2, PyReadonlyArray2};
use pyo3::prelude::*;
use quadfringe::Encoding;
use quadfringe::height;
use quadfringe::optics::ProjectorPair;
use quadfringe::rig::{Bench, Light};
use quadfringe::stages::Phases;

type Map<'py> = Bound<'py, PyArray2<f32>>;

/// The kernel's pair.
pub fn pair_of(
    visible: &Device,
    infrared: &Device,
    predeformed_z_mm: Option<f64>,
) -> quadfringe::Result<ProjectorPair> {
    let pair = ProjectorPair::new(visible.0.clone(), infrared.0.clone());
    predeformed_z_mm.map_or(Ok(pair.clone()), |z_mm| pair.predeformed(z_mm))
}

/// Infrared image that puts the fringes on a plane where the visible projector would put them, (height, width) float32.
#[pyfunction]
#[pyo3(signature = (visible, infrared, fringe_number, *, z_mm, layout = "regular"))]
pub fn predeform<'py>(
    py: Python<'py>,
    visible: Device,
    infrared: Device,
    fringe_number: f64,
    z_mm: f64,
    layout: &str,
) -> PyResult<Map<'py>> {
    let reference = Bench::reference_with(layout_named(layout)?);
    let bench = Bench { visible: visible.0, infrared: infrared.0, ..reference };
    let light = Light::fringes(fringe_number, 0.0);
    let image = detached(py, || bench.predeform(&light, z_mm))?.map_err(value_error)?;
    Ok(image.into_pyarray(py))
}

/// The infrared phase along every camera ray.
#[pyclass(frozen, module = "quadfringe._core")]
pub struct PairTable(height::PairTable);

#[pymethods]
impl PairTable {
    #[new]
    #[pyo3(signature = (camera, visible, infrared, fringe_numbers, *, predeformed_z_mm = None,
        depth_range_mm = None))]
    fn new(
        py: Python<'_>,
        camera: Device,
        visible: Device,
        infrared: Device,
        fringe_numbers: [f64; 3],
        predeformed_z_mm: Option<f64>,
        depth_range_mm: Option<[f64; 2]>,
    ) -> PyResult<Self> {
        let plan = || {
            let encoding = Encoding::four_channel(fringe_numbers, visible.0.width)?;
            let pair = pair_of(&visible, &infrared, predeformed_z_mm)?;
            height::PairTable::new(&camera.0, &pair, &encoding, depth_range_mm)
        };
        detached(py, plan)?.map(Self).map_err(value_error)
    }

    /// The infrared phase in rad, not wrapped, at the points with this first absolute phase.
    fn infrared_rad<'py>(&self, py: Python<'py>, phase_rad: &Bound<'py, PyAny>) -> PyResult<Map<'py>> {
        let phase = expected::<f32, 2>("phase_rad", phase_rad)?;
        let view = phase.as_array();
        let found = detached(py, || self.0.infrared_rad(view))?.map_err(value_error)?;
        Ok(found.into_pyarray(py))
    }

    /// Absolute phase and margin from three wrapped phases, searched along the rays.
    #[pyo3(signature = (first, second, third, *, rows = 1))]
    fn unwrap<'py>(
        &self,
        py: Python<'py>,
        first: &Bound<'py, PyAny>,
        second: &Bound<'py, PyAny>,
        third: &Bound<'py, PyAny>,
        rows: usize,
    ) -> PyResult<(Map<'py>, Map<'py>)> {
        let map = |name: &str, object| expected::<f32, 2>(name, object);
        let maps = [map("first", first)?, map("second", second)?, map("third", third)?];
        let views = Phases::from_array(maps.each_ref().map(PyReadonlyArray2::as_array));
        let found = detached(py, || self.0.unwrap_blocks(views, rows))?.map_err(value_error)?;
        Ok((found.phase_rad.into_pyarray(py), found.margin.into_pyarray(py)))
    }
}
