//! Step 3: the phasor of the fringes in a window, by fits of a signal against a plane wave.
//!
//! In a window of about a fringe the signal is fitted as an offset plus cosine and sine of a plane wave. The coefficients turn the
//! wave into the phasor of the signal (J34), whose local frequency is closer to that of the fringes; so the fit is repeated with it.
//! The signal is R for three colours of different fringe numbers. Of R and B in quadrature it is their ratio (J40), which does not
//! depend on the albedo that both share.

use super::rows::{Rows, turn};
use super::signal::{self, Gain, Signal, fit, sum};
use crate::joint::cells::{CellMaps, CellWindow, RowMaps, TaskWork};
use crate::joint::params::local_fit::CARRIER_WINDOWS;
use crate::joint::params::pyramid::SAMPLED_ROWS;
use crate::joint::scene::Scene;
use crate::parallel::angle::sin_cos;
use crate::parallel::lanes::{LANES, lanes_mut, put};
use crate::parallel::slots::Slots;
use multiversion::multiversion;
use std::f32::consts::{FRAC_1_SQRT_2, TAU};

/// The phasor of R along the rows of a scene.
#[derive(Debug)]
pub(super) struct Carrier {
    signal: Signal,
    /// Change of the phase of the plane wave per pixel along a row and along a column, in rad.
    per_px: [f32; 2],
    /// `g` of the whole image.
    gain: f32,
    /// The fits, each against the phasor of those before.
    fits: [CellMaps; CARRIER_WINDOWS.len()],
}

impl Carrier {
    pub fn new(signal: Signal) -> Self {
        let mut fits = std::array::from_fn(|_| CellMaps::new(fit::FOLLOWED));
        fits[CARRIER_WINDOWS.len() - 1] = CellMaps::new(fit::COUNT);
        Self { signal, per_px: [0.0; 2], gain: 1.0, fits }
    }

    /// Finds the phasor in a scene.
    pub fn find(&mut self, scene: &Scene<'_>, slots: &Slots<TaskWork<Rows>>, sums: &mut CellMaps) {
        let [along, down] = match self.signal {
            Signal::Red => signal::direction(scene),
            Signal::Ratio => signal::direction_in_quadrature(scene),
        };
        let turn = TAU / scene.period_px as f32;
        self.per_px = [turn * along, turn * down];
        self.gain = signal::gain(scene);
        for (number, width) in CARRIER_WINDOWS.into_iter().enumerate() {
            let mut found = std::mem::take(&mut self.fits[number]);
            let before = &*self;
            scene.grid.window_sums::<{ sum::COUNT }, Rows>(
                CellWindow { sigma_cells: scene.cells(width), sampled_rows: SAMPLED_ROWS },
                slots,
                sums,
                &mut found,
                |Rows { maps, cos, sin, signal, total, .. }, y, sums| {
                    before.wave(scene, y, number, maps, [cos, sin]);
                    before.signal(scene, y, number, maps, [signal, total]);
                    signal::add_signal(scene.row(scene.usable, y), [cos, sin], [signal, total], sums);
                },
                |row, sums, out| {
                    let gains = number.checked_sub(1).map(|last| before.fits[last].line(row, fit::RATIO));
                    signal::solve_row(sums, |column| gains.map_or(before.gain, |gains| gains[column]), out);
                },
            );
            self.fits[number] = found;
        }
    }

    /// The phasor of R along row `y`, as cosine and sine of its phase.
    pub fn row(&self, scene: &Scene<'_>, y: usize, maps: &mut RowMaps, [cos, sin]: [&mut Vec<f32>; 2]) {
        self.wave(scene, y, self.fits.len(), maps, [&mut *cos, &mut *sin]);
        if self.signal == Signal::Ratio {
            // The first harmonic of the ratio is greatest where cos(Phi) + sin(Phi) is, an eighth of a turn after R.
            for (cos, sin) in cos.iter_mut().zip(sin) {
                (*cos, *sin) = (FRAC_1_SQRT_2 * (*cos - *sin), FRAC_1_SQRT_2 * (*cos + *sin));
            }
        }
    }

    /// The albedo of the pixels of row `y` by their `R + g B`, relative to that of the window; `phasor` is that of [`Self::row`].
    pub fn albedo(
        &self,
        scene: &Scene<'_>,
        y: usize,
        maps: &mut RowMaps,
        phasor: [&[f32]; 2],
        out: &mut Vec<f32>,
    ) {
        out.resize(scene.grid.stride, 0.0);
        let last = &self.fits[self.fits.len() - 1];
        signal::albedo(maps.sample(scene.grid, last, fit::RATIO, y), phasor, scene.rows(y), out);
    }

    /// The share of the variance of the ratio in a row of cells that fringes of one surface explain: less where a window sees two
    /// surfaces or several colours, or where noise makes most of the variance.
    pub fn purity(&self, row: usize) -> &[f32] {
        self.fits[self.fits.len() - 1].line(row, fit::PURITY)
    }

    /// The plane wave, turned by the first `fits`.
    fn wave(
        &self,
        scene: &Scene<'_>,
        y: usize,
        fits: usize,
        maps: &mut RowMaps,
        [cos, sin]: [&mut Vec<f32>; 2],
    ) {
        [&mut *cos, &mut *sin].into_iter().for_each(|row| row.resize(scene.grid.stride, 0.0));
        plane_wave(self.per_px, y, cos, sin);
        for found in &self.fits[..fits] {
            let [p, q] = maps.sample(scene.grid, found, fit::P, y);
            turn([p, q], cos, sin);
        }
    }

    /// The signal, and what it was divided by, with the `g` of the fit before number `fit`.
    fn signal(
        &self,
        scene: &Scene<'_>,
        y: usize,
        number: usize,
        maps: &mut RowMaps,
        [signal, total]: [&mut Vec<f32>; 2],
    ) {
        let light = scene.rows(y);
        signal.clear();
        signal.extend_from_slice(light[0]);
        total.resize(light[0].len(), 0.0);
        if self.signal == Signal::Ratio {
            let gain = match number.checked_sub(1) {
                None => Gain::Everywhere(self.gain),
                Some(last) => {
                    let [gain] = maps.sample(scene.grid, &self.fits[last], fit::RATIO, y);
                    Gain::Row(gain)
                }
            };
            signal::ratio(gain, light[2], signal, total);
        }
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn plane_wave([along, down]: [f32; 2], y: usize, cos: &mut [f32], sin: &mut [f32]) {
    let mut out = [lanes_mut(cos), lanes_mut(sin)];
    for i in 0..out[0].len() {
        let mut wave = [[0.0; LANES]; 2];
        for x in 0..LANES {
            let (sine, cosine) = sin_cos(along * (i * LANES + x) as f32 + down * y as f32);
            (wave[0][x], wave[1][x]) = (cosine, sine);
        }
        put(&mut out, i, &wave);
    }
}
