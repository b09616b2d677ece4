//! The decoding method, and the thresholds that both methods have.

use super::method::Method;
use super::params::{MODULATION_MIN, PERIOD_MIN_PX, QUALITY_MIN};
use crate::error::{Error, Limit, Result};

/// The options of decoding. This is the only place that defines their defaults.
///
/// ```
/// use quadfringe::Options;
/// let options = Options::default().with_modulation_min(0.01).with_period_px(20.0);
/// assert_eq!((options.modulation_min, options.quality_min), (Some(0.01), 0.15));
/// ```
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Options {
    /// The method, with the options that only it has. Default: joint.
    pub method: Method,
    /// Least modulation of R and B that counts as light, as a fraction of full scale. `None`: by the joint method the noise of
    /// the shot, so that dark surfaces count where the noise allows it; by the published one 0.02. Default: `None`.
    pub modulation_min: Option<f32>,
    /// Least quality of a fringe order that is returned, in [0, 1]. A higher value removes more wrong orders, and
    /// correct points with them. Default: 0.15.
    pub quality_min: f32,
    /// Fringe period across the fringes in camera pixels, from 3 to the longer side of the image, good to a third; `None`
    /// estimates it from every shot. Set it if the estimate fails, for example for an object narrower than two fringes.
    /// Default: `None`.
    pub period_px: Option<f64>,
    /// Shortest and longest fringe period across the fringes in camera pixels, within the limits of [`Self::period_px`], which
    /// takes its place if both are set. An estimate outside is replaced by the geometric mean of both. Default: `None`.
    pub period_range_px: Option<[f64; 2]>,
    /// Whether the joint method gives the albedo. Without it, a decode takes less time. Default: true.
    pub albedo: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            method: Method::default(),
            modulation_min: None,
            quality_min: QUALITY_MIN,
            period_px: None,
            period_range_px: None,
            albedo: true,
        }
    }
}

impl Options {
    /// These options with this method.
    #[must_use]
    pub fn with_method(mut self, method: impl Into<Method>) -> Self {
        self.method = method.into();
        self
    }

    /// These options with this least modulation.
    #[must_use]
    pub const fn with_modulation_min(mut self, modulation_min: f32) -> Self {
        self.modulation_min = Some(modulation_min);
        self
    }

    /// These options with this least quality.
    #[must_use]
    pub const fn with_quality_min(mut self, quality_min: f32) -> Self {
        self.quality_min = quality_min;
        self
    }

    /// These options with this fringe period in camera pixels.
    #[must_use]
    pub const fn with_period_px(mut self, period_px: f64) -> Self {
        self.period_px = Some(period_px);
        self
    }

    /// These options with this shortest and longest fringe period in camera pixels.
    #[must_use]
    pub const fn with_period_range_px(mut self, period_range_px: [f64; 2]) -> Self {
        self.period_range_px = Some(period_range_px);
        self
    }

    /// The fringe period in camera pixels that the options state, or else the one that is `estimated` within their range.
    pub(crate) fn period_px_or(&self, estimated: impl FnOnce() -> f64) -> f64 {
        self.period_px.unwrap_or_else(|| match (estimated(), self.period_range_px) {
            (outside, Some([shortest, longest])) if !(shortest..=longest).contains(&outside) => {
                (shortest * longest).sqrt()
            }
            (found, _) => found,
        })
    }

    /// These options with or without the albedo.
    #[must_use]
    pub const fn with_albedo(mut self, albedo: bool) -> Self {
        self.albedo = albedo;
        self
    }

    /// The least modulation that counts as light; `None` if the noise of each shot decides.
    #[must_use]
    pub const fn modulation_min_in_use(&self) -> Option<f32> {
        match (self.modulation_min, &self.method) {
            (None, Method::Published(_)) => Some(MODULATION_MIN),
            (given, _) => given,
        }
    }

    /// Whether decoded shots have the albedo, which only the joint method gives.
    #[must_use]
    pub const fn gives_albedo(&self) -> bool {
        self.albedo && matches!(&self.method, Method::Joint(_))
    }

    /// Instants of the channels; `None` if they are not set or the method does not have them.
    #[must_use]
    pub const fn channel_instants_us(&self) -> Option<[f32; 4]> {
        match &self.method {
            Method::Joint(joint) => joint.channel_instants_us,
            Method::Published(_) => None,
        }
    }

    /// The choice between detail and noise; `None` if the method does not have it.
    #[must_use]
    pub const fn detail(&self) -> Option<f32> {
        match &self.method {
            Method::Joint(joint) => Some(joint.detail),
            Method::Published(_) => None,
        }
    }

    /// Whether the infrared phase is that of a calibrated pair along the camera rays.
    #[must_use]
    pub const fn searches_along_rays(&self) -> bool {
        match &self.method {
            Method::Joint(joint) => joint.along_rays.is_some(),
            Method::Published(published) => published.along_rays.is_some(),
        }
    }

    /// Checks the options for images of `shape` (rows, columns).
    pub(super) fn check(&self, shape: [usize; 2]) -> Result<()> {
        let modulation_min = self.modulation_min.map(|value| ("modulation_min", value));
        for (name, value) in modulation_min.into_iter().chain([("quality_min", self.quality_min)]) {
            if !(0.0..1.0).contains(&value) {
                return Err(Error::value(name, Limit::Fraction, value));
            }
        }
        let longest = shape[0].max(shape[1]) as f64;
        for period in self.period_px.into_iter().chain(self.period_range_px.into_iter().flatten()) {
            if !(PERIOD_MIN_PX..=longest).contains(&period) {
                let expected = Limit::Range { from: PERIOD_MIN_PX, to: longest };
                return Err(Error::value("period_px (camera pixels)", expected, period));
            }
        }
        if let Some([shortest, longest]) =
            self.period_range_px.filter(|[shortest, longest]| shortest > longest)
        {
            return Err(Error::value(
                "longest period_range_px (camera pixels)",
                Limit::AtLeast(shortest),
                longest,
            ));
        }
        self.method.check(shape)
    }
}
