//! Positions of the projector's mirrors, and the ideal images sampled at them.

use std::f64::consts::TAU;

use ndarray::Array2;

use super::channel::ChannelCode;
use crate::error::{Error, Result};

/// Arrangement of the mirrors of a projector.
///
/// ```
/// use quadfringe::DmdLayout;
/// assert_eq!(DmdLayout::Diamond.pitch_um(), [10.8, 5.4]);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
#[non_exhaustive]
pub enum DmdLayout {
    /// Square grid: mirror (row, column) lies at (row, column).
    #[default]
    Regular,
    /// Diamond array: odd rows lie half a column to the right.
    Diamond,
}

impl DmdLayout {
    /// Spacing of columns and of rows in um for the 912 x 1140 array: 7.63 and 7.63, or 10.8 and 5.4 (diamond).
    #[must_use]
    pub const fn pitch_um(self) -> [f64; 2] {
        match self {
            Self::Regular => [7.63, 7.63],
            Self::Diamond => [10.8, 5.4],
        }
    }
}

/// Direction in which fringes are counted.
///
/// ```
/// use quadfringe::encoding::Axis;
/// use quadfringe::rig::Light;
/// let horizontal = Light::Fringes { number: 45.0, shift_rad: 0.0, axis: Axis::Rows };
/// assert_ne!(horizontal, Light::fringes(45.0, 0.0));
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
pub enum Axis {
    /// Vertical fringes, counted over the columns.
    #[default]
    Columns,
    /// Horizontal fringes, counted over the rows; for calibrating a projector.
    Rows,
}

/// Horizontal position, in columns, of the mirror that is stored at (row, column).
///
/// ```
/// use quadfringe::encoding::{DmdLayout, mirror_column};
/// assert_eq!(mirror_column(DmdLayout::Diamond, 3, 10), 10.5);
/// assert_eq!(mirror_column(DmdLayout::Regular, 3, 10), 10.0);
/// ```
#[must_use]
pub fn mirror_column(layout: DmdLayout, row: usize, column: usize) -> f64 {
    column as f64 + row_shift(layout, row)
}

/// Distance by which a row of mirrors is shifted to the right, in columns.
pub(crate) fn row_shift(layout: DmdLayout, row: usize) -> f64 {
    match layout {
        DmdLayout::Diamond if row % 2 == 1 => 0.5,
        _ => 0.0,
    }
}

/// Ideal image of one channel for a projector of `[width, height]` mirrors, `(height, width)`, linear light from 0 to 1
/// (S1). [`Encoding::patterns`](super::Encoding::patterns) returns the images of all channels.
///
/// ```
/// use quadfringe::encoding::{DmdLayout, Encoding, pattern};
/// let encoding = Encoding::optimum(36, 912)?;
/// let red = pattern(&encoding.channels()[0], [912, 1140], DmdLayout::Regular);
/// assert_eq!((red.dim(), red[[0, 0]]), ((1140, 912), 1.0));
/// # Ok::<(), quadfringe::error::Error>(())
/// ```
#[must_use]
pub fn pattern(channel: &ChannelCode, [width, height]: [usize; 2], layout: DmdLayout) -> Array2<f32> {
    let level = |row: usize, column: usize| {
        let phase = channel.phase_rad(mirror_column(layout, row, column), width);
        (0.5 + 0.5 * (phase + channel.shift_rad).cos()) as f32
    };
    // All even rows are equal, and all odd rows are equal.
    let kinds: Vec<Vec<f32>> =
        (0..2).map(|row| (0..width).map(|column| level(row, column)).collect()).collect();
    Array2::from_shape_fn((height, width), |(row, column)| kinds[row % 2][column])
}

/// Ideal image of one step of an N-step capture, `(height, width)`, linear light `0.5 + 0.5 cos(2 pi number u / size + shift)`
/// where `u` is the column or the row of each mirror.
///
/// # Errors
/// [`Error::Value`] when the image has no pixels or a number is not finite.
///
/// ```
/// use quadfringe::encoding::{Axis, DmdLayout, step_pattern};
/// let image = step_pattern(36.0, 0.0, Axis::Rows, [912, 1140], DmdLayout::Diamond)?;
/// assert!((image[[0, 5]], image[[1140 / 72, 5]]) > (0.99, 0.0) && image[[1140 / 72, 5]] < 0.01);
/// # Ok::<(), quadfringe::error::Error>(())
/// ```
pub fn step_pattern(
    number: f64,
    shift_rad: f64,
    axis: Axis,
    [width, height]: [usize; 2],
    layout: DmdLayout,
) -> Result<Array2<f32>> {
    if width == 0 || height == 0 || !(number.is_finite() && shift_rad.is_finite()) {
        let actual = format!("{width} x {height}, number {number}, shift {shift_rad} rad");
        return Err(Error::value("step pattern", "an image size and a finite number and shift", actual));
    }
    Ok(Array2::from_shape_fn((height, width), |(row, column)| {
        let cycles = match axis {
            Axis::Columns => mirror_column(layout, row, column) / width as f64,
            Axis::Rows => row as f64 / height as f64,
        };
        (0.5 + 0.5 * (TAU * number * cycles + shift_rad).cos()) as f32
    }))
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::encoding::Encoding;

    #[test]
    fn diamond_rows_are_shifted() {
        let encoding = Encoding::optimum(36, 912).expect("valid");
        let [_, _, blue, _] = encoding.channels() else { panic!("four channels") };
        let image = pattern(blue, [912, 4], DmdLayout::Diamond);
        let expected = 0.5 + 0.5 * (encoding.absolute_phase_rad(7.5) + PI / 2.0).cos();
        assert!((f64::from(image[[3, 7]]) - expected).abs() < 1e-7);
        assert_eq!(image.row(0), image.row(2));
    }
}
