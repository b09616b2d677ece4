//! Step 3: local least squares for wrapped phase (S2), offset and amplitude of every channel, and beats (S3).
//!
//! In a window of about a fringe every channel is `I = rho (a + p cos(Phi) + q sin(Phi))`, with `Phi` the phase of R
//! and B and `rho` the albedo of the pixel. R and B give `Phi` pixel by pixel; G and IR have nearly the same carrier,
//! so that `p - i q = b exp(i (Phi_c - Phi))` is their *beat* against it, six to thirty times slower than a fringe.
//! Unlike a Fourier filter along rows, this fit prefers no direction, no band and no slope. Sums are kept once per cell.
//!
//! Where the albedo changes within a fringe, a second fit (`textured`) takes `Phi` from the ratio of R and B in a window (`carrier`).
//! Of three colours with different fringe numbers, R gives `Phi` in a window, and B is the third channel.

mod carrier;
mod normal;
mod rows;
mod signal;
mod textured;

use super::cells::{CellMaps, CellWindow, RowMaps, TaskWork};
use super::model::{CellFringes, FringeRows, has_quadrature};
use super::neighbours::{around, binomial};
use super::params::local_fit::{FIRST_WINDOW, WINDOW};
use super::params::pyramid::SAMPLED_ROWS;
use super::scene::Scene;
use crate::parallel::slots::Slots;
use carrier::Carrier;
use rayon::prelude::*;
use rows::{
    ChannelRows, RedBlueRows, Rows, StrengthRows, add_products, add_squares, finish_row, map,
    relative_albedo, solve_row, sum, two_step,
};
use signal::Signal;

/// Results of the fit on the cells, and its working maps.
#[derive(Debug)]
pub(super) struct LocalFit {
    /// Fringe numbers over the first; offset, amplitude and beat of a channel that is absent are 0.
    ratios: [f32; 4],
    start: CellMaps,
    carrier: Carrier,
    maps: CellMaps,
    textured: Textured,
    slots: Slots<TaskWork<Rows>>,
}

/// The second fit, and where it is kept.
#[derive(Debug)]
struct Textured {
    maps: CellMaps,
    /// 1 for cells that keep it, 0 for the others.
    kept: CellMaps,
}

impl Default for Textured {
    fn default() -> Self {
        Self { maps: CellMaps::new(map::COUNT), kept: CellMaps::new(1) }
    }
}

/// Where there is light.
#[derive(Clone, Copy)]
pub(super) struct Lit<'a> {
    /// 1 where light of the projector falls.
    pub lit: &'a [f32],
    /// Least modulation that counts, in linear light.
    pub least: f32,
}

/// Maps of the pixels that the fit fills: wrapped phase of R and B in rad, and their modulation in linear light (0 where
/// the pixel takes no part).
pub(super) struct PixelMaps<'a> {
    pub phase: &'a mut [f32],
    pub modulation: &'a mut [f32],
}

/// Beats of G and of IR against R and B in a row of cells: `cosine - i sine` is the phasor of each.
pub(super) struct Beats<'a> {
    pub cosine: [&'a [f32]; 2],
    pub sine: [&'a [f32]; 2],
}

impl LocalFit {
    pub fn new(ratios: [f32; 4]) -> Self {
        Self {
            ratios,
            start: CellMaps::new(4),
            carrier: Carrier::new(if has_quadrature(ratios) { Signal::Ratio } else { Signal::Red }),
            maps: CellMaps::new(map::COUNT),
            textured: Textured::default(),
            slots: Slots::default(),
        }
    }

    /// Whether the phase of a pixel comes from the light of that pixel: from R and B in quadrature, not from a window.
    pub fn is_of_pixels(&self) -> bool {
        has_quadrature(self.ratios)
    }

    /// Fit a scene with fringes in any direction. The content of `sums` is lost.
    pub fn run(&mut self, scene: &Scene<'_>, light: Lit<'_>, out: PixelMaps<'_>, sums: &mut CellMaps) {
        if self.is_of_pixels() {
            self.start(scene, sums);
        } else {
            self.carrier.find(scene, &self.slots, sums);
        }
        self.solve(scene, sums);
        self.phase(scene, light, out);
    }

    /// Offsets and amplitudes at row `y`.
    pub fn fringes<'a>(&self, scene: &Scene<'_>, y: usize, maps: &'a mut [RowMaps; 2]) -> FringeRows<'a> {
        let [first, second] = maps;
        let [a_r, b_r, a_b, b_b] = first.sample(scene.grid, &self.maps, map::A_R, y);
        let [a_g, _, _, a_ir, _, _, b_g, b_ir] = second.sample(scene.grid, &self.maps, map::A_G, y);
        FringeRows { offset: [a_r, a_g, a_b, a_ir], amplitude: [b_r, b_g, b_b, b_ir] }
    }

    /// Offsets and amplitudes in one cell.
    pub fn cell(&self, row: usize, column: usize) -> CellFringes {
        let value = |k: usize| self.maps.line(row, k)[column];
        CellFringes {
            offset: [map::A_R, map::A_G, map::A_B, map::A_IR].map(value),
            amplitude: [map::A_R + 1, map::B_G, map::A_B + 1, map::B_IR].map(value),
        }
    }

    /// Beats in a row of cells.
    pub fn beats(&self, row: usize) -> Beats<'_> {
        let [g, ir] = [map::A_G, map::A_IR].map(|first| [1, 2].map(|k| self.maps.line(row, first + k)));
        Beats { cosine: [g[0], ir[0]], sine: [g[1], ir[1]] }
    }

    /// Mean and amplitude of R and B in a window that holds whole fringes.
    fn start(&mut self, scene: &Scene<'_>, sums: &mut CellMaps) {
        scene.grid.window_sums::<5, Rows>(
            CellWindow { sigma_cells: scene.cells(FIRST_WINDOW), sampled_rows: SAMPLED_ROWS },
            &self.slots,
            sums,
            &mut self.start,
            |_, y, sums| add_squares(scene.row(scene.usable, y), scene.rows(y), sums),
            |_, [weight, red, red_2, blue, blue_2], out| {
                let mut lines = out.chunks_exact_mut(weight.len());
                for [sum, square] in [[red, red_2], [blue, blue_2]] {
                    let (mean, amplitude) = (lines.next().expect("4 lines"), lines.next().expect("4 lines"));
                    for i in 0..weight.len() {
                        let weight = weight[i].max(1e-6);
                        mean[i] = sum[i] / weight;
                        amplitude[i] = (2.0 * (square[i] / weight - mean[i] * mean[i]).max(0.0)).sqrt();
                    }
                }
            },
        );
    }

    /// Normal equations of every cell for `a`, `p`, `q` of the four channels.
    fn solve(&mut self, scene: &Scene<'_>, sums: &mut CellMaps) {
        let ratios = self.ratios;
        let source = Source::of(ratios, &self.carrier, &self.start);
        scene.grid.window_sums::<{ sum::COUNT }, Rows>(
            CellWindow { sigma_cells: scene.cells(WINDOW), sampled_rows: SAMPLED_ROWS },
            &self.slots,
            sums,
            &mut self.maps,
            |rows, y, sums| {
                let Rows { maps, cos, sin, .. } = rows;
                source.row(scene, y, None, maps, [cos, sin]);
                add_products(scene.row(scene.usable, y), [cos, sin], None, scene.rows(y), sums);
            },
            |_, sums, out| solve_row(sums, ratios, out),
        );
    }

    /// Albedo of every pixel, not sharper than the lens, and the two-step phase with it (S2).
    fn phase(&self, scene: &Scene<'_>, Lit { lit, least }: Lit<'_>, out: PixelMaps<'_>) {
        let grid = scene.grid;
        let out = out.phase.par_chunks_mut(grid.stride).zip(out.modulation.par_chunks_mut(grid.stride));
        let block = grid.step.max(4);
        // Blocks of rows: of each the albedo is computed once, except for the two rows next to a block.
        let out = out.chunks(block).enumerate();
        out.for_each_init(
            || self.slots.take(),
            |slot, (block_row, out)| {
                let rows = &mut slot.rows;
                let first = block_row * block;
                for row in &mut rows.albedo {
                    row.resize(grid.stride, 0.0);
                }
                let [above, _, _] = around(first, grid.height);
                self.albedo_row(scene, above, 0, rows);
                self.albedo_row(scene, first, 1, rows);
                for (i, (phase, modulation)) in out.into_iter().enumerate() {
                    let y = first + i;
                    self.albedo_row(scene, around(y, grid.height)[2], (i + 2) % 3, rows);
                    let Rows { maps, cos, sin, albedo: ring, smooth, albedo_smooth, .. } = rows;
                    albedo_smooth.resize(grid.stride, 0.0);
                    let near = [0, 1, 2].map(|k| ring[(i + k) % 3].as_slice());
                    binomial(near, grid.width, smooth, albedo_smooth);
                    let source = Source::of(self.ratios, &self.carrier, &self.maps);
                    source.row(scene, y, Some(albedo_smooth), maps, [cos, sin]);
                    let [weakest, mean] = maps.sample(grid, &self.maps, map::WEAKEST, y);
                    let strength =
                        StrengthRows { weakest, mean, lit: scene.row(lit, y), albedo: albedo_smooth };
                    finish_row([cos, sin], &strength, least, phase, modulation);
                }
            },
        );
    }

    /// Albedo of row `y` into place `at` of the ring: the factor that brings the model of all four channels closest to
    /// what was seen.
    fn albedo_row(&self, scene: &Scene<'_>, y: usize, at: usize, rows: &mut Rows) {
        let Rows { maps, cos, sin, albedo, .. } = rows;
        Source::of(self.ratios, &self.carrier, &self.maps).row(scene, y, None, maps, [&mut *cos, &mut *sin]);
        let model = ChannelRows::sample(maps, scene, &self.maps, y);
        relative_albedo(model, [cos, sin], scene.rows(y), &mut albedo[at]);
    }
}

/// What the phasor of R comes from.
#[derive(Clone, Copy)]
enum Source<'a> {
    /// R and B in quadrature, with offsets and amplitudes from these maps.
    TwoStep(&'a CellMaps),
    /// R in a window.
    Window(&'a Carrier),
}

impl<'a> Source<'a> {
    fn of(ratios: [f32; 4], carrier: &'a Carrier, maps: &'a CellMaps) -> Self {
        if has_quadrature(ratios) { Self::TwoStep(maps) } else { Self::Window(carrier) }
    }

    /// Writes the phasor along row `y`.
    #[inline(always)]
    fn row(
        self,
        scene: &Scene<'_>,
        y: usize,
        albedo: Option<&[f32]>,
        rows: &mut RowMaps,
        [cos, sin]: [&mut Vec<f32>; 2],
    ) {
        match self {
            Self::TwoStep(maps) => {
                let red_blue = RedBlueRows::sample(rows, scene, maps, y);
                cos.resize(scene.grid.stride, 0.0);
                sin.resize(scene.grid.stride, 0.0);
                two_step(&red_blue, albedo, scene.rows(y), cos, sin);
            }
            Self::Window(carrier) => carrier.row(scene, y, rows, [cos, sin]),
        }
    }
}

impl<'a> RedBlueRows<'a> {
    /// Row `y` of maps of the fit, or of its start.
    fn sample(rows: &'a mut RowMaps, scene: &Scene<'_>, maps: &CellMaps, y: usize) -> Self {
        let [red_offset, red_amplitude, blue_offset, blue_amplitude] =
            rows.sample(scene.grid, maps, map::A_R, y);
        Self { red_offset, red_amplitude, blue_offset, blue_amplitude }
    }
}

impl<'a> ChannelRows<'a> {
    /// Row `y` of the coefficients of R, G, B, IR.
    fn sample(rows: &'a mut RowMaps, scene: &Scene<'_>, maps: &CellMaps, y: usize) -> [Self; 4] {
        let maps = rows.sample::<14>(scene.grid, maps, map::A_R, y);
        let channel = |a: usize, p: usize| ChannelRows { a: maps[a], p: maps[p], q: maps[p + 1] };
        [
            channel(map::A_R, map::P_R),
            channel(map::A_G, map::A_G + 1),
            channel(map::A_B, map::P_B),
            channel(map::A_IR, map::A_IR + 1),
        ]
    }
}

#[cfg(test)]
mod tests;
