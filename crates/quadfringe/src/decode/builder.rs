//! Builder of a decoder.

use super::method::Method;
use super::options::Options;
use super::params::SIDE_MIN_PX;
use super::{Decoder, Engine};
use crate::condition::Conditioner;
use crate::encoding::Encoding;
use crate::error::{Error, Result};
use crate::height::Triangulator;
use crate::joint::Joint;
use crate::published::Published;

/// The plan of a [`Decoder`], made by [`Decoder::builder`]. A part that is left out takes its default.
#[derive(Debug, Clone)]
#[must_use = "a builder does nothing until `build`"]
pub struct DecoderBuilder {
    encoding: Encoding,
    shape: [usize; 2],
    conditioner: Conditioner,
    options: Options,
    triangulator: Option<Triangulator>,
}

impl Decoder {
    /// Starts the plan of a decoder for this encoding and for images of `shape` (rows, columns).
    pub fn builder(encoding: &Encoding, shape: [usize; 2]) -> DecoderBuilder {
        DecoderBuilder {
            encoding: encoding.clone(),
            shape,
            conditioner: Conditioner::default(),
            options: Options::default(),
            triangulator: None,
        }
    }
}

impl DecoderBuilder {
    /// The encoding that the decoder is for.
    #[must_use]
    pub const fn encoding(&self) -> &Encoding {
        &self.encoding
    }

    /// Sets the photometric calibration. Default: images are linear, without crosstalk, and registered.
    pub fn conditioner(mut self, conditioner: Conditioner) -> Self {
        self.conditioner = conditioner;
        self
    }

    /// Sets the method and its thresholds.
    pub fn options(mut self, options: Options) -> Self {
        self.options = options;
        self
    }

    /// Sets the calibrated camera and projector, for points in mm. Default: the decoder gives projector columns and no
    /// points.
    pub fn triangulator(mut self, triangulator: Triangulator) -> Self {
        self.triangulator = Some(triangulator);
        self
    }

    /// Checks and plans everything once.
    ///
    /// # Errors
    /// [`Error::TooSmall`] for images of less than 16 x 16 pixels; [`Error::NotFourChannel`] for an encoding that the
    /// method does not take; [`Error::Shape`] when a calibration was made for another size of image; [`Error::Value`]
    /// for an option or a number of the conditioner out of range.
    pub fn build(self) -> Result<Decoder> {
        let Self { encoding, shape, conditioner, options, triangulator } = self;
        if shape.iter().any(|side| *side < SIDE_MIN_PX) {
            return Err(Error::TooSmall { least: [SIDE_MIN_PX; 2], actual: shape });
        }
        options.check(shape)?;
        let of_camera = |triangulator: &Triangulator| <[usize; 2]>::from(triangulator.shape());
        let camera = triangulator.as_ref().map_or(shape, of_camera);
        if camera != shape {
            return Err(Error::shape("calibrated camera", &shape, &camera));
        }
        options.method.accepts(&encoding)?;
        let four = encoding.four_channel_view()?;
        let conditioner = if four.has_infrared() { conditioner } else { conditioner.without_infrared() };
        let engine = match &options.method {
            Method::Joint(joint) => {
                let mut engine = Joint::new(&four, shape);
                if let Some(table) = &joint.along_rays {
                    engine.unwrap_along_rays(table);
                }
                Engine::Joint(Box::new(engine))
            }
            Method::Published(published) => {
                let mut engine = Published::new(&four, shape);
                if let Some(table) = &published.along_rays {
                    engine.unwrap_along_rays(table.clone());
                }
                Engine::Published(Box::new(engine))
            }
        };
        Ok(Decoder { encoding, four, shape, plan: conditioner.plan()?, options, engine, triangulator })
    }
}
