//! Weights with which every place counts by whether it shows fringes, and not by its brightness (J39).
//!
//! A few bright objects can hold most of the power of the fringes while most of the frame is dim. They are narrow and often tilted, so
//! their period need not be that of the frame. In a tile the difference R - B holds fringes and noise. Fringes change little from a
//! pixel to the next, and the noise of a pixel tells nothing of the next one, so the covariance `v` of neighbours is the variance of
//! the fringes. With the variance `s` of the difference, `1 / sqrt(v)` makes the fringes of all tiles equally strong, and `v / s` is the
//! gain of the Wiener filter; their product is the weight. Without noise the faintest shade would count as much as fringes, so a share
//! of the mean variance of all tiles counts as noise.

use super::params::{EVEN_TILE_PX, EVEN_TILE_STEP, FAINT_SHARE, TILE_CORRELATION_MIN};
use ndarray::ArrayView2;
use rayon::prelude::*;

/// Weights of the tiles of a frame.
pub(super) struct EvenWeights {
    weights: Vec<f32>,
    /// Number of tiles in a row of tiles.
    across: usize,
    /// Share of the tiles that show fringes.
    pub shown: f64,
}

impl EvenWeights {
    /// The weights of a frame of R and B, in linear light of equal shapes.
    pub fn of(red: ArrayView2<'_, f32>, blue: ArrayView2<'_, f32>) -> Self {
        let (height, width) = red.dim();
        let [down, across] = [height, width].map(|length| length.div_ceil(EVEN_TILE_PX));
        let tiles = (0..down * across).into_par_iter();
        let tiles =
            tiles.map(|n| Tile::of(red, blue, [n / across, n % across].map(|tile| tile * EVEN_TILE_PX)));
        let tiles: Vec<Tile> = tiles.collect();
        let count = tiles.len().max(1) as f32;
        let faint = FAINT_SHARE * tiles.iter().map(|tile| tile.variance).sum::<f32>() / count;
        let shown = |tile: &&Tile| tile.shared > TILE_CORRELATION_MIN * (tile.variance + faint);
        Self {
            shown: tiles.iter().filter(shown).count() as f64 / f64::from(count),
            weights: tiles.iter().map(|tile| tile.weight(faint)).collect(),
            across,
        }
    }

    /// Weight of the pixel in row `y` and column `x`.
    pub fn at(&self, y: usize, x: usize) -> f32 {
        self.weights[y / EVEN_TILE_PX * self.across + x / EVEN_TILE_PX]
    }
}

/// Second moments of R - B in a tile.
struct Tile {
    variance: f32,
    /// Covariance of neighbours along the direction in which it is greater; at least 0.
    shared: f32,
}

impl Tile {
    fn of(red: ArrayView2<'_, f32>, blue: ArrayView2<'_, f32>, [top, left]: [usize; 2]) -> Self {
        let (height, width) = red.dim();
        // The last row and the last column have no next pixel.
        let [bottom, right] =
            [[top, height], [left, width]].map(|[at, end]| (at + EVEN_TILE_PX).min(end - 1));
        let difference = |y: usize, x: usize| red[[y, x]] - blue[[y, x]];
        let (mut count, mut mean, mut square) = (0.0f32, 0.0, 0.0);
        let (mut next_means, mut products) = ([0.0; 2], [0.0; 2]);
        for y in (top..bottom).step_by(EVEN_TILE_STEP) {
            for x in (left..right).step_by(EVEN_TILE_STEP) {
                let (here, next) = (difference(y, x), [difference(y, x + 1), difference(y + 1, x)]);
                if !(here + next[0] + next[1]).is_finite() {
                    continue;
                }
                count += 1.0;
                mean += here;
                square += here * here;
                for k in 0..2 {
                    next_means[k] += next[k];
                    products[k] += here * next[k];
                }
            }
        }
        let mean_of = |sum: f32| sum / count.max(1.0);
        let covariance = |k: usize| mean_of(products[k]) - mean_of(mean) * mean_of(next_means[k]);
        let variance = (mean_of(square) - mean_of(mean).powi(2)).max(0.0);
        Self { variance, shared: covariance(0).max(covariance(1)).clamp(0.0, variance) }
    }

    /// Weight of the pixels of the tile; light with the variance `faint` counts as noise.
    fn weight(&self, faint: f32) -> f32 {
        if self.shared > 0.0 { self.shared.sqrt() / (self.variance + faint) } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::Array2;
    use rand_distr::{Distribution, StandardNormal};
    use rand_pcg::{Pcg64Mcg, rand_core::SeedableRng};
    use std::f32::consts::TAU;

    #[test]
    fn bright_and_dim_fringes_count_alike_and_noise_hardly() {
        const AMPLITUDES: [f32; 3] = [0.4, 0.04, 0.0];
        let mut random = Pcg64Mcg::seed_from_u64(3);
        let mut image = |shift: f32| {
            Array2::from_shape_fn((96, 288), |(_, x)| {
                let noise: f32 = StandardNormal.sample(&mut random);
                AMPLITUDES[x / 96] * (TAU * x as f32 / 20.0 + shift).cos() + 0.004 * noise
            })
        };
        let (red, blue) = (image(0.0), image(TAU / 4.0));
        let found = EvenWeights::of(red.view(), blue.view());
        assert!((found.shown - 2.0 / 3.0).abs() < 1e-6, "{}", found.shown);
        let [bright, dim, dark] = [40, 136, 232].map(|x| found.at(40, x));
        let even = dim * AMPLITUDES[1] / (bright * AMPLITUDES[0]);
        assert!((0.8..1.1).contains(&even), "{even}");
        assert!(0.004 * dark < 0.3 * bright * AMPLITUDES[0], "{dark} {bright}");
    }

    #[test]
    fn a_frame_without_neighbours_or_without_light_shows_no_fringes() {
        for shape in [(1, 1), (1, 40), (40, 1), (40, 40)] {
            let image = Array2::from_elem(shape, f32::NAN);
            let found = EvenWeights::of(image.view(), image.view());
            assert_eq!((found.shown, found.at(shape.0 - 1, shape.1 - 1)), (0.0, 0.0));
        }
    }
}
