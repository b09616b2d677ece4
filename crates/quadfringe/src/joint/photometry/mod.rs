//! Step 5: photometry, which fits offset and amplitude of every channel once the absolute phase is known.
//!
//! In the model (S1) each pixel has a phase and an albedo, and each window of about a fringe has offsets `A` and amplitudes `B`.
//! To first order, an error of the phase or the albedo changes the four intensities of a pixel in known directions. These
//! directions are projected out (variable projection; Golub and Pereyra, SIAM J. Numer. Anal. 10, 413 (1973)), so that neither
//! noise of the phase nor texture reaches `A` and `B`, and one fit replaces many alternating ones.

mod choice;
#[cfg(test)]
mod edge;
mod solve;
mod texture;

use super::cells::{CellMaps, CellWindow, Grid, RowMaps, TaskWork};
use super::local_fit::LocalFit;
use super::model::{CellFringes, FringeRows, carriers, contrast};
use super::params::photometry::{CELL, NEIGHBOURHOOD, OTHER_TEXTURE_MIN, OTHER_TEXTURE_NOISES, WINDOW};
use super::scene::{PhaseMap, Scene};
use super::slopes::Slopes;
use crate::parallel::lanes::{LANES, Lanes, add, lanes, take};
use crate::parallel::slots::Slots;
use choice::Choice;
use multiversion::multiversion;
use solve::{MATRIX, SUMS, improve};
use texture::PixelAlbedo;

/// Offsets and amplitudes on cells that are wider than the cells of the scene.
#[derive(Debug)]
pub(in crate::joint) struct Photometry {
    grid: Grid,
    maps: CellMaps,
    next: CellMaps,
    sums: CellMaps,
    choice: Choice,
    albedo: PixelAlbedo,
    slots: Slots<TaskWork<Rows>>,
}

/// Working rows.
#[derive(Debug, Default)]
struct Rows {
    maps: RowMaps,
    losses: RowMaps,
    usable: Vec<f32>,
}

/// How offsets and amplitudes are fitted.
pub(in crate::joint) struct PhotometryFit {
    /// Greatest misfit (root mean square residual over modulation) of a pixel that takes part.
    pub misfit_max: f32,
    /// Noise divided by modulation.
    pub relative_noise: f32,
    /// Number of pixel rows that are sampled for each row of cells.
    pub sampled_rows: usize,
    /// Weight of the given phase relative to the information about the phase in the light.
    pub phase_trust: f32,
    /// A pixel takes part if at least this share of the window of the slopes around it is lit.
    pub lit_share_min: f32,
}

impl Photometry {
    pub fn new() -> Self {
        Self {
            grid: Grid::new([1, 1], 1.0),
            maps: CellMaps::new(8),
            next: CellMaps::new(8),
            sums: CellMaps::default(),
            choice: Choice::default(),
            albedo: PixelAlbedo::default(),
            slots: Slots::default(),
        }
    }

    /// Starts from the offsets and amplitudes of the local fit, which needs no orders, averaged over the neighbourhood. Where the
    /// phase hardly changes in a window, later fits cannot improve them.
    pub fn start(&mut self, scene: &Scene<'_>, fit: &LocalFit, slopes: &Slopes, ratios: [f32; 3]) {
        let fine = scene.grid;
        let side = (CELL * scene.period_px).max(fine.step as f64);
        self.grid = Grid::with_stride([fine.height, fine.width], fine.stride, side);
        let times = self.grid.step / fine.step;
        self.choice.forget();
        self.albedo.forget();
        self.next.fill::<8>(&self.grid, |row, lines| {
            for column in 0..lines[0].len() {
                let inside = |at: usize, count: usize| (at * times + times / 2).min(count - 1);
                let cell = [inside(row, fine.rows), inside(column, fine.columns)];
                let CellFringes { offset, amplitude } = fit.cell(cell[0], cell[1]);
                let loss = slopes.loss_at(scene, cell);
                for (c, ratio) in [ratios[0], ratios[1], ratios[0], ratios[2]].into_iter().enumerate() {
                    lines[2 * c][column] = offset[c];
                    lines[2 * c + 1][column] = amplitude[c] / contrast(loss * ratio * ratio);
                }
            }
        });
        self.draw_together(scene, f32::INFINITY);
    }

    /// Offsets and amplitudes that the pixels of row `y` have chosen, in the scene of the fit or a finer image of it.
    pub fn sample<'a>(&self, scene: &Scene<'_>, y: usize, maps: &'a mut RowMaps) -> FringeRows<'a> {
        let grid = self.grid.over(scene.grid);
        if self.albedo.is_known(scene) {
            return FringeRows::from_interleaved(self.albedo.sample(&grid, y, maps).map(|row| &*row));
        }
        let mut rows = maps.sample_mut(&grid, &self.maps, 0, y);
        self.choice.apply(&grid, &self.maps, y, &mut rows);
        FringeRows::from_interleaved(rows.map(|row| &*row))
    }

    /// Offsets and amplitudes at the positions of the pixels, whatever place they have chosen.
    pub fn sample_in_place<'a>(&self, scene: &Scene<'_>, y: usize, maps: &'a mut RowMaps) -> FringeRows<'a> {
        FringeRows::from_interleaved(maps.sample(&self.grid.over(scene.grid), &self.maps, 0, y))
    }

    /// Lets every pixel choose among the offsets and amplitudes of the places around it, given the phase in `map` and intensities
    /// with the standard deviation `noise`. Returns the share of the lit pixels that choose another place.
    pub fn choose_places(
        &mut self,
        scene: &Scene<'_>,
        ratios: [f32; 3],
        map: PhaseMap<'_>,
        slopes: &Slopes,
        noise: f32,
    ) -> f32 {
        let grid = self.grid.over(scene.grid);
        self.choice.make((&grid, &self.maps), scene, (ratios, slopes), [map.phase, map.modulation], noise)
    }

    /// Estimates the albedo of every channel at every pixel.
    pub fn estimate_albedo(
        &mut self,
        scene: &Scene<'_>,
        ratios: [f32; 3],
        map: PhaseMap<'_>,
        slopes: &Slopes,
        noise: f32,
    ) {
        let grid = self.grid.over(scene.grid);
        let Self { maps, albedo, sums, .. } = self;
        albedo.measure((&grid, maps), scene, (ratios, slopes), [map.phase, map.modulation], noise, sums);
    }

    /// Offsets and amplitudes near the middle of a cell of the scene's grid.
    pub fn cell(&self, scene: &Scene<'_>, row: usize, column: usize) -> CellFringes {
        let times = self.grid.over(scene.grid).step / scene.grid.step;
        let value = |k: usize| self.maps.line(row / times, k)[column / times];
        CellFringes { offset: [0, 2, 4, 6].map(value), amplitude: [1, 3, 5, 7].map(value) }
    }

    /// Fits offsets and amplitudes to an absolute phase. Pixels that have chosen another place take no part.
    pub fn fit(
        &mut self,
        scene: &Scene<'_>,
        ratios: [f32; 3],
        PhaseMap { phase, modulation }: PhaseMap<'_>,
        slopes: &Slopes,
        fit: &PhotometryFit,
    ) {
        let Self { grid, maps, next, sums, slots, choice, .. } = self;
        let &PhotometryFit { misfit_max, relative_noise, sampled_rows, phase_trust, lit_share_min } = fit;
        let sigma_cells = WINDOW * scene.period_px as f32 / grid.step as f32;
        grid.window_sums::<SUMS, Rows>(
            CellWindow { sigma_cells, sampled_rows },
            slots,
            sums,
            next,
            |rows, y, sums| {
                let Rows { maps: model, losses, usable } = rows;
                let model = model.sample::<8>(grid, maps, 0, y);
                usable.clear();
                usable.extend_from_slice(scene.row(scene.usable, y));
                choice.leave_out(y, usable);
                if lit_share_min > 0.0 {
                    let shares = slopes.lit(scene, y, losses).iter();
                    usable.iter_mut().zip(shares).for_each(|(usable, &lit)| {
                        *usable = if lit >= lit_share_min { *usable } else { 0.0 };
                    });
                }
                let [phase, modulation] = [phase, modulation].map(|plane| scene.row(plane, y));
                let pixels = [phase, modulation, usable, slopes.loss(scene, y, losses)];
                let limits = [4.0 * misfit_max * misfit_max, phase_trust];
                add_projected(model, pixels, scene.rows(y), ratios, limits, sums);
            },
            |row, sums, out| {
                let before: [&[f32]; 8] = std::array::from_fn(|k| maps.line(row, k));
                improve(sums, before, out);
            },
        );
        self.draw_together(scene, (OTHER_TEXTURE_NOISES * relative_noise).max(OTHER_TEXTURE_MIN));
    }

    /// Draws every cell to the mean of its neighbourhood unless the two differ by more than `threshold`.
    fn draw_together(&mut self, scene: &Scene<'_>, threshold: f32) {
        let Self { grid, maps, next, sums, slots, .. } = self;
        let sigma = NEIGHBOURHOOD * scene.period_px as f32 / grid.step as f32;
        let fitted = &*next;
        grid.smooth::<8, Rows>(
            sigma,
            slots,
            sums,
            maps,
            |row, k| Some(fitted.line(row, k)),
            |row, wide, out| blend(threshold, std::array::from_fn(|k| fitted.line(row, k)), wide, out),
        );
    }
}

/// Draws the fit of every cell to the mean of its neighbourhood unless their textures differ (J14).
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn blend(threshold: f32, cell: [&[f32]; 8], wide: [&[f32]; 8], out: &mut [f32]) {
    let columns = cell[0].len();
    for i in 0..columns {
        let norm = |maps: &[&[f32]; 8]| (0..8).map(|k| maps[k][i] * maps[k][i]).sum::<f32>().max(1e-12);
        // Only ratios have a meaning, because the albedo of the pixels compensates a common factor.
        let scale = (norm(&cell) / norm(&wide)).sqrt();
        let size = norm(&cell);
        let square: f32 = (0..8).map(|k| (cell[k][i] - scale * wide[k][i]).powi(2)).sum();
        let apart = square / (size * threshold * threshold);
        let weight = (apart - 1.0).clamp(0.0, 1.0);
        for k in 0..8 {
            out[k * columns + i] = scale * wide[k][i] + weight * (cell[k][i] - scale * wide[k][i]);
        }
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn add_projected(
    model: [&[f32]; 8],
    pixels: [&[f32]; 4],
    light: [&[f32]; 4],
    ratios: [f32; 3],
    limits: [f32; 2],
    sums: &mut [[Lanes; SUMS]],
) {
    let (model, pixels, light) = (model.map(lanes), pixels.map(lanes), light.map(lanes));
    for (i, sums) in sums.iter_mut().enumerate() {
        let (model, light) = (take(&model, i), take(&light, i));
        let [phase, modulation, usable, loss] = take(&pixels, i);
        let mut terms = [[0.0; LANES]; SUMS];
        for x in 0..LANES {
            let model: [f32; 8] = std::array::from_fn(|k| model[k][x]);
            let seen: [f32; 4] = std::array::from_fn(|c| light[c][x]);
            let pixel = [phase[x], modulation[x], usable[x], loss[x]];
            let pixel_terms = project(model, pixel, seen, ratios, limits);
            for k in 0..SUMS {
                terms[k][x] = pixel_terms[k];
            }
        }
        add(sums, &terms);
    }
}

/// Terms of one pixel in the normal equations. `trust` is the weight of the given phase relative to the information about it in
/// the light: the smaller it is, the more of an error of the phase is projected out (J12).
#[inline(always)]
fn project(
    model: [f32; 8],
    [phase, modulation, usable, loss]: [f32; 4],
    seen: [f32; 4],
    ratios: [f32; 3],
    [misfit_max, trust]: [f32; 2],
) -> [f32; SUMS] {
    let carriers = carriers(phase, ratios, loss);
    let (mut m, mut d) = ([0.0f32; 4], [0.0f32; 4]);
    let (mut mm, mut md, mut dd, mut ms) = (1e-9f32, 0.0f32, 1e-9f32, 0.0f32);
    for c in 0..4 {
        let (a, b) = (model[2 * c], model[2 * c + 1]);
        (m[c], d[c]) = (a + b * carriers.cosine[c], b * carriers.derivative[c]);
        mm += m[c] * m[c];
        md += m[c] * d[c];
        dd += d[c] * d[c];
        ms += m[c] * seen[c];
    }
    dd += trust * mm;
    // Projection onto the part that neither m (albedo) nor d (phase) can explain.
    let determinant = mm * dd - md * md;
    let inverse = 1.0 / if determinant > 1e-12 { determinant } else { 1e-12 };
    let mut projector = [[0.0f32; 4]; 4];
    let mut rest = [0.0f32; 4];
    let mut misfit = 0.0f32;
    for c in 0..4 {
        let (along_m, along_d) = (dd * m[c] - md * d[c], mm * d[c] - md * m[c]);
        for k in 0..4 {
            let identity = if c == k { 1.0 } else { 0.0 };
            projector[c][k] = identity - (along_m * m[k] + along_d * d[k]) * inverse;
            rest[c] += projector[c][k] * seen[k];
        }
        misfit += rest[c] * seen[c];
    }
    let sound = (modulation > 0.0) & (misfit <= misfit_max * modulation * modulation);
    let weight = if sound { usable } else { 0.0 };
    let albedo = ms / mm;
    let (first, square) = (weight * albedo, weight * albedo * albedo);
    let mut terms = [0.0f32; SUMS];
    let mut at = 0;
    for c in 0..4 {
        for k in c..4 {
            let p = square * projector[c][k];
            let q = p * carriers.cosine[c];
            terms[at] = p;
            terms[at + 1] = p * carriers.cosine[k];
            // Products of a_c and b_c with a_k and b_k. The triangle below the diagonal is not stored.
            if k > c {
                terms[at + 2] = q;
                terms[at + 3] = q * carriers.cosine[k];
                at += 4;
            } else {
                terms[at + 2] = q * carriers.cosine[k];
                at += 3;
            }
        }
        terms[MATRIX + 2 * c] = first * rest[c];
        terms[MATRIX + 2 * c + 1] = first * rest[c] * carriers.cosine[c];
    }
    terms
}

#[cfg(test)]
mod tests {
    use super::edge::{EDGE, Edge, RATIOS};
    use super::*;
    use std::f32::consts::TAU;

    fn free_fit(misfit_max: f32) -> PhotometryFit {
        PhotometryFit {
            misfit_max,
            relative_noise: 0.0,
            sampled_rows: 4,
            phase_trust: 0.0,
            lit_share_min: 0.0,
        }
    }

    #[test]
    fn a_window_on_two_colours_keeps_its_size() {
        let textures =
            [[0.5, 0.4, 0.2, 0.15, 0.6, 0.45, 0.4, 0.35], [0.3, 0.25, 0.5, 0.4, 0.2, 0.15, 0.4, 0.3]];
        let edge = Edge::new(textures, 0.0);
        let (grid, phase) = (&edge.grid, &edge.phase);
        let (usable, modulation) = (edge.plane(1.0), edge.plane(0.3));
        let scene = edge.scene(&usable);
        let (mut fit, mut found, slopes) = (LocalFit::default(), Photometry::new(), Slopes::flat(grid));
        let (mut wrapped, mut spare) = (vec![0.0; grid.pixels()], vec![0.0; grid.pixels()]);
        let maps = super::super::local_fit::PixelMaps { phase: &mut wrapped, modulation: &mut spare };
        fit.run(&scene, &usable, 0.02, maps);
        found.start(&scene, &fit, &slopes, RATIOS);
        let size_at = |found: &Photometry| {
            let mut maps = RowMaps::default();
            let rows = found.sample_in_place(&scene, 30, &mut maps);
            let sum = |rows: [&[f32]; 4]| rows.map(|row| row[EDGE].powi(2)).iter().sum::<f32>();
            (sum(rows.offset) + sum(rows.amplitude)).sqrt()
        };
        let before = size_at(&found);
        for _ in 0..6 {
            let fit = free_fit(1.0);
            found.fit(&scene, RATIOS, PhaseMap { phase, modulation: &modulation }, &slopes, &fit);
        }
        let after = size_at(&found);
        assert!((after / before - 1.0).abs() < 0.15, "{before} {after}");
    }

    #[test]
    fn offsets_and_amplitudes_are_found_under_texture_and_an_error_of_the_phase() {
        let grid = Grid::new([96, 256], 4.0);
        let truth: Vec<f32> = (0..grid.pixels()).map(|i| 40.0 + TAU * (i % 256) as f32 / 25.0).collect();
        let texture = |i: usize| 0.7 + 0.2 * ((i / 256) as f32 * 0.9).sin() * ((i % 256) as f32 * 0.7).cos();
        let fringes = [[0.5, 0.4], [0.45, 0.38], [0.55, 0.42], [0.4, 0.37]];
        let planes: [Vec<f32>; 4] = std::array::from_fn(|c| {
            let [a, b] = fringes[c];
            (0..grid.pixels())
                .map(|i| texture(i) * (a + b * carriers(truth[i], RATIOS, 0.0).cosine[c]))
                .collect()
        });
        let (usable, modulation) = (vec![1.0; grid.pixels()], vec![0.3; grid.pixels()]);
        let light = planes.each_ref().map(Vec::as_slice);
        let scene = Scene { light, usable: &usable, grid: &grid, period_px: 25.0, factor: 1 };
        let (mut fit, mut found, slopes) = (LocalFit::default(), Photometry::new(), Slopes::flat(&grid));
        let (mut phase, mut spare) = (vec![0.0; grid.pixels()], vec![0.0; grid.pixels()]);
        let maps = super::super::local_fit::PixelMaps { phase: &mut phase, modulation: &mut spare };
        fit.run(&scene, &usable, 0.02, maps);
        found.start(&scene, &fit, &slopes, RATIOS);
        // The given phase has an error of 0.05 rad, like a two-step phase with wrong offsets.
        let phase: Vec<f32> = truth.iter().map(|t| t + 0.05 * (2.0 * t).sin()).collect();
        for _ in 0..3 {
            let fit = free_fit(0.3);
            let map = PhaseMap { phase: &phase, modulation: &modulation };
            found.fit(&scene, RATIOS, map, &slopes, &fit);
        }
        let mut maps = RowMaps::default();
        let rows = found.sample(&scene, 48, &mut maps);
        for x in 40..216 {
            // Only ratios have a meaning.
            let scale = rows.offset[0][x] / fringes[0][0];
            for c in 0..4 {
                let (a, b) = (rows.offset[c][x] / scale, rows.amplitude[c][x] / scale);
                assert!(
                    (a - fringes[c][0]).abs() < 0.02 && (b - fringes[c][1]).abs() < 0.02,
                    "{c} {x} {a} {b}"
                );
            }
        }
    }
}
