//! Step 2: the height of the light above the bottom of its surroundings, in units of its range (J2).

use crate::parallel::lanes::{LANES, lanes, lanes_mut, take};
use multiversion::multiversion;

/// Number of maps of cells: bottom and 1 / range^2 for each channel.
pub(super) const LEVEL_MAPS: usize = 8;

/// Bottom and range of the light along one row of pixels.
pub(super) struct LevelRows<'a> {
    pub bottom: [&'a [f32]; 4],
    /// 1 / range^2.
    pub precision: [&'a [f32]; 4],
}

impl<'a> LevelRows<'a> {
    pub fn new(maps: [&'a [f32]; LEVEL_MAPS]) -> Self {
        Self { bottom: [0, 2, 4, 6].map(|k| maps[k]), precision: [1, 3, 5, 7].map(|k| maps[k]) }
    }
}

/// Sum over the first channels of the squared height above the bottom, in units of the range, minus the variance of the
/// noise.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
pub(super) fn heights<const CHANNELS: usize>(
    levels: &LevelRows,
    light: [&[f32]; 4],
    noise_variance: f32,
    out: &mut [f32],
) {
    let (bottom, precision, light) =
        (levels.bottom.map(lanes), levels.precision.map(lanes), light.map(lanes));
    for (i, out) in lanes_mut(out).iter_mut().enumerate() {
        let (bottom, precision, light) = (take(&bottom, i), take(&precision, i), take(&light, i));
        let mut sum = [0.0; LANES];
        for c in 0..CHANNELS {
            for x in 0..LANES {
                let height = light[c][x] - bottom[c][x];
                sum[x] += (height * height - noise_variance) * precision[c][x];
            }
        }
        *out = sum;
    }
}
