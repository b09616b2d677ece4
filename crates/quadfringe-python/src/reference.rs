//! `StepDecoder`: from the images of a reference measurement to a shape.

use crate::arrays::{borrowed, expected, value_error, wrong_array};
use crate::conditioner::ResponseNumbers;
use crate::device::Device;
use crate::memory::{Memory, Optional};
use crate::workers::{Workers, detached};
use numpy::ndarray::Ix3;
use numpy::{Element, PyReadonlyArray};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use quadfringe::Decoded;
use quadfringe::condition::Sample;
use quadfringe::height::Triangulator;
use quadfringe::reference::{Reference, ReferenceOptions, StepImages, StepSet};
use std::sync::Arc;

/// Decodes N-step images of one size at several fringe numbers. All settings are checked when it is made.
#[pyclass(frozen, module = "quadfringe._core")]
pub struct StepDecoder {
    kernel: Reference,
    workers: Workers,
    full_scale: Option<f32>,
    shape: [usize; 2],
    calibrated: bool,
    memory: Arc<Memory>,
}

#[pymethods]
impl StepDecoder {
    #[new]
    #[pyo3(signature = (shape, fringe_numbers, steps, projector_width, *, full_scale = None, modulation_min = None,
        saturation = None, response = None, columns_px = None, threads = None, camera = None, projector = None))]
    #[expect(clippy::too_many_arguments, reason = "keyword arguments of Python")]
    fn new(
        py: Python<'_>,
        shape: [usize; 2],
        fringe_numbers: Vec<f64>,
        steps: Vec<usize>,
        projector_width: usize,
        full_scale: Option<f32>,
        modulation_min: Option<f32>,
        saturation: Option<f32>,
        response: Option<ResponseNumbers>,
        columns_px: Option<[f64; 2]>,
        threads: Option<usize>,
        camera: Option<Device>,
        projector: Option<Device>,
    ) -> PyResult<Self> {
        let sets: Vec<_> = fringe_numbers
            .into_iter()
            .zip(steps)
            .map(|(number, steps)| StepSet::new(number, steps))
            .collect();
        let mut options = ReferenceOptions::default();
        options.modulation_min = modulation_min.unwrap_or(options.modulation_min);
        options.saturation = saturation.unwrap_or(options.saturation);
        options.response = response.map_or(options.response, |numbers| numbers.0);
        options.columns_px = columns_px.map(|[first, last]| first..last);
        let calibrated = camera.is_some() && projector.is_some();
        let plan = || {
            let devices = camera.zip(projector);
            let known = devices.map(|(camera, projector)| Triangulator::new(&camera.0, &projector.0));
            Reference::new(sets, projector_width, shape, options, known.transpose()?)
        };
        let kernel = detached(py, plan)?.map_err(value_error)?;
        let (workers, memory) = (Workers::start(threads)?, Arc::default());
        Ok(Self { kernel, workers, full_scale, shape, calibrated, memory })
    }

    /// The settings in use, including the kernel's defaults.
    fn settings<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let options = self.kernel.options();
        let named = PyDict::new(py);
        named.set_item("method", "reference")?;
        named.set_item("method_version", Reference::VERSION)?;
        named.set_item("modulation_min", options.modulation_min)?;
        named.set_item("saturation", options.saturation)?;
        named.set_item(
            "columns_px",
            options.columns_px.as_ref().map(|columns| [columns.start, columns.end]),
        )?;
        Ok(named)
    }

    /// Decode one stack (steps, H, W) for each fringe number into maps by name, float32.
    fn decode<'py>(&self, py: Python<'py>, stacks: Vec<Bound<'py, PyAny>>) -> PyResult<Bound<'py, PyDict>> {
        let Some(first) = stacks.first() else {
            return Err(value_error(StepImages::<u8>::new(Vec::new()).expect_err("no stack")));
        };
        let decoded = if borrowed::<u8, 3>(first)?.is_some() {
            self.run::<u8>(py, &stacks)
        } else if borrowed::<u16, 3>(first)?.is_some() {
            self.run::<u16>(py, &stacks)
        } else if borrowed::<f32, 3>(first)?.is_some() {
            self.run::<f32>(py, &stacks)
        } else {
            Err(wrong_array("stack 0", "a 3D uint8, uint16 or float32 array (steps, H, W)", first))
        }?;
        self.memory.named(py, decoded)
    }
}

impl StepDecoder {
    fn run<T: Sample + Element>(&self, py: Python<'_>, stacks: &[Bound<'_, PyAny>]) -> PyResult<Decoded> {
        let named = stacks.iter().enumerate();
        let borrowed: PyResult<Vec<PyReadonlyArray<'_, T, Ix3>>> =
            named.map(|(k, stack)| expected::<T, 3>(&format!("stack {k}"), stack)).collect();
        let borrowed = borrowed?;
        let views = borrowed.iter().map(PyReadonlyArray::as_array).collect();
        let pool = self.workers.in_use()?;
        let work = || {
            let images = StepImages::new(views)?;
            let images = match self.full_scale {
                Some(full_scale) => images.with_full_scale(full_scale)?,
                None => images,
            };
            let mut maps = self.memory.maps(self.shape, Optional { points: self.calibrated, albedo: false });
            self.kernel.decode_into(&images, &mut maps).map(|()| maps)
        };
        let decoded = py.detach(|| match pool {
            Some(pool) => pool.install(work),
            None => work(),
        });
        decoded.map_err(value_error)
    }
}
