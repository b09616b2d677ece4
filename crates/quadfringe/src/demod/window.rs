//! A smoothing window that follows the local slope of the phase and stops at edges.
//!
//! Neighbours count as far as their phase fits the plane through the pixel within the noise (a plane-compensated
//! bilateral window, Tukey's biweight); phases are compared modulo a turn, so they may be wrapped or absolute.

use super::scene::{RowMaps, Scene};
use crate::angle::{round, wrap};
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

/// Slopes of the phase on the cells, in rad per pixel.
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
    maps: RowMaps,
    along: Vec<f32>,
    down: Vec<f32>,
    sharpness: Vec<f32>,
    weight: Vec<f32>,
    offset: Vec<f32>,
    top: Vec<f32>,
    bottom: Vec<f32>,
}

/// One neighbour of a row: its offset, the columns that have it, and its index less the column (wrapping).
struct Neighbour {
    dx: f32,
    dy: f32,
    from: usize,
    to: usize,
    start: usize,
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

    /// The phase, smoothed.
    pub fn smooth(&self, phase: &[f32], out: &mut [f32]) {
        self.run(phase, out, |rows, at| {
            let Rows { weight, offset, top, bottom, .. } = rows;
            for x in at.from..at.to {
                top[x] += weight[x] * offset[x];
                bottom[x] += weight[x];
            }
        });
    }

    /// The phase plus the ratio of two maps, each summed over the window: a Gauss-Newton step that neighbours share.
    pub fn step(&self, phase: &[f32], numerator: &[f32], denominator: &[f32], out: &mut [f32]) {
        self.run(phase, out, |rows, at| {
            let Rows { weight, offset, top, bottom, .. } = rows;
            let (numerator, denominator) = (&numerator[at.start..], &denominator[at.start..]);
            let n = at.to - at.from;
            let sums = top[at.from..at.to].iter_mut().zip(&mut bottom[at.from..at.to]);
            let terms = numerator[..n].iter().zip(&denominator[..n]);
            let seen = weight[at.from..at.to].iter().zip(&offset[at.from..at.to]);
            for (((top, bottom), (w, d)), (num, den)) in sums.zip(seen).zip(terms) {
                *top += w * (num + den * d);
                *bottom += w * den;
            }
        });
    }

    fn run(&self, phase: &[f32], out: &mut [f32], gather: impl Fn(&mut Rows, &Neighbour) + Sync) {
        let width = self.scene.width;
        let height = phase.len() / width;
        out.par_chunks_mut(width).enumerate().for_each_init(Rows::default, |rows, (y, out)| {
            self.start(y, rows);
            let here = &phase[y * width..][..width];
            for dy in -self.radius..=self.radius {
                let Some(row) = y.checked_add_signed(dy).filter(|&r| r < height) else {
                    continue;
                };
                for dx in -self.radius..=self.radius {
                    let from = dx.min(0).unsigned_abs().min(width);
                    let to = (width as isize - dx.max(0)).max(from as isize) as usize;
                    let start = (row * width + from).wrapping_add_signed(dx);
                    let at = Neighbour { dx: dx as f32, dy: dy as f32, from, to, start };
                    self.weigh(here, phase, &at, rows);
                    gather(rows, &at);
                }
            }
            for (x, value) in out.iter_mut().enumerate() {
                *value = here[x] + rows.top[x] / rows.bottom[x].max(f32::MIN_POSITIVE);
            }
        });
    }

    fn start(&self, y: usize, rows: &mut Rows) {
        let width = self.scene.width;
        let Rows { maps, along, down, sharpness, weight, offset, top, bottom } = rows;
        for row in [&mut *along, down, sharpness, weight, offset, top, bottom] {
            row.clear();
            row.resize(width, 0.0);
        }
        let [a, d] = maps.sample(self.scene, y, [&self.slopes.along, &self.slopes.down]);
        along.copy_from_slice(a);
        down.copy_from_slice(d);
        for (sharp, &m) in sharpness.iter_mut().zip(&self.modulation[y * width..]) {
            let reach = (REACH_SIGMAS * self.noise / m.max(1e-6)).clamp(REACH_RAD, TAU);
            *sharp = 1.0 / (reach * reach);
        }
    }

    /// Weight of one neighbour for every pixel of a row, and its phase less what the slope explains.
    #[inline]
    fn weigh(&self, here: &[f32], phase: &[f32], at: &Neighbour, rows: &mut Rows) {
        let spatial = (-0.5 * (at.dx * at.dx + at.dy * at.dy) / (self.sigma * self.sigma)).exp();
        let (from, to, n) = (at.from, at.to, at.to - at.from);
        let there = &phase[at.start..at.start + n];
        let lit = &self.modulation[at.start..at.start + n];
        let here = &here[from..to];
        let (along, down) = (&rows.along[from..to], &rows.down[from..to]);
        let sharpness = &rows.sharpness[from..to];
        let weight = &mut rows.weight[from..to];
        let offset = &mut rows.offset[from..to];
        for x in 0..n {
            let turns = (there[x] - here[x] - along[x] * at.dx - down[x] * at.dy) * (1.0 / TAU);
            let d = (turns - round(turns)) * TAU;
            let fits = (1.0 - d * d * sharpness[x]).max(0.0);
            weight[x] = if lit[x] > 0.0 { spatial * fits * fits } else { 0.0 };
            offset[x] = d;
        }
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
        let slopes = Slopes { along: vec![slope; grid.cells()], down: vec![0.0; grid.cells()] };
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
