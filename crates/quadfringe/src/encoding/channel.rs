//! One channel of an encoding, and the projector that shows it.

use std::f64::consts::TAU;

/// One of the two projectors.
///
/// ```
/// use quadfringe::encoding::{Channel, Projector};
/// assert_eq!(Channel::Ir.projector(), Projector::Infrared);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Projector {
    /// The visible light projector, P1.
    Visible,
    /// The infrared light projector, P2.
    Infrared,
}

impl Projector {
    /// Both projectors, in the order of arrays with one entry for each projector.
    pub const ALL: [Self; 2] = [Self::Visible, Self::Infrared];

    /// Index in arrays with one entry for each projector.
    #[must_use]
    pub const fn index(self) -> usize {
        self as usize
    }
}

/// The fringes of one channel.
///
/// ```
/// use quadfringe::encoding::{ChannelCode, Projector};
/// let green = ChannelCode::new(35.0, 0.0, Projector::Visible);
/// assert_eq!(green.phase_rad(0.0, 912), 0.0);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct ChannelCode {
    /// Number of fringes over the full projector width. It need not be an integer.
    pub fringe_number: f64,
    /// Constant that is added to the phase of the column, in rad.
    pub shift_rad: f64,
    /// The projector that shows the channel.
    pub projector: Projector,
}

impl ChannelCode {
    /// A channel with `fringe_number` fringes over the projector width, shifted by `shift_rad`.
    /// [`Encoding::new`](super::Encoding::new) checks the numbers.
    #[must_use]
    pub const fn new(fringe_number: f64, shift_rad: f64, projector: Projector) -> Self {
        Self { fringe_number, shift_rad, projector }
    }

    /// Phase in rad at a column of a projector of this width, not wrapped and without the shift of the channel (S1).
    #[must_use]
    pub fn phase_rad(&self, column_px: f64, projector_width: usize) -> f64 {
        phase_at(self.fringe_number, column_px, projector_width)
    }
}

/// Phase in rad at a projector column of fringes with this number, not wrapped (S1).
pub(super) fn phase_at(fringe_number: f64, column_px: f64, projector_width: usize) -> f64 {
    TAU * fringe_number * column_px / projector_width as f64
}
