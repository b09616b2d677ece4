//! Step 3: local least squares for wrapped phase (S2), offset and amplitude of every channel, and beats (S3), without a carrier.
//!
//! In a window of about a fringe every channel is `I = rho (a + p cos(Phi) + q sin(Phi))`, with `Phi` the phase of R
//! and B and `rho` the albedo of the pixel. R and B give `Phi` pixel by pixel; G and IR have nearly the same carrier,
//! so that `p - i q = b exp(i (Phi_c - Phi))` is their *beat* against it, six to thirty times slower than a fringe.
//! Unlike a Fourier filter along rows, the fit prefers no direction, no band and no slope. Sums are kept once per cell.

use super::cells::{CellMaps, CellWindow, RowMaps, TaskWork};
use super::model::{CellFringes, FringeRows};
use super::neighbours::{around, binomial};
use super::params::local_fit::{CONTRAST_MIN, FIRST_WINDOW, RIDGE, SAMPLED_ROWS, SPREAD_MIN, WINDOW};
use super::scene::Scene;
use crate::parallel::angle::atan2;
use crate::parallel::lanes::{LANES, Lanes, add, lanes, lanes_mut, put, take};
use crate::parallel::slots::Slots;
use multiversion::multiversion;
use rayon::prelude::*;

/// Sums of one cell: w, wc, ws, wcc, wcs, then w I, w I c, w I s of R, G, B, IR.
const SUMS: usize = 17;

/// Maps of the fit on the cells. Of R and B: offset and amplitude, four maps in a row; then of all channels the coefficients of
/// `a + p cos + q sin`; then the least amplitude of all channels and the mean amplitude of R and B.
mod map {
    pub const TWO_STEP: usize = 0;
    pub const P_R: usize = 4;
    pub const P_B: usize = 6;
    pub const A_G: usize = 8;
    pub const A_IR: usize = 11;
    pub const B_G: usize = 14;
    pub const B_IR: usize = 15;
    pub const WEAKEST: usize = 16;
    pub const COUNT: usize = 18;
}

/// Results of the fit on the cells, and its working maps.
#[derive(Debug)]
pub(super) struct LocalFit {
    start: CellMaps,
    maps: CellMaps,
    sums: CellMaps,
    slots: Slots<TaskWork<Rows>>,
}

/// Maps of the pixels that the fit fills: wrapped phase of R and B in rad, and their modulation in linear light (0 where
/// the pixel takes no part).
pub(super) struct PixelMaps<'a> {
    pub phase: &'a mut [f32],
    pub modulation: &'a mut [f32],
}

impl Default for LocalFit {
    fn default() -> Self {
        Self {
            start: CellMaps::new(4),
            maps: CellMaps::new(map::COUNT),
            sums: CellMaps::default(),
            slots: Slots::default(),
        }
    }
}

/// Rows of one task.
#[derive(Debug, Default)]
struct Rows {
    maps: RowMaps,
    cos: Vec<f32>,
    sin: Vec<f32>,
    albedo: [Vec<f32>; 3],
    smooth: Vec<f32>,
    albedo_smooth: Vec<f32>,
}

/// Beats of G and of IR against R and B in a row of cells: `cosine - i sine` is the phasor of each.
pub(super) struct Beats<'a> {
    pub cosine: [&'a [f32]; 2],
    pub sine: [&'a [f32]; 2],
}

impl LocalFit {
    /// Fit a scene with fringes in any direction. `lit` is 1 where light of the projector falls; `least` is the least
    /// modulation that counts.
    pub fn run(&mut self, scene: &Scene<'_>, lit: &[f32], least: f32, out: PixelMaps<'_>) {
        self.start(scene);
        self.solve(scene);
        self.phase(scene, lit, least, out);
    }

    /// Offsets and amplitudes at row `y`.
    pub fn fringes<'a>(&self, scene: &Scene<'_>, y: usize, maps: &'a mut [RowMaps; 2]) -> FringeRows<'a> {
        let [first, second] = maps;
        let [a_r, b_r, a_b, b_b] = first.sample(scene.grid, &self.maps, map::TWO_STEP, y);
        let [a_g, _, _, a_ir, _, _, b_g, b_ir] = second.sample(scene.grid, &self.maps, map::A_G, y);
        FringeRows { offset: [a_r, a_g, a_b, a_ir], amplitude: [b_r, b_g, b_b, b_ir] }
    }

    /// Offsets and amplitudes in one cell.
    pub fn cell(&self, row: usize, column: usize) -> CellFringes {
        let value = |k: usize| self.maps.line(row, k)[column];
        CellFringes {
            offset: [0, map::A_G, 2, map::A_IR].map(value),
            amplitude: [1, map::B_G, 3, map::B_IR].map(value),
        }
    }

    /// Beats in a row of cells.
    pub fn beats(&self, row: usize) -> Beats<'_> {
        let [g, ir] = [map::A_G, map::A_IR].map(|first| [1, 2].map(|k| self.maps.line(row, first + k)));
        Beats { cosine: [g[0], ir[0]], sine: [g[1], ir[1]] }
    }

    /// Mean and amplitude of R and B in a window that holds whole fringes.
    fn start(&mut self, scene: &Scene<'_>) {
        scene.grid.window_sums::<5, Rows>(
            CellWindow { sigma_cells: scene.cells(FIRST_WINDOW), sampled_rows: SAMPLED_ROWS },
            &self.slots,
            &mut self.sums,
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
    fn solve(&mut self, scene: &Scene<'_>) {
        let start = &self.start;
        scene.grid.window_sums::<SUMS, Rows>(
            CellWindow { sigma_cells: scene.cells(WINDOW), sampled_rows: SAMPLED_ROWS },
            &self.slots,
            &mut self.sums,
            &mut self.maps,
            |rows, y, sums| {
                let Rows { maps, cos, sin, .. } = rows;
                let maps = maps.sample::<4>(scene.grid, start, 0, y);
                cos.resize(scene.grid.stride, 0.0);
                sin.resize(scene.grid.stride, 0.0);
                two_step(maps, None, scene.rows(y), cos, sin);
                add_products(scene.row(scene.usable, y), [cos, sin], scene.rows(y), sums);
            },
            |_, sums, out| solve_row(sums, out),
        );
    }

    /// Albedo of every pixel, not sharper than the lens, and the two-step phase with it (S2).
    fn phase(&self, scene: &Scene<'_>, lit: &[f32], least: f32, out: PixelMaps<'_>) {
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
                    let Rows { maps, cos, sin, albedo: ring, smooth, albedo_smooth } = rows;
                    albedo_smooth.resize(grid.stride, 0.0);
                    let near = [0, 1, 2].map(|k| ring[(i + k) % 3].as_slice());
                    binomial(near, grid.width, smooth, albedo_smooth);
                    let two = maps.sample::<4>(grid, &self.maps, map::TWO_STEP, y);
                    two_step(two, Some(albedo_smooth), scene.rows(y), cos, sin);
                    let strengths = maps.sample::<2>(grid, &self.maps, map::WEAKEST, y);
                    let known = [cos.as_slice(), sin, scene.row(lit, y), albedo_smooth];
                    finish_row(known, strengths, least, [phase, modulation]);
                }
            },
        );
    }

    /// Albedo of row `y` into place `at` of the ring: the factor that brings the model of all four channels closest to
    /// what was seen.
    fn albedo_row(&self, scene: &Scene<'_>, y: usize, at: usize, rows: &mut Rows) {
        let Rows { maps, cos, sin, albedo, .. } = rows;
        let grid = scene.grid;
        cos.resize(grid.stride, 0.0);
        sin.resize(grid.stride, 0.0);
        let maps = maps.sample::<14>(grid, &self.maps, map::TWO_STEP, y);
        let [two @ .., _, _, _, _, _, _, _, _, _, _] = maps;
        two_step(two, None, scene.rows(y), cos, sin);
        let model = [
            [maps[0], maps[map::P_R], maps[map::P_R + 1]],
            [maps[map::A_G], maps[map::A_G + 1], maps[map::A_G + 2]],
            [maps[2], maps[map::P_B], maps[map::P_B + 1]],
            [maps[map::A_IR], maps[map::A_IR + 1], maps[map::A_IR + 2]],
        ];
        relative_albedo(model, [cos, sin], scene.rows(y), &mut albedo[at]);
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn add_squares(usable: &[f32], light: [&[f32]; 4], sums: &mut [[Lanes; 5]]) {
    let rows = [lanes(usable), lanes(light[0]), lanes(light[2])];
    for (i, sums) in sums.iter_mut().enumerate() {
        let [w, red, blue] = take(&rows, i);
        let mut terms = [w; 5];
        for x in 0..LANES {
            let (r, b) = (w[x] * red[x], w[x] * blue[x]);
            (terms[1][x], terms[2][x]) = (r, r * red[x]);
            (terms[3][x], terms[4][x]) = (b, b * blue[x]);
        }
        add(sums, &terms);
    }
}

/// Unit phasor of R and B for offsets and amplitudes `a_r, b_r, a_b, b_b`: (R / rho - a) / b times rho b_r b_b, as
/// only the direction counts.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn two_step(maps: [&[f32]; 4], albedo: Option<&[f32]>, light: [&[f32]; 4], cos: &mut [f32], sin: &mut [f32]) {
    let (maps, light) = (maps.map(lanes), [lanes(light[0]), lanes(light[2])]);
    let mut out = [lanes_mut(cos), lanes_mut(sin)];
    for i in 0..out[0].len() {
        let albedo = albedo.map_or([1.0; LANES], |albedo| lanes(albedo)[i]);
        let ([a_r, b_r, a_b, b_b], [red, blue]) = (take(&maps, i), take(&light, i));
        let mut phasor = [[0.0; LANES]; 2];
        for x in 0..LANES {
            let real = (red[x] - albedo[x] * a_r[x]) * b_b[x];
            let imaginary = (albedo[x] * a_b[x] - blue[x]) * b_r[x];
            let length = (real * real + imaginary * imaginary).sqrt();
            let inverse = 1.0 / if length > 1e-12 { length } else { 1e-12 };
            (phasor[0][x], phasor[1][x]) = (real * inverse, imaginary * inverse);
        }
        put(&mut out, i, &phasor);
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn add_products(usable: &[f32], phasor: [&[f32]; 2], light: [&[f32]; 4], sums: &mut [[Lanes; SUMS]]) {
    let (rows, light) = ([lanes(usable), lanes(phasor[0]), lanes(phasor[1])], light.map(lanes));
    for (i, sums) in sums.iter_mut().enumerate() {
        let ([w, cos, sin], light) = (take(&rows, i), take(&light, i));
        let mut terms = [w; SUMS];
        for x in 0..LANES {
            let (c, s) = (w[x] * cos[x], w[x] * sin[x]);
            (terms[1][x], terms[2][x]) = (c, s);
            (terms[3][x], terms[4][x]) = (c * cos[x], c * sin[x]);
            for k in 0..4 {
                let seen = light[k][x];
                terms[5 + 3 * k][x] = w[x] * seen;
                terms[6 + 3 * k][x] = c * seen;
                terms[7 + 3 * k][x] = s * seen;
            }
        }
        add(sums, &terms);
    }
}

/// Inverse of the normal matrix by its adjugate, and everything that follows from it, cell by cell.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn solve_row(sums: [&[f32]; SUMS], out: &mut [f32]) {
    let columns = sums[0].len();
    let mut maps = out.chunks_exact_mut(columns);
    let mut maps: [&mut [f32]; map::COUNT] =
        std::array::from_fn(|_| maps.next().expect("a line for each map"));
    for i in 0..columns {
        let [w, wc, ws, wcc, wcs] = [0, 1, 2, 3, 4].map(|k| sums[k][i]);
        let half = 0.5 * w;
        let skew = wcc - half;
        let spread = half - (skew * skew + wcs * wcs).sqrt();
        let ridge = RIDGE * w + 1e-12;
        let (a, b, c, d, e, f) = (w + ridge, wc, ws, wcc + ridge, wcs, w - wcc + ridge);
        let (xx, xy, xz) = (d * f - e * e, c * e - b * f, b * e - c * d);
        let (yy, yz, zz) = (a * f - c * c, b * c - a * e, a * d - b * b);
        let scale = 1.0 / (a * xx + b * xy + c * xz).max(f32::MIN_POSITIVE);
        let mut fits = [[0.0f32; 4]; 4];
        for (k, fit) in fits.iter_mut().enumerate() {
            let [u, v, t] = [5 + 3 * k, 6 + 3 * k, 7 + 3 * k].map(|m| sums[m][i] * scale);
            let (p, q) = (xy * u + yy * v + yz * t, xz * u + yz * v + zz * t);
            *fit = [xx * u + xy * v + xz * t, p, q, (p * p + q * q).sqrt()];
        }
        let [r, g, b, ir] = fits;
        let strength = |[a, _, _, b]: [f32; 4]| if b > CONTRAST_MIN * a { b } else { 0.0 };
        let seen = if spread > SPREAD_MIN * w { 1.0 } else { 0.0 };
        let weakest = strength(r).min(strength(b)).min(strength(g)).min(strength(ir));
        let values = [
            r[0],
            r[3],
            b[0],
            b[3],
            r[1],
            r[2],
            b[1],
            b[2],
            g[0],
            g[1],
            g[2],
            ir[0],
            ir[1],
            ir[2],
            g[3],
            ir[3],
            seen * weakest,
            0.5 * (r[3] + b[3]),
        ];
        for (map, value) in maps.iter_mut().zip(values) {
            map[i] = value;
        }
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn relative_albedo(model: [[&[f32]; 3]; 4], phasor: [&[f32]; 2], light: [&[f32]; 4], out: &mut [f32]) {
    let (model, phasor, light) = (model.map(|maps| maps.map(lanes)), phasor.map(lanes), light.map(lanes));
    for (i, out) in lanes_mut(out).iter_mut().enumerate() {
        let ([cos, sin], light) = (take(&phasor, i), take(&light, i));
        let (mut sum, mut norm) = ([0.0; LANES], [1e-9; LANES]);
        for c in 0..4 {
            let [a, p, q] = take(&model[c], i);
            for x in 0..LANES {
                let model = a[x] + p[x] * cos[x] + q[x] * sin[x];
                let model = if model > 0.0 { model } else { 0.0 };
                sum[x] += model * light[c][x];
                norm[x] += model * model;
            }
        }
        for x in 0..LANES {
            let albedo = sum[x] / norm[x];
            out[x] = if albedo > 1e-4 { albedo } else { 1e-4 };
        }
    }
}

/// Phase, and modulation where there is enough of it.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn finish_row(known: [&[f32]; 4], strengths: [&[f32]; 2], least: f32, [phase, modulation]: [&mut [f32]; 2]) {
    let rows = [known[0], known[1], strengths[0], strengths[1], known[2], known[3]].map(lanes);
    let mut out = [lanes_mut(phase), lanes_mut(modulation)];
    for i in 0..out[0].len() {
        let [cos, sin, weakest, mean, lit, albedo] = take(&rows, i);
        let mut found = [[0.0; LANES]; 2];
        for x in 0..LANES {
            found[0][x] = atan2(sin[x], cos[x]);
            let enough = lit[x] * albedo[x] * weakest[x] >= least;
            found[1][x] = if enough { albedo[x] * mean[x] } else { 0.0 };
        }
        put(&mut out, i, &found);
    }
}
