//! From light on the sensor to intensities: noise, response, saturation and rounding.

use ndarray::{Array2, Axis};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::SeedableRng;
use rayon::prelude::*;

use super::RenderOptions;

/// Turns linear light (1 = full scale) into counts, in place. Every row has a separate random generator, seeded from
/// seed, channel and row, so that the result does not depend on the number of threads.
pub(super) fn expose(plane: &mut Array2<f32>, channel: usize, options: &RenderOptions) {
    let full_scale = options.bit_depth.full_scale();
    let rounds = full_scale > 1.0;
    let offset = options.camera_offset[channel] as f32;
    let power = (1.0 / options.camera_exponent[channel]) as f32;
    let noise = options.noise as f32;
    plane.axis_iter_mut(Axis(0)).into_par_iter().enumerate().for_each(|(row, mut line)| {
        let mut random = generator(options.seed, channel, row);
        for value in &mut line {
            let mut light = *value;
            if noise > 0.0 {
                let draw: f32 = StandardNormal.sample(&mut random);
                light += noise * draw;
            }
            let mut captured = light;
            if power != 1.0 {
                captured = light.max(0.0).powf(power);
            }
            captured = ((captured + offset) * full_scale).clamp(0.0, full_scale);
            *value = if rounds { captured.round() } else { captured };
        }
    });
}

fn generator(seed: u64, channel: usize, row: usize) -> Pcg64Mcg {
    let stream = (channel as u64) << 32 | row as u64;
    Pcg64Mcg::seed_from_u64(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ stream)
}
