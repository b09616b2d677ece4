//! The Bayer chip: one colour at each pixel, the others interpolated.

use ndarray::{Array2, Axis, Zip};
use rayon::prelude::*;

use super::BayerOrder;

impl BayerOrder {
    /// Colour (0 R, 1 G, 2 B) of a pixel.
    const fn colour(self, row: usize, column: usize) -> usize {
        let (odd_row, odd_column) = match self {
            Self::Rggb => (0, 0),
            Self::Grbg => (0, 1),
            Self::Gbrg => (1, 0),
            Self::Bggr => (1, 1),
        };
        (row + odd_row) % 2 + (column + odd_column) % 2
    }
}

/// Replaces R, G and B by what is interpolated from the pixels of their own colour.
pub(super) fn sample_and_interpolate(colours: &mut [Array2<f32>], order: BayerOrder) {
    let mut raw = Array2::zeros(colours[0].dim());
    Zip::indexed(&mut raw).par_for_each(|(row, column), raw| {
        *raw = colours[order.colour(row, column)][[row, column]];
    });
    for (colour, plane) in colours.iter_mut().enumerate() {
        plane.axis_iter_mut(Axis(0)).into_par_iter().enumerate().for_each(|(row, mut line)| {
            for (column, out) in line.iter_mut().enumerate() {
                *out = interpolated(&raw, order, colour, row, column);
            }
        });
    }
}

/// The pixel itself, or the mean of the neighbours of that colour, those across a corner at half weight.
fn interpolated(raw: &Array2<f32>, order: BayerOrder, colour: usize, row: usize, column: usize) -> f32 {
    if order.colour(row, column) == colour {
        return raw[[row, column]];
    }
    let (rows, columns) = raw.dim();
    let (mut sum, mut total) = (0.0, 0.0);
    for r in row.saturating_sub(1)..(row + 2).min(rows) {
        for c in column.saturating_sub(1)..(column + 2).min(columns) {
            if order.colour(r, c) == colour {
                let weight = if r == row || c == column { 1.0 } else { 0.5 };
                sum += weight * raw[[r, c]];
                total += weight;
            }
        }
    }
    if total > 0.0 { sum / total } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_linear_image_comes_back_in_every_order() {
        for order in [BayerOrder::Rggb, BayerOrder::Bggr, BayerOrder::Grbg, BayerOrder::Gbrg] {
            let ramp =
                |scale: f32| Array2::from_shape_fn((9, 10), |(r, c)| scale * (r as f32 + 2.0 * c as f32));
            let mut colours = [ramp(1.0), ramp(2.0), ramp(-1.0)];
            let expected = colours.clone();
            sample_and_interpolate(&mut colours, order);
            for (got, expected) in colours.iter().zip(&expected) {
                for r in 1..8 {
                    for c in 1..9 {
                        assert!((got[[r, c]] - expected[[r, c]]).abs() < 1e-4, "{order:?}");
                    }
                }
            }
        }
    }
}
