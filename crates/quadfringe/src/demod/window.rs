//! A smoothing window that follows the local slope of the phase and stops at edges.
//!
//! Neighbours count as far as their phase fits the plane through the pixel within the noise (a plane-compensated
//! bilateral window, Tukey's biweight); phases are compared modulo a turn, so they may be wrapped or absolute.

use super::scene::Scene;
use crate::angle::{round, wrap};
use multiversion::multiversion;
use rayon::prelude::*;
use std::f32::consts::TAU;

/// Width (sigma) of the window in fringe periods.
const WIDTH: f32 = 0.08;
/// Neighbours further off than this many noise widths belong to another surface.
const REACH_SIGMAS: f32 = 7.0;
/// The same for a capture without noise.
const REACH_RAD: f32 = 0.06;
/// Greatest misfit of the four channels, root mean square: in units of the noise, and of the modulation.
const NOISE_MAX: f32 = 1.5;
const MISFIT_MAX: f32 = 0.2;
/// One pixel in so many is asked for the noise.
const NOISE_STRIDE: usize = 7;

/// Slopes of the phase at every pixel, in rad per pixel.
#[derive(Debug, Clone, Default)]
pub(crate) struct Slopes {
    pub along: Vec<f32>,
    pub down: Vec<f32>,
}

/// The window and the pixels it may use: `modulation` is 0 where there is no light to measure by.
pub(crate) struct Window<'a> {
    scene: &'a Scene<'a>,
    slopes: &'a Slopes,
    modulation: &'a [f32],
    radius: isize,
    sigma: f32,
    noise: f32,
}

/// Rows that one output row needs.
#[derive(Default)]
struct Rows {
    sharpness: Vec<f32>,
    top: Vec<f32>,
    bottom: Vec<f32>,
}

/// How far a window reaches.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Reach {
    /// Two pixels: enough on the way to a solution.
    Near,
    /// Two sigma: as far as there is anything to gain.
    Full,
}

impl<'a> Window<'a> {
    /// A window over lit pixels of a scene whose intensities have `noise` (standard deviation in linear light).
    pub fn new(scene: &'a Scene<'a>, slopes: &'a Slopes, modulation: &'a [f32], noise: f32) -> Self {
        let sigma = (WIDTH * scene.period_px as f32).clamp(0.8, 4.0);
        Self { scene, slopes, modulation, radius: (2.0 * sigma).ceil() as isize, sigma, noise }
    }

    /// Greatest mean square misfit of the four channels that the noise and an imperfect model of a pixel explain.
    pub fn tolerance(&self, at: usize) -> f32 {
        (NOISE_MAX * self.noise).powi(2) + (MISFIT_MAX * self.modulation[at]).powi(2)
    }

    /// Whether a pixel has light to measure by.
    pub fn is_lit(&self, at: usize) -> bool {
        self.modulation[at] > 0.0
    }

    /// The phase, smoothed.
    pub fn smooth(&self, phase: &[f32], out: &mut [f32]) {
        let weights: Vec<f32> = self.modulation.iter().map(|m| f32::from(u8::from(*m > 0.0))).collect();
        let nothing = vec![0.0; phase.len()];
        self.step(phase, &nothing, &weights, Reach::Full, out);
    }

    /// Every pixel's Gauss-Newton step `numerator / denominator` added to its phase, and the sum averaged over the
    /// window with the denominators as weights; they must be 0 in the dark.
    pub fn step(&self, phase: &[f32], numerator: &[f32], denominator: &[f32], reach: Reach, out: &mut [f32]) {
        let width = self.scene.width;
        let height = phase.len() / width;
        let radius = if reach == Reach::Near { 2 } else { self.radius };
        out.par_chunks_mut(width).enumerate().for_each_init(Rows::default, |rows, (y, out)| {
            self.start(y, rows);
            let [here, along, down] =
                [phase, &self.slopes.along, &self.slopes.down].map(|map| &map[y * width..][..width]);
            for dy in -radius..=radius {
                let Some(row) = y.checked_add_signed(dy).filter(|&r| r < height) else {
                    continue;
                };
                for dx in -radius..=radius {
                    let from = dx.min(0).unsigned_abs().min(width);
                    let to = (width as isize - dx.max(0)).max(from as isize) as usize;
                    let start = (row * width + from).wrapping_add_signed(dx);
                    let there = start..start + (to - from);
                    let (dx, dy) = (dx as f32, dy as f32);
                    let neighbour = Neighbour {
                        dx,
                        dy,
                        weight: (-0.5 * (dx * dx + dy * dy) / (self.sigma * self.sigma)).exp(),
                        phase: &phase[there.clone()],
                        along: &self.slopes.along[there.clone()],
                        down: &self.slopes.down[there.clone()],
                        numerator: &numerator[there.clone()],
                        denominator: &denominator[there],
                    };
                    let own = [here, along, down, &rows.sharpness].map(|row| &row[from..to]);
                    let sums = [&mut rows.top[from..to], &mut rows.bottom[from..to]];
                    add_neighbour(own, &neighbour, sums);
                }
            }
            for (x, value) in out.iter_mut().enumerate() {
                *value = here[x] + rows.top[x] / rows.bottom[x].max(f32::MIN_POSITIVE);
            }
        });
    }

    fn start(&self, y: usize, rows: &mut Rows) {
        let width = self.scene.width;
        for row in [&mut rows.sharpness, &mut rows.top, &mut rows.bottom] {
            row.clear();
            row.resize(width, 0.0);
        }
        for (sharp, &m) in rows.sharpness.iter_mut().zip(&self.modulation[y * width..]) {
            let reach = (REACH_SIGMAS * self.noise / m.max(1e-6)).clamp(REACH_RAD, TAU);
            *sharp = 1.0 / (reach * reach);
        }
    }
}

/// One neighbour of a stretch of a row.
struct Neighbour<'a> {
    dx: f32,
    dy: f32,
    /// Weight for its distance.
    weight: f32,
    phase: &'a [f32],
    along: &'a [f32],
    down: &'a [f32],
    numerator: &'a [f32],
    denominator: &'a [f32],
}

/// Adds one neighbour to two sums of every pixel of a stretch, as far as it fits: the phase between two pixels is the
/// mean of their slopes times their distance, which is exact for a surface of constant curvature.
#[multiversion(targets("x86_64+avx2"))]
fn add_neighbour<'a>(
    [here, along, down, sharpness]: [&[f32]; 4],
    there: &Neighbour<'a>,
    [top, bottom]: [&mut [f32]; 2],
) {
    let n = here.len();
    let (phase, numerator, denominator) = (&there.phase[..n], &there.numerator[..n], &there.denominator[..n]);
    let (other_along, other_down) = (&there.along[..n], &there.down[..n]);
    let (along, down, sharpness) = (&along[..n], &down[..n], &sharpness[..n]);
    let (top, bottom) = (&mut top[..n], &mut bottom[..n]);
    let (dx, dy) = (0.5 * there.dx, 0.5 * there.dy);
    for x in 0..n {
        let way = (along[x] + other_along[x]) * dx + (down[x] + other_down[x]) * dy;
        let turns = (phase[x] - here[x] - way) * (1.0 / TAU);
        let d = (turns - round(turns)) * TAU;
        let miss = 1.0 - d * d * sharpness[x];
        let fits = if miss > 0.0 { miss } else { 0.0 };
        let weight = there.weight * fits * fits;
        top[x] += weight * (numerator[x] + denominator[x] * d);
        bottom[x] += weight * denominator[x];
    }
}

/// Standard deviation of the intensities, from the second differences of the phase: slopes and most curvature drop out.
pub(crate) fn noise(phase: &[f32], modulation: &[f32], width: usize) -> f32 {
    let mut seen: Vec<f32> = (0..phase.len())
        .step_by(NOISE_STRIDE)
        .filter(|i| (1..width - 1).contains(&(i % width)) && modulation[*i] > 0.0)
        .map(|i| {
            let bend = wrap(wrap(phase[i + 1] - phase[i]) - wrap(phase[i] - phase[i - 1]));
            bend.abs() * modulation[i]
        })
        .collect();
    if seen.is_empty() {
        return 0.0;
    }
    let middle = seen.len() / 2;
    let (_, median, _) = seen.select_nth_unstable_by(middle, f32::total_cmp);
    *median / (0.6745 * 6f32.sqrt())
}

#[cfg(test)]
mod tests {
    use super::super::grid::Grid;
    use super::*;

    #[test]
    fn noise_goes_edges_and_slopes_stay() {
        let (width, height, slope) = (120, 60, 0.25f32);
        let truth = |x: usize| slope * x as f32 + if x >= 60 { 1.3 } else { 0.0 };
        let mut state = 1u32;
        let mut uniform = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / 8_388_608.0 - 1.0
        };
        let wrapped: Vec<f32> =
            (0..width * height).map(|i| wrap(truth(i % width) + 0.02 * uniform())).collect();
        let (grid, usable) = (Grid::new(height, width, 3), vec![true; width * height]);
        let planes = [(); 4].map(|()| vec![0.5; width * height]);
        let light = planes.each_ref().map(Vec::as_slice);
        let scene = Scene { light, usable: &usable, width, grid: &grid, period_px: 25.0 };
        let slopes = Slopes { along: vec![slope; width * height], down: vec![0.0; width * height] };
        let modulation = vec![0.4; width * height];
        let spread = noise(&wrapped, &modulation, width);
        let mut out = vec![0.0; width * height];
        Window::new(&scene, &slopes, &modulation, spread).smooth(&wrapped, &mut out);
        let error = |i: usize| wrap(out[i] - truth(i % width)).abs();
        let worst = (0..width * height).map(error).fold(0.0, f32::max);
        assert!(worst < 0.02, "{worst}");
        let rms =
            ((0..width * height).map(|i| error(i).powi(2)).sum::<f32>() / (width * height) as f32).sqrt();
        assert!(rms < 0.004, "{rms}");
    }
}
