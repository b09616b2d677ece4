//! The response of a channel and its inverse.

use super::params::KNEE_POWER;
use crate::{Error, Result};

/// Inverse response of one channel: captured intensity `I` (fraction of full scale, dark subtracted) to linear light,
/// `linear = max(I / (1 - knee I^20) - offset, 0) ^ exponent`.
///
/// A power law is the only curve that is the same for dark and bright patches, because it commutes with the albedo of the
/// object. The knee describes the compression of highlights just below saturation. The default is the identity.
///
/// ```
/// use quadfringe::Response;
/// let projector = Response { offset: 0.0, exponent: 1.0 / 2.2, knee: 0.0 };
/// let captured = 0.5f32.powf(2.2);
/// assert!((projector.linear(captured) - 0.5).abs() < 1e-6);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Response {
    /// Intensity of black, as a fraction of full scale, in [0, 0.5).
    pub offset: f32,
    /// Exponent of the inverse, in (0.05, 5): 1 / 2.2 for a projector of gamma 2.2.
    pub exponent: f32,
    /// Compression of highlights, in [0, 0.98]; 0 for none.
    pub knee: f32,
}

impl Default for Response {
    fn default() -> Self {
        Self { offset: 0.0, exponent: 1.0, knee: 0.0 }
    }
}

impl Response {
    /// Linear light from a captured intensity, both fractions of full scale.
    #[must_use]
    pub fn linear(&self, captured: f32) -> f32 {
        if *self == Self::default() {
            return captured;
        }
        let open = if self.knee > 0.0 {
            captured / (1.0 - self.knee * captured.clamp(0.0, 1.0).powi(KNEE_POWER))
        } else {
            captured
        };
        (open - self.offset).max(0.0).powf(self.exponent)
    }

    /// Check the range of every number.
    ///
    /// # Errors
    /// [`Error::Value`], which names the kind of response (`what`), the channel and the number.
    pub fn check(&self, what: &str, channel: &str) -> Result<()> {
        let numbers = [
            ("offset", self.offset, 0.0..0.5, "[0, 0.5)"),
            ("exponent", self.exponent, 0.05..5.0, "[0.05, 5)"),
            ("knee", self.knee, 0.0..0.9801, "[0, 0.98]"),
        ];
        for (number, value, range, expected) in numbers {
            if !range.contains(&value) {
                let name = format!("{what} {number} of {channel}");
                return Err(Error::value(name, format!("a number in {expected}"), value));
            }
        }
        Ok(())
    }
}
