//! The plan of a decoder from keyword arguments. An absent argument takes the kernel's default.

use crate::device::Device;
use crate::pair::pair_of;
use pyo3::FromPyObject;
use quadfringe::height::{PairTable, Triangulator};
use quadfringe::{Decoder, DecoderBuilder, Method, Options, Result};

/// A fringe period in camera pixels, or the shortest and the longest one.
#[derive(Clone, Copy, FromPyObject)]
pub enum Period {
    Known(f64),
    Range([f64; 2]),
}

/// The method and its thresholds.
pub struct Choices<'a> {
    pub method: Option<&'a str>,
    pub modulation_min: Option<f32>,
    pub quality_min: Option<f32>,
    pub period_px: Option<Period>,
    pub channel_instants_us: Option<[f32; 4]>,
    pub albedo: Option<bool>,
    pub detail: Option<f32>,
}

/// Calibrated devices.
pub struct Geometry {
    pub camera: Option<Device>,
    pub projector: Option<Device>,
    pub infrared: Option<Device>,
    pub predeformed_z_mm: Option<f64>,
    pub depth_range_mm: Option<[f64; 2]>,
}

impl Geometry {
    /// Camera and visible projector, when both are known.
    pub fn devices(&self) -> Option<(&Device, &Device)> {
        self.camera.as_ref().zip(self.projector.as_ref())
    }
}

/// Add choices and devices to a builder, and make the decoder.
pub fn planned(builder: DecoderBuilder, choices: &Choices<'_>, geometry: &Geometry) -> Result<Decoder> {
    let mut method = choices.method.map_or(Ok(Method::default()), Method::from_name)?;
    if let Some(instants) = choices.channel_instants_us {
        method = method.with_channel_instants_us(instants)?;
    }
    if let Some(detail) = choices.detail {
        method = method.with_detail(detail)?;
    }
    if let (Some((camera, projector)), Some(infrared)) = (geometry.devices(), &geometry.infrared) {
        let pair = pair_of(projector, infrared, geometry.predeformed_z_mm)?;
        let table = PairTable::new(&camera.0, &pair, builder.encoding(), geometry.depth_range_mm)?;
        method = method.with_along_rays(table);
    }
    let mut options = Options::default().with_method(method);
    options.modulation_min = choices.modulation_min;
    options.quality_min = choices.quality_min.unwrap_or(options.quality_min);
    match choices.period_px {
        Some(Period::Known(period_px)) => options.period_px = Some(period_px),
        Some(Period::Range(range_px)) => options.period_range_px = Some(range_px),
        None => {}
    }
    options.albedo = choices.albedo.unwrap_or(options.albedo);
    let builder = builder.options(options);
    match geometry.devices() {
        Some((camera, projector)) => {
            builder.triangulator(Triangulator::new(&camera.0, &projector.0)?).build()
        }
        None => builder.build(),
    }
}
