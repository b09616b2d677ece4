//! Step 9: whether the channels agree. The difference between the phase of R with B and that of G with IR, beyond noise.
//!
//! All four channels measure the same column. Where offsets, amplitudes or albedo are wrong (near edges, at the border of the
//! image, on textured or moving surfaces) the error of each pair is different, and the mean of both is off by about half of
//! their difference.

use super::cells::{CellMaps, CellWindow, RowMaps, TaskWork, kernel};
use super::infrared::{Waves, with_waves};
use super::model::FringeRows;
use super::params::uncertainty::{
    PAIR_EXCESS_MAX_RAD2, PAIR_NEIGHBOURHOOD, PAIR_SAMPLED_ROWS, PAIR_SHARE_MIN, PAIR_WINDOW,
};
use super::photometry::Photometry;
use super::scene::{PhaseMap, PixelRow, Scene};
use crate::parallel::lanes::{LANES, Lanes, add, lanes, take};
use crate::parallel::slots::Slots;
use multiversion::multiversion;

/// Variance of the phase by the disagreement of the two pairs, on the cells, with working maps.
#[derive(Debug)]
pub(super) struct Agreement {
    variance: CellMaps,
    excess: CellMaps,
    sums: CellMaps,
    slots: Slots<TaskWork<RowMaps>>,
}

impl Default for Agreement {
    fn default() -> Self {
        Self {
            variance: CellMaps::new(1),
            excess: CellMaps::new(2),
            sums: CellMaps::default(),
            slots: Slots::default(),
        }
    }
}

impl Agreement {
    /// Measure the disagreement at a final absolute phase. `ratios` are the fringe numbers over the first, `noise` is the standard
    /// deviation of the intensities in linear light.
    pub fn measure(
        &mut self,
        scene: &Scene<'_>,
        ratios: [f32; 4],
        noise: f32,
        photometry: &Photometry,
        map: PhaseMap<'_>,
    ) {
        let sigma = scene.cells(PAIR_WINDOW);
        // Sum of the squared weights of the window, along rows times along columns.
        let share = kernel(sigma).iter().map(|weight| weight * weight).sum::<f32>().powi(2);
        let variance = noise * noise * share;
        scene.grid.window_sums::<4, RowMaps>(
            CellWindow { sigma_cells: sigma, sampled_rows: PAIR_SAMPLED_ROWS },
            &self.slots,
            &mut self.sums,
            &mut self.excess,
            |maps, y, sums| {
                // Offsets and amplitudes of the place of each pixel: those that it has chosen among many were chosen to agree.
                let fringes = photometry.sample_in_place(scene, y, maps);
                let pixels = scene.pixel_row(map, y);
                with_waves!(scene, y, ratios, |waves| add_pairs(
                    &fringes,
                    &pixels,
                    scene.rows(y),
                    waves,
                    sums
                ));
            },
            |_, [numerator, information, other_numerator, other_information], out| {
                let pair = Pair { numerator, information };
                let other = Pair { numerator: other_numerator, information: other_information };
                let (weight, found) = out.split_at_mut(numerator.len());
                excess(pair, other, variance, weight, found);
            },
        );
        self.average(scene);
    }

    /// Mean excess over the neighbourhood.
    fn average(&mut self, scene: &Scene<'_>) {
        let Self { variance, excess, sums, slots } = self;
        let excess = &*excess;
        scene.grid.smooth::<2, RowMaps>(
            scene.cells(PAIR_NEIGHBOURHOOD),
            slots,
            sums,
            variance,
            |row, k| Some(excess.line(row, k)),
            |_, [weight, excess], out| {
                for (out, (weight, excess)) in out.iter_mut().zip(weight.iter().zip(excess)) {
                    *out = excess.max(0.0) / weight.max(1e-6);
                }
            },
        );
    }

    /// Variance of the phase along row `y`, rad^2.
    pub fn row<'a>(&self, scene: &Scene<'_>, y: usize, maps: &'a mut RowMaps) -> &'a [f32] {
        let [row] = maps.sample(scene.grid, &self.variance, 0, y);
        row
    }
}

/// Normal equations of a phase step by one pair of channels, cell by cell: the step is numerator over information.
#[derive(Clone, Copy)]
struct Pair<'a> {
    numerator: &'a [f32],
    information: &'a [f32],
}

/// Adds numerator and information of R with B and of G with IR, the albedo eliminated.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn add_pairs<W: Waves>(
    fringes: &FringeRows,
    pixels: &PixelRow,
    light: [&[f32]; 4],
    waves: W,
    sums: &mut [[Lanes; 4]],
) {
    let pixels = [pixels.phase, pixels.modulation, pixels.usable].map(lanes);
    let (offset, amplitude, light) =
        (fringes.offset.map(lanes), fringes.amplitude.map(lanes), light.map(lanes));
    for (i, sums) in sums.iter_mut().enumerate() {
        let (offset, amplitude, light) = (take(&offset, i), take(&amplitude, i), take(&light, i));
        let [phase, modulation, usable] = take(&pixels, i);
        let vector = waves.vector(i);
        let mut terms = [[0.0; LANES]; 4];
        for x in 0..LANES {
            let carriers = waves.carriers(&vector, x, phase[x]);
            let (mut mm, mut ms) = (1e-9f32, 0.0f32);
            let (mut ds, mut dd, mut dm) = ([0.0f32; 2], [0.0f32; 2], [0.0f32; 2]);
            for c in 0..4 {
                let (a, b) = (offset[c][x], amplitude[c][x]);
                let (m, d) = (a + b * carriers.cosine[c], b * carriers.derivative[c]);
                mm += m * m;
                ms += m * light[c][x];
                ds[c % 2] += d * light[c][x];
                dd[c % 2] += d * d;
                dm[c % 2] += d * m;
            }
            let albedo = ms / mm;
            let weight = if modulation[x] > 0.0 { usable[x] * albedo } else { 0.0 };
            for k in 0..2 {
                terms[2 * k][x] = weight * (ds[k] - albedo * dm[k]);
                terms[2 * k + 1][x] = weight * albedo * (dd[k] - dm[k] * dm[k] / mm);
            }
        }
        add(sums, &terms);
    }
}

/// Weight of every cell, then the squared difference between the pairs above that of noise, as a variance of their mean.
fn excess(pair: Pair<'_>, other: Pair<'_>, variance: f32, weight: &mut [f32], excess: &mut [f32]) {
    for i in 0..weight.len() {
        let (first, second) = (pair.information[i], other.information[i]);
        let whole = first + second;
        let counts = whole > 1e-9 && first.min(second) > PAIR_SHARE_MIN * whole;
        (weight[i], excess[i]) = (0.0, 0.0);
        if counts {
            let apart = pair.numerator[i] / first - other.numerator[i] / second;
            let by_noise = variance * (1.0 / first + 1.0 / second);
            let shares = (first * first + second * second) / (2.0 * whole * whole);
            (weight[i], excess[i]) = (1.0, shares * (apart * apart - by_noise).min(PAIR_EXCESS_MAX_RAD2));
        }
    }
}
