//! Decoding of one shot through the whole inverse half: the images of one exposure -> absolute phase -> millimetres.
//!
//! ```text
//! condition   dark level, response, Bayer mosaic, crosstalk, registration               (S1)
//! demodulate  R and B by two-step phase shifting                                        (S2)
//!             G and IR: with R and B in one local fit (joint), by Fourier (published)   (S3)
//! unwrap      fringe orders from neighbourhoods (joint) or pixel by pixel (published)   (S4)
//!             or along the camera ray, when both projectors are calibrated and not coaxial
//! height      camera ray and projector column -> X, Y, Z                                (S7)
//! ```
//!
//! [`Decoder::builder`] plans and checks everything once; [`Decoder::decode`] then runs for every shot. The modules of the
//! two methods, `joint` and `published`, contain the steps.

mod builder;
pub(crate) mod method;
pub(crate) mod options;
pub(crate) mod output;
pub(crate) mod params;
pub(crate) mod reason;

pub use builder::DecoderBuilder;
pub use method::{JointOptions, Method, PublishedOptions};
pub use options::Options;
pub use output::Decoded;
pub use reason::Reason;

use crate::condition::{Known, Of, Plan, Sample, Shot};
use crate::encoding::{Encoding, FourChannel};
use crate::error::{Error, Result};
use crate::height::Triangulator;
use crate::joint::Joint;
use crate::published::Published;
use output::{Finish, Wanted};
use std::marker::PhantomData;

/// Decodes shots of one size and one encoding. A decoder is planned once and used for many shots. Results are
/// bit-identical for any number of threads.
///
/// ```
/// use quadfringe::{Decoder, DmdLayout, Encoding, Shot};
/// // A camera that sees the projector's columns one to one.
/// let encoding = Encoding::optimum(16, 400)?;
/// let images = encoding.patterns(64, DmdLayout::Regular);
/// let mut decoder = Decoder::builder(&encoding, [64, 400]).build()?;
/// let decoded = decoder.decode(&Shot::try_from(images.as_slice())?)?;
/// assert!((decoded.column_px[[32, 150]] - 150.0).abs() < 0.05);
/// # Ok::<(), quadfringe::Error>(())
/// ```
pub struct Decoder {
    encoding: Encoding,
    four: FourChannel,
    shape: [usize; 2],
    plan: Plan,
    options: Options,
    engine: Engine,
    triangulator: Option<Triangulator>,
}

enum Engine {
    Joint(Box<Joint>),
    Published(Box<Published>),
}

/// A borrowed shot of any type of intensities.
struct OfShot<'shot, 'image>(PhantomData<&'shot &'image ()>);

impl<'shot, 'image> Of for OfShot<'shot, 'image> {
    type Type<T: 'static> = &'shot Shot<'image, T>;
}

impl Decoder {
    /// The encoding that this decoder decodes.
    #[must_use]
    pub const fn encoding(&self) -> &Encoding {
        &self.encoding
    }

    /// Size of the images, (rows, columns).
    #[must_use]
    pub const fn shape(&self) -> [usize; 2] {
        self.shape
    }

    /// All options, including those that have their default.
    #[must_use]
    pub const fn options(&self) -> &Options {
        &self.options
    }

    /// Decodes one shot.
    ///
    /// # Errors
    /// As [`Self::decode_into`].
    pub fn decode<T: Sample>(&mut self, shot: &Shot<'_, T>) -> Result<Decoded> {
        let mut decoded = Decoded::default();
        self.decode_into(shot, &mut decoded)?;
        Ok(decoded)
    }

    /// Decodes one shot into the maps of an earlier shot, without allocating memory. Every pixel is written, with NaN for
    /// no data. Maps of another size, such as the empty maps of [`Decoded::default`], are replaced by new ones.
    ///
    /// ```
    /// use quadfringe::{Decoded, Decoder, DmdLayout, Encoding, Shot};
    /// let encoding = Encoding::optimum(16, 400)?;
    /// let images = encoding.patterns(64, DmdLayout::Regular);
    /// let mut decoder = Decoder::builder(&encoding, [64, 400]).build()?;
    /// let mut decoded = Decoded::default();
    /// for _ in 0..3 {
    ///     decoder.decode_into(&Shot::try_from(images.as_slice())?, &mut decoded)?;
    /// }
    /// assert_eq!(decoded.phase_rad.dim(), (64, 400));
    /// # Ok::<(), quadfringe::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Error::Shape`] when the shot does not have the size that the decoder was planned for; [`Error::Value`] when it has
    /// no infrared image although the encoding has that channel, or the reverse, and when an intensity is more than 10 000
    /// times full scale.
    pub fn decode_into<T: Sample>(&mut self, shot: &Shot<'_, T>, out: &mut Decoded) -> Result<()> {
        self.decode_known(T::known(shot), out)
    }

    fn decode_known(&mut self, shot: Known<OfShot<'_, '_>>, out: &mut Decoded) -> Result<()> {
        match shot {
            Known::U8(shot) => self.decode_samples(shot, out),
            Known::U16(shot) => self.decode_samples(shot, out),
            Known::F32(shot) => self.decode_samples(shot, out),
        }
    }

    fn decode_samples<T: Sample>(&mut self, shot: &Shot<'_, T>, out: &mut Decoded) -> Result<()> {
        if shot.shape() != self.shape {
            return Err(Error::shape("shot", &self.shape, &shot.shape()));
        }
        shot.check_channels(&self.four)?;
        shot.check_light()?;
        out.fit(
            self.shape,
            Wanted { points: self.triangulator.is_some(), albedo: self.options.gives_albedo() },
        );
        self.plan.prepare(shot);
        let finish = Finish {
            period_px: self.four.period_px(),
            columns_px: self.four.columns_px,
            triangulator: self.triangulator.as_ref(),
        };
        let Self { plan, options, engine, .. } = self;
        // Enters the thread pool once. Otherwise every parallel stage would enter it from outside and have to wake its
        // threads.
        rayon::scope(|_| match engine {
            Engine::Joint(engine) => engine.run(plan, shot, options, &finish, out),
            Engine::Published(engine) => engine.run(plan, shot, options, &finish, out),
        });
        Ok(())
    }
}
