//! `Decoder`: one call from four images to a shape.

use crate::arrays::{BAYER_IMAGES, CHANNELS, COLOURS, Images, RAW, value_error, views};
use crate::conditioner::{ResponseNumbers, conditioner_of, scaled};
use crate::device::{Device, FringeNumbers};
use crate::memory::{Memory, Optional};
use crate::plan::{Choices, Geometry, Period, planned};
use crate::workers::{Workers, detached, interruptible};
use numpy::ndarray::{ArrayView2, Ix2};
use numpy::{Element, PyReadonlyArray};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use quadfringe::condition::Sample;
use quadfringe::{BayerPattern, Decoded, Method, Shot};
use rayon::ThreadPool;
use std::sync::{Arc, Mutex, PoisonError};

/// Shots of so many pixels take a tenth of a second and more on two cores, so that their decoding answers to signals. This
/// costs a copy of the images, about 1 ms.
const LONG_PX: LongPx = LongPx { joint: 1 << 18, published: 1 << 23 };

struct LongPx {
    joint: usize,
    published: usize,
}

fn is_long(method: &Method, [rows, columns]: [usize; 2]) -> bool {
    let long = if matches!(method, Method::Published(_)) { LONG_PX.published } else { LONG_PX.joint };
    rows * columns >= long
}

/// Decodes shots of one size. All settings are checked when it is made.
#[pyclass(frozen, module = "quadfringe._core")]
pub struct Decoder(Arc<Inner>);

/// What a decoder shares with work that goes on after a signal.
struct Inner {
    kernel: Mutex<quadfringe::Decoder>,
    workers: Workers,
    full_scale: Option<f32>,
    shape: [usize; 2],
    calibrated: bool,
    long: bool,
    memory: Arc<Memory>,
}

#[pymethods]
impl Decoder {
    #[new]
    #[pyo3(signature = (shape, fringe_numbers, projector_width, *, columns_px = None, full_scale = None, method = None,
        modulation_min = None, quality_min = None, period_px = None, channel_instants_us = None, albedo = None, detail = None, threads = None, dark = None, response = None,
        crosstalk = None, projector_response = None, ir_registration = None, camera = None, projector = None, infrared = None,
        predeformed_z_mm = None, depth_range_mm = None))]
    #[expect(clippy::too_many_arguments, reason = "keyword arguments of Python")]
    fn new(
        py: Python<'_>,
        shape: [usize; 2],
        fringe_numbers: FringeNumbers,
        projector_width: usize,
        columns_px: Option<[f64; 2]>,
        full_scale: Option<f32>,
        method: Option<&str>,
        modulation_min: Option<f32>,
        quality_min: Option<f32>,
        period_px: Option<Period>,
        channel_instants_us: Option<[f32; 4]>,
        albedo: Option<bool>,
        detail: Option<f32>,
        threads: Option<usize>,
        dark: Option<[f32; 4]>,
        response: Option<[ResponseNumbers; 4]>,
        crosstalk: Option<[[f64; 4]; 4]>,
        projector_response: Option<[ResponseNumbers; 4]>,
        ir_registration: Option<[[f64; 3]; 2]>,
        camera: Option<Device>,
        projector: Option<Device>,
        infrared: Option<Device>,
        predeformed_z_mm: Option<f64>,
        depth_range_mm: Option<[f64; 2]>,
    ) -> PyResult<Self> {
        let conditioner = conditioner_of(dark, response, crosstalk, projector_response, ir_registration);
        let choices =
            Choices { method, modulation_min, quality_min, period_px, channel_instants_us, albedo, detail };
        let geometry = Geometry { camera, projector, infrared, predeformed_z_mm, depth_range_mm };
        let plan = || {
            let encoding = fringe_numbers.encoding(projector_width, columns_px)?;
            let builder = quadfringe::Decoder::builder(&encoding, shape).conditioner(conditioner);
            planned(builder, &choices, &geometry)
        };
        let kernel = detached(py, plan)?.map_err(value_error)?;
        let (long, calibrated) = (is_long(&kernel.options().method, shape), geometry.devices().is_some());
        let (kernel, workers, memory) = (Mutex::new(kernel), Workers::start(threads)?, Arc::default());
        Ok(Self(Arc::new(Inner { kernel, workers, full_scale, shape, calibrated, long, memory })))
    }

    /// The settings in use, including the kernel's defaults.
    fn settings<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let kernel = self.0.kernel.lock().unwrap_or_else(PoisonError::into_inner);
        let options = kernel.options();
        let named = PyDict::new(py);
        named.set_item("method", options.method.name())?;
        named.set_item("method_version", options.method.version())?;
        named.set_item("modulation_min", options.modulation_min_in_use())?;
        named.set_item("quality_min", options.quality_min)?;
        named.set_item("period_px", options.period_px)?;
        named.set_item("channel_instants_us", options.channel_instants_us())?;
        named.set_item("albedo", options.gives_albedo())?;
        named.set_item("detail", options.detail())?;
        named.set_item("unwrapping", if options.searches_along_rays() { "pair" } else { "coaxial" })?;
        Ok(named)
    }

    /// Decode a shot into maps by name, float32.
    #[pyo3(signature = (red, green, blue, ir = None))]
    fn decode<'py>(
        &self,
        py: Python<'py>,
        red: &Bound<'py, PyAny>,
        green: &Bound<'py, PyAny>,
        blue: &Bound<'py, PyAny>,
        ir: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let Some(ir) = ir else {
            let decoded = match &Images::borrow(COLOURS, [red, green, blue])? {
                Images::U8(three) => self.run(py, three, |three| Shot::rgb(three)),
                Images::U16(three) => self.run(py, three, |three| Shot::rgb(three)),
                Images::F32(three) => self.run(py, three, |three| Shot::rgb(three)),
            }?;
            return self.0.memory.named(py, decoded);
        };
        let decoded = match &Images::borrow(CHANNELS, [red, green, blue, ir])? {
            Images::U8(four) => self.run(py, four, |four| Shot::new(four)),
            Images::U16(four) => self.run(py, four, |four| Shot::new(four)),
            Images::F32(four) => self.run(py, four, |four| Shot::new(four)),
        }?;
        self.0.memory.named(py, decoded)
    }

    /// Decode the raw mosaic of a Bayer chip, and an infrared image if there is one, into maps by name.
    #[pyo3(signature = (raw, bayer, ir = None))]
    fn decode_bayer<'py>(
        &self,
        py: Python<'py>,
        raw: &Bound<'py, PyAny>,
        bayer: &str,
        ir: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let pattern = BayerPattern::from_name(bayer).map_err(value_error)?;
        let Some(ir) = ir else {
            let decoded = match &Images::borrow(RAW, [raw])? {
                Images::U8(one) => self.run(py, one, move |[raw]| Shot::bayer_rgb(raw, pattern)),
                Images::U16(one) => self.run(py, one, move |[raw]| Shot::bayer_rgb(raw, pattern)),
                Images::F32(one) => self.run(py, one, move |[raw]| Shot::bayer_rgb(raw, pattern)),
            }?;
            return self.0.memory.named(py, decoded);
        };
        let decoded = match &Images::borrow(BAYER_IMAGES, [raw, ir])? {
            Images::U8(two) => self.run(py, two, move |[raw, ir]| Shot::bayer(raw, pattern, ir)),
            Images::U16(two) => self.run(py, two, move |[raw, ir]| Shot::bayer(raw, pattern, ir)),
            Images::F32(two) => self.run(py, two, move |[raw, ir]| Shot::bayer(raw, pattern, ir)),
        }?;
        self.0.memory.named(py, decoded)
    }
}

impl Decoder {
    fn run<T: Sample + Element, const COUNT: usize>(
        &self,
        py: Python<'_>,
        images: &[PyReadonlyArray<'_, T, Ix2>; COUNT],
        shot: impl for<'a> FnOnce([ArrayView2<'a, T>; COUNT]) -> quadfringe::Result<Shot<'a, T>> + Send + 'static,
    ) -> PyResult<Decoded> {
        let pool = self.0.workers.in_use()?;
        let decoded = if self.0.long {
            let copies = images.each_ref().map(|image| image.as_array().to_owned());
            let inner = Arc::clone(&self.0);
            interruptible(py, move || {
                inner.decode(pool.as_deref(), || shot(copies.each_ref().map(|copy| copy.view())))
            })?
        } else {
            let views = views(images);
            py.detach(|| self.0.decode(pool.as_deref(), || shot(views)))
        };
        decoded.map_err(value_error)
    }
}

impl Inner {
    fn decode<'a, T: Sample>(
        &self,
        pool: Option<&ThreadPool>,
        shot: impl FnOnce() -> quadfringe::Result<Shot<'a, T>> + Send,
    ) -> quadfringe::Result<Decoded> {
        // A poisoned lock does no harm, because every shot writes all that it reads. The lock is taken outside the pool,
        // because a thread of the pool that waited for it could not work on the shot that has the lock.
        let kernel = &mut *self.kernel.lock().unwrap_or_else(PoisonError::into_inner);
        let work = || {
            let shot = scaled(shot()?, self.full_scale)?;
            let optional = Optional { points: self.calibrated, albedo: kernel.options().gives_albedo() };
            let mut maps = self.memory.maps(self.shape, optional);
            kernel.decode_into(&shot, &mut maps).map(|()| maps)
        };
        match pool {
            Some(pool) => pool.install(work),
            None => work(),
        }
    }
}
