//! Joint least squares of all four channels: once the order is known every channel measures the same column.
//!
//! `I_c = rho (a_c + b_c cos(N_c / N_1 Phi + delta_c))` with `Phi` absolute: only albedo, background and modulation are
//! free, so that nothing can turn the phase as a whole. Rounds alternate between background and modulation (in a wide
//! window), albedo (per pixel) and one Gauss-Newton step of the phase (in the small window that follows the surface).

use super::scene::{RowMaps, Scene, smooth_albedo};
use super::window::{Reach, Window};
use crate::Channel;
use crate::angle::sin_cos;
use rayon::prelude::*;

/// Width (sigma) of the window of backgrounds and modulations, in fringe periods: the albedo takes what is faster.
const WINDOW: f32 = 1.0;
/// Rounds of background, albedo and phase.
const ROUNDS: usize = 4;
/// Ridge of the normal equations relative to the weight in the window.
const RIDGE: f32 = 1e-3;
/// Sums of one cell: the weight, then per channel w e, w e e, w I, w I e with e = cos(Phi_c + delta_c).
const SUMS: usize = 17;

/// Background `a` and modulation `b` of one channel on the cells.
#[derive(Debug, Clone, Default)]
pub(crate) struct Fringes {
    pub a: Vec<f32>,
    pub b: Vec<f32>,
}

/// Working maps of the joint fit.
#[derive(Debug, Clone, Default)]
pub(crate) struct Joint {
    ratios: [f32; 4],
    numerator: Vec<f32>,
    denominator: Vec<f32>,
    next: Vec<f32>,
    /// Misfit of the four channels: mean square in linear light.
    pub misfit: Vec<f32>,
}

impl Joint {
    /// For fringe numbers of R and B, G, IR.
    pub fn new(numbers: [f64; 3]) -> Self {
        Self {
            ratios: Channel::ALL.map(|c| (numbers[c.phase_index()] / numbers[0]) as f32),
            ..Self::default()
        }
    }

    /// Fit `phase` (absolute, rad) in place; `albedo` comes in as a first guess.
    pub fn run(
        &mut self,
        scene: &Scene<'_>,
        window: &Window<'_>,
        albedo: &mut Vec<f32>,
        phase: &mut Vec<f32>,
    ) {
        for map in [&mut self.numerator, &mut self.denominator, &mut self.next, &mut self.misfit] {
            map.resize(phase.len(), 0.0);
        }
        self.misfit.fill(0.0);
        for round in 1..=ROUNDS {
            let channels = self.fringes(scene, albedo, phase, |at| self.misfit[at] <= window.tolerance(at));
            self.update_albedo(scene, &channels, albedo, phase);
            self.linearise(scene, window, &channels, albedo, phase);
            let reach = if round < ROUNDS { Reach::Near } else { Reach::Full };
            window.step(phase, &self.numerator, &self.denominator, reach, &mut self.next);
            std::mem::swap(phase, &mut self.next);
        }
    }

    /// Background and modulation of every channel, intensities divided by the albedo and weighted by its square, as
    /// additive noise asks for; pixels that are not `sound` take no part.
    pub fn fringes(
        &self,
        scene: &Scene<'_>,
        albedo: &[f32],
        phase: &[f32],
        sound: impl Fn(usize) -> bool + Sync,
    ) -> [Fringes; 4] {
        let sums = scene.window_sums::<SUMS>(WINDOW, |light, at| {
            let rho = albedo[at];
            let mut sums = [0.0; SUMS];
            if !sound(at) {
                return sums;
            }
            sums[0] = rho * rho;
            for c in 0..4 {
                let (_, e) = self.carrier(c, phase[at]);
                let seen = rho * light[c];
                sums[1 + 4 * c..5 + 4 * c].copy_from_slice(&[
                    rho * rho * e,
                    rho * rho * e * e,
                    seen,
                    seen * e,
                ]);
            }
            sums
        });
        std::array::from_fn(|c| {
            let cells = 0..scene.grid.cells();
            let solved =
                cells.map(|i| solve([0, 1 + 4 * c, 2 + 4 * c, 3 + 4 * c, 4 + 4 * c].map(|k| sums[k][i])));
            let (a, b) = solved.unzip();
            Fringes { a, b }
        })
    }

    /// Sine and cosine of a channel's own phase.
    #[inline]
    fn carrier(&self, c: usize, phase: f32) -> (f32, f32) {
        let (s, e) = sin_cos(self.ratios[c] * phase);
        if c == Channel::B.index() { (e, -s) } else { (s, e) }
    }

    /// Albedo of every pixel, not sharper than the lens.
    fn update_albedo(
        &mut self,
        scene: &Scene<'_>,
        channels: &[Fringes; 4],
        albedo: &mut Vec<f32>,
        phase: &[f32],
    ) {
        let width = scene.width;
        albedo.par_chunks_mut(width).enumerate().for_each_init(Row::default, |row, (y, out)| {
            row.start(width);
            let phase = &phase[y * width..][..width];
            for (c, light) in scene.rows(y).into_iter().enumerate() {
                row.model(self, scene, &channels[c], c, y, phase);
                for x in 0..width {
                    let model = row.model[x].max(0.0);
                    row.top[x] += model * light[x];
                    row.bottom[x] += model * model;
                }
            }
            for x in 0..width {
                out[x] = (row.top[x] / row.bottom[x].max(1e-9)).max(1e-4);
            }
        });
        smooth_albedo(albedo, &mut self.next, width);
    }

    /// Gauss-Newton terms of every pixel with the albedo eliminated, and how far the channels are from their model.
    fn linearise(
        &mut self,
        scene: &Scene<'_>,
        window: &Window<'_>,
        channels: &[Fringes; 4],
        albedo: &[f32],
        phase: &[f32],
    ) {
        let width = scene.width;
        let mut maps = [&mut self.numerator, &mut self.denominator, &mut self.misfit].map(std::mem::take);
        let [numerator, denominator, misfit] = &mut maps;
        numerator
            .par_chunks_mut(width)
            .zip(denominator.par_chunks_mut(width))
            .zip(misfit.par_chunks_mut(width))
            .enumerate()
            .for_each_init(Row::default, |row, (y, ((numerator, denominator), misfit))| {
                row.start(width);
                let at = y * width..(y + 1) * width;
                let (phase, albedo) = (&phase[at.clone()], &albedo[at]);
                for map in [&mut *numerator, &mut *denominator, &mut *misfit] {
                    map.fill(0.0);
                }
                for (c, light) in scene.rows(y).into_iter().enumerate() {
                    row.model(self, scene, &channels[c], c, y, phase);
                    for x in 0..width {
                        let (model, slope) = (albedo[x] * row.model[x], albedo[x] * row.slope[x]);
                        let error = light[x] - model;
                        numerator[x] += slope * error;
                        denominator[x] += slope * slope;
                        misfit[x] += 0.25 * error * error;
                        row.top[x] += slope * model;
                        row.bottom[x] += model * model;
                    }
                }
                // What a change of albedo would explain as well says nothing about the phase.
                for x in 0..width {
                    let shared = row.top[x] * row.top[x] / row.bottom[x].max(1e-9);
                    denominator[x] = (denominator[x] - shared).max(0.25 * denominator[x]);
                    if !window.is_lit(y * width + x) {
                        (numerator[x], denominator[x]) = (0.0, 0.0);
                    }
                }
            });
        [self.numerator, self.denominator, self.misfit] = maps;
    }
}

/// Background and modulation from the sums of one window.
fn solve([w, e, ee, light, light_e]: [f32; 5]) -> (f32, f32) {
    let (w, ee) = (w * (1.0 + RIDGE) + 1e-9, ee + w * RIDGE + 1e-9);
    let scale = 1.0 / (w * ee - e * e).max(f32::MIN_POSITIVE);
    ((ee * light - e * light_e) * scale, (w * light_e - e * light) * scale)
}

/// Working rows: the model of a channel for an albedo of 1, its derivative by the absolute phase, and two sums.
#[derive(Default)]
struct Row {
    maps: RowMaps,
    model: Vec<f32>,
    slope: Vec<f32>,
    top: Vec<f32>,
    bottom: Vec<f32>,
}

impl Row {
    fn start(&mut self, width: usize) {
        for row in [&mut self.model, &mut self.slope, &mut self.top, &mut self.bottom] {
            row.clear();
            row.resize(width, 0.0);
        }
    }

    fn model(
        &mut self,
        joint: &Joint,
        scene: &Scene<'_>,
        fringes: &Fringes,
        c: usize,
        y: usize,
        phase: &[f32],
    ) {
        let [a, b] = self.maps.sample(scene, y, [&fringes.a, &fringes.b]);
        for x in 0..phase.len() {
            let (s, e) = joint.carrier(c, phase[x]);
            self.model[x] = a[x] + b[x] * e;
            self.slope[x] = -b[x] * joint.ratios[c] * s;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::grid::Grid;
    use super::super::window::Slopes;
    use super::*;
    use std::f32::consts::TAU;

    #[test]
    fn a_rippled_phase_and_an_unknown_texture_are_put_right() {
        let (width, height, period) = (256, 64, 25.0f32);
        let joint = Joint::new([36.0, 35.0, 30.0]);
        let truth: Vec<f32> = (0..width * height).map(|i| 40.0 + TAU * (i % width) as f32 / period).collect();
        let texture =
            |i: usize| 0.7 + 0.2 * ((i / width) as f32 * 0.3).sin() * ((i % width) as f32 * 0.2).cos();
        let planes: [Vec<f32>; 4] = std::array::from_fn(|c| {
            let seen = |i: usize| texture(i) * (0.5 + 0.4 * joint.carrier(c, truth[i]).1);
            (0..width * height).map(seen).collect()
        });
        let (grid, usable) = (Grid::new(height, width, 3), vec![true; width * height]);
        let light = planes.each_ref().map(Vec::as_slice);
        let scene = Scene { light, usable: &usable, width, grid: &grid, period_px: f64::from(period) };
        let slopes = Slopes { along: vec![TAU / period; width * height], down: vec![0.0; width * height] };
        let modulation = vec![0.3; width * height];
        let window = Window::new(&scene, &slopes, &modulation, 0.003);
        let rms = |phase: &[f32]| {
            let square = phase.iter().zip(&truth).map(|(p, t)| (p - t).powi(2)).sum::<f32>();
            (square / phase.len() as f32).sqrt()
        };
        let mut phase: Vec<f32> = truth.iter().map(|t| t + 0.05 * (2.0 * t).sin()).collect();
        let (mut albedo, before, mut joint) = (vec![1.0; width * height], rms(&phase), joint);
        joint.run(&scene, &window, &mut albedo, &mut phase);
        assert!(rms(&phase) < 0.2 * before, "{} after {before}", rms(&phase));
        let mean = joint.misfit.iter().sum::<f32>() / phase.len() as f32;
        assert!(mean < 1e-4, "{mean}");
    }
}
