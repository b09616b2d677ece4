//! Everything that can be wrong with an input; the doc comment of a variant is the message that the user reads.

use displaydoc::Display;

/// Result of every fallible call of this crate.
pub type Result<T> = std::result::Result<T, Error>;

/// What was expected, what came, and what to do.
#[derive(Debug, Clone, PartialEq, Display)]
#[non_exhaustive]
pub enum Error {
    /// {what}: expected {expected} (rows, columns), got {actual}; every image of a shot must have the size that the decoder was made for
    Shape {
        /// The array at fault.
        what: String,
        /// The size asked for.
        expected: String,
        /// The size received.
        actual: String,
    },
    /// {name}: expected {expected}, got {actual}
    Value {
        /// The parameter at fault, with its unit.
        name: String,
        /// The range or form asked for.
        expected: String,
        /// What came.
        actual: String,
    },
    /// fringe numbers {numbers:?} cannot number the fringes of {width} columns: columns {first_px:.1} and {second_px:.1} look alike (phases {margin_rad:.3} rad apart, {needed_rad} needed); choose numbers whose joint range covers the field, such as 36, 35, 30
    JointRange {
        /// The fringe numbers asked for.
        numbers: [f64; 3],
        /// Columns of the projector.
        width: usize,
        /// One column of the confused pair.
        first_px: f64,
        /// The other column.
        second_px: f64,
        /// Distance of the two in phase space.
        margin_rad: f64,
        /// The least distance that is accepted.
        needed_rad: f64,
    },
    /// {what} contains {count} values that are not finite (first at row {row}, column {column}); give finite intensities
    NotFinite {
        /// The array at fault.
        what: String,
        /// How many.
        count: usize,
        /// Row of the first.
        row: usize,
        /// Column of the first.
        column: usize,
    },
}

impl std::error::Error for Error {}

impl Error {
    /// A parameter outside its range, named with what was expected and what came.
    pub(crate) fn value(
        name: impl Into<String>,
        expected: impl Into<String>,
        actual: impl std::fmt::Display,
    ) -> Self {
        Self::Value { name: name.into(), expected: expected.into(), actual: actual.to_string() }
    }

    /// An array of the wrong size.
    pub(crate) fn shape(what: impl Into<String>, expected: &[usize], actual: &[usize]) -> Self {
        Self::Shape { what: what.into(), expected: format!("{expected:?}"), actual: format!("{actual:?}") }
    }
}
