//! Joint least squares of all four channels: once the order is known every channel measures the same column.
//!
//! `I_c = rho (a_c + b_c cos(N_c / N_1 Phi + delta_c))` with `Phi` absolute: a Gauss-Newton step of the phase of every
//! pixel, its albedo eliminated, averaged over the window that follows the surface.

use super::cells::RowMaps;
use super::local_fit::binomial;
use super::photometry::{Backgrounds, carriers};
use super::scene::{Scene, around};
use super::window::{Average, Window, WindowRows};
use crate::parallel::lanes::{LANES, lanes, lanes_mut, put, take};
use crate::parallel::slots::Slots;
use multiversion::multiversion;
use rayon::prelude::*;

/// Rows that one task works on: of each the model is computed once, but for the two rows beside a block.
const BLOCK: usize = 32;

/// Share of a pixel in the albedo that it is given, the mean of nine by [`binomial`]. Were all of it its own, a step would be up to
/// four times longer and, where neighbours err to different sides, lead beyond the solution.
const OWN_ALBEDO: f32 = 0.25;

/// What a dark pixel counts in the albedo of its neighbours: its phase is anything, and with it its albedo.
const UNKNOWN: f32 = 1e-3;

/// Working rows of the joint fit.
#[derive(Debug, Default)]
pub(crate) struct Joint {
    slots: Slots<Rows>,
}

/// Rows of the image to write what a round finds, each as long as what is wanted of it.
pub(crate) struct Found<'a> {
    /// Misfit of the four channels: mean square in linear light.
    pub misfit: Vec<&'a mut [f32]>,
    /// Modulation of R and B in linear light.
    pub modulation: Vec<&'a mut [f32]>,
    /// What the window knows of the phase of every pixel: sum of weighted squared derivatives, 1/rad^2 in units of linear
    /// light. The uncertainty is made of it.
    pub information: Vec<&'a mut [f32]>,
}

impl Found<'_> {
    /// When nothing is wanted but the phase.
    pub fn nothing(height: usize) -> Self {
        let rows = || (0..height).map(|_| <&mut [f32]>::default()).collect();
        Self { misfit: rows(), modulation: rows(), information: rows() }
    }
}

/// Sums over the four channels on one row: products of the model `m` for an albedo of 1, of its derivative `d` by the phase and
/// of the light `s`, as mm, md, dd, ms, ds, ss; the mean modulation of R and B for an albedo of 1; the albedo that fits best times
/// its weight, and that weight.
#[derive(Debug, Default)]
struct ModelRow {
    rows: [Vec<f32>; 9],
}

/// Rows of one task.
#[derive(Debug, Default)]
struct Rows {
    maps: RowMaps,
    losses: RowMaps,
    ring: [ModelRow; 3],
    /// Means of albedo and weight over neighbours.
    means: [Vec<f32>; 2],
    smooth: Vec<f32>,
    /// Misfit and modulation.
    found: [Vec<f32>; 2],
    window: WindowRows,
}

impl Joint {
    /// One round on an absolute phase in rad, in place. `ratios` are the fringe numbers over the first; what two `lent` planes
    /// held is lost.
    pub fn step(
        &mut self,
        scene: &Scene<'_>,
        (backgrounds, ratios): (&Backgrounds, [f32; 3]),
        window: &Window<'_>,
        phase: &mut [f32],
        [average, weight]: [&mut [f32]; 2],
        found: &mut Found<'_>,
    ) {
        let (grid, slots) = (scene.grid, &self.slots);
        let [average, weight] = [average, weight].map(|plane| &mut plane[..grid.pixels()]);
        let Found { misfit, modulation, information } = found;
        let before = &*phase;
        let out = average
            .par_chunks_mut(grid.stride)
            .zip(weight.par_chunks_mut(grid.stride))
            .zip(misfit.par_iter_mut().zip(modulation.par_iter_mut()))
            .chunks(BLOCK)
            .enumerate();
        out.for_each_init(
            || slots.take(),
            |rows, (block, out)| {
                let rows = &mut **rows;
                let first = block * BLOCK;
                let model = |rows: &mut Rows, y: usize, at: usize| {
                    let maps = backgrounds.sample(scene, y, &mut rows.maps);
                    let loss = window.loss(y, &mut rows.losses);
                    let pixels = [scene.row(before, y), loss, window.modulation(y)];
                    rows.ring[at].fill(maps, pixels, scene.rows(y), ratios);
                };
                model(rows, around(first, grid.height)[0], 0);
                model(rows, first, 1);
                for (i, ((phase, weight), (misfit, modulation))) in out.into_iter().enumerate() {
                    let y = first + i;
                    model(rows, around(y, grid.height)[2], (i + 2) % 3);
                    let Rows { ring, means, smooth, found, window: window_rows, .. } = rows;
                    means.iter_mut().chain(&mut *found).for_each(|row| row.resize(grid.stride, 0.0));
                    for (mean, from) in means.iter_mut().zip([7, 8]) {
                        let near = [0, 1, 2].map(|k| ring[(i + k) % 3].rows[from].as_slice());
                        binomial(near, grid.width, smooth, mean);
                    }
                    let model = ring[(i + 1) % 3].rows.each_ref().map(Vec::as_slice);
                    let means = means.each_ref().map(Vec::as_slice);
                    let lit = [window.modulation(y), scene.row(scene.usable, y)];
                    let [misfits, modulations] = found.each_mut().map(Vec::as_mut_slice);
                    let measure = |[numerator, denominator]: [&mut [f32]; 2]| {
                        linearise(model, means, lit, [numerator, denominator, misfits, modulations]);
                    };
                    window.along(y, window_rows, scene.row(before, y), measure, [phase, weight]);
                    let [misfits, modulations] = found;
                    misfit.copy_from_slice(&misfits[..misfit.len()]);
                    modulation.copy_from_slice(&modulations[..modulation.len()]);
                }
            },
        );
        let average = Average { phase: average, weight };
        window.down(&average, slots, |rows| &mut rows.window, phase, information);
    }
}

impl ModelRow {
    fn fill(&mut self, maps: [&[f32]; 8], pixels: [&[f32]; 3], light: [&[f32]; 4], ratios: [f32; 3]) {
        self.rows.iter_mut().for_each(|row| row.resize(pixels[0].len(), 0.0));
        predict(maps, pixels, light, ratios, self.rows.each_mut().map(Vec::as_mut_slice));
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn predict(
    maps: [&[f32]; 8],
    pixels: [&[f32]; 3],
    light: [&[f32]; 4],
    ratios: [f32; 3],
    out: [&mut [f32]; 9],
) {
    let (maps, pixels, light) = (maps.map(lanes), pixels.map(lanes), light.map(lanes));
    let mut out = out.map(lanes_mut);
    for i in 0..pixels[0].len() {
        let (maps, light) = (take(&maps, i), take(&light, i));
        let [phase, loss, lit] = take(&pixels, i);
        let mut found = [[0.0; LANES]; 9];
        for x in 0..LANES {
            let (cosines, derivatives) = carriers(phase[x], ratios, loss[x]);
            let (mut mm, mut md, mut dd) = (1e-9f32, 0.0f32, 0.0f32);
            let (mut ms, mut ds, mut ss) = (0.0f32, 0.0f32, 0.0f32);
            for c in 0..4 {
                let (a, b, s) = (maps[2 * c][x], maps[2 * c + 1][x], light[c][x]);
                let m = a + b * cosines[c];
                let (m, d) = (if m > 0.0 { m } else { 0.0 }, b * derivatives[c]);
                mm += m * m;
                md += m * d;
                dd += d * d;
                ms += m * s;
                ds += d * s;
                ss += s * s;
            }
            let albedo = ms / mm;
            let albedo = if albedo > 1e-4 { albedo } else { 1e-4 };
            let weight = if lit[x] > 0.0 { 1.0 } else { UNKNOWN };
            let mean = 0.5 * (maps[1][x] + maps[5][x]);
            let own = [mm, md, dd, ms, ds, ss, mean, weight * albedo, weight];
            (0..9).for_each(|row| found[row][x] = own[row]);
        }
        put(&mut out, i, &found);
    }
}

/// Gauss-Newton terms of every pixel with the albedo eliminated, and how far the channels are from their model.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn linearise(model: [&[f32]; 9], means: [&[f32]; 2], lit: [&[f32]; 2], out: [&mut [f32]; 4]) {
    let (model, means, lit) = (model.map(lanes), means.map(lanes), lit.map(lanes));
    let mut out = out.map(lanes_mut);
    for i in 0..means[0].len() {
        let [mm, md, dd, ms, ds, ss, modulation, _, _] = take(&model, i);
        let ([albedo, weight], lit) = (take(&means, i), take(&lit, i));
        let mut found = [[0.0; LANES]; 4];
        for x in 0..LANES {
            let albedo = albedo[x] / weight[x];
            let top = albedo * (ds[x] - albedo * md[x]);
            let square = ss[x] - albedo * (2.0 * ms[x] - albedo * mm[x]);
            // What a change of albedo would explain as well says nothing about the phase.
            let kept = albedo * albedo * (dd[x] - OWN_ALBEDO * md[x] * md[x] / mm[x]);
            let on = (lit[0][x] > 0.0) & (lit[1][x] > 0.0);
            found[0][x] = if on { top } else { 0.0 };
            found[1][x] = if on { kept } else { 0.0 };
            found[2][x] = if square > 0.0 { 0.25 * square } else { 0.0 };
            found[3][x] = if lit[0][x] > 0.0 { albedo * modulation[x] } else { 0.0 };
        }
        put(&mut out, i, &found);
    }
}
