//! Texture that is finer than the cells (J31).

use crate::parallel::lanes::{LANES, Lanes, lanes, lanes_mut, put, take};
use multiversion::multiversion;

/// One row of pixels, R, G, B, IR.
#[derive(Debug, Default)]
pub(super) struct Row {
    pub albedo: [Vec<f32>; 4],
    /// The light that the albedo of the cells predicts; 0 where the pixel takes no part.
    pub signal: [Vec<f32>; 4],
    /// Light less the prediction.
    pub rest: [Vec<f32>; 4],
}

/// Which channels change together.
#[derive(Debug, Clone, Copy)]
pub(super) enum Change {
    Common,
    /// Channel by channel.
    Of(usize),
}

impl Change {
    fn channels(self) -> std::ops::Range<usize> {
        match self {
            Self::Common => 0..4,
            Self::Of(channel) => channel..channel + 1,
        }
    }
}

/// Sums that determine the variance of the texture in a block of `ROWS` rows and as many columns as a vector has.
#[derive(Debug, Default, Clone, Copy)]
pub(super) struct Texture {
    /// Squared correlation of rest and signal, less that of noise.
    excess: f32,
    /// Squared power of the signal.
    power: f32,
}

impl Texture {
    /// The excess less two standard errors of it by noise of this variance, relative to the power.
    fn variance(self, noise: f32) -> f32 {
        let chance = 2.0 * noise * (2.0 * self.power).sqrt();
        if self.power > 0.0 { ((self.excess - chance) / self.power).max(0.0) } else { 0.0 }
    }
}

/// Correlation of rest and signal over the channels that change together, and power of the signal.
#[inline(always)]
fn correlation(row: &Row, change: Change, at: usize) -> [Lanes; 2] {
    let [mut cross, mut power] = [[0.0; LANES]; 2];
    for c in change.channels() {
        let [signal, rest] = take(&[lanes(&row.signal[c]), lanes(&row.rest[c])], at);
        for x in 0..LANES {
            cross[x] += signal[x] * rest[x];
            power[x] += signal[x] * signal[x];
        }
    }
    [cross, power]
}

/// Adds what a row tells of the texture.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2+fma"))]
pub(super) fn add_texture(row: &Row, change: Change, noise: f32, blocks: &mut [Texture]) {
    for (at, block) in blocks.iter_mut().enumerate() {
        let [cross, power] = correlation(row, change, at);
        for x in 0..LANES {
            block.excess += cross[x] * cross[x] - noise * power[x];
            block.power += power[x] * power[x];
        }
    }
}

/// Adds the expected texture of a row to the albedo, and to the light that it predicts.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2+fma"))]
pub(super) fn take_texture(row: &mut Row, channels: Change, noise: f32, blocks: &[Texture]) {
    for (at, block) in blocks.iter().enumerate() {
        let variance = block.variance(noise);
        if variance == 0.0 {
            continue;
        }
        let [cross, power] = correlation(row, channels, at);
        let mut change = [0.0; LANES];
        for x in 0..LANES {
            change[x] = variance * cross[x] / (noise + variance * power[x]);
        }
        for c in channels.channels() {
            let mut rows =
                [&mut row.albedo[c], &mut row.signal[c], &mut row.rest[c]].map(|row| lanes_mut(row));
            let [mut albedo, mut signal, mut rest] = rows.each_ref().map(|row| row[at]);
            for x in 0..LANES {
                let added = change[x] * signal[x];
                albedo[x] *= 1.0 + change[x];
                signal[x] += added;
                rest[x] -= added;
            }
            put(&mut rows, at, &[albedo, signal, rest]);
        }
    }
}
