//! Texture that is finer than the cells (J31).

use crate::parallel::lanes::{LANES, Lanes, lanes, lanes_mut, take};
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

/// Sums that determine the variance of the texture in a block of `ROWS` rows and as many columns as a vector has.
#[derive(Debug, Default, Clone, Copy)]
pub(super) struct Texture {
    /// Squared correlation of rest and signal, less that of noise.
    excess: f32,
    /// Squared power of the signal.
    power: f32,
}

impl Texture {
    fn variance(self) -> f32 {
        if self.power > 0.0 { (self.excess / self.power).max(0.0) } else { 0.0 }
    }
}

/// Correlation of rest and signal over the four channels, and power of the signal.
#[inline(always)]
fn correlation(row: &Row, at: usize) -> [Lanes; 2] {
    let [mut cross, mut power] = [[0.0; LANES]; 2];
    for c in 0..4 {
        let [signal, rest] = take(&[lanes(&row.signal[c]), lanes(&row.rest[c])], at);
        for x in 0..LANES {
            cross[x] += signal[x] * rest[x];
            power[x] += signal[x] * signal[x];
        }
    }
    [cross, power]
}

/// Adds what a row tells of the texture, which the channels have in common.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2+fma"))]
pub(super) fn add_texture(row: &Row, noise: f32, blocks: &mut [Texture]) {
    for (at, block) in blocks.iter_mut().enumerate() {
        let [cross, power] = correlation(row, at);
        for x in 0..LANES {
            block.excess += cross[x] * cross[x] - noise * power[x];
            block.power += power[x] * power[x];
        }
    }
}

/// Adds the expected texture of a row to the albedo.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2+fma"))]
pub(super) fn take_texture(row: &mut Row, noise: f32, blocks: &[Texture]) {
    for (at, block) in blocks.iter().enumerate() {
        let ([cross, power], variance) = (correlation(row, at), block.variance());
        let mut change = [0.0; LANES];
        for x in 0..LANES {
            change[x] = variance * cross[x] / (noise + variance * power[x]);
        }
        for c in 0..4 {
            let albedo = &mut lanes_mut(&mut row.albedo[c])[at];
            for x in 0..LANES {
                albedo[x] *= 1.0 + change[x];
            }
        }
    }
}
