//! Local least squares: phase, backgrounds, modulations and beats without a carrier to choose.
//!
//! In a window of about a fringe every channel is `I = rho (a + p cos(Phi) + q sin(Phi))`, with `Phi` the phase of R
//! and B and `rho` the albedo of the pixel. R and B give `Phi` pixel by pixel; G and IR have nearly the same carrier,
//! so that `p - i q = b exp(i (Phi_c - Phi))` is their *beat* against it, six to thirty times slower than a fringe.
//! No direction, no band and no slope is preferred, which a Fourier filter along rows must do. Sums are kept once per
//! cell of an eighth of a fringe.

use super::scene::{RowMaps, Scene, smooth_albedo};
use super::window::Slopes;
use crate::angle::atan2;
use rayon::prelude::*;

/// Width (sigma) of the fitting window in fringe periods: shorter follows edges, longer averages noise.
const WINDOW: f32 = 0.3;
/// Width (sigma) of the first window, which has to average whole fringes away.
const FIRST_WINDOW: f32 = 0.5;
/// Ridge of the normal equations relative to the weight in the window.
const RIDGE: f32 = 1e-3;
/// Width (sigma) in cells over which slopes are averaged.
const SLOPE_CELLS: f32 = 2.0;
/// Sums of one cell: w, wc, ws, wcc, wcs, then w I, w I c, w I s of four channels.
const SUMS: usize = 17;
/// Least contrast (modulation over background) of light that comes from the projector.
const CONTRAST_MIN: f32 = 0.1;
/// Least mean square of the phasor of R and B in any direction: 1/2 for whole fringes, 0 when B repeats R.
const SPREAD_MIN: f32 = 0.02;

/// `a`, `p`, `q` of one channel on the cells.
#[derive(Debug, Clone, Default)]
pub(crate) struct Harmonic {
    pub a: Vec<f32>,
    pub p: Vec<f32>,
    pub q: Vec<f32>,
}

impl Harmonic {
    fn modulation(&self) -> Vec<f32> {
        self.p.iter().zip(&self.q).map(|(p, q)| p.hypot(*q)).collect()
    }
}

/// What the fit knows on the cells.
#[derive(Debug, Clone)]
pub(crate) struct LocalFit {
    channels: [Harmonic; 4],
    /// Least mean square of the phasor in any direction: whether R and B are two views or one.
    spread: Vec<f32>,
}

/// What the fit knows of every pixel: unit phasor of R and B, and albedo relative to the surroundings.
#[derive(Debug, Clone, Default)]
pub(crate) struct PixelMaps {
    pub cos: Vec<f32>,
    pub sin: Vec<f32>,
    pub albedo: Vec<f32>,
    spare: Vec<f32>,
}

impl LocalFit {
    /// Fit a scene with fringes in any direction.
    pub fn new(scene: &Scene<'_>, maps: &mut PixelMaps) -> Self {
        for map in [&mut maps.cos, &mut maps.sin, &mut maps.albedo, &mut maps.spare] {
            map.resize(scene.pixels(), 0.0);
        }
        maps.albedo.fill(1.0);
        let mut fit = Self::start(scene);
        fit.update_phase(scene, maps);
        fit.solve(scene, maps);
        fit.update_albedo(scene, maps);
        smooth_albedo(&mut maps.albedo, &mut maps.spare, scene.width);
        fit.update_phase(scene, maps);
        fit
    }

    /// Beats of G and of IR against R and B on the cells: real and negative imaginary part of each.
    pub fn beats(&self) -> [&Vec<f32>; 4] {
        let [_, g, _, ir] = &self.channels;
        [&g.p, &g.q, &ir.p, &ir.q]
    }

    /// Modulation of R and B at every pixel in linear light; 0 where any channel has less than `least`, hardly any
    /// contrast, or nothing of its own to say.
    pub fn modulation(&self, scene: &Scene<'_>, maps: &PixelMaps, lit: &[bool], least: f32, out: &mut [f32]) {
        let strengths: [Vec<f32>; 4] = self.channels.each_ref().map(|h| {
            let fringes = |((strength, a), spread): ((f32, &f32), &f32)| {
                let seen = strength > CONTRAST_MIN * a && *spread > SPREAD_MIN;
                if seen { strength } else { 0.0 }
            };
            h.modulation().into_iter().zip(&h.a).zip(&self.spread).map(fringes).collect()
        });
        let width = scene.width;
        out.par_chunks_mut(width).enumerate().for_each_init(RowMaps::default, |row_maps, (y, out)| {
            let [red, green, blue, infrared] = row_maps.sample(scene, y, strengths.each_ref());
            for x in 0..width {
                let albedo = maps.albedo[y * width + x];
                let weakest = red[x].min(blue[x]).min(green[x]).min(infrared[x]);
                let enough = lit[y * width + x] && albedo * weakest >= least;
                out[x] = if enough { 0.5 * albedo * (red[x] + blue[x]) } else { 0.0 };
            }
        });
    }

    /// Mean and amplitude in a window that holds whole fringes.
    fn start(scene: &Scene<'_>) -> Self {
        let sums = scene.window_sums::<9>(FIRST_WINDOW, |light, _| {
            let [r, g, b, ir] = light;
            [1.0, r, r * r, g, g * g, b, b * b, ir, ir * ir]
        });
        let cells = scene.grid.cells();
        let channels = std::array::from_fn(|c| {
            let statistics = (0..cells).map(|i| {
                let weight = sums[0][i].max(1e-6);
                let mean = sums[1 + 2 * c][i] / weight;
                let variance = (sums[2 + 2 * c][i] / weight - mean * mean).max(0.0);
                (mean, (2.0 * variance).sqrt())
            });
            let (a, p) = statistics.unzip();
            Harmonic { a, p, q: vec![0.0; cells] }
        });
        Self { channels, spread: vec![0.0; cells] }
    }

    /// Two-step phase (S2) of every pixel from the present backgrounds, modulations and albedo.
    fn update_phase(&self, scene: &Scene<'_>, maps: &mut PixelMaps) {
        let [red, _, blue, _] = &self.channels;
        let (b_red, b_blue) = (red.modulation(), blue.modulation());
        let width = scene.width;
        maps.cos
            .par_chunks_mut(width)
            .zip(maps.sin.par_chunks_mut(width))
            .zip(maps.albedo.par_chunks(width))
            .enumerate()
            .for_each_init(RowMaps::default, |row_maps, (y, ((cos, sin), albedo))| {
                let [a_r, b_r, a_b, b_b] = row_maps.sample(scene, y, [&red.a, &b_red, &blue.a, &b_blue]);
                let [red, _, blue, _] = scene.rows(y);
                for x in 0..width {
                    // (R / rho - a) / b, times rho b_r b_b: only the direction counts.
                    let real = (red[x] - albedo[x] * a_r[x]) * b_b[x];
                    let imaginary = (albedo[x] * a_b[x] - blue[x]) * b_r[x];
                    let length = (real * real + imaginary * imaginary).sqrt().max(f32::MIN_POSITIVE);
                    (cos[x], sin[x]) = (real / length, imaginary / length);
                }
            });
    }

    /// Albedo of every pixel: the factor that brings the model of all four channels closest to what was seen.
    fn update_albedo(&self, scene: &Scene<'_>, maps: &mut PixelMaps) {
        let width = scene.width;
        let PixelMaps { cos, sin, albedo, .. } = maps;
        albedo.par_chunks_mut(width).enumerate().for_each_init(
            <(RowMaps, Vec<f32>)>::default,
            |(row_maps, norm), (y, albedo)| {
                let at = y * width..(y + 1) * width;
                let (cos, sin) = (&cos[at.clone()], &sin[at]);
                norm.clear();
                norm.resize(width, 1e-9);
                albedo.fill(0.0);
                for (h, light) in self.channels.iter().zip(scene.rows(y)) {
                    let [a, p, q] = row_maps.sample(scene, y, [&h.a, &h.p, &h.q]);
                    for x in 0..width {
                        let model = (a[x] + p[x] * cos[x] + q[x] * sin[x]).max(0.0);
                        albedo[x] += model * light[x];
                        norm[x] += model * model;
                    }
                }
                albedo.iter_mut().zip(norm).for_each(|(t, n)| *t = (*t / *n).max(1e-4));
            },
        );
    }

    /// Normal equations of every cell for `a`, `p`, `q` of the four channels.
    fn solve(&mut self, scene: &Scene<'_>, maps: &PixelMaps) {
        let sums = scene.window_sums::<SUMS>(WINDOW, |light, at| {
            let (c, s) = (maps.cos[at], maps.sin[at]);
            let [r, g, b, ir] = light;
            [1.0, c, s, c * c, c * s, r, r * c, r * s, g, g * c, g * s, b, b * c, b * s, ir, ir * c, ir * s]
        });
        for i in 0..scene.grid.cells() {
            let [w, wc, ws, wcc, wcs] = [0, 1, 2, 3, 4].map(|k| sums[k][i]);
            let half = 0.5 * w;
            self.spread[i] = (half - (wcc - half).hypot(wcs)) / w.max(1e-9);
            let ridge = RIDGE * w + 1e-12;
            let normal = Symmetric3::new(w + ridge, wc, ws, wcc + ridge, wcs, w - wcc + ridge);
            for (k, h) in self.channels.iter_mut().enumerate() {
                let right = [5 + 3 * k, 6 + 3 * k, 7 + 3 * k].map(|m| sums[m][i]);
                [h.a[i], h.p[i], h.q[i]] = normal.solve(right);
            }
        }
    }
}

impl PixelMaps {
    /// Wrapped phase of R and B in rad.
    pub fn phase(&self, out: &mut [f32]) {
        let phasors = self.cos.par_iter().zip(&self.sin);
        out.par_iter_mut().zip(phasors).for_each(|(phase, (&c, &s))| *phase = atan2(s, c));
    }

    /// Slopes of the phase; `modulation` is 0 where there is no light.
    pub fn slopes(&self, scene: &Scene<'_>, modulation: &[f32]) -> Slopes {
        let width = scene.width;
        let mut sums = scene.sums::<4>(|_, at| {
            let step = |inside: bool, other: usize| {
                if !inside || modulation[at] <= 0.0 || modulation[other] <= 0.0 {
                    return [0.0, 0.0];
                }
                let (c, s, c2, s2) = (self.cos[at], self.sin[at], self.cos[other], self.sin[other]);
                [c2 * c + s2 * s, s2 * c - c2 * s]
            };
            let [a, b] = step(at % width + 1 < width, at + 1);
            let [d, e] = step(at + width < modulation.len(), at + width);
            [a, b, d, e]
        });
        scene.grid.smooth_all(&mut sums, SLOPE_CELLS);
        let slope = |re: &Vec<f32>, im: &Vec<f32>| {
            let cells = re.iter().zip(im).map(|(re, im)| atan2(*im, *re)).collect();
            scene.spread_out(&cells)
        };
        Slopes { along: slope(&sums[0], &sums[1]), down: slope(&sums[2], &sums[3]) }
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
        [xx * u + xy * v + xz * w, xy * u + yy * v + yz * w, xz * u + yz * v + zz * w]
    }
}
