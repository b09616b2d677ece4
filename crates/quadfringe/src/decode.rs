//! THE RECIPE: the images of one exposure -> absolute phase -> millimetres, steps in order.
//!
//! ```text
//! condition   dark, response, Bayer mosaic, crosstalk, registration                    (S1)
//! demodulate  R and B by two-step phase shifting                                       (S2)
//!             G and IR against them: local fit (best) or Fourier filter (published)    (S3)
//! unwrap      orders with support (best) or the ladder, point by point (published)     (S4)
//!             or along the camera ray, when both projectors are calibrated
//! height      camera ray and projector column -> X, Y, Z                               (S7)
//! ```

mod best;
mod expand;
mod guide;
mod judge;
mod level;
mod orders;
mod output;
mod published;
mod uncertainty;

pub use output::{Decoded, aligned_zeros};

use crate::condition::{Plan, Sample};
use crate::height::{PairTable, Triangulator};
use crate::{Conditioner, Error, FringeCode, Result, Shot};
use best::Best;
use level::Level;
use output::Finish;
use published::Published;

/// Which way a shot is decoded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Method {
    /// As published: mean envelope, two-step, improved Fourier filter along rows, ladder point by point. Needs fringes
    /// across the rows.
    Published,
    /// Local fit of all channels in any fringe direction, noise-aware phase, orders with spatial support.
    #[default]
    Best,
}

/// What a user may choose; the defaults live here and nowhere else.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// The way of decoding.
    pub method: Method,
    /// Least modulation of R and B that counts as light, as a fraction of full scale.
    pub modulation_min: f32,
    /// Least quality of an order that is trusted, in [0, 1].
    pub quality_min: f32,
    /// Fringe period in camera pixels; `None` estimates it from every shot.
    pub period_px: Option<f64>,
    /// Instants at which R, G, B and IR are seen (the middle of each exposure), in us from the instant that the result is to
    /// stand for; `None` when all see the same. A projector that shows its colours one after another needs them when the
    /// surface moves. [`Method::Best`] alone can do this.
    pub channel_instants_us: Option<[f32; 4]>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            method: Method::default(),
            modulation_min: 0.02,
            quality_min: 0.15,
            period_px: None,
            channel_instants_us: None,
        }
    }
}

impl Options {
    fn check(&self) -> Result<()> {
        let fractions = [("modulation_min", self.modulation_min), ("quality_min", self.quality_min)];
        for (name, value) in fractions {
            if !(0.0..1.0).contains(&value) {
                return Err(Error::value(name, "a fraction in [0, 1)", value));
            }
        }
        self.channel_instants_us.map_or(Ok(()), |instants| check_instants(instants, self.method))?;
        match self.period_px {
            Some(period) if !(period.is_finite() && period >= 3.0) => {
                Err(Error::value("period_px", "at least 3 camera pixels", period))
            }
            _ => Ok(()),
        }
    }
}

fn check_instants(instants: [f32; 4], method: Method) -> Result<()> {
    let expected = match method {
        Method::Published => "none with the published method, which cannot undo motion; take the best one",
        Method::Best if instants.iter().any(|t| !t.is_finite()) => "finite times",
        Method::Best if instants.iter().all(|t| *t == instants[0]) => "times that differ, or none",
        Method::Best => return Ok(()),
    };
    Err(Error::value("channel_instants_us", expected, format!("{instants:?}")))
}

/// Decodes shots of one size and one code: planned once, run many times.
///
/// ```
/// use ndarray::Array2;
/// use quadfringe::{Channel, Conditioner, Decoder, FringeCode, Options, Shot, fringe};
/// // A camera that sees the projector's columns one to one.
/// let code = FringeCode::optimum(16, 400)?;
/// let image = |c| fringe::pattern(&code, c, 64, fringe::DmdLayout::Regular);
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
    Best(Box<Best>),
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
            Method::Best => Engine::Best(Box::new(Best::new(&code, shape))),
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
            Engine::Best(_) => {
                let expected =
                    "published, the one that can search along the camera rays of a calibrated pair";
                return Err(Error::value("method", expected, "best"));
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
            Engine::Best(engine) => engine.run(plan, shot, options, &finish, out),
        });
        Ok(())
    }
}
