//! How a shot is to be decoded.

use crate::{Error, Result};

/// Which way a shot is decoded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Method {
    /// As published: mean envelope, two-step, improved Fourier filter along rows, ladder point by point. Needs fringes
    /// across the rows.
    Published,
    /// Local fit of all channels in any fringe direction, noise-aware phase, orders with spatial support.
    #[default]
    Joint,
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
    /// surface moves. [`Method::Joint`] alone can do this.
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
    pub(super) fn check(&self) -> Result<()> {
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
        Method::Published => "none with the published method, which cannot undo motion; take the joint one",
        Method::Joint if instants.iter().any(|t| !t.is_finite()) => "finite times",
        Method::Joint if instants.iter().all(|t| *t == instants[0]) => "times that differ, or none",
        Method::Joint => return Ok(()),
    };
    Err(Error::value("channel_instants_us", expected, format!("{instants:?}")))
}
