//! Joint least squares of all four channels: once the order is known every channel measures the same column.
//!
//! `I_c = rho (a_c + b_c cos(N_c / N_1 Phi + delta_c))` with `Phi` absolute: only albedo, background and modulation are
//! free, so that nothing can turn the phase as a whole. Rounds alternate between albedo (per pixel), background and
//! modulation (in a window of about a fringe) and one Gauss-Newton step of the phase (in the small window that follows
//! the surface).

use super::grid::Grid;
use super::local_fit::{Harmonic, Planes, RowMaps, cell_sums_at, smooth_albedo};
use super::window::Window;
use crate::Channel;
use crate::angle::sin_cos;
use rayon::prelude::*;

/// Width (sigma) of the window of backgrounds and modulations, in fringe periods.
const WINDOW: f32 = 1.0;
/// Rounds of albedo, background and phase.
const ROUNDS: usize = 4;
/// Ridge of the normal equations relative to the weight in the window.
const RIDGE: f32 = 1e-3;
/// Sums of one cell: the weight, then per channel w e, w e e, w I, w I e with e = cos(Phi_c + delta_c).
const SUMS: usize = 17;

/// Working maps of the joint fit.
#[derive(Debug, Clone, Default)]
pub(crate) struct Joint {
    numerator: Vec<f32>,
    denominator: Vec<f32>,
    next: Vec<f32>,
    /// Misfit of the four channels: mean square in linear light.
    pub misfit: Vec<f32>,
}

/// Background `a` and modulation `p` of the four channels on the cells.
pub(crate) type Channels = [Harmonic; 4];

impl Joint {
    /// Fit `phase` (absolute, rad) in place; `albedo` comes in as a first guess.
    pub fn run(
        &mut self,
        grid: &Grid,
        window: &Window<'_>,
        planes: &Planes<'_>,
        numbers: [f64; 3],
        period_px: f64,
        albedo: &mut Vec<f32>,
        phase: &mut Vec<f32>,
    ) {
        for map in [
            &mut self.numerator,
            &mut self.denominator,
            &mut self.next,
            &mut self.misfit,
        ] {
            map.resize(phase.len(), 0.0);
        }
        let ratios = ratios(numbers);
        for _ in 0..ROUNDS {
            let channels = fit(grid, planes, numbers, period_px, albedo, phase);
            self.update_albedo(grid, planes, &channels, ratios, albedo, phase);
            self.linearise(grid, planes, &channels, ratios, albedo, phase);
            window.step(phase, &self.numerator, &self.denominator, &mut self.next);
            std::mem::swap(phase, &mut self.next);
        }
    }

    /// Albedo of every pixel, not sharper than the lens.
    fn update_albedo(
        &mut self,
        grid: &Grid,
        planes: &Planes<'_>,
        channels: &Channels,
        ratios: [f32; 4],
        albedo: &mut Vec<f32>,
        phase: &[f32],
    ) {
        let width = planes.width;
        self.next
            .par_chunks_mut(width)
            .enumerate()
            .for_each_init(Row::default, |row, (y, out)| {
                row.start(width);
                let phase = &phase[y * width..][..width];
                for (c, light) in planes.rows(y).into_iter().enumerate() {
                    row.model(grid, &channels[c], c, ratios[c], y, phase);
                    for x in 0..width {
                        let model = row.model[x].max(0.0);
                        row.top[x] += model * light[x];
                        row.bottom[x] += model * model;
                    }
                }
                for (x, value) in out.iter_mut().enumerate() {
                    *value = (row.top[x] / row.bottom[x].max(1e-9)).max(1e-4);
                }
            });
        std::mem::swap(albedo, &mut self.next);
        smooth_albedo(albedo, &mut self.next, width);
    }

    /// Gauss-Newton terms of every pixel, and how far the channels are from their model.
    fn linearise(
        &mut self,
        grid: &Grid,
        planes: &Planes<'_>,
        channels: &Channels,
        ratios: [f32; 4],
        albedo: &[f32],
        phase: &[f32],
    ) {
        let width = planes.width;
        self.numerator
            .par_chunks_mut(width)
            .zip(self.denominator.par_chunks_mut(width))
            .zip(self.misfit.par_chunks_mut(width))
            .enumerate()
            .for_each_init(
                Row::default,
                |row, (y, ((numerator, denominator), misfit))| {
                    row.start(width);
                    let at = y * width..(y + 1) * width;
                    let (phase, albedo) = (&phase[at.clone()], &albedo[at]);
                    numerator.fill(0.0);
                    denominator.fill(0.0);
                    misfit.fill(0.0);
                    for (c, light) in planes.rows(y).into_iter().enumerate() {
                        row.model(grid, &channels[c], c, ratios[c], y, phase);
                        for x in 0..width {
                            let error = light[x] - albedo[x] * row.model[x];
                            let slope = albedo[x] * row.slope[x];
                            numerator[x] += slope * error;
                            denominator[x] += slope * slope;
                            misfit[x] += 0.25 * error * error;
                            row.top[x] += albedo[x] * slope * row.model[x];
                            row.bottom[x] += albedo[x] * albedo[x] * row.model[x] * row.model[x];
                        }
                    }
                    for x in 0..width {
                        denominator[x] = (denominator[x]
                            - row.top[x] * row.top[x] / row.bottom[x].max(1e-9))
                        .max(0.1 * denominator[x]);
                    }
                },
            );
    }
}

fn ratios(numbers: [f64; 3]) -> [f32; 4] {
    Channel::ALL.map(|c| (numbers[c.phase_index()] / numbers[0]) as f32)
}

/// Working rows.
#[derive(Default)]
struct Row {
    maps: RowMaps,
    /// Model for an albedo of 1, and its derivative by the absolute phase.
    model: Vec<f32>,
    slope: Vec<f32>,
    top: Vec<f32>,
    bottom: Vec<f32>,
}

impl Row {
    fn start(&mut self, width: usize) {
        for row in [
            &mut self.model,
            &mut self.slope,
            &mut self.top,
            &mut self.bottom,
        ] {
            row.clear();
            row.resize(width, 0.0);
        }
    }

    fn model(
        &mut self,
        grid: &Grid,
        channel: &Harmonic,
        c: usize,
        ratio: f32,
        y: usize,
        phase: &[f32],
    ) {
        let width = phase.len();
        let slow = [&channel.a, &channel.p, &channel.p, &channel.p];
        let [a, b, ..] = self.maps.sample(grid, y, slow, width);
        for x in 0..width {
            let (s, e) = carrier(c, ratio, phase[x]);
            self.model[x] = a[x] + b[x] * e;
            self.slope[x] = -b[x] * ratio * s;
        }
    }
}

/// Sine and cosine of a channel's own phase.
#[inline]
fn carrier(c: usize, ratio: f32, phase: f32) -> (f32, f32) {
    let (s, e) = sin_cos(ratio * phase);
    if c == Channel::B.index() {
        (e, -s)
    } else {
        (s, e)
    }
}

/// Background and modulation of every channel on the cells, intensities divided by the albedo and weighted by its
/// square, as additive noise asks for.
pub(crate) fn fit(
    grid: &Grid,
    planes: &Planes<'_>,
    numbers: [f64; 3],
    period_px: f64,
    albedo: &[f32],
    phase: &[f32],
) -> Channels {
    let ratios = ratios(numbers);
    let sigma_cells = WINDOW * period_px as f32 / grid.step as f32;
    let width = planes.width;
    let mut sums = cell_sums_at::<SUMS>(grid, planes, |rows, usable, y, x| {
        let mut sums = [0.0; SUMS];
        let at = y * width + x;
        if usable[x] && phase[at].is_finite() {
            let rho = albedo[at];
            sums[0] = rho * rho;
            for (c, row) in rows.iter().enumerate() {
                let (_, e) = carrier(c, ratios[c], phase[at]);
                let light = rho * row[x];
                sums[1 + 4 * c..5 + 4 * c].copy_from_slice(&[
                    rho * rho * e,
                    rho * rho * e * e,
                    light,
                    light * e,
                ]);
            }
        }
        sums
    });
    grid.smooth_all(&mut sums, sigma_cells);
    std::array::from_fn(|c| {
        let mut channel = Harmonic::default();
        for i in 0..grid.cells() {
            let [a, b] = solve([0, 1 + 4 * c, 2 + 4 * c, 3 + 4 * c, 4 + 4 * c].map(|k| sums[k][i]));
            channel.a.push(a);
            channel.p.push(b);
        }
        channel
    })
}

/// Background and modulation from the sums of one window.
fn solve([w, e, ee, light, light_e]: [f32; 5]) -> [f32; 2] {
    let (w, ee) = (w * (1.0 + RIDGE) + 1e-9, ee + w * RIDGE + 1e-9);
    let scale = 1.0 / (w * ee - e * e).max(f32::MIN_POSITIVE);
    [
        (ee * light - e * light_e) * scale,
        (w * light_e - e * light) * scale,
    ]
}
