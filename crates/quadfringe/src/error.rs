//! Errors of invalid input. `displaydoc` turns the doc comment of each variant into the message that the user reads.

use displaydoc::Display;
use std::borrow::Cow;
use std::fmt::{self, Formatter};

/// Result of every fallible call of this crate.
pub type Result<T> = std::result::Result<T, Error>;

/// The reason why an input cannot be used. A message gives the expected and the actual value, and what to do.
///
/// ```
/// use quadfringe::error::{Error, Limit};
/// use quadfringe::{Decoder, Encoding, Options};
/// let encoding = Encoding::optimum(36, 912)?;
/// let options = Options::default().with_modulation_min(1.5);
/// let refused = Decoder::builder(&encoding, [768, 1024]).options(options).build().map(|_| ()).unwrap_err();
/// assert_eq!(refused.to_string(), "modulation_min: expected a fraction in [0, 1), got 1.5");
/// match refused {
///     Error::Value { parameter, expected: Limit::Fraction, .. } => assert_eq!(parameter, "modulation_min"),
///     other => panic!("{other}"),
/// }
/// # Ok::<(), Error>(())
/// ```
#[derive(Debug, Clone, PartialEq, Display)]
#[non_exhaustive]
pub enum Error {
    /// {what}: expected {expected:?} (rows, columns), got {actual:?}; all arrays must have the size that the decoder or the calibration was made for
    Shape {
        /// The array at fault.
        what: Cow<'static, str>,
        /// The required shape.
        expected: Vec<usize>,
        /// The actual shape.
        actual: Vec<usize>,
    },
    /// images of {actual:?} (rows, columns) are too small to decode; give at least {least:?}
    TooSmall {
        /// The least size, (rows, columns).
        least: [usize; 2],
        /// The actual size, (rows, columns).
        actual: [usize; 2],
    },
    /// {parameter}: expected {expected}, got {actual}
    Value {
        /// The parameter at fault.
        parameter: Cow<'static, str>,
        /// The condition that it must meet.
        expected: Limit,
        /// The actual value.
        actual: Given,
    },
    /// fringe numbers {fringe_numbers:?} cannot number the fringes of {width_px} columns: columns {first_px:.1} and {second_px:.1} look alike (phases {margin_rad:.3} rad apart, {needed_rad} needed); choose numbers whose joint range covers the field, such as 36, 35, 30, or 16, 15 without infrared, or name the columns that light the scene
    JointRange {
        /// Fringe numbers of the phases that the encoding measures.
        fringe_numbers: Vec<f64>,
        /// Columns of the projector.
        width_px: usize,
        /// One of two columns with nearly the same phases.
        first_px: f64,
        /// The other column.
        second_px: f64,
        /// Distance of the two columns in phase space.
        margin_rad: f64,
        /// The least distance that is accepted.
        needed_rad: f64,
    },
    /// expected the encoding of a single shot (R, G and B from the visible projector and none or IR from the infrared one, R and B of one fringe number, B shifted by pi/2 and the others by 0; or R, G and B of three fringe numbers and no shifts), got {fault}; make it with Encoding::four_channel, Encoding::optimum, Encoding::rgb or Encoding::three_colours
    NotFourChannel {
        /// The first difference.
        fault: FourChannelFault,
    },
    /// {option} is an option of the {of} method, and the method is {method}: choose {of}, or leave the option out
    NotOfMethod {
        /// The option that was set.
        option: &'static str,
        /// The method that has it.
        of: &'static str,
        /// The method that was chosen.
        method: &'static str,
    },
    /// {what} contains {count} values that are not finite (first at row {row}, column {column}); give finite intensities
    NotFinite {
        /// The array at fault.
        what: Cow<'static, str>,
        /// Number of values that are not finite.
        count: usize,
        /// Row of the first of them.
        row: usize,
        /// Column of the first of them.
        column: usize,
    },
}

impl std::error::Error for Error {}

/// The first difference between an encoding and the four-channel encoding.
#[derive(Debug, Clone, Copy, PartialEq, Display)]
#[non_exhaustive]
pub enum FourChannelFault {
    /// {0} channels
    Count(usize),
    /// channel {channel} from the other projector
    Projector {
        /// The channel at fault.
        channel: &'static str,
    },
    /// channel {channel} shifted by {found_rad} rad
    Shift {
        /// The channel at fault.
        channel: &'static str,
        /// The shift of the encoding in rad.
        found_rad: f64,
    },
    /// {0} fringes in G and in another channel
    Alike(f64),
    /// {red} fringes in R and {blue} in B
    Quadrature {
        /// Fringe number of R.
        red: f64,
        /// Fringe number of B.
        blue: f64,
    },
}

/// The condition that a value must meet.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Limit {
    /// Finite numbers.
    Finite,
    /// A number that is finite and positive.
    Positive,
    /// A fraction in [0, 1).
    Fraction,
    /// A number that is not less than this.
    AtLeast(f64),
    /// A number in a closed range.
    Range {
        /// The least value.
        from: f64,
        /// The greatest value.
        to: f64,
    },
    /// A fringe number: measurable, and below half the projector columns, as a fringe needs more than two.
    FringeNumber {
        /// The least number.
        from: f64,
        /// Half the projector columns.
        below: f64,
    },
    /// One of these names.
    OneOf(&'static [&'static str]),
    /// Any other condition, in words.
    Words(Cow<'static, str>),
}

impl Limit {
    /// A condition in words.
    pub(crate) fn words(text: impl Into<Cow<'static, str>>) -> Self {
        Self::Words(text.into())
    }
}

impl fmt::Display for Limit {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::Finite => f.write_str("finite numbers"),
            Self::Positive => f.write_str("a positive number"),
            Self::Fraction => f.write_str("a fraction in [0, 1)"),
            Self::AtLeast(least) => write!(f, "at least {least}"),
            Self::Range { from, to } => write!(f, "a number from {from} to {to}"),
            Self::FringeNumber { from, below } => {
                write!(f, "a number from {from} to below {below} (half the projector width)")
            }
            Self::OneOf([first @ .., before, last]) => {
                first.iter().try_for_each(|name| write!(f, "{name}, "))?;
                write!(f, "{before} or {last}")
            }
            Self::OneOf(names) => f.write_str(&names.join("")),
            Self::Words(text) => f.write_str(text),
        }
    }
}

impl<T: Into<Cow<'static, str>>> From<T> for Limit {
    fn from(text: T) -> Self {
        Self::words(text)
    }
}

/// The actual value.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Given {
    /// A number.
    Number(f64),
    /// Numbers of one parameter.
    Numbers(Vec<f64>),
    /// A name or a composite value, as text.
    Text(String),
}

impl fmt::Display for Given {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(number) => number.fmt(f),
            Self::Numbers(numbers) => write!(f, "{numbers:?}"),
            Self::Text(text) => f.write_str(text),
        }
    }
}

impl From<f64> for Given {
    fn from(number: f64) -> Self {
        Self::Number(number)
    }
}

impl From<f32> for Given {
    /// Takes the shortest decimal that stands for the number, so that messages show 0.1 and not 0.10000000149.
    fn from(number: f32) -> Self {
        Self::Number(number.to_string().parse().unwrap_or(f64::from(number)))
    }
}

impl From<u32> for Given {
    fn from(number: u32) -> Self {
        Self::Number(f64::from(number))
    }
}

impl From<usize> for Given {
    fn from(number: usize) -> Self {
        Self::Number(number as f64)
    }
}

impl<T: Copy + Into<Self>> From<&T> for Given {
    fn from(number: &T) -> Self {
        (*number).into()
    }
}

impl<T: Copy + Into<Self>, const COUNT: usize> From<[T; COUNT]> for Given {
    fn from(numbers: [T; COUNT]) -> Self {
        let number = |given: T| match given.into() {
            Self::Number(number) => number,
            _ => f64::NAN,
        };
        Self::Numbers(numbers.map(number).to_vec())
    }
}

impl From<&str> for Given {
    fn from(text: &str) -> Self {
        Self::Text(text.into())
    }
}

impl From<String> for Given {
    fn from(text: String) -> Self {
        Self::Text(text)
    }
}

impl Error {
    /// Error for a parameter outside its limit.
    pub(crate) fn value(
        parameter: impl Into<Cow<'static, str>>,
        expected: impl Into<Limit>,
        actual: impl Into<Given>,
    ) -> Self {
        Self::Value { parameter: parameter.into(), expected: expected.into(), actual: actual.into() }
    }

    /// Error for an array of the wrong shape.
    pub(crate) fn shape(what: impl Into<Cow<'static, str>>, expected: &[usize], actual: &[usize]) -> Self {
        Self::Shape { what: what.into(), expected: expected.to_vec(), actual: actual.to_vec() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_name_the_parameter_the_limit_and_the_value() {
        let names = Limit::OneOf(&["rggb", "grbg", "gbrg", "bggr"]);
        assert_eq!(names.to_string(), "rggb, grbg, gbrg or bggr");
        assert_eq!(Limit::OneOf(&["bilinear"]).to_string(), "bilinear");
        let found = Error::value("dark level of G", Limit::Fraction, 0.1f32 + 1.0);
        assert_eq!(found.to_string(), "dark level of G: expected a fraction in [0, 1), got 1.1");
        let found = Error::value("instants", Limit::Finite, [0.1f32, f32::NAN]);
        assert_eq!(found.to_string(), "instants: expected finite numbers, got [0.1, NaN]");
    }
}
