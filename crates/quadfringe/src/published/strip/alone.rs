//! Three colours of different fringe numbers: R has no channel in quadrature, and a Fourier filter gives its phase too.

use crate::decode::output::OutputRow;
use crate::stages::{Judged, Limits, RowFilter};

/// What the phase of R alone needs.
pub(in crate::published) struct Alone {
    /// Weights of the filter.
    pub weights: Vec<f32>,
    /// Standard deviation of the phase for unit noise of a pixel and a modulation of 1.
    noise_share: f32,
}

impl Alone {
    /// For blocks of `pixels` pixels.
    pub fn new(filter: &RowFilter, weights: Vec<f32>, pixels: usize) -> Self {
        let noise_share = filter.phase_noise(&weights) / (pixels as f32).sqrt();
        Self { weights, noise_share }
    }

    /// Writes the results of a row of pixels.
    #[inline(always)]
    pub(super) fn write(&self, row: MeansRow<'_>, noise: f32, limits: Limits, out: &mut OutputRow<'_>) {
        let deviation = noise * self.noise_share;
        let known = row.absolute.iter().zip(row.margin).zip(row.power);
        let light = row.light.iter().zip(row.level);
        let maps = out.phase.iter_mut().zip(out.quality.iter_mut()).zip(out.reason.iter_mut());
        let maps = maps.zip(out.modulation.iter_mut().zip(out.sigma.iter_mut()));
        for ((((absolute, margin), power), (light, level)), maps) in known.zip(light).zip(maps) {
            let (((phase, quality), reason), (modulation, sigma)) = maps;
            *modulation = power.sqrt();
            *sigma = deviation / modulation.max(1e-6);
            let judged = Judged::of(*margin, *modulation, limits);
            *phase = judged.phase(*absolute);
            *quality = judged.quality(*margin);
            // A dark fringe of R has the light of its surroundings.
            *reason = judged.reason(light.max(*level), limits);
        }
        out.wrong.copy_from_slice(row.wrong);
    }
}

/// What is known about a row of pixels from the means of the rows, which all rows of a strip share.
#[derive(Clone, Copy)]
pub(super) struct MeansRow<'a> {
    /// Absolute phase of the means, its margin, and the probability that its order is wrong.
    pub absolute: &'a [f32],
    pub margin: &'a [f32],
    pub wrong: &'a [f32],
    /// Squared modulation.
    pub power: &'a [f32],
    /// Light of R in the row, and its background.
    pub light: &'a [f32],
    pub level: &'a [f32],
}
