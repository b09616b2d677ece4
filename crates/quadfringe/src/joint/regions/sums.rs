//! Step 8: sums over the pixels of a part of a region, from which the fit of an offset and an amplitude, both in proportion to the
//! brightness of a pixel, follows for any shift of the phase.

use crate::joint::energy::Rows;
use crate::joint::infrared::{Waves, with_waves};
use crate::joint::scene::Scene;
use crate::parallel::angle::sin_cos;
use crate::parallel::lanes::{LANES, Lanes, lanes, take};
use multiversion::multiversion;
use std::ops::Range;

/// The brightness of the surface without fringes.
pub(in crate::joint) trait Brightness: Sync {
    /// Writes row `y` of the scene, 0 where it is not known.
    fn write(&self, y: usize, work: &mut Rows, out: &mut Vec<f32>);
}

impl<F: Fn(usize, &mut Rows, &mut Vec<f32>) + Sync> Brightness for F {
    fn write(&self, y: usize, work: &mut Rows, out: &mut Vec<f32>) {
        self(y, work, out);
    }
}

/// Sums of one channel: products of the brightness, the brightness times cosine and sine, and the light.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct ChannelSums {
    pub bright_cosine: f64,
    pub bright_sine: f64,
    pub cosine_cosine: f64,
    pub cosine_sine: f64,
    pub sine_sine: f64,
    pub bright_light: f64,
    pub cosine_light: f64,
    pub sine_light: f64,
    pub light_light: f64,
}

/// Sums of a part.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Sums {
    /// Number of usable pixels whose brightness is known.
    pub weight: f32,
    /// Sum of the squared brightness.
    pub bright_bright: f64,
    /// Of G, and of IR or B alone.
    pub channels: [ChannelSums; 2],
}

/// Terms of the pixels of one row: weight, brightness, then cosine, sine and light of G and of IR, the waves times the brightness.
#[derive(Debug, Default)]
pub(super) struct RowTerms {
    rows: [Vec<f32>; 8],
    bright: Vec<f32>,
    work: Rows,
}

impl RowTerms {
    /// Computes the terms of row `y`.
    pub fn fill(
        &mut self,
        scene: &Scene<'_>,
        y: usize,
        ratios: [f32; 4],
        phase: &[f32],
        brightness: &impl Brightness,
    ) {
        self.rows.iter_mut().for_each(|row| row.resize(scene.grid.stride + LANES, 0.0));
        brightness.write(y, &mut self.work, &mut self.bright);
        let light = scene.rows(y);
        let bright = &self.bright[..scene.grid.stride];
        let inputs = [scene.row(phase, y), scene.row(scene.usable, y), bright, light[1], light[3]];
        with_waves!(scene, y, ratios, |waves| fill(inputs, waves, &mut self.rows));
    }

    /// Adds the terms of pixels to the sums of a part.
    pub fn add(&self, pixels: Range<usize>, sums: &mut Sums) {
        let mut found = [[0.0; LANES]; 20];
        add_terms(&self.rows, pixels, &mut found);
        let total = found.map(|lanes| f64::from(lanes.iter().sum::<f32>()));
        sums.weight += total[0] as f32;
        sums.bright_bright += total[1];
        for (channel, total) in sums.channels.iter_mut().zip(total[2..].chunks(9)) {
            channel.bright_cosine += total[0];
            channel.bright_sine += total[1];
            channel.cosine_cosine += total[2];
            channel.cosine_sine += total[3];
            channel.sine_sine += total[4];
            channel.bright_light += total[5];
            channel.cosine_light += total[6];
            channel.sine_light += total[7];
            channel.light_light += total[8];
        }
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn fill<W: Waves>(inputs: [&[f32]; 5], waves: W, rows: &mut [Vec<f32>; 8]) {
    let inputs = inputs.map(lanes);
    let ratio = waves.ratios()[1];
    for i in 0..inputs[0].len() {
        let [phase, usable, bright, green, infrared] = take(&inputs, i);
        let vector = waves.vector(i);
        let mut out = [[0.0; LANES]; 8];
        for x in 0..LANES {
            let (sine_green, cosine_green) = sin_cos(ratio * phase[x]);
            let (sine, cosine) = sin_cos(waves.infrared(&vector, x, phase[x]).phase);
            let (bright, known) = (bright[x], if bright[x] > 0.0 { usable[x] } else { 0.0 });
            let [cosine_green, sine_green] = [bright * cosine_green, bright * sine_green];
            let [cosine, sine] = [bright * cosine, bright * sine];
            let values = [known, bright, cosine_green, sine_green, green[x], cosine, sine, infrared[x]];
            for k in 0..8 {
                out[k][x] = values[k];
            }
        }
        for (row, out) in rows.iter_mut().zip(out) {
            row[i * LANES..][..LANES].copy_from_slice(&out);
        }
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn add_terms(rows: &[Vec<f32>; 8], pixels: Range<usize>, found: &mut [Lanes; 20]) {
    for from in pixels.clone().step_by(LANES) {
        let terms: [Lanes; 8] = std::array::from_fn(|k| {
            let mut lanes = [0.0; LANES];
            lanes.copy_from_slice(&rows[k][from..][..LANES]);
            lanes
        });
        for x in 0..LANES {
            let weight = if from + x < pixels.end { terms[0][x] } else { 0.0 };
            let (bright, b) = (terms[1][x], weight * terms[1][x]);
            found[0][x] += weight;
            found[1][x] += b * bright;
            for channel in 0..2 {
                let [cosine, sine, light] = [2, 3, 4].map(|k| terms[3 * channel + k][x]);
                let [c, s, l] = [cosine, sine, light].map(|value| weight * value);
                let values = [
                    b * cosine,
                    b * sine,
                    c * cosine,
                    c * sine,
                    s * sine,
                    b * light,
                    c * light,
                    s * light,
                    l * light,
                ];
                for k in 0..9 {
                    found[2 + 9 * channel + k][x] += values[k];
                }
            }
        }
    }
}
