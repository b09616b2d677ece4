//! Standard deviation of the intensities, estimated from the shot itself.

use super::cells::Grid;
use super::model::{count, weights};
use super::params::illumination::{
    MODULATION_FLOOR, MODULATION_NOISES, NOISE_GROUPS, NOISE_LIMITS, NOISE_SAMPLES,
};
use super::scene::{PhaseMap, Scene};
use crate::parallel::angle::wrap;
use multiversion::multiversion;
use rayon::prelude::*;

/// Median of the absolute value of a normal deviation, in standard deviations.
const MEDIAN_OF_NORMAL: f32 = 0.6745;

/// Noise of a plane of light, from a mask that gives 0 for every variation that is only along rows or only along
/// columns (Immerkaer, Comput. Vis. Image Underst. 64, 300 (1996)); in the unit of the light.
pub(super) fn noise_of_image(red: &[f32], grid: &Grid) -> f32 {
    deviation(bends(|at| red[at], grid, NOISE_SAMPLES).map(|seen| seen.bend).collect())
}

/// Noise of a pixel from the difference of two channels, in which the texture that they share cancels; in the unit of the light.
pub(super) fn noise_of_difference([one, other]: [&[f32]; 2], grid: &Grid) -> f32 {
    let bends = bends(|at| one[at] - other[at], grid, NOISE_SAMPLES);
    deviation(bends.map(|seen| seen.bend).collect()) / std::f32::consts::SQRT_2
}

/// Least modulation that counts as light in a shot with this red image.
pub(super) fn least_modulation(red: &[f32], grid: &Grid) -> f32 {
    (MODULATION_NOISES * noise_of_image(red, grid)).max(MODULATION_FLOOR)
}

/// Variance of the noise of each channel by its light, relative to that of the whole red image. Photons make bright pixels noisier;
/// a response that is undone makes those pixels noisier where it is flat.
#[derive(Debug, Default)]
pub(super) struct NoiseByLight {
    channels: [Curve; 4],
    /// 1 for a channel with light, 0 for infrared without a projector; their sum is 1.
    weights: [f32; 4],
}

/// Relative variance of the noise by the light, in straight pieces, and constant beyond them.
#[derive(Debug, Default)]
struct Curve {
    /// Variance of the darkest light.
    dark: f32,
    pieces: Vec<Piece>,
}

#[derive(Debug)]
struct Piece {
    /// Light at which it begins.
    from: f32,
    /// Its slope less that of the one before.
    turn: f32,
}

impl NoiseByLight {
    /// Estimates the noise of four planes of light.
    pub fn measure(&mut self, light: [&[f32]; 4], grid: &Grid, ratios: [f32; 4]) {
        let whole = noise_of_image(light[0], grid).powi(2);
        self.weights = weights(ratios).map(|weight| weight / count(ratios));
        let channels = self.channels.par_iter_mut().zip(light);
        channels.for_each(|(curve, plane)| *curve = Curve::of(plane, grid, whole));
    }

    /// Mean relative variance of the channels for the light of each pixel of a row.
    pub fn row(&self, light: [&[f32]; 4], out: &mut Vec<f32>) {
        out.clear();
        out.resize(light[0].len(), 0.0);
        for ((curve, weight), light) in self.channels.iter().zip(self.weights).zip(light) {
            curve.add(weight, light, out);
        }
    }
}

impl Curve {
    /// The noise of groups of pixels of similar light, interpolated.
    fn of(plane: &[f32], grid: &Grid, whole: f32) -> Self {
        let mut seen: Vec<Seen> = bends(|at| plane[at], grid, NOISE_SAMPLES / 4).collect();
        if seen.len() < NOISE_GROUPS || whole <= 0.0 {
            return Self::through([[0.0, 1.0]].into_iter());
        }
        seen.sort_unstable_by(|a, b| a.light.total_cmp(&b.light));
        let groups = seen.chunks(seen.len().div_ceil(NOISE_GROUPS)).map(|group| {
            let noise = deviation(group.iter().map(|seen| seen.bend).collect());
            [group[group.len() / 2].light, (noise * noise / whole).clamp(NOISE_LIMITS[0], NOISE_LIMITS[1])]
        });
        Self::through(groups)
    }

    /// Straight pieces through groups, as light and variance. Groups with the same light, but for rounding, count as the last one.
    fn through(groups: impl Iterator<Item = [f32; 2]>) -> Self {
        let mut distinct: Vec<[f32; 2]> = Vec::with_capacity(NOISE_GROUPS);
        for group in groups {
            if distinct.last().is_some_and(|last| group[0] - last[0] < MODULATION_FLOOR) {
                distinct.pop();
            }
            distinct.push(group);
        }
        let slopes = distinct.windows(2).map(|pair| (pair[1][1] - pair[0][1]) / (pair[1][0] - pair[0][0]));
        let mut before = 0.0;
        let pieces = distinct.iter().zip(slopes.chain([0.0])).map(|([from, _], slope)| {
            let turn = slope - before;
            before = slope;
            Piece { from: *from, turn }
        });
        Self { pieces: pieces.collect(), dark: distinct[0][1] }
    }

    /// Adds the variance, times a weight, for the light of each pixel of a row.
    fn add(&self, weight: f32, light: &[f32], out: &mut [f32]) {
        out.iter_mut().for_each(|out| *out += weight * self.dark);
        for Piece { from, turn } in &self.pieces {
            add_line(*from, weight * turn, light, out);
        }
    }
}

/// Adds a line that rises by `turn` from the light `from` on.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2+fma"))]
fn add_line(from: f32, turn: f32, light: &[f32], out: &mut [f32]) {
    for (out, light) in out.iter_mut().zip(light) {
        *out += turn * (light - from).max(0.0);
    }
}

/// What is seen around a pixel.
#[derive(Debug, Clone, Copy)]
struct Seen {
    /// Mean of 3 x 3 pixels.
    light: f32,
    /// Absolute value of the mask.
    bend: f32,
}

/// What is seen around `samples` to twice as many pixels of a plane, whose `light` is given by the place.
fn bends<'a>(
    light: impl Fn(usize) -> f32 + 'a,
    grid: &'a Grid,
    samples: usize,
) -> impl Iterator<Item = Seen> + 'a {
    let (stride, len) = (grid.stride, grid.stride * grid.height);
    // Rows are padded to whole vectors, so an odd step visits all columns.
    let step = (len / samples) | 1;
    (stride + 1..len.saturating_sub(stride + 1))
        .step_by(step)
        .filter(move |i| i % stride + 1 < grid.width)
        .map(move |i| {
            let rows = [i - stride, i, i + stride].map(|at| [light(at - 1), light(at), light(at + 1)]);
            let [above, here, below] = rows.map(|[left, middle, right]| left - 2.0 * middle + right);
            let light = rows.iter().flatten().sum::<f32>() / 9.0;
            Seen { light, bend: (above - 2.0 * here + below).abs() }
        })
}

/// Standard deviation of the noise, from values of the mask, whose squares sum up to 36.
fn deviation(bends: Vec<f32>) -> f32 {
    median(bends) / (MEDIAN_OF_NORMAL * 6.0)
}

/// Noise of the intensities in linear light, from the second differences of a wrapped phase along rows, in which slopes and most
/// of the curvature cancel.
pub(super) fn noise_of_phase(scene: &Scene<'_>, PhaseMap { phase, modulation }: PhaseMap<'_>) -> f32 {
    let grid = scene.grid;
    let seen = (0..phase.len())
        .step_by((phase.len() / NOISE_SAMPLES) | 1)
        .filter(|i| (1..grid.width - 1).contains(&(i % grid.stride)))
        .filter(|&i| modulation[i - 1].min(modulation[i]).min(modulation[i + 1]) > 0.0)
        .map(|i| {
            let bend = wrap(wrap(phase[i + 1] - phase[i]) - wrap(phase[i] - phase[i - 1]));
            bend.abs() * modulation[i]
        });
    median(seen.collect()) / (MEDIAN_OF_NORMAL * 6f32.sqrt())
}

/// Upper median; 0 for an empty list.
fn median(mut values: Vec<f32>) -> f32 {
    if values.is_empty() {
        return 0.0;
    }
    let middle = values.len() / 2;
    let (_, median, _) = values.select_nth_unstable_by(middle, f32::total_cmp);
    *median
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_distr::{Distribution, StandardNormal};
    use rand_pcg::{Pcg64Mcg, rand_core::SeedableRng};

    fn normal(seed: u64, count: usize) -> Vec<f32> {
        let mut random = Pcg64Mcg::seed_from_u64(seed);
        (0..count).map(|_| StandardNormal.sample(&mut random)).collect()
    }

    const NOISE: f32 = 0.02;

    #[test]
    fn texture_that_two_channels_share_is_no_noise() {
        let grid = Grid::new([256, 256], 8.0);
        let shared = normal(9, grid.pixels());
        let found = |texture: f32| {
            let [red, green] = [1, 2].map(|seed| -> Vec<f32> {
                let noise = normal(seed, grid.pixels());
                noise
                    .iter()
                    .zip(&shared)
                    .map(|(noise, shared)| 0.5 + NOISE * noise + texture * shared)
                    .collect()
            });
            [noise_of_image(&red, &grid), noise_of_difference([&red, &green], &grid)]
        };
        let [alone, difference] = found(0.0);
        assert!((alone / NOISE - 1.0).abs() < 0.05 && (difference / NOISE - 1.0).abs() < 0.05);
        let [alone, difference] = found(1.5 * NOISE);
        assert!(alone > 1.5 * NOISE && (difference / NOISE - 1.0).abs() < 0.05, "{alone} {difference}");
    }

    #[test]
    fn variance_is_interpolated_between_groups_and_constant_beyond() {
        let curve = Curve::through([[0.0, 9.0], [0.001, 1.0], [0.2, 3.0], [0.5, 2.0]].into_iter());
        let mut found = vec![0.0; 6];
        curve.add(0.5, &[-0.1, 0.0, 0.1005, 0.2, 0.35, 0.9], &mut found);
        let expected = [0.5, 0.5, 1.0, 1.5, 1.25, 1.0];
        assert!(
            found.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 1e-5),
            "{found:?}"
        );
    }
}
