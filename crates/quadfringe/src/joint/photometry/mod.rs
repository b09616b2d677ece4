//! Background and modulation of every channel, once the absolute phase is known.
//!
//! `I_c = rho (a_c + b_c cos(N_c / N_1 Phi + delta_c))`: phase and albedo belong to the pixel, backgrounds `a` and
//! modulations `b` to a window of about a fringe. What an error of the pixel's phase or albedo would change to first order
//! is projected out of its four intensities (variable projection; Golub and Pereyra, SIAM J. Numer. Anal. 10, 413 (1973)),
//! so that neither noise of the phase nor texture reaches `a` and `b`, and one round does what alternating takes many for.

mod choice;
#[cfg(test)]
mod edge;
mod solve;
mod texture;

use super::cells::{CellMaps, CellWork, Grid, RowMaps};
use super::local_fit::LocalFit;
use super::scene::Scene;
use super::slopes::Slopes;
use crate::parallel::angle::sin_cos;
use crate::parallel::lanes::{LANES, Lanes, add, lanes, take};
use crate::parallel::slots::Slots;
use choice::Choice;
use multiversion::multiversion;
use solve::improve;
use texture::Colours;

/// Width (sigma) of the window in fringe periods: the albedo takes what is faster.
const WINDOW: f32 = 0.28;
/// Width (sigma) over which surroundings of one colour are averaged on top of that.
const SURROUNDINGS: f32 = 1.0;
/// Relative difference (root mean square of eight) from the surroundings that is a colour of its own: in units of the
/// noise over the modulation, and at least.
const OWN_COLOUR_NOISES: f32 = 0.2;
const OWN_COLOUR_MIN: f32 = 0.01;
/// Sides of the cells in fringe periods.
const CELL: f64 = 0.35;
/// Upper triangle of the normal matrix of a_r, b_r, a_g, b_g, a_b, b_b, a_ir, b_ir.
const MATRIX: usize = 36;
/// The same with the right hand side.
const SUMS: usize = MATRIX + 8;

/// Backgrounds and modulations on cells of their own.
#[derive(Debug)]
pub(crate) struct Backgrounds {
    grid: Grid,
    maps: CellMaps,
    next: CellMaps,
    sums: CellMaps,
    choice: Choice,
    colours: Colours,
    slots: Slots<(Rows, CellWork)>,
}

/// Working rows.
#[derive(Debug, Default)]
struct Rows {
    maps: RowMaps,
    losses: RowMaps,
    usable: Vec<f32>,
}

/// How backgrounds are fitted.
pub(crate) struct Fit {
    /// Pixels that are further from any model than this many times their modulation (root mean square) take no part.
    pub misfit_max: f32,
    /// Noise over modulation.
    pub relative_noise: f32,
    /// Rows of pixels that stand for a row of cells.
    pub rows: usize,
    /// How much the given phase counts, next to what the light says of it.
    pub trust: f32,
    /// Least share of the window of the slopes that is lit around a pixel that takes part.
    pub lit_min: f32,
}

impl Backgrounds {
    pub fn new() -> Self {
        Self {
            grid: Grid::new([1, 1], 1.0),
            maps: CellMaps::new(8),
            next: CellMaps::new(8),
            sums: CellMaps::default(),
            choice: Choice::default(),
            colours: Colours::default(),
            slots: Slots::default(),
        }
    }

    /// Start from what is known without orders, averaged over the surroundings: where the phase hardly changes in a window
    /// the fit has nothing better to go by.
    pub fn start(&mut self, scene: &Scene<'_>, fit: &LocalFit, slopes: &Slopes, ratios: [f32; 3]) {
        let fine = scene.grid;
        let side = (CELL * scene.period_px).max(fine.step as f64);
        self.grid = Grid::with_stride([fine.height, fine.width], fine.stride, side);
        let times = self.grid.step / fine.step;
        self.choice.forget();
        self.colours.forget();
        self.next.fill::<8>(&self.grid, |row, mut lines| {
            for column in 0..lines[0].len() {
                let inside = |at: usize, count: usize| (at * times + times / 2).min(count - 1);
                let cell = [inside(row, fine.rows), inside(column, fine.columns)];
                let mut channels = fit.cell(cell[0], cell[1]);
                let loss = slopes.loss_at(scene, cell);
                for ([_, b], ratio) in channels.iter_mut().zip([ratios[0], ratios[1], ratios[0], ratios[2]]) {
                    *b /= contrast(loss * ratio * ratio);
                }
                for (line, value) in lines.iter_mut().zip(channels.as_flattened()) {
                    line[column] = *value;
                }
            }
        });
        self.draw_together(scene, f32::INFINITY);
    }

    /// Backgrounds and modulations that the pixels of row `y` have chosen, in a scene, that of the fit or a finer one: a, b of R, of
    /// G, of B, of IR.
    pub fn sample<'a>(&self, scene: &Scene<'_>, y: usize, maps: &'a mut RowMaps) -> [&'a [f32]; 8] {
        let grid = self.grid.over(scene.grid);
        if self.colours.known(scene) {
            return self.colours.sample(&grid, y, maps).map(|row| &*row);
        }
        let mut rows = maps.sample_mut(&grid, &self.maps, 0, y);
        self.choice.apply(&grid, &self.maps, y, &mut rows);
        rows.map(|row| &*row)
    }

    /// The same at the places of the pixels themselves, whatever they have chosen.
    pub fn sample_own<'a>(&self, scene: &Scene<'_>, y: usize, maps: &'a mut RowMaps) -> [&'a [f32]; 8] {
        maps.sample(&self.grid.over(scene.grid), &self.maps, 0, y)
    }

    /// Let every pixel choose among the backgrounds around it. The pixels' phase and modulation are those of the last fit, and the
    /// intensities have the standard deviation `noise`. Returns the share of the lit pixels that take those of another place.
    pub fn choose(
        &mut self,
        scene: &Scene<'_>,
        ratios: [f32; 3],
        pixels: [&[f32]; 2],
        slopes: &Slopes,
        noise: f32,
    ) -> f32 {
        let grid = self.grid.over(scene.grid);
        self.choice.make((&grid, &self.maps), scene, (ratios, slopes), pixels, noise)
    }

    /// Give every pixel a colour of its own.
    pub fn colour(
        &mut self,
        scene: &Scene<'_>,
        ratios: [f32; 3],
        pixels: [&[f32]; 2],
        slopes: &Slopes,
        noise: f32,
    ) {
        let grid = self.grid.over(scene.grid);
        let Self { maps, colours, sums, .. } = self;
        colours.measure((&grid, maps), scene, (ratios, slopes), pixels, noise, sums);
    }

    /// Backgrounds and modulations of the four channels near the middle of a cell of the scene's grid.
    pub fn cell(&self, scene: &Scene<'_>, row: usize, column: usize) -> [[f32; 2]; 4] {
        let times = self.grid.over(scene.grid).step / scene.grid.step;
        [0, 2, 4, 6].map(|c| [c, c + 1].map(|k| self.maps.line(row / times, k)[column / times]))
    }

    /// Fit them to an absolute phase in rad. Pixels that have chosen another place say nothing of their own.
    pub fn fit(
        &mut self,
        scene: &Scene<'_>,
        ratios: [f32; 3],
        [phase, modulation]: [&[f32]; 2],
        slopes: &Slopes,
        fit: &Fit,
    ) {
        let Self { grid, maps, next, sums, slots, choice, .. } = self;
        let &Fit { misfit_max, relative_noise, rows: most, trust, lit_min } = fit;
        let sigma = WINDOW * scene.period_px as f32 / grid.step as f32;
        grid.window_sums::<SUMS, Rows>(
            (sigma, most),
            slots,
            sums,
            next,
            |rows, y, sums| {
                let Rows { maps: model, losses, usable } = rows;
                let model = model.sample::<8>(grid, maps, 0, y);
                usable.clear();
                usable.extend_from_slice(scene.row(scene.usable, y));
                choice.leave_out(y, usable);
                if lit_min > 0.0 {
                    let shares = slopes.lit(scene, y, losses).iter();
                    usable.iter_mut().zip(shares).for_each(|(usable, &lit)| {
                        *usable = if lit >= lit_min { *usable } else { 0.0 };
                    });
                }
                let [phase, modulation] = [phase, modulation].map(|plane| scene.row(plane, y));
                let pixels = [phase, modulation, usable, slopes.loss(scene, y, losses)];
                let limits = [4.0 * misfit_max * misfit_max, trust];
                add_projected(model, pixels, scene.rows(y), ratios, limits, sums);
            },
            |row, sums, out| {
                let before: [&[f32]; 8] = std::array::from_fn(|k| maps.line(row, k));
                improve(sums, before, out);
            },
        );
        self.draw_together(scene, (OWN_COLOUR_NOISES * relative_noise).max(OWN_COLOUR_MIN));
    }

    /// Every cell drawn to its surroundings as far as the two are not further apart than `threshold`.
    fn draw_together(&mut self, scene: &Scene<'_>, threshold: f32) {
        let Self { grid, maps, next, sums, slots, .. } = self;
        let sigma = SURROUNDINGS * scene.period_px as f32 / grid.step as f32;
        let own = &*next;
        grid.smooth::<8, Rows>(
            sigma,
            slots,
            sums,
            maps,
            |row, k| Some(own.line(row, k)),
            |row, wide, out| blend(threshold, std::array::from_fn(|k| own.line(row, k)), wide, out),
        );
    }
}

/// The fit of every cell, drawn to that of its surroundings as far as the two have one colour.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn blend(threshold: f32, own: [&[f32]; 8], wide: [&[f32]; 8], out: &mut [f32]) {
    let columns = own[0].len();
    for i in 0..columns {
        let norm = |maps: &[&[f32]; 8]| (0..8).map(|k| maps[k][i] * maps[k][i]).sum::<f32>().max(1e-12);
        // Only ratios count: the albedo of the pixels takes a common factor.
        let scale = (norm(&own) / norm(&wide)).sqrt();
        let size = norm(&own);
        let square: f32 = (0..8).map(|k| (own[k][i] - scale * wide[k][i]).powi(2)).sum();
        let apart = square / (size * threshold * threshold);
        let weight = (apart - 1.0).clamp(0.0, 1.0);
        for k in 0..8 {
            out[k * columns + i] = scale * wide[k][i] + weight * (own[k][i] - scale * wide[k][i]);
        }
    }
}

/// What is left of a contrast, by [`Slopes::loss`] in the first order and by the mean over a step of the phase in the second.
#[inline(always)]
fn contrast(loss: f32) -> f32 {
    1.0 - loss + 0.3 * loss * loss
}

/// Cosines of the four channels and the derivative of each by the phase of the first; `loss` is the share of the contrast
/// of the first that is lost, see [`Slopes::loss`].
#[inline(always)]
pub(crate) fn carriers(phase: f32, [_, second, third]: [f32; 3], loss: f32) -> ([f32; 4], [f32; 4]) {
    let (s, c) = sin_cos(phase);
    let (s_g, c_g) = sin_cos(second * phase);
    let (s_ir, c_ir) = sin_cos(third * phase);
    let kept = [1.0, second * second, 1.0, third * third].map(|square| contrast(loss * square));
    let scale = |values: [f32; 4]| [0, 1, 2, 3].map(|k| kept[k] * values[k]);
    (scale([c, c_g, -s, c_ir]), scale([-s, -second * s_g, -c, -third * s_ir]))
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
            let own = project(model, pixel, seen, ratios, limits);
            for k in 0..SUMS {
                terms[k][x] = own[k];
            }
        }
        add(sums, &terms);
    }
}

/// Terms of one pixel. An error of its phase is projected out as far as its light knows better than the one given.
#[inline(always)]
fn project(
    model: [f32; 8],
    [phase, modulation, usable, loss]: [f32; 4],
    seen: [f32; 4],
    ratios: [f32; 3],
    [misfit_max, trust]: [f32; 2],
) -> [f32; SUMS] {
    let (cosines, derivatives) = carriers(phase, ratios, loss);
    let (mut m, mut d) = ([0.0f32; 4], [0.0f32; 4]);
    let (mut mm, mut md, mut dd, mut ms) = (1e-9f32, 0.0f32, 1e-9f32, 0.0f32);
    for c in 0..4 {
        let (a, b) = (model[2 * c], model[2 * c + 1]);
        (m[c], d[c]) = (a + b * cosines[c], b * derivatives[c]);
        mm += m[c] * m[c];
        md += m[c] * d[c];
        dd += d[c] * d[c];
        ms += m[c] * seen[c];
    }
    dd += trust * mm;
    // Projector onto what neither m (albedo) nor d (phase) can explain.
    let determinant = mm * dd - md * md;
    let inverse = 1.0 / if determinant > 1e-12 { determinant } else { 1e-12 };
    let mut projector = [[0.0f32; 4]; 4];
    let mut rest = [0.0f32; 4];
    let mut misfit = 0.0f32;
    for c in 0..4 {
        let (along_m, along_d) = (dd * m[c] - md * d[c], mm * d[c] - md * m[c]);
        for k in 0..4 {
            let own = if c == k { 1.0 } else { 0.0 };
            projector[c][k] = own - (along_m * m[k] + along_d * d[k]) * inverse;
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
            let q = p * cosines[c];
            terms[at] = p;
            terms[at + 1] = p * cosines[k];
            // Columns a_c and b_c meet a_k and b_k; below the diagonal nothing is kept.
            if k > c {
                terms[at + 2] = q;
                terms[at + 3] = q * cosines[k];
                at += 4;
            } else {
                terms[at + 2] = q * cosines[k];
                at += 3;
            }
        }
        terms[MATRIX + 2 * c] = first * rest[c];
        terms[MATRIX + 2 * c + 1] = first * rest[c] * cosines[c];
    }
    terms
}

#[cfg(test)]
mod tests {
    use super::edge::{EDGE, Edge, RATIOS};
    use super::*;
    use std::f32::consts::TAU;

    #[test]
    fn a_window_on_two_colours_keeps_its_size() {
        let colours =
            [[0.5, 0.4, 0.2, 0.15, 0.6, 0.45, 0.4, 0.35], [0.3, 0.25, 0.5, 0.4, 0.2, 0.15, 0.4, 0.3]];
        let edge = Edge::new(colours, 0.0);
        let (grid, phase) = (&edge.grid, &edge.phase);
        let (usable, modulation) = (edge.plane(1.0), edge.plane(0.3));
        let scene = edge.scene(&usable);
        let (mut fit, mut found, slopes) = (LocalFit::default(), Backgrounds::new(), Slopes::flat(grid));
        let (mut wrapped, mut spare) = (vec![0.0; grid.pixels()], vec![0.0; grid.pixels()]);
        let maps = super::super::local_fit::PixelMaps { phase: &mut wrapped, modulation: &mut spare };
        fit.run(&scene, &usable, 0.02, maps);
        found.start(&scene, &fit, &slopes, RATIOS);
        let size_at = |found: &Backgrounds| {
            let mut maps = RowMaps::default();
            let rows = found.sample_own(&scene, 30, &mut maps);
            rows.map(|row| row[EDGE].powi(2)).iter().sum::<f32>().sqrt()
        };
        let before = size_at(&found);
        for _ in 0..6 {
            let fit = Fit { misfit_max: 1.0, relative_noise: 0.0, rows: 4, trust: 0.0, lit_min: 0.0 };
            found.fit(&scene, RATIOS, [phase, &modulation], &slopes, &fit);
        }
        let after = size_at(&found);
        assert!((after / before - 1.0).abs() < 0.15, "{before} {after}");
    }

    #[test]
    fn backgrounds_are_found_whatever_the_texture_and_an_error_of_the_phase() {
        let grid = Grid::new([96, 256], 4.0);
        let truth: Vec<f32> = (0..grid.pixels()).map(|i| 40.0 + TAU * (i % 256) as f32 / 25.0).collect();
        let texture = |i: usize| 0.7 + 0.2 * ((i / 256) as f32 * 0.9).sin() * ((i % 256) as f32 * 0.7).cos();
        let fringes = [[0.5, 0.4], [0.45, 0.38], [0.55, 0.42], [0.4, 0.37]];
        let planes: [Vec<f32>; 4] = std::array::from_fn(|c| {
            let [a, b] = fringes[c];
            (0..grid.pixels()).map(|i| texture(i) * (a + b * carriers(truth[i], RATIOS, 0.0).0[c])).collect()
        });
        let (usable, modulation) = (vec![1.0; grid.pixels()], vec![0.3; grid.pixels()]);
        let light = planes.each_ref().map(Vec::as_slice);
        let scene = Scene { light, usable: &usable, grid: &grid, period_px: 25.0, factor: 1 };
        let (mut fit, mut found, slopes) = (LocalFit::default(), Backgrounds::new(), Slopes::flat(&grid));
        let (mut phase, mut spare) = (vec![0.0; grid.pixels()], vec![0.0; grid.pixels()]);
        let maps = super::super::local_fit::PixelMaps { phase: &mut phase, modulation: &mut spare };
        fit.run(&scene, &usable, 0.02, maps);
        found.start(&scene, &fit, &slopes, RATIOS);
        // The phase given is 0.05 rad off, as a two-step phase with wrong backgrounds is.
        let phase: Vec<f32> = truth.iter().map(|t| t + 0.05 * (2.0 * t).sin()).collect();
        for _ in 0..3 {
            let fit = Fit { misfit_max: 0.3, relative_noise: 0.0, rows: 4, trust: 0.0, lit_min: 0.0 };
            found.fit(&scene, RATIOS, [&phase, &modulation], &slopes, &fit);
        }
        let mut maps = RowMaps::default();
        let rows = found.sample(&scene, 48, &mut maps);
        for x in 40..216 {
            // Only ratios are defined.
            let scale = rows[0][x] / fringes[0][0];
            for c in 0..4 {
                let (a, b) = (rows[2 * c][x] / scale, rows[2 * c + 1][x] / scale);
                assert!(
                    (a - fringes[c][0]).abs() < 0.02 && (b - fringes[c][1]).abs() < 0.02,
                    "{c} {x} {a} {b}"
                );
            }
        }
    }
}
