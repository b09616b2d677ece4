//! What is projected: fringe numbers, phase shifts, channels and the ideal pattern images.
//!
//! A channel `c` shows `0.5 + 0.5 cos(2 pi N_c u / W + delta_c)` over the projector columns `u` (S1), in linear light:
//! `R` and `B` share the first fringe number and are in quadrature, `G` has the second number, `Ir` the third.

use std::f64::consts::{PI, TAU};

use crate::error::{Error, Result};

mod layout;

pub(crate) use layout::row_shift;
pub use layout::{Axis, DmdLayout, mirror_column, pattern, step_pattern};

/// Least distance in phase space (rad) between two columns for them to be told apart.
const MARGIN_NEEDED_RAD: f64 = 0.3;

/// One of the four channels of a shot, in the order of every four-channel array: R, G, B, IR.
///
/// ```
/// use quadfringe::encoding::Channel;
/// assert_eq!(Channel::ALL.map(Channel::phase_index), [0, 1, 0, 2]);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Channel {
    /// Red, visible projector: first fringe number, shift 0.
    R,
    /// Green, visible projector: second fringe number, shift 0.
    G,
    /// Blue, visible projector: first fringe number, shift +pi/2.
    B,
    /// Infrared, infrared projector: third fringe number, shift 0.
    Ir,
}

impl Channel {
    /// The channels in array order.
    pub const ALL: [Self; 4] = [Self::R, Self::G, Self::B, Self::Ir];

    /// Place in four-channel arrays: R 0, G 1, B 2, IR 3.
    #[must_use]
    pub const fn index(self) -> usize {
        self as usize
    }

    /// Place of the channel's fringe number: 0 for R and B, 1 for G, 2 for IR.
    #[must_use]
    pub const fn phase_index(self) -> usize {
        match self {
            Self::R | Self::B => 0,
            Self::G => 1,
            Self::Ir => 2,
        }
    }

    /// The channel's name in messages and files: R, G, B, IR.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::R => "R",
            Self::G => "G",
            Self::B => "B",
            Self::Ir => "IR",
        }
    }

    /// Phase shift in rad: pi/2 for B, else 0.
    #[must_use]
    pub const fn shift_rad(self) -> f64 {
        match self {
            Self::B => PI / 2.0,
            _ => 0.0,
        }
    }
}

/// Fringe numbers over the full projector width, proven to give every column its own triple of phases.
///
/// ```
/// use quadfringe::encoding::FringeCode;
/// let code = FringeCode::optimum(36, 912)?;
/// assert_eq!(code.numbers(), [36.0, 35.0, 30.0]);
/// assert!(FringeCode::new([16.0, 8.0, 4.0], 912).is_err());
/// # Ok::<(), quadfringe::error::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct FringeCode {
    numbers: [f64; 3],
    projector_width: usize,
}

impl FringeCode {
    /// Code from three fringe numbers (whole or not) over `projector_width` columns: R and B, G, IR.
    ///
    /// # Errors
    /// [`Error::Value`] when a number is not finite, not positive, or not below half the width (a fringe needs more than
    /// two columns); [`Error::JointRange`] when two columns of the field have nearly the same three phases.
    pub fn new(numbers: [f64; 3], projector_width: usize) -> Result<Self> {
        if projector_width < 2 {
            return Err(Error::value("projector_width (columns)", "at least 2", projector_width));
        }
        let limit = projector_width as f64 / 2.0;
        for number in numbers {
            if !(number.is_finite() && number > 0.0 && number < limit) {
                let expected = format!("a number above 0 and below {limit} (half the projector width)");
                return Err(Error::value("fringe number", expected, number));
            }
        }
        let code = Self { numbers, projector_width };
        let (margin_rad, distance_px) = code.closest_columns();
        if margin_rad < MARGIN_NEEDED_RAD {
            return Err(Error::JointRange {
                numbers,
                width: projector_width,
                first_px: 0.0,
                second_px: distance_px,
                margin_rad,
                needed_rad: MARGIN_NEEDED_RAD,
            });
        }
        Ok(code)
    }

    /// The optimum three-frequency code `N`, `N - 1`, `N - sqrt(N)` (S4): the beats number 1 and `sqrt(N)` fringes.
    ///
    /// # Errors
    /// [`Error::Value`] when `n` is not a perfect square of at least 4, or does not fit the width; [`Error::JointRange`]
    /// when `n` is so large that neighbouring beats can no longer be told apart.
    pub fn optimum(n: u32, projector_width: usize) -> Result<Self> {
        let root = n.isqrt();
        if n < 4 || root * root != n {
            let expected = "a perfect square of at least 4, such as 16, 25 or 36";
            return Err(Error::value("optimum fringe number", expected, n));
        }
        let numbers = [n, n - 1, n - root].map(f64::from);
        Self::new(numbers, projector_width)
    }

    /// Fringe numbers over the full width: of R and B, of G, of IR.
    #[must_use]
    pub const fn numbers(&self) -> [f64; 3] {
        self.numbers
    }

    /// Number of projector columns that the fringe numbers refer to.
    #[must_use]
    pub const fn projector_width(&self) -> usize {
        self.projector_width
    }

    /// Fringe period in projector columns.
    ///
    /// # Panics
    /// When `phase_index` is not 0, 1 or 2.
    #[must_use]
    pub fn period_px(&self, phase_index: usize) -> f64 {
        self.projector_width as f64 / self.numbers[phase_index]
    }

    /// Number of fringe orders of the first fringe number that the field can hold.
    #[must_use]
    pub fn orders(&self) -> usize {
        self.numbers[0].ceil() as usize
    }

    /// Least distance in phase space (rad) between two columns of the field that share the first phase: how far the
    /// second and third phases may stray before a fringe order is mistaken. At most `pi sqrt(2)`.
    #[must_use]
    pub fn ambiguity_margin_rad(&self) -> f64 {
        self.closest_columns().0
    }

    /// Margin in rad, and the column distance at which it occurs. Two columns share the first phase when a whole number
    /// of first periods lies between them.
    fn closest_columns(&self) -> (f64, f64) {
        let width = self.projector_width as f64;
        let period = self.period_px(0);
        let mut closest = (PI * 2f64.sqrt(), width);
        for k in 1.. {
            let distance = f64::from(k) * period;
            if distance >= width * (1.0 - 1e-12) {
                break;
            }
            let apart = |index: usize| wrapped(TAU * self.numbers[index] * distance / width);
            let margin = apart(1).hypot(apart(2));
            if margin < closest.0 {
                closest = (margin, distance);
            }
        }
        closest
    }
}

/// Angle brought to `[-pi, pi]`.
fn wrapped(angle_rad: f64) -> f64 {
    angle_rad - TAU * (angle_rad / TAU).round()
}

/// Phase in rad, not wrapped and without the channel's shift, at a projector column (S1).
///
/// # Panics
/// When `phase_index` is not 0, 1 or 2.
///
/// ```
/// use quadfringe::encoding::{FringeCode, phase_at};
/// let code = FringeCode::optimum(36, 912)?;
/// assert!((phase_at(&code, 0, 912.0 / 36.0) - std::f64::consts::TAU).abs() < 1e-12);
/// # Ok::<(), quadfringe::error::Error>(())
/// ```
#[must_use]
pub fn phase_at(code: &FringeCode, phase_index: usize, column_px: f64) -> f64 {
    TAU * code.numbers[phase_index] * column_px / code.projector_width as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn joint_range_decides() {
        let accepted = [
            ([36.0, 35.0, 30.0], 912),
            ([36.0, 35.0, 34.0], 912),
            ([1920.0 / 42.0, 1920.0 / 45.0, 40.0], 1920),
            ([45.714, 42.667, 40.0], 1920),
            ([1.0, 1.0, 1.0], 912),
        ];
        for (numbers, width) in accepted {
            assert!(FringeCode::new(numbers, width).is_ok(), "{numbers:?}");
        }
        for numbers in [[16.0, 8.0, 4.0], [30.0, 30.0, 30.0], [36.0, 34.0, 30.0], [36.0, 36.0, 36.0]] {
            let refused = FringeCode::new(numbers, 912);
            assert!(matches!(refused, Err(Error::JointRange { .. })), "{numbers:?}");
        }
        for numbers in [[f64::NAN, 35.0, 30.0], [-1.0, 35.0, 30.0], [456.0, 35.0, 30.0], [0.0, 1.0, 2.0]] {
            let refused = FringeCode::new(numbers, 912);
            assert!(matches!(refused, Err(Error::Value { .. })), "{numbers:?}");
        }
    }

    #[test]
    fn margins_of_known_codes() {
        let optimum = FringeCode::optimum(36, 912).expect("valid code");
        assert!((optimum.ambiguity_margin_rad() - TAU / 6.0).abs() < 1e-9);
        let captured = FringeCode::new([45.714, 42.667, 40.0], 1920).expect("valid code");
        assert!((captured.ambiguity_margin_rad() - 0.42).abs() < 0.05);
        assert!(FringeCode::optimum(35, 912).is_err());
        assert!(FringeCode::optimum(0, 912).is_err());
    }
}
