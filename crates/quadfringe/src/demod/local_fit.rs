//! Local least squares: phase, backgrounds, modulations and beats without a carrier to choose.
//!
//! In a window of about a fringe every channel is `I = rho (a + p cos(Phi) + q sin(Phi))`, with `Phi` the phase of R
//! and B and `rho` the albedo of the pixel. R and B give `Phi` pixel by pixel; G and IR have nearly the same carrier,
//! so that `p - i q = b exp(i (Phi_c - Phi))` is their *beat* against it, six to thirty times slower than a fringe.
//! No direction, no band and no slope is preferred, which a Fourier filter along rows must do. Sums are kept once per
//! cell of an eighth of a fringe.

use super::grid::Grid;
use super::window::Slopes;
use crate::angle::atan2;
use rayon::prelude::*;

/// Width (sigma) of the fitting window in fringe periods: shorter follows edges, longer averages noise.
const WINDOW: f32 = 0.3;
/// Width (sigma) of the first window, which has to average whole fringes away.
const FIRST_WINDOW: f32 = 0.5;
/// Rounds of phase, albedo and fit.
const ROUNDS: usize = 1;
/// Ridge of the normal equations relative to the weight in the window.
const RIDGE: f32 = 1e-3;
/// Sums of one cell: w, wc, ws, wcc, wcs, then w I, w I c, w I s of four channels.
const SUMS: usize = 17;

/// `a`, `p`, `q` of one channel on the cells.
#[derive(Debug, Clone, Default)]
pub(crate) struct Harmonic {
    pub a: Vec<f32>,
    pub p: Vec<f32>,
    pub q: Vec<f32>,
}

/// What the local fit knows after the last round.
#[derive(Debug, Clone)]
pub(crate) struct LocalFit {
    pub grid: Grid,
    pub channels: [Harmonic; 4],
    /// Least mean square of the phasor in any direction, on the cells: whether R and B are two views or one.
    pub spread: Vec<f32>,
    window_cells: f32,
}

/// Four planes of linear light, row-major, with their width.
#[derive(Clone, Copy)]
pub(crate) struct Planes<'a> {
    pub light: [&'a [f32]; 4],
    /// Pixels that may take part in a fit: lit and not saturated.
    pub usable: &'a [bool],
    pub width: usize,
}

impl<'a> Planes<'a> {
    pub fn height(&self) -> usize {
        self.light[0].len() / self.width
    }

    pub fn rows(&self, y: usize) -> [&'a [f32]; 4] {
        self.light
            .map(|plane| &plane[y * self.width..][..self.width])
    }
}

/// Pixel maps of the fit: unit phasor of R and B, and albedo.
#[derive(Debug, Clone, Default)]
pub(crate) struct PixelMaps {
    pub cos: Vec<f32>,
    pub sin: Vec<f32>,
    /// Albedo relative to its surroundings, as fitted.
    pub albedo: Vec<f32>,
    raw: Vec<f32>,
}

impl LocalFit {
    /// Fit a shot whose fringes are about `period_px` apart, in any direction.
    pub fn new(grid: Grid, planes: &Planes<'_>, period_px: f64, maps: &mut PixelMaps) -> Self {
        let (height, width) = (planes.height(), planes.width);
        let step = grid.step;
        let mut fit = Self {
            grid,
            channels: Default::default(),
            spread: Vec::new(),
            window_cells: WINDOW * period_px as f32 / step as f32,
        };
        for map in [
            &mut maps.cos,
            &mut maps.sin,
            &mut maps.albedo,
            &mut maps.raw,
        ] {
            map.resize(height * width, 0.0);
        }
        maps.albedo.fill(1.0);
        fit.start(planes, FIRST_WINDOW * period_px as f32 / step as f32);
        fit.update_phase(planes, maps);
        for _ in 0..ROUNDS {
            let sums = fit.sums(planes, maps);
            fit.solve(&sums);
            fit.update_albedo(planes, maps);
            smooth_albedo(&mut maps.albedo, &mut maps.raw, width);
            fit.update_phase(planes, maps);
        }
        fit
    }

    /// Beat of G (`channel` 1) or IR (3) against R and B on the cells: real and imaginary part.
    pub fn beat(&self, channel: usize) -> [&[f32]; 2] {
        [&self.channels[channel].p, &self.channels[channel].q]
    }

    /// Slopes of the phase on the cells; `modulation` is 0 where there is no light.
    pub fn slopes(&self, planes: &Planes<'_>, maps: &PixelMaps, modulation: &[f32]) -> Slopes {
        let width = planes.width;
        let mut sums = cell_sums_at::<4>(&self.grid, planes, |_, _, y, x| {
            let at = y * width + x;
            let step = |inside: bool, other: usize| {
                if !inside || modulation[at] <= 0.0 || modulation[other] <= 0.0 {
                    return [0.0, 0.0];
                }
                let (c, s, c2, s2) = (maps.cos[at], maps.sin[at], maps.cos[other], maps.sin[other]);
                [c2 * c + s2 * s, s2 * c - c2 * s]
            };
            let [a, b] = step(x + 1 < width, at + 1);
            let [d, e] = step(at + width < modulation.len(), at + width);
            [a, b, d, e]
        });
        self.grid.smooth_all(&mut sums, 1.0);
        let angle = |real: &[f32], imaginary: &[f32]| {
            let pairs = real.iter().zip(imaginary);
            pairs.map(|(&re, &im)| atan2(im, re)).collect()
        };
        Slopes {
            along: angle(&sums[0], &sums[1]),
            down: angle(&sums[2], &sums[3]),
        }
    }

    /// Mean and amplitude in a window that holds whole fringes; only R and B are needed to start.
    fn start(&mut self, planes: &Planes<'_>, sigma_cells: f32) {
        let grid = &self.grid;
        let mut maps = cell_sums::<9>(grid, planes, |rows, usable, x| {
            let mut sums = [0.0; 9];
            if usable[x] {
                sums[0] = 1.0;
                for c in 0..4 {
                    sums[1 + 2 * c] = rows[c][x];
                    sums[2 + 2 * c] = rows[c][x] * rows[c][x];
                }
            }
            sums
        });
        grid.smooth_all(&mut maps, sigma_cells);
        for (c, harmonic) in self.channels.iter_mut().enumerate() {
            let cells = (0..grid.cells()).map(|i| {
                let weight = maps[0][i].max(1e-6);
                let mean = maps[1 + 2 * c][i] / weight;
                let variance = (maps[2 + 2 * c][i] / weight - mean * mean).max(0.0);
                (mean, (2.0 * variance).sqrt())
            });
            (harmonic.a, harmonic.p) = cells.unzip();
            harmonic.q = vec![0.0; grid.cells()];
        }
    }

    /// Two-step phase (S2) of every pixel from the present backgrounds, modulations and albedo.
    fn update_phase(&self, planes: &Planes<'_>, maps: &mut PixelMaps) {
        let modulation: [Vec<f32>; 2] = [0, 2].map(|c: usize| {
            let harmonic = &self.channels[c];
            harmonic
                .p
                .iter()
                .zip(&harmonic.q)
                .map(|(p, q)| p.hypot(*q))
                .collect()
        });
        let width = planes.width;
        maps.cos
            .par_chunks_mut(width)
            .zip(maps.sin.par_chunks_mut(width))
            .zip(maps.albedo.par_chunks(width))
            .enumerate()
            .for_each_init(RowMaps::default, |row_maps, (y, ((cos, sin), albedo))| {
                let slow = [
                    &self.channels[0].a,
                    &modulation[0],
                    &self.channels[2].a,
                    &modulation[1],
                ];
                let [a_r, b_r, a_b, b_b] = row_maps.sample(&self.grid, y, slow, width);
                let [red, _, blue, _] = planes.rows(y);
                for x in 0..width {
                    // (R / rho - a) / b, times rho b_r b_b: only the direction counts.
                    let real = (red[x] - albedo[x] * a_r[x]) * b_b[x];
                    let imaginary = (albedo[x] * a_b[x] - blue[x]) * b_r[x];
                    let length = real.hypot(imaginary).max(f32::MIN_POSITIVE);
                    (cos[x], sin[x]) = (real / length, imaginary / length);
                }
            });
    }

    /// Albedo of every pixel: the factor that brings the model of all four channels closest to what was seen.
    fn update_albedo(&self, planes: &Planes<'_>, maps: &mut PixelMaps) {
        let width = planes.width;
        let PixelMaps {
            cos,
            sin,
            albedo,
            raw,
        } = maps;
        raw.par_chunks_mut(width).enumerate().for_each_init(
            RowMaps::default,
            |row_maps, (y, target)| {
                let rows = planes.rows(y);
                let at = y * width..(y + 1) * width;
                let (cos, sin) = (&cos[at.clone()], &sin[at]);
                let mut norm = vec![1e-9f32; width];
                target.fill(0.0);
                for (harmonic, light) in self.channels.iter().zip(rows) {
                    let slow = [&harmonic.a, &harmonic.p, &harmonic.q, &harmonic.q];
                    let [a, p, q, _] = row_maps.sample(&self.grid, y, slow, width);
                    for x in 0..width {
                        let model = (a[x] + p[x] * cos[x] + q[x] * sin[x]).max(0.0);
                        target[x] += model * light[x];
                        norm[x] += model * model;
                    }
                }
                target
                    .iter_mut()
                    .zip(norm)
                    .for_each(|(t, n)| *t = (*t / n).max(1e-4));
            },
        );
        std::mem::swap(albedo, raw);
    }

    /// The seventeen sums of every cell, smoothed over the window; intensities are divided by the albedo and
    /// weighted by its square, as additive noise asks for.
    fn sums(&self, planes: &Planes<'_>, maps: &PixelMaps) -> Vec<Vec<f32>> {
        let width = planes.width;
        let mut sums = cell_sums_at::<SUMS>(&self.grid, planes, |rows, usable, y, x| {
            let mut sums = [0.0; SUMS];
            if usable[x] {
                let at = y * width + x;
                let (c, s, rho) = (maps.cos[at], maps.sin[at], maps.albedo[at]);
                let w = rho * rho;
                sums[..5].copy_from_slice(&[w, w * c, w * s, w * c * c, w * c * s]);
                for (k, row) in rows.iter().enumerate() {
                    let light = rho * row[x];
                    sums[5 + 3 * k..8 + 3 * k].copy_from_slice(&[light, light * c, light * s]);
                }
            }
            sums
        });
        self.grid.smooth_all(&mut sums, self.window_cells);
        sums
    }

    /// Normal equations of every cell for `a`, `p`, `q` of the four channels.
    fn solve(&mut self, sums: &[Vec<f32>]) {
        let cells = self.grid.cells();
        for harmonic in &mut self.channels {
            for map in [&mut harmonic.a, &mut harmonic.p, &mut harmonic.q] {
                map.resize(cells, 0.0);
            }
        }
        self.spread.resize(cells, 0.0);
        for i in 0..cells {
            let [w, wc, ws, wcc, wcs] = [0, 1, 2, 3, 4].map(|k| sums[k][i]);
            let middle = 0.5 * w;
            self.spread[i] = (middle - (wcc - middle).hypot(wcs)) / w.max(1e-9);
            let ridge = RIDGE * w + 1e-12;
            let normal = Symmetric3::new(w + ridge, wc, ws, wcc + ridge, wcs, w - wcc + ridge);
            for (k, harmonic) in self.channels.iter_mut().enumerate() {
                let right = [5 + 3 * k, 6 + 3 * k, 7 + 3 * k].map(|m| sums[m][i]);
                [harmonic.a[i], harmonic.p[i], harmonic.q[i]] = normal.solve(right);
            }
        }
    }
}

/// Inverse of a symmetric positive definite 3 x 3 matrix by its adjugate.
struct Symmetric3([f32; 6]);

impl Symmetric3 {
    fn new(a: f32, b: f32, c: f32, d: f32, e: f32, f: f32) -> Self {
        let (xx, xy, xz) = (d * f - e * e, c * e - b * f, b * e - c * d);
        let (yy, yz, zz) = (a * f - c * c, b * c - a * e, a * d - b * b);
        let scale = 1.0 / (a * xx + b * xy + c * xz).max(f32::MIN_POSITIVE);
        Self([xx, xy, xz, yy, yz, zz].map(|v| v * scale))
    }

    fn solve(&self, [u, v, w]: [f32; 3]) -> [f32; 3] {
        let [xx, xy, xz, yy, yz, zz] = self.0;
        [
            xx * u + xy * v + xz * w,
            xy * u + yy * v + yz * w,
            xz * u + yz * v + zz * w,
        ]
    }
}

/// Slow maps interpolated along one row.
#[derive(Debug, Default)]
pub(crate) struct RowMaps {
    mix: Vec<f32>,
    rows: [Vec<f32>; 4],
}

impl RowMaps {
    /// Four maps at row `y`.
    pub fn sample<M: AsRef<[f32]>>(
        &mut self,
        grid: &Grid,
        y: usize,
        maps: [M; 4],
        width: usize,
    ) -> [&[f32]; 4] {
        for (row, map) in self.rows.iter_mut().zip(maps) {
            row.resize(width, 0.0);
            grid.sample_row(map.as_ref(), y, &mut self.mix, row);
        }
        self.rows.each_ref().map(Vec::as_slice)
    }
}

/// [1 2 1] / 4 in both directions: the albedo is not sharper than the lens.
pub(crate) fn smooth_albedo(albedo: &mut Vec<f32>, raw: &mut Vec<f32>, width: usize) {
    let height = albedo.len() / width;
    raw.par_chunks_mut(width).enumerate().for_each(|(y, out)| {
        let line = |row: usize| &albedo[row * width..][..width];
        let (above, here, below) = (
            line(y.saturating_sub(1)),
            line(y),
            line((y + 1).min(height - 1)),
        );
        let column = |x: usize| above[x] + 2.0 * here[x] + below[x];
        for (x, value) in out.iter_mut().enumerate() {
            let (left, right) = (x.saturating_sub(1), (x + 1).min(width - 1));
            *value = (column(left) + 2.0 * column(x) + column(right)) / 16.0;
        }
    });
    std::mem::swap(albedo, raw);
}

fn cell_sums<const N: usize>(
    grid: &Grid,
    planes: &Planes<'_>,
    terms: impl Fn(&[&[f32]; 4], &[bool], usize) -> [f32; N] + Sync,
) -> Vec<Vec<f32>> {
    cell_sums_at(grid, planes, |rows, usable, _, x| terms(rows, usable, x))
}

/// Sums over the pixels of every cell of `N` terms given per pixel (rows, usable, y, x).
pub(crate) fn cell_sums_at<const N: usize>(
    grid: &Grid,
    planes: &Planes<'_>,
    terms: impl Fn(&[&[f32]; 4], &[bool], usize, usize) -> [f32; N] + Sync,
) -> Vec<Vec<f32>> {
    let (step, width, height) = (grid.step, planes.width, planes.height());
    let rows: Vec<Vec<[f32; N]>> = (0..grid.rows)
        .into_par_iter()
        .map(|cell_row| {
            let mut sums = vec![[0.0f32; N]; grid.columns];
            for y in cell_row * step..((cell_row + 1) * step).min(height) {
                let lines = planes.rows(y);
                let usable = &planes.usable[y * width..][..width];
                for x in 0..width {
                    let add = terms(&lines, usable, y, x);
                    let cell = &mut sums[x / step];
                    cell.iter_mut().zip(add).for_each(|(c, a)| *c += a);
                }
            }
            sums
        })
        .collect();
    (0..N)
        .map(|k| rows.iter().flatten().map(|cell| cell[k]).collect())
        .collect()
}
