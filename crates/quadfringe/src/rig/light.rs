//! The pattern that a projector shows in one channel.

use std::f64::consts::TAU;

use ndarray::ArrayView2;

use crate::encoding::{Axis, Channel, DmdLayout, Encoding, row_shift};
use crate::error::{Error, Limit, Result};
use crate::optics::Device;

use super::Projector;

/// Light of one channel before the projector's response, 0 to 1.
///
/// ```
/// use quadfringe::{Encoding, rig::Light};
/// let lights = Light::shot(&Encoding::optimum(36, 912)?)?;
/// assert_eq!(lights[1], Light::fringes(35.0, 0.0));
/// # Ok::<(), quadfringe::error::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Light<'a> {
    /// The same everywhere: 1 for white, 0 for black.
    Uniform(f64),
    /// The continuous sinusoid `0.5 + 0.5 cos(2 pi number u / size + shift)` (S1), not sampled by mirrors.
    Fringes {
        /// Fringes over the full width (or height) of the projector.
        number: f64,
        /// Shift, rad.
        shift_rad: f64,
        /// Whether the fringes are counted over columns or rows.
        axis: Axis,
    },
    /// An image of the projector's size (rows, columns), interpolated bilinearly between mirrors.
    Image(ArrayView2<'a, f32>),
}

impl Light<'_> {
    /// Vertical fringes.
    #[must_use]
    pub const fn fringes(number: f64, shift_rad: f64) -> Self {
        Self::Fringes { number, shift_rad, axis: Axis::Columns }
    }

    /// The four channels of a shot: R, G, B, IR. Without an infrared channel that projector is dark.
    ///
    /// # Errors
    /// [`Error::NotFourChannel`] for another encoding, because the camera of the bench has these four channels.
    pub fn shot(encoding: &Encoding) -> Result<[Self; 4]> {
        let four = encoding.four_channel_view()?;
        Ok(Channel::ALL.map(|channel| match channel {
            Channel::Ir if !four.has_infrared() => Self::Uniform(0.0),
            _ => Self::fringes(four.fringe_number(channel), four.shift_rad(channel)),
        }))
    }

    /// The same fringes in all four channels: one step of an N-step capture. If `projector` is given, the other
    /// projector is dark.
    ///
    /// ```
    /// use quadfringe::rig::{Axis, Projector, Light};
    /// let lights = Light::step(36.0, 0.0, Axis::Rows, Some(Projector::Infrared));
    /// assert_eq!(lights[0], Light::Uniform(0.0));
    /// ```
    #[must_use]
    pub fn step(number: f64, shift_rad: f64, axis: Axis, projector: Option<Projector>) -> [Self; 4] {
        Channel::ALL.map(|channel| match projector {
            Some(projector) if projector != channel.projector() => Self::Uniform(0.0),
            _ => Self::Fringes { number, shift_rad, axis },
        })
    }

    pub(super) fn check(&self, projector: &Device) -> Result<()> {
        match self {
            Self::Image(image) if image.dim() != (projector.height, projector.width) => {
                Err(Error::shape("pattern image", &[projector.height, projector.width], image.shape()))
            }
            Self::Uniform(level) if !(0.0..=1.0).contains(level) => {
                Err(Error::value("uniform light", Limit::Range { from: 0.0, to: 1.0 }, level))
            }
            Self::Fringes { number, shift_rad, .. } if !(number.is_finite() && shift_rad.is_finite()) => {
                let actual = format!("number {number}, shift {shift_rad} rad");
                Err(Error::value("fringes", "a finite number and shift", actual))
            }
            _ => Ok(()),
        }
    }

    /// Light that leaves the projector at (column, row).
    pub(super) fn level(&self, projector: &Device, layout: DmdLayout, at: [f64; 2]) -> f64 {
        match self {
            Self::Uniform(level) => *level,
            Self::Fringes { number, shift_rad, axis } => {
                let cycles = match axis {
                    Axis::Columns => at[0] / projector.width as f64,
                    Axis::Rows => at[1] / projector.height as f64,
                };
                0.5 + 0.5 * (TAU * number * cycles + shift_rad).cos()
            }
            Self::Image(image) => sample(image, layout, at),
        }
    }
}

/// Linear interpolation along each of the two nearest rows of mirrors, then between the rows.
fn sample(image: &ArrayView2<'_, f32>, layout: DmdLayout, [column, row]: [f64; 2]) -> f64 {
    let (rows, columns) = image.dim();
    let split = |position: f64, n: usize| {
        let held = position.clamp(0.0, (n - 1) as f64);
        let first = held as usize;
        (first, (first + 1).min(n - 1), held - first as f64)
    };
    let (upper, lower, v) = split(row, rows);
    let along = |row: usize| {
        let (left, right, u) = split(column - row_shift(layout, row), columns);
        let [a, b] = [image[[row, left]], image[[row, right]]].map(f64::from);
        a + u * (b - a)
    };
    let first = along(upper);
    first + v * (along(lower) - first)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::encoding::pattern;

    #[test]
    fn images_follow_the_continuous_fringes_in_both_layouts() {
        let encoding = Encoding::optimum(36, 912).expect("valid");
        let device = Device::pinhole(912, 20, [1500.0; 2], [455.5, 9.5]).expect("valid device");
        for layout in [DmdLayout::Regular, DmdLayout::Diamond] {
            let image = pattern(&encoding.channels()[0], [912, 20], layout);
            let (image, fringes) = (Light::Image(image.view()), Light::fringes(36.0, 0.0));
            for i in 0..500 {
                let at = [1.0 + 1.8 * f64::from(i), 0.036 * f64::from(i)];
                let level = |light: &Light<'_>| light.level(&device, layout, at);
                assert!((level(&image) - level(&fringes)).abs() < 5e-3, "{layout:?} {at:?}");
            }
        }
    }
}
