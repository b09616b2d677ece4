//! From the phase that guides to a first phase of every pixel.
//!
//! Where the surface is smooth it is interpolated. Beside tears and shadows every pixel is asked: of the surfaces that
//! meet there it is given the one that explains its four intensities, and those of its neighbours, best.

use crate::joint::cells::{blend, spread};
use crate::joint::coarse::Guide;
use crate::joint::photometry::carriers;
use crate::joint::scene::{Scene, around};
use crate::parallel::lanes::{LANES, Lanes, lanes};
use crate::parallel::slots::Slots;
use multiversion::multiversion;
use rayon::prelude::*;

/// Surfaces nearer than this, in rad, are one.
const SAME_RAD: f32 = 0.3;
/// Greatest square of what a surface leaves unexplained, in units of the modulation.
const MISS_MAX: f32 = 0.5;
/// Greatest step from the phase of a surface to that of the pixel, in rad.
const STEP_MAX: f32 = 1.0;
/// A pixel and its eight neighbours.
const NEAR: usize = 9;
/// Greatest factor between the two images.
pub(in crate::joint) const FACTOR_MAX: usize = 4;
const VECTORS: usize = ((FACTOR_MAX + 2) * (FACTOR_MAX + 2)).div_ceil(LANES);

/// Working rows of the tasks.
#[derive(Debug, Default)]
pub(in crate::joint) struct Expander {
    slots: Slots<Rows>,
}

#[derive(Debug, Default)]
struct Rows {
    mix: Vec<f32>,
    around: Around,
}

/// What the surfaces leave unexplained at the pixels of a block and around it, and their steps to them.
#[derive(Debug, Default)]
struct Around {
    misses: [[Lanes; NEAR]; VECTORS],
    steps: [[Lanes; NEAR]; VECTORS],
}

/// One of the surfaces that meet at a pixel of the coarse image: phase at its middle and slopes, per fine pixel.
#[derive(Debug, Clone, Copy, Default)]
struct Surface {
    phase: f32,
    along: f32,
    down: f32,
    modulation: f32,
}

impl Surface {
    /// Its phase at fine pixel (x, y) of the block, whose first is (0, 0).
    fn at(&self, [x, y]: [f32; 2]) -> f32 {
        self.phase + self.along * x + self.down * y
    }
}

impl Expander {
    /// Phase (rad) and modulation of the pixels of `fine`, from a guide on `coarse`; `lit` is 1 where light falls.
    pub fn run(
        &self,
        [coarse, fine]: [&Scene<'_>; 2],
        guide: &Guide,
        ratios: [f32; 3],
        lit: &[f32],
        [phase, modulation]: [&mut [f32]; 2],
    ) {
        let (grid, stride) = (coarse.grid, fine.grid.stride);
        let factor = stride / grid.stride;
        let out = phase.par_chunks_mut(factor * stride).zip(modulation.par_chunks_mut(factor * stride));
        out.enumerate().for_each_init(
            || self.slots.take(),
            |rows, (row, (phase, modulation))| {
                let rows = &mut **rows;
                let near = around(row, grid.height);
                let phases = near.map(|y| coarse.row(&guide.phase, y));
                let lights = near.map(|y| coarse.row(&guide.modulation, y));
                for (from, to) in [(phases, &mut *phase), (lights, &mut *modulation)] {
                    for (i, out) in to.chunks_exact_mut(stride).enumerate() {
                        interpolate(from, (i, factor), &mut rows.mix, out);
                    }
                }
                let beside = Beside { scenes: [coarse, fine], guide, ratios, lit, row, factor };
                beside.decide(rows, phase, modulation);
                let lit = &lit[row * factor * stride..];
                modulation.iter_mut().zip(lit).for_each(|(modulation, lit)| *modulation *= lit);
            },
        );
    }
}

/// Row `i` of `factor` below each other, bilinear.
fn interpolate(rows: [&[f32]; 3], (i, factor): (usize, usize), mix: &mut Vec<f32>, out: &mut [f32]) {
    let columns = rows[0].len();
    mix.resize(columns + 2, 0.0);
    let place = (i as f32 + 0.5) / factor as f32 - 0.5;
    let other = if place < 0.0 { rows[0] } else { rows[2] };
    blend(rows[1], other, place.abs(), &mut mix[1..=columns]);
    (mix[0], mix[columns + 1]) = (mix[1], mix[columns]);
    spread(factor, mix, out);
}

/// The pixels of one coarse row that lie beside tears and shadows.
struct Beside<'a> {
    scenes: [&'a Scene<'a>; 2],
    guide: &'a Guide,
    ratios: [f32; 3],
    lit: &'a [f32],
    row: usize,
    factor: usize,
}

impl Beside<'_> {
    fn decide(&self, rows: &mut Rows, phase: &mut [f32], modulation: &mut [f32]) {
        let width = self.scenes[0].grid.width;
        let torn = self.scenes[0].row(&self.guide.torn, self.row);
        // Vectors without a tear are the rule.
        let torn = lanes(torn).iter().enumerate().filter(|(_, torn)| torn.iter().any(|&t| t > 0.0));
        for (i, torn) in torn {
            let columns = (i * LANES..((i + 1) * LANES).min(width)).filter(|x| torn[x % LANES] > 0.0);
            columns.for_each(|column| self.block(column, &mut rows.around, phase, modulation));
        }
    }

    /// The fine pixels of one coarse pixel.
    fn block(&self, column: usize, around: &mut Around, phase: &mut [f32], modulation: &mut [f32]) {
        let (factor, stride) = (self.factor, self.scenes[1].grid.stride);
        let mut found = [Surface::default(); NEAR];
        let count = self.surfaces(column, &mut found);
        let surfaces = &found[..count];
        if count > 1 {
            self.ask(column, surfaces, around);
        }
        for i in 0..factor * factor {
            let (y, x) = (i / factor, i % factor);
            let at = y * stride + column * factor + x;
            if at >= phase.len() {
                break; // below the last row of the image
            }
            (phase[at], modulation[at]) = match surfaces {
                [] => (0.0, 0.0),
                [only] => (only.at([x as f32, y as f32]), only.modulation),
                _ => {
                    let best = around.least([x, y], factor + 2, count);
                    let own = (y + 1) * (factor + 2) + x + 1;
                    let step = around.steps[own / LANES][best][own % LANES];
                    (surfaces[best].at([x as f32, y as f32]) + step, surfaces[best].modulation)
                }
            };
        }
    }

    /// Backgrounds and modulations near a coarse pixel.
    fn fringes(&self, column: usize) -> [[f32; 2]; 4] {
        let coarse = self.scenes[0];
        let [row, column] = [self.row, column].map(|v| v / coarse.grid.step);
        self.guide.backgrounds.cell(coarse, row, column)
    }

    /// Surfaces of the pixel and its neighbours, those that differ; their number.
    fn surfaces(&self, column: usize, found: &mut [Surface; NEAR]) -> usize {
        let (grid, factor) = (self.scenes[0].grid, self.factor as f32);
        let slopes = self.guide.slopes.at(self.row / grid.step, column / grid.step);
        let [along, down] = slopes.map(|slope| slope / (grid.step as f32 * factor));
        let middle = 0.5 * (factor - 1.0);
        let mut count = 0;
        // The pixel itself comes first.
        for n in [4, 1, 3, 5, 7, 0, 2, 6, 8] {
            let (dy, dx) = (n / 3, n % 3);
            let (y, x) = ((self.row + dy).wrapping_sub(1), (column + dx).wrapping_sub(1));
            if y >= grid.height || x >= grid.width {
                continue;
            }
            let at = y * grid.stride + x;
            let modulation = self.guide.modulation[at];
            if modulation <= 0.0 {
                continue;
            }
            let offset = |d: usize| middle + (d as f32 - 1.0) * factor;
            let phase = self.guide.phase[at] - along * offset(dx) - down * offset(dy);
            if found[..count].iter().all(|other| (other.phase - phase).abs() > SAME_RAD) {
                found[count] = Surface { phase, along, down, modulation };
                count += 1;
            }
        }
        count
    }

    /// What every surface leaves unexplained at the pixels of a block and around it.
    fn ask(&self, column: usize, surfaces: &[Surface], around: &mut Around) {
        let (fine, factor) = (self.scenes[1], self.factor);
        let (grid, side) = (fine.grid, factor + 2);
        let first = [column * factor, self.row * factor];
        let fringes = self.fringes(column);
        for vector in 0..(side * side).div_ceil(LANES) {
            let (mut light, mut lit, mut places) = ([[0.0; LANES]; 4], [0.0; LANES], [[0.0; LANES]; 2]);
            for k in 0..LANES.min(side * side - vector * LANES) {
                let i = vector * LANES + k;
                let x = (first[0] + i % side).saturating_sub(1).min(grid.width - 1);
                let y = (first[1] + i / side).saturating_sub(1).min(grid.height - 1);
                let at = y * grid.stride + x;
                lit[k] = self.lit[at];
                light.iter_mut().zip(fine.light).for_each(|(light, plane)| light[k] = plane[at]);
                (places[0][k], places[1][k]) = (x as f32 - first[0] as f32, y as f32 - first[1] as f32);
            }
            for (k, surface) in surfaces.iter().enumerate() {
                let mut phases = [0.0; LANES];
                for x in 0..LANES {
                    phases[x] = surface.at([places[0][x], places[1][x]]);
                }
                let known = [&phases, &lit];
                let found = [&mut around.misses[vector][k], &mut around.steps[vector][k]];
                explain(&light, known, &fringes, self.ratios, surface.modulation, found);
            }
        }
    }
}

impl Around {
    /// The surface with the least misfit over the pixel (x, y) of a block and its neighbours.
    fn least(&self, [x, y]: [usize; 2], side: usize, count: usize) -> usize {
        let miss = |n: usize, k: usize| {
            let at = (y + n / 3) * side + x + n % 3;
            self.misses[at / LANES][k][at % LANES]
        };
        let sum = |k: usize| -> f32 { (0..NEAR).map(|n| miss(n, k)).sum() };
        let (mut best, mut least) = (0, sum(0));
        for k in 1..count {
            let own = sum(k);
            if own < least {
                (best, least) = (k, own);
            }
        }
        best
    }
}

/// What neither albedo nor a small change of the phase explains of the intensities of lit pixels, and that change.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn explain(
    light: &[Lanes; 4],
    [phases, lit]: [&Lanes; 2],
    fringes: &[[f32; 2]; 4],
    ratios: [f32; 3],
    modulation: f32,
    [misses, steps]: [&mut Lanes; 2],
) {
    let most = MISS_MAX * modulation * modulation;
    for x in 0..LANES {
        let (cosines, derivatives) = carriers(phases[x], ratios, 0.0);
        let (mut mm, mut md, mut dd) = (1e-9f32, 0.0f32, 1e-9f32);
        let (mut ms, mut ds, mut ss) = (0.0f32, 0.0f32, 0.0f32);
        for c in 0..4 {
            let [a, b] = fringes[c];
            let (m, d, s) = (a + b * cosines[c], b * derivatives[c], light[c][x]);
            mm += m * m;
            md += m * d;
            dd += d * d;
            ms += m * s;
            ds += d * s;
            ss += s * s;
        }
        let determinant = mm * dd - md * md;
        let inverse = 1.0 / if determinant > 1e-12 { determinant } else { 1e-12 };
        let (albedo, change) = ((dd * ms - md * ds) * inverse, (mm * ds - md * ms) * inverse);
        let rest = ss - albedo * ms - change * ds;
        let rest = if rest > 0.0 { rest } else { 0.0 };
        let rest = if rest < most { rest } else { most };
        let step = change / if albedo > 1e-4 { albedo } else { 1e-4 };
        let step = if step < STEP_MAX { step } else { STEP_MAX };
        let on = lit[x] > 0.0;
        misses[x] = if on { rest } else { 0.0 };
        steps[x] = if on { if step > -STEP_MAX { step } else { -STEP_MAX } } else { 0.0 };
    }
}
