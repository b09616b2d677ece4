//! THE RECIPE: the images of one exposure -> absolute phase -> millimetres, steps in order.
//!
//! ```text
//! condition   dark, response, Bayer mosaic, crosstalk, registration                    (S1)
//! demodulate  R and B by two-step phase shifting                                       (S2)
//!             G and IR against them: local fit (joint) or Fourier filter (published)    (S3)
//! unwrap      orders with support (joint) or the ladder, point by point (published)     (S4)
//!             or along the camera ray, when both projectors are calibrated
//! height      camera ray and projector column -> X, Y, Z                               (S7)
//! ```

pub(crate) mod options;
pub(crate) mod output;

pub use options::{Method, Options};
pub use output::{Decoded, aligned_zeros};

use crate::condition::{Plan, Sample};
use crate::height::{PairTable, Triangulator};
use crate::joint::Joint;
use crate::published::Published;
use crate::{Conditioner, Error, FringeCode, Result, Shot};
use output::Finish;

/// Decodes shots of one size and one code: planned once, run many times.
///
/// ```
/// use ndarray::Array2;
/// use quadfringe::{Channel, Conditioner, Decoder, FringeCode, Options, Shot, encoding};
/// // A camera that sees the projector's columns one to one.
/// let code = FringeCode::optimum(16, 400)?;
/// let image = |c| encoding::pattern(&code, c, 64, encoding::DmdLayout::Regular);
/// let planes = Channel::ALL.map(image);
/// let mut decoder = Decoder::new(code, [64, 400], &Conditioner::default(), Options::default())?;
/// let decoded = decoder.decode(&Shot::new(planes.each_ref().map(|p| p.view()))?)?;
/// assert!((decoded.column_px[[32, 150]] - 150.0).abs() < 0.05);
/// # Ok::<(), quadfringe::Error>(())
/// ```
pub struct Decoder {
    code: FringeCode,
    shape: [usize; 2],
    plan: Plan,
    options: Options,
    engine: Engine,
    triangulator: Option<Triangulator>,
}

enum Engine {
    Published(Box<Published>),
    Joint(Box<Joint>),
}

impl Decoder {
    /// Plan for images of `shape` (rows, columns).
    ///
    /// # Errors
    /// [`Error::Shape`] for images smaller than 16 x 16; [`Error::Value`] for a conditioner or options out of range.
    pub fn new(
        code: FringeCode,
        shape: [usize; 2],
        conditioner: &Conditioner,
        options: Options,
    ) -> Result<Self> {
        if shape[0] < 16 || shape[1] < 16 {
            return Err(Error::shape("decoder", &[16, 16], &shape));
        }
        options.check()?;
        let engine = match options.method {
            Method::Published => Engine::Published(Box::new(Published::new(&code, shape))),
            Method::Joint => Engine::Joint(Box::new(Joint::new(&code, shape))),
        };
        Ok(Self { code, shape, plan: conditioner.plan()?, options, engine, triangulator: None })
    }

    /// Go on to millimetres with a calibrated camera and projector.
    ///
    /// # Errors
    /// [`Error::Shape`] when the triangulator was made for another size of image.
    pub fn triangulate_with(mut self, triangulator: Triangulator) -> Result<Self> {
        let (rows, columns) = triangulator.shape();
        if [rows, columns] != self.shape {
            return Err(Error::shape("calibrated camera", &self.shape, &[rows, columns]));
        }
        self.triangulator = Some(triangulator);
        Ok(self)
    }

    /// Choose fringe orders along the camera ray with both projectors calibrated: each candidate order is a depth, at
    /// which the infrared projector lights the ray with a phase that is known. Without this the infrared light is taken as
    /// coaxial with the visible.
    ///
    /// # Errors
    /// [`Error::Shape`] when the table was made for another size of image; [`Error::Value`] for a method other than
    /// [`Method::Published`].
    pub fn unwrap_along_rays(mut self, table: PairTable) -> Result<Self> {
        let (rows, columns) = table.shape();
        if [rows, columns] != self.shape {
            return Err(Error::shape("calibrated camera", &self.shape, &[rows, columns]));
        }
        match &mut self.engine {
            Engine::Published(engine) => engine.unwrap_along_rays(table),
            Engine::Joint(_) => {
                let expected =
                    "published, the one that can search along the camera rays of a calibrated pair";
                return Err(Error::value("method", expected, "joint"));
            }
        }
        Ok(self)
    }

    /// The code that is decoded.
    #[must_use]
    pub fn code(&self) -> &FringeCode {
        &self.code
    }

    /// The options in force.
    #[must_use]
    pub fn options(&self) -> &Options {
        &self.options
    }

    /// Whether orders are searched along the camera rays of a calibrated pair.
    #[must_use]
    pub fn searches_rays(&self) -> bool {
        matches!(&self.engine, Engine::Published(engine) if engine.searches_rays())
    }

    /// Decode one shot.
    ///
    /// # Errors
    /// As [`Self::decode_into`].
    pub fn decode<T: Sample>(&mut self, shot: &Shot<'_, T>) -> Result<Decoded> {
        let mut decoded = Decoded::new(self.shape, self.triangulator.is_some());
        self.decode_into(shot, &mut decoded)?;
        Ok(decoded)
    }

    /// Decode one shot into maps made by an earlier call; every pixel is written, NaN where nothing can be trusted.
    ///
    /// # Errors
    /// [`Error::Shape`] when the shot or the maps have another size than the decoder.
    pub fn decode_into<T: Sample>(&mut self, shot: &Shot<'_, T>, out: &mut Decoded) -> Result<()> {
        if shot.shape() != self.shape {
            return Err(Error::shape("shot", &self.shape, &shot.shape()));
        }
        out.check(self.shape, self.triangulator.is_some())?;
        self.plan.prepare(shot);
        let finish = Finish { code: &self.code, triangulator: self.triangulator.as_ref() };
        let Self { plan, options, engine, .. } = self;
        // One way into the pool of threads; from outside every stage would have to wake them.
        rayon::scope(|_| match engine {
            Engine::Published(engine) => engine.run(plan, shot, options, &finish, out),
            Engine::Joint(engine) => engine.run(plan, shot, options, &finish, out),
        });
        Ok(())
    }
}
