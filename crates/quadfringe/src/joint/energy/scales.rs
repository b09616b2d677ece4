//! The scales of noise and priors, estimated from the tile itself (empirical Bayes).
//!
//! Each prior says that neighbours differ by a random amount of unknown variance. The variance that makes the data most probable
//! satisfies `variance = sum of weighted squared differences / number of differences that the data determine` (MacKay, Neural
//! Computation 4, 415 (1992)). For a field with the information `g` in each cell and a prior of the weight `w`, the share that the
//! data determine at the spatial frequency k is `g / (g + w |D(k)|^2)`; its mean over all frequencies is the share of the tile.

use super::plane::total;
use crate::joint::model::{count, weights};
use crate::joint::params::energy::{
    DETERMINED_MIN, MODEL_SHARE, PRIOR_CELLS, RELAXATION, SCALE_LIMITS, START,
};
use crate::parallel::lanes::Lanes;
use std::ops::RangeInclusive;

/// Variances of noise and priors in one tile.
#[derive(Debug, Clone, Copy)]
pub(super) struct Scales {
    /// Variance of the intensity of a cell, in linear light squared.
    pub noise: f32,
    /// The part of it that the residuals show.
    pub misfit: f32,
    /// Variance of the second difference of the phase, rad^2.
    pub bend: f32,
    /// Variances of first differences of logarithms.
    pub brightness: f32,
    pub colour: f32,
    pub contrast: f32,
    /// Contrast of each channel relative to their mean.
    pub channel_contrast: [f32; 4],
    /// Unknowns that the data determine at these scales; none before the first estimate of the priors.
    pub determined: Determined,
}

impl Default for Scales {
    fn default() -> Self {
        let [bend, brightness, colour, contrast] = START.map(|deviation| deviation * deviation);
        Self {
            noise: 1.0,
            misfit: 1.0,
            bend,
            brightness,
            colour,
            contrast,
            channel_contrast: [1.0; 4],
            determined: Determined::default(),
        }
    }
}

/// Sums over the data of a tile, or of each lane of a row.
#[derive(Debug, Default)]
pub(super) struct DataSums<T = f64> {
    /// Usable cells.
    pub cells: T,
    /// Squared residuals; large ones count less.
    pub squares: T,
    /// Squared offsets of the channels.
    pub brightness: T,
    /// Fringes times residuals, and squared fringes, of each channel.
    pub cross: [T; 4],
    pub power: [T; 4],
}

impl DataSums {
    /// Adds the sums of a row.
    #[inline(always)]
    pub fn add(&mut self, row: &DataSums<Lanes>) {
        self.cells += total(row.cells);
        self.squares += total(row.squares);
        self.brightness += total(row.brightness);
        for c in 0..4 {
            self.cross[c] += total(row.cross[c]);
            self.power[c] += total(row.power[c]);
        }
    }
}

/// Sums over the differences of one prior.
#[derive(Debug, Default)]
pub(super) struct Sums<T = f64> {
    /// Weighted squared differences.
    pub energy: T,
    /// Number of differences.
    pub count: T,
    /// Sum of the weights.
    pub weight: T,
}

impl Sums {
    #[inline(always)]
    fn add(&mut self, row: &Sums<Lanes>) {
        self.energy += total(row.energy);
        self.count += total(row.count);
        self.weight += total(row.weight);
    }
}

/// Sums over the differences of all priors, of a tile or of each lane of a row.
#[derive(Debug, Default)]
pub(super) struct PriorSums<T = f64> {
    pub bend: Sums<T>,
    pub brightness: Sums<T>,
    pub colour: Sums<T>,
    pub contrast: Sums<T>,
}

impl PriorSums {
    /// Adds the sums of a row.
    #[inline(always)]
    pub fn add(&mut self, row: &PriorSums<Lanes>) {
        self.bend.add(&row.bend);
        self.brightness.add(&row.brightness);
        self.colour.add(&row.colour);
        self.contrast.add(&row.contrast);
    }
}

/// Half the number of unknowns for each of them, for a number of channels.
#[inline(always)]
pub(super) fn unknowns(channels: f32) -> [f32; 3] {
    [0.5, 0.5 * (channels - 1.0), 0.5]
}

/// Mean information of a cell about its unknowns, in linear light squared.
#[derive(Debug, Default, Clone, Copy)]
pub(super) struct Information {
    pub phase: f32,
    pub albedo: f32,
    pub contrast: f32,
}

/// Numbers of unknowns that the data determine, for each cell.
#[derive(Debug, Default, Clone, Copy)]
pub(super) struct Determined {
    phase: f32,
    brightness: f32,
    colour: f32,
    contrast: f32,
}

impl Scales {
    /// Estimates the variance of the noise from the residuals, within `bounds`, and the contrasts of the channels.
    pub fn estimate_noise(&mut self, sums: &DataSums, ratios: [f32; 4], bounds: RangeInclusive<f32>) {
        let channels = count(ratios);
        let Determined { phase, brightness, colour, contrast } = self.determined;
        let used = phase + brightness + (channels - 1.0) * colour + contrast;
        let free = sums.cells * f64::from((channels - used).max(0.5));
        self.misfit = ((sums.squares / free.max(1e-9)) as f32).max(*bounds.start()).min(*bounds.end());
        let mean = sums.brightness / (f64::from(channels) * sums.cells).max(1e-9);
        self.noise = self.misfit + MODEL_SHARE * MODEL_SHARE * mean as f32;
        let mut change = [1.0; 4];
        for c in 0..4 {
            let ridge = 1e-3 * sums.power[c] + 1e-9;
            change[c] = (1.0 + sums.cross[c] / (sums.power[c] + ridge)) as f32 * self.channel_contrast[c];
        }
        let present = weights(ratios);
        let sum: f32 = change.iter().zip(present).map(|(value, present)| value * present).sum();
        let mean = sum / channels;
        self.channel_contrast = change.map(|value| (value / mean.max(1e-6)).clamp(0.5, 1.5));
    }

    /// Estimates the variances of the priors, and the numbers of unknowns that the data determine. The variance of the bending is
    /// at most `bend_max`. As long as it is that, the variance of the contrast does not rise, or contrast would explain what the surface
    /// may not (J43).
    pub fn estimate_priors(
        &mut self,
        sums: &PriorSums,
        information: Information,
        channels: f32,
        bend_max: f32,
    ) {
        let Information { phase, albedo, contrast } = information;
        let noise = self.noise;
        let weight =
            |sums: &Sums, variance: f32| (sums.weight / sums.count.max(1e-9)) as f32 * noise / variance;
        self.determined = Determined {
            phase: bend_share(weight(&sums.bend, self.bend) / phase.max(1e-12)),
            brightness: difference_share(weight(&sums.brightness, self.brightness) / albedo.max(1e-12)),
            colour: difference_share(weight(&sums.colour, self.colour) / albedo.max(1e-12)),
            contrast: difference_share(weight(&sums.contrast, self.contrast) / contrast.max(1e-12)),
        };
        let update = |sums: &Sums, each: f32, share: f32, start: f32, old: f32| {
            let count = f64::from(each) * sums.count * f64::from(share.max(DETERMINED_MIN));
            let prior = f64::from(PRIOR_CELLS);
            let variance = (sums.energy + prior * f64::from(start * start)) / (count + prior);
            let growth = (variance as f32 / old).powf(RELAXATION);
            (old * growth).clamp(SCALE_LIMITS[0].powi(2), SCALE_LIMITS[1].powi(2))
        };
        let [bright, colour, slow] = unknowns(channels);
        let Determined { phase, brightness, colour: coloured, contrast } = self.determined;
        self.bend = update(&sums.bend, 1.0, phase, START[0], self.bend).min(bend_max);
        self.brightness = update(&sums.brightness, bright, brightness, START[1], self.brightness);
        self.colour = update(&sums.colour, colour, coloured, START[2], self.colour);
        let contrast = update(&sums.contrast, slow, contrast, START[3], self.contrast);
        self.contrast = if self.bend < bend_max { contrast } else { contrast.min(self.contrast) };
    }
}

/// Number of frequencies in each direction for the means below.
const FREQUENCIES: usize = 8;

/// Squared response of a first difference at frequency number `n`.
fn response(n: usize) -> f32 {
    2.0 - 2.0 * (std::f32::consts::PI * (n as f32 + 0.5) / FREQUENCIES as f32).cos()
}

fn mean_share(square: impl Fn(f32) -> f32) -> f32 {
    let sum: f32 = (0..FREQUENCIES * FREQUENCIES)
        .map(|i| square(response(i / FREQUENCIES) + response(i % FREQUENCIES)))
        .map(|weighted| 1.0 / (1.0 + weighted))
        .sum();
    sum / (FREQUENCIES * FREQUENCIES) as f32
}

/// Share of a field that the data determine, by the weight of its bending relative to the information.
fn bend_share(relative: f32) -> f32 {
    mean_share(|laplacian| relative * laplacian * laplacian)
}

/// The same for first differences.
fn difference_share(relative: f32) -> f32 {
    mean_share(|gradient| relative * gradient)
}

/// Variance of the phase of a cell for unit variance of the noise, by its information and the weight of its bending. Noise passes
/// the smoothing at the frequency k with the gain `1 / (1 + r |D(k)|^2)`, where r is the weight relative to the information. The
/// mean of its square over all frequencies is close to the function below (U13).
#[inline(always)]
pub(super) fn variance_share(information: f32, bend: f32) -> f32 {
    let relative = bend / information;
    let smoothing = 1.0 + 50.0 * relative;
    (1.0 + 22.0 * relative) / (information * smoothing * smoothing.sqrt())
}
