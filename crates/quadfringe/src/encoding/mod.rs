//! The encoding of projector columns: channels of fringes, their ideal images, and the layout of the projector's mirrors.
//!
//! An [`Encoding`] is a list of channels over the columns `u` of a projector of width `W`. Channel `c` shows `0.5 + 0.5
//! cos(2 pi N_c u / W + delta_c)` in linear light (S1), with its fringe number `N_c` and shift `delta_c`. Channels with
//! the same projector and the same fringe number measure one phase together: two channels in quadrature by two-step
//! phase shifting, more channels by N-step phase shifting. A Fourier filter gives the phase of a single channel. An
//! encoding is valid if no two columns have the same combination of phases.

mod ambiguity;
mod channel;
mod four_channel;
mod layout;
mod params;

pub use channel::{ChannelCode, Projector};
pub use four_channel::{Channel, FourChannel};
pub(crate) use layout::row_shift;
pub use layout::{Axis, DmdLayout, mirror_column, pattern, step_pattern};

use crate::error::{Error, Limit, Result};
use ambiguity::Closest;
use ndarray::Array2;
use params::{FRINGE_NUMBER_MIN, MARGIN_NEEDED_RAD, PROJECTOR_WIDTH_MAX};
use std::f64::consts::FRAC_PI_2;

/// The channels that are projected. Every value of this type is valid: the phases of the channels distinguish all
/// projector columns.
///
/// Decoding makes the phase of the first channel absolute.
///
/// ```
/// use quadfringe::Encoding;
/// use quadfringe::encoding::{ChannelCode, Projector};
/// use std::f64::consts::FRAC_PI_2;
///
/// let encoding = Encoding::optimum(36, 912)?;
/// let channels: Vec<f64> = encoding.channels().iter().map(|channel| channel.fringe_number).collect();
/// assert_eq!(channels, [36.0, 35.0, 36.0, 30.0]);
///
/// // The same, channel by channel.
/// let visible = |number, shift_rad| ChannelCode::new(number, shift_rad, Projector::Visible);
/// let infrared = ChannelCode::new(30.0, 0.0, Projector::Infrared);
/// let list = [visible(36.0, 0.0), visible(35.0, 0.0), visible(36.0, FRAC_PI_2), infrared];
/// assert_eq!(Encoding::new(list, 912)?, encoding);
///
/// // 16, 8 and 4 fringes repeat four times over the projector.
/// assert!(Encoding::four_channel([16.0, 8.0, 4.0], 912).is_err());
/// # Ok::<(), quadfringe::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Encoding {
    channels: Vec<ChannelCode>,
    projector_width: usize,
    columns_px: [f64; 2],
}

impl Encoding {
    /// Makes an encoding from any channels over `projector_width` columns.
    ///
    /// # Errors
    /// [`Error::Value`] for an empty list, a projector of less than 2 or more than 65 536 columns, a fringe number below
    /// 0.001 or not below half the width (a fringe needs more than two columns), and a shift that is not finite;
    /// [`Error::JointRange`] when two columns of the projector have nearly the same phases.
    pub fn new(channels: impl Into<Vec<ChannelCode>>, projector_width: usize) -> Result<Self> {
        Self::within(channels, projector_width, [0.0, projector_width as f64])
    }

    /// As [`Self::new`], for scenes that only the columns from `columns_px[0]` to `columns_px[1]` light. Only these need to
    /// be distinguished, so that more fringe numbers are possible, and decoding gives no other columns.
    ///
    /// # Errors
    /// As [`Self::new`]; [`Error::Value`] also for a range that is empty or leaves the projector.
    pub fn within(
        channels: impl Into<Vec<ChannelCode>>,
        projector_width: usize,
        columns_px: [f64; 2],
    ) -> Result<Self> {
        let encoding = Self { channels: channels.into(), projector_width, columns_px };
        encoding.check_values()?;
        let closest = encoding.closest_columns();
        if closest.margin_rad < MARGIN_NEEDED_RAD {
            return Err(Error::JointRange {
                fringe_numbers: encoding.measured_numbers(),
                width_px: projector_width,
                first_px: columns_px[0],
                second_px: columns_px[0] + closest.distance_px,
                margin_rad: closest.margin_rad,
                needed_rad: MARGIN_NEEDED_RAD,
            });
        }
        Ok(encoding)
    }

    /// Makes the four channels of the paper from three fringe numbers: for R and B, for G, and for IR. R and B are in
    /// quadrature: B is shifted by `pi/2`. The visible projector shows R, G and B, the infrared one IR.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn four_channel(numbers: [f64; 3], projector_width: usize) -> Result<Self> {
        Self::four_channel_within(numbers, projector_width, [0.0, projector_width as f64])
    }

    /// As [`Self::four_channel`], for scenes that only a range of columns lights, as [`Self::within`].
    ///
    /// # Errors
    /// As [`Self::within`].
    pub fn four_channel_within(
        [quadrature, green, infrared]: [f64; 3],
        projector_width: usize,
        columns_px: [f64; 2],
    ) -> Result<Self> {
        let visible = |number, shift_rad| ChannelCode::new(number, shift_rad, Projector::Visible);
        let channels = [
            visible(quadrature, 0.0),
            visible(green, 0.0),
            visible(quadrature, FRAC_PI_2),
            ChannelCode::new(infrared, 0.0, Projector::Infrared),
        ];
        Self::within(channels, projector_width, columns_px)
    }

    /// Makes three channels for a projector without infrared, from two fringe numbers: for R and B, which are in quadrature,
    /// and for G. The beat of the two numbers `N` and `N - 1` has one fringe over the projector.
    ///
    /// ```
    /// use quadfringe::Encoding;
    /// let view = Encoding::rgb([16.0, 15.0], 912)?.four_channel_view()?;
    /// assert_eq!((view.quadrature, view.green, view.has_infrared()), (16.0, 15.0, false));
    /// # Ok::<(), quadfringe::Error>(())
    /// ```
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn rgb(numbers: [f64; 2], projector_width: usize) -> Result<Self> {
        Self::rgb_within(numbers, projector_width, [0.0, projector_width as f64])
    }

    /// As [`Self::rgb`], for scenes that only a range of columns lights, as [`Self::within`].
    ///
    /// # Errors
    /// As [`Self::within`].
    pub fn rgb_within(
        [quadrature, green]: [f64; 2],
        projector_width: usize,
        columns_px: [f64; 2],
    ) -> Result<Self> {
        let visible = |number, shift_rad| ChannelCode::new(number, shift_rad, Projector::Visible);
        let channels = [visible(quadrature, 0.0), visible(green, 0.0), visible(quadrature, FRAC_PI_2)];
        Self::within(channels, projector_width, columns_px)
    }

    /// Makes three channels for a projector without infrared, from three different fringe numbers: for R, for G and for B.
    /// None is in quadrature with another: a window along the surface gives the phase of each.
    ///
    /// ```
    /// use quadfringe::Encoding;
    /// let view = Encoding::three_colours([36.0, 35.0, 30.0], 912)?.four_channel_view()?;
    /// assert_eq!((view.numbers(), view.has_infrared()), ([36.0, 35.0, 30.0], false));
    /// # Ok::<(), quadfringe::Error>(())
    /// ```
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn three_colours(numbers: [f64; 3], projector_width: usize) -> Result<Self> {
        Self::three_colours_within(numbers, projector_width, [0.0, projector_width as f64])
    }

    /// As [`Self::three_colours`], for scenes that only a range of columns lights, as [`Self::within`].
    ///
    /// # Errors
    /// As [`Self::within`].
    pub fn three_colours_within(
        numbers: [f64; 3],
        projector_width: usize,
        columns_px: [f64; 2],
    ) -> Result<Self> {
        let channels = numbers.map(|number| ChannelCode::new(number, 0.0, Projector::Visible));
        Self::within(channels, projector_width, columns_px)
    }

    /// Makes the four channels of the paper with the optimum fringe numbers `N`, `N - 1` and `N - sqrt(N)` (S4): the
    /// beats of the first with the others have 1 and `sqrt(N)` fringes.
    ///
    /// # Errors
    /// [`Error::Value`] when `n` is not a perfect square of at least 4, or does not fit the width; [`Error::JointRange`]
    /// when `n` is so large that neighbouring fringes of the beats cannot be distinguished.
    pub fn optimum(n: u32, projector_width: usize) -> Result<Self> {
        let root = n.isqrt();
        if n < 4 || root * root != n {
            let expected = Limit::words("a perfect square of at least 4, such as 16, 25 or 36");
            return Err(Error::value("optimum fringe number", expected, n));
        }
        Self::four_channel([n, n - 1, n - root].map(f64::from), projector_width)
    }

    /// The channels in the order of the images of a shot.
    #[must_use]
    pub fn channels(&self) -> &[ChannelCode] {
        &self.channels
    }

    /// Number of projector columns that the fringe numbers refer to.
    #[must_use]
    pub const fn projector_width(&self) -> usize {
        self.projector_width
    }

    /// First and last of the columns that light the scene; the whole projector unless [`Self::within`] was given fewer.
    #[must_use]
    pub const fn columns_px(&self) -> [f64; 2] {
        self.columns_px
    }

    /// Number of projector columns in one turn of the absolute phase, which is the phase of the first channel.
    #[must_use]
    pub fn period_px(&self) -> f64 {
        self.projector_width as f64 / self.channels[0].fringe_number
    }

    /// Absolute phase in rad at a projector column, which is the phase of the first channel.
    ///
    /// ```
    /// use quadfringe::Encoding;
    /// let encoding = Encoding::optimum(36, 912)?;
    /// assert!((encoding.absolute_phase_rad(912.0 / 36.0) - std::f64::consts::TAU).abs() < 1e-12);
    /// # Ok::<(), quadfringe::Error>(())
    /// ```
    #[must_use]
    pub fn absolute_phase_rad(&self, column_px: f64) -> f64 {
        self.channels[0].phase_rad(column_px, self.projector_width)
    }

    /// The ideal images of all channels in their order, each `(height, projector width)`, linear light from 0 to 1.
    ///
    /// ```
    /// use quadfringe::{DmdLayout, Encoding};
    /// let images = Encoding::optimum(36, 912)?.patterns(1140, DmdLayout::Regular);
    /// assert_eq!((images.len(), images[3].dim(), images[3][[0, 0]]), (4, (1140, 912), 1.0));
    /// # Ok::<(), quadfringe::Error>(())
    /// ```
    #[must_use]
    pub fn patterns(&self, height: usize, layout: DmdLayout) -> Vec<Array2<f32>> {
        let size_px = [self.projector_width, height];
        self.channels.iter().map(|channel| pattern(channel, size_px, layout)).collect()
    }

    /// Ambiguity margin: least distance in phase space (rad) between two columns with the same first phase. A fringe
    /// order can be mistaken when the joint error of the other phases reaches half of it. It is at most `pi sqrt(m)` for
    /// `m` other phases.
    #[must_use]
    pub fn ambiguity_margin_rad(&self) -> f64 {
        self.closest_columns().margin_rad
    }

    fn check_values(&self) -> Result<()> {
        if self.channels.is_empty() {
            return Err(Error::value("channels of an encoding", Limit::AtLeast(1.0), 0.0));
        }
        if !(2..=PROJECTOR_WIDTH_MAX).contains(&self.projector_width) {
            let expected = Limit::Range { from: 2.0, to: PROJECTOR_WIDTH_MAX as f64 };
            return Err(Error::value("projector_width", expected, self.projector_width));
        }
        let ([from, to], width) = (self.columns_px, self.projector_width as f64);
        if !(from >= 0.0 && to > from && to <= width) {
            let expected = format!("two growing numbers from 0 to {width}, the columns of the projector");
            return Err(Error::value("columns that light the scene", expected, format!("{from} and {to}")));
        }
        let limit = width / 2.0;
        for channel in &self.channels {
            let number = channel.fringe_number;
            if !(FRINGE_NUMBER_MIN..limit).contains(&number) {
                let expected = Limit::FringeNumber { from: FRINGE_NUMBER_MIN, below: limit };
                return Err(Error::value("fringe number", expected, number));
            }
            if !channel.shift_rad.is_finite() {
                return Err(Error::value("shift_rad", Limit::Finite, channel.shift_rad));
            }
        }
        Ok(())
    }

    /// Fringe numbers of the measured phases, in order. Channels with the same projector and fringe number measure one
    /// phase.
    fn measured_numbers(&self) -> Vec<f64> {
        let mut phases: Vec<(f64, Projector)> = Vec::new();
        for channel in &self.channels {
            let phase = (channel.fringe_number, channel.projector);
            if !phases.contains(&phase) {
                phases.push(phase);
            }
        }
        phases.into_iter().map(|(number, _)| number).collect()
    }

    fn closest_columns(&self) -> Closest {
        let [from, to] = self.columns_px;
        ambiguity::closest_columns(&self.measured_numbers(), self.projector_width, to - from)
    }
}
