//! Options of a rendered shot, from keyword arguments.

use crate::arrays::{borrowed, value_error};
use crate::device::unknown;
use numpy::PyArrayMethods;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use quadfringe::BayerPattern;
use quadfringe::rig::{Albedo, BitDepth, Demosaic, RenderOptions};

/// The kernel's defaults, replaced by the given options.
pub fn render_options(given: Option<&Bound<'_, PyDict>>) -> PyResult<RenderOptions> {
    let mut options = RenderOptions::default();
    let mut patch_mm = None;
    for (name, value) in given.into_iter().flatten() {
        let name: String = name.extract()?;
        match name.as_str() {
            "albedo" => options.albedo = albedo(&value)?,
            "patch_mm" => patch_mm = Some(value.extract()?),
            "ambient" => options.ambient = value.extract()?,
            "shading" => options.shading = value.extract()?,
            "projector_exponent" => options.projector_exponent = value.extract()?,
            "crosstalk" => options.crosstalk = value.extract()?,
            "gain" => options.gain = value.extract()?,
            "blur_px" => options.blur_px = value.extract()?,
            "noise" => options.noise = value.extract()?,
            "camera_offset" => options.camera_offset = value.extract()?,
            "camera_exponent" => options.camera_exponent = value.extract()?,
            "bayer" => {
                options.bayer = Some(BayerPattern::from_name(value.extract()?).map_err(value_error)?);
            }
            "demosaic" => options.demosaic = Some(demosaic_named(value.extract()?)?),
            "bit_depth" => options.bit_depth = BitDepth::from_bits(value.extract()?).map_err(value_error)?,
            "seed" => options.seed = value.extract()?,
            _ => {
                return Err(PyTypeError::new_err(format!("render: {name:?} is not an option")));
            }
        }
    }
    if let (Some(side_mm), Albedo::Uniform(albedo)) = (patch_mm, &options.albedo) {
        options.albedo = Albedo::Patches { side_mm, albedo: *albedo };
    }
    Ok(options)
}

/// One albedo for each channel, or an image of them.
fn albedo(value: &Bound<'_, PyAny>) -> PyResult<Albedo> {
    if let Some(image) = borrowed::<f32, 3>(value)? {
        return Ok(Albedo::Image(image.to_owned_array()));
    }
    Ok(Albedo::Uniform(value.extract()?))
}

fn demosaic_named(name: &str) -> PyResult<Demosaic> {
    match name {
        "bilinear" => Ok(Demosaic::Bilinear),
        _ => Err(unknown("demosaic", name, "bilinear")),
    }
}
