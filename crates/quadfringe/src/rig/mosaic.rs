//! The Bayer chip, which measures one colour at each pixel, and the bilinear interpolation by which common cameras add
//! the other two.

use ndarray::{Array2, Zip};

use crate::encoding::Channel;
use crate::optics::BayerPattern;

/// The mosaic: each pixel takes R, G or B, whichever its colour filter passes.
pub(super) fn sample(colours: &[Array2<f32>], pattern: BayerPattern) -> Array2<f32> {
    let mut raw = Array2::zeros(colours[0].dim());
    Zip::indexed(&mut raw).par_for_each(|(row, column), raw| {
        *raw = colours[pattern.channel(row, column).index()][[row, column]];
    });
    raw
}

/// R, G and B at every pixel, by the mean of the nearest samples of each colour.
pub(super) fn bilinear(raw: &Array2<f32>, pattern: BayerPattern) -> [Array2<f32>; 3] {
    [Channel::R, Channel::G, Channel::B].map(|colour| {
        let mut plane = Array2::zeros(raw.dim());
        Zip::indexed(&mut plane).par_for_each(|(row, column), out| {
            *out = interpolated(raw, pattern, colour, row, column);
        });
        plane
    })
}

/// The pixel if it has this colour, else the weighted mean of its neighbours of this colour. Diagonal neighbours have
/// half the weight of the others.
fn interpolated(raw: &Array2<f32>, pattern: BayerPattern, colour: Channel, row: usize, column: usize) -> f32 {
    if pattern.channel(row, column) == colour {
        return raw[[row, column]];
    }
    let (rows, columns) = raw.dim();
    let (mut sum, mut total) = (0.0, 0.0);
    for r in row.saturating_sub(1)..(row + 2).min(rows) {
        for c in column.saturating_sub(1)..(column + 2).min(columns) {
            if pattern.channel(r, c) == colour {
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
    fn a_linear_image_comes_back_in_every_pattern() {
        for pattern in BayerPattern::ALL {
            let ramp =
                |scale: f32| Array2::from_shape_fn((9, 10), |(r, c)| scale * (r as f32 + 2.0 * c as f32));
            let expected = [ramp(1.0), ramp(2.0), ramp(-1.0)];
            let colours = bilinear(&sample(&expected, pattern), pattern);
            for (got, expected) in colours.iter().zip(&expected) {
                for r in 1..8 {
                    for c in 1..9 {
                        assert!((got[[r, c]] - expected[[r, c]]).abs() < 1e-4, "{pattern:?}");
                    }
                }
            }
        }
    }
}
