//! `Decoder`: one call from four images to a shape.

use crate::arrays::{BAYER_IMAGES, CHANNELS, Images, value_error, views};
use crate::device::{Device, unknown};
use crate::memory::Memory;
use crate::pair::pair_of;
use ndarray::{Ix2, Ix3};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use quadfringe::condition::Sample;
use quadfringe::height::{PairTable, Triangulator};
use quadfringe::{BayerPattern, Conditioner, Decoded, FringeCode, Method, Options, Response, Shot};
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::sync::{Arc, Mutex, PoisonError};

/// Offset, exponent and knee of the four channels.
pub type Responses = [(f32, f32, f32); 4];

/// Decodes shots of one size; planned and checked when made.
#[pyclass(frozen, module = "quadfringe._core")]
pub struct Decoder {
    kernel: Mutex<quadfringe::Decoder>,
    pool: Option<ThreadPool>,
    full_scale: Option<f32>,
    shape: [usize; 2],
    calibrated: bool,
    memory: Arc<Memory>,
}

#[pymethods]
impl Decoder {
    #[new]
    #[pyo3(signature = (shape, fringe_numbers, projector_width, *, full_scale = None, method = None,
        modulation_min = None, quality_min = None, period_px = None, channel_instants_us = None, threads = None, dark = None, response = None,
        crosstalk = None, projector_response = None, ir_registration = None, camera = None, projector = None, infrared = None,
        predeformed_z_mm = None, depth_range_mm = None))]
    #[expect(clippy::too_many_arguments, reason = "keyword arguments of Python")]
    fn new(
        py: Python<'_>,
        shape: [usize; 2],
        fringe_numbers: [f64; 3],
        projector_width: usize,
        full_scale: Option<f32>,
        method: Option<&str>,
        modulation_min: Option<f32>,
        quality_min: Option<f32>,
        period_px: Option<f64>,
        channel_instants_us: Option<[f32; 4]>,
        threads: Option<usize>,
        dark: Option<[f32; 4]>,
        response: Option<Responses>,
        crosstalk: Option<[[f64; 4]; 4]>,
        projector_response: Option<Responses>,
        ir_registration: Option<[[f64; 3]; 2]>,
        camera: Option<Device>,
        projector: Option<Device>,
        infrared: Option<Device>,
        predeformed_z_mm: Option<f64>,
        depth_range_mm: Option<[f64; 2]>,
    ) -> PyResult<Self> {
        let code = FringeCode::new(fringe_numbers, projector_width).map_err(value_error)?;
        let plain = Options::default();
        let options = Options {
            method: method.map_or(Ok(plain.method), method_named)?,
            modulation_min: modulation_min.unwrap_or(plain.modulation_min),
            quality_min: quality_min.unwrap_or(plain.quality_min),
            period_px: period_px.or(plain.period_px),
            channel_instants_us: channel_instants_us.or(plain.channel_instants_us),
        };
        let conditioner = conditioner_of(dark, response, crosstalk, projector_response, ir_registration);
        let kernel = py.detach(|| {
            let decoder = quadfringe::Decoder::new(code.clone(), shape, &conditioner, options)?;
            let (Some(camera), Some(projector)) = (&camera, &projector) else {
                return Ok(decoder);
            };
            let decoder = decoder.triangulate_with(Triangulator::new(&camera.0, &projector.0)?)?;
            let Some(infrared) = &infrared else { return Ok(decoder) };
            let pair = pair_of(projector, infrared, predeformed_z_mm)?;
            decoder.unwrap_along_rays(PairTable::new(&camera.0, &pair, &code, depth_range_mm)?)
        });
        Ok(Self {
            kernel: Mutex::new(kernel.map_err(value_error)?),
            pool: threads.map(pool_of).transpose()?,
            full_scale,
            shape,
            calibrated: camera.is_some() && projector.is_some(),
            memory: Arc::default(),
        })
    }

    /// The settings in force, the kernel's defaults included.
    fn settings<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let kernel = self.kernel.lock().unwrap_or_else(PoisonError::into_inner);
        let options = kernel.options();
        let named = PyDict::new(py);
        named.set_item("method", name_of(options.method))?;
        named.set_item("modulation_min", options.modulation_min)?;
        named.set_item("quality_min", options.quality_min)?;
        named.set_item("period_px", options.period_px)?;
        named.set_item("channel_instants_us", options.channel_instants_us)?;
        named.set_item("unwrapping", if kernel.searches_rays() { "pair" } else { "coaxial" })?;
        Ok(named)
    }

    /// Maps by name, float32.
    fn decode<'py>(
        &self,
        py: Python<'py>,
        red: &Bound<'py, PyAny>,
        green: &Bound<'py, PyAny>,
        blue: &Bound<'py, PyAny>,
        ir: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let decoded = match &Images::borrow(CHANNELS, [red, green, blue, ir])? {
            Images::U8(four) => self.run(py, views(four), Shot::new),
            Images::U16(four) => self.run(py, views(four), Shot::new),
            Images::F32(four) => self.run(py, views(four), Shot::new),
        }?;
        self.maps_by_name(py, decoded)
    }

    /// The same from the raw mosaic of a Bayer chip and an infrared image.
    fn decode_bayer<'py>(
        &self,
        py: Python<'py>,
        raw: &Bound<'py, PyAny>,
        bayer: &str,
        ir: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let pattern = BayerPattern::from_name(bayer).map_err(value_error)?;
        let decoded = match &Images::borrow(BAYER_IMAGES, [raw, ir])? {
            Images::U8(two) => self.run(py, views(two), |[raw, ir]| Shot::bayer(raw, pattern, ir)),
            Images::U16(two) => self.run(py, views(two), |[raw, ir]| Shot::bayer(raw, pattern, ir)),
            Images::F32(two) => self.run(py, views(two), |[raw, ir]| Shot::bayer(raw, pattern, ir)),
        }?;
        self.maps_by_name(py, decoded)
    }
}

impl Decoder {
    fn run<'a, T: Sample, I: Send>(
        &self,
        py: Python<'_>,
        images: I,
        shot: impl FnOnce(I) -> quadfringe::Result<Shot<'a, T>> + Send,
    ) -> PyResult<Decoded> {
        let decoded = py.detach(|| {
            // A panic in an earlier shot leaves nothing behind that the next one does not write again. A thread of the pool must
            // not wait for the lock: while a shot is decoded it may take up the next one.
            let kernel = &mut *self.kernel.lock().unwrap_or_else(PoisonError::into_inner);
            let work = || {
                let shot = scaled(shot(images)?, self.full_scale)?;
                let mut maps = self.maps();
                kernel.decode_into(&shot, &mut maps).map(|()| maps)
            };
            match &self.pool {
                Some(pool) => pool.install(work),
                None => work(),
            }
        });
        decoded.map_err(value_error)
    }

    /// Maps for the kernel to fill.
    fn maps(&self) -> Decoded {
        let [rows, columns] = self.shape;
        let map = || self.memory.take(Ix2(rows, columns));
        Decoded {
            phase_rad: map(),
            column_px: map(),
            modulation: map(),
            quality: map(),
            wrong_order_probability: map(),
            uncertainty_rad: (!self.calibrated).then(map),
            uncertainty_mm: self.calibrated.then(map),
            xyz_mm: self.calibrated.then(|| self.memory.take(Ix3(rows, columns, 3))),
        }
    }

    fn maps_by_name<'py>(&self, py: Python<'py>, decoded: Decoded) -> PyResult<Bound<'py, PyDict>> {
        let named = PyDict::new(py);
        named.set_item("phase_rad", self.memory.lend(py, decoded.phase_rad)?)?;
        named.set_item("column_px", self.memory.lend(py, decoded.column_px)?)?;
        named.set_item("modulation", self.memory.lend(py, decoded.modulation)?)?;
        named.set_item("quality", self.memory.lend(py, decoded.quality)?)?;
        named.set_item("wrong_order_probability", self.memory.lend(py, decoded.wrong_order_probability)?)?;
        let uncertain =
            [("uncertainty_rad", decoded.uncertainty_rad), ("uncertainty_mm", decoded.uncertainty_mm)];
        for (name, map) in uncertain {
            if let Some(map) = map {
                named.set_item(name, self.memory.lend(py, map)?)?;
            }
        }
        if let Some(xyz_mm) = decoded.xyz_mm {
            named.set_item("xyz_mm", self.memory.lend(py, xyz_mm)?)?;
        }
        Ok(named)
    }
}

/// The shot with its white, where that is not the greatest value of the type.
pub fn scaled<T: Sample>(shot: Shot<'_, T>, full_scale: Option<f32>) -> quadfringe::Result<Shot<'_, T>> {
    match full_scale {
        Some(full_scale) => shot.with_full_scale(full_scale),
        None => Ok(shot),
    }
}

/// What is known about the intensities; what is absent is ideal.
pub fn conditioner_of(
    dark: Option<[f32; 4]>,
    response: Option<Responses>,
    crosstalk: Option<[[f64; 4]; 4]>,
    projector_response: Option<Responses>,
    ir_registration: Option<[[f64; 3]; 2]>,
) -> Conditioner {
    let ideal = Conditioner::default();
    Conditioner {
        dark: dark.unwrap_or(ideal.dark),
        response: response.map_or(ideal.response, |four| four.map(response_of)),
        crosstalk: crosstalk.unwrap_or(ideal.crosstalk),
        projector_response: projector_response.map_or(ideal.projector_response, |four| four.map(response_of)),
        ir_registration: ir_registration.unwrap_or(ideal.ir_registration),
    }
}

fn response_of((offset, exponent, knee): (f32, f32, f32)) -> Response {
    Response { offset, exponent, knee }
}

fn name_of(method: Method) -> &'static str {
    match method {
        Method::Published => "published",
        Method::Joint => "joint",
    }
}

fn method_named(name: &str) -> PyResult<Method> {
    match name {
        "published" => Ok(Method::Published),
        // Files and settings written before the method had this name say "best".
        "joint" | "best" => Ok(Method::Joint),
        _ => Err(unknown("method", name, "published or joint")),
    }
}

fn pool_of(threads: usize) -> PyResult<ThreadPool> {
    let built = ThreadPoolBuilder::new().num_threads(threads).build();
    built.map_err(|error| PyValueError::new_err(format!("threads: {threads} cannot be started: {error}")))
}
