//! Step 6: upsampling from the phase of the coarse level to a first phase of every pixel.
//!
//! Where the surface is smooth, the phase is interpolated. Near discontinuities and shadows several surfaces meet, and each pixel
//! takes the one that best explains its four intensities and the intensities of its neighbours.

use crate::joint::cells::{blend, spread};
use crate::joint::coarse::CoarseLevel;
use crate::joint::infrared::{Coaxial, Gathered, Waves};
use crate::joint::model::{CellFringes, count};
use crate::joint::neighbours::around;
use crate::joint::params::phase::ALBEDO_MIN;
use crate::joint::params::pyramid::{CORRECTION_MAX_RAD, FACTOR_MAX, SQUARED_MISFIT_MAX};
use crate::joint::params::validity::SAME_SURFACE_RAD;
use crate::joint::scene::Scene;
use crate::parallel::lanes::{LANES, Lanes, lanes};
use crate::parallel::slots::Slots;
use multiversion::multiversion;
use rayon::prelude::*;

/// A pixel and its eight neighbours.
const NEAR: usize = 9;
/// Number of vectors for the pixels of a block and of a rim of one pixel around it.
const VECTORS: usize = ((FACTOR_MAX + 2) * (FACTOR_MAX + 2)).div_ceil(LANES);

/// Working rows of the tasks.
#[derive(Debug, Default)]
pub(in crate::joint) struct Upsampler {
    slots: Slots<Rows>,
}

#[derive(Debug, Default)]
struct Rows {
    mix: Vec<f32>,
    around: Around,
}

/// Squared residuals and corrections of the phase for each surface, at the pixels of a block and of its rim.
#[derive(Debug, Default)]
struct Around {
    squared_residuals: [[Lanes; NEAR]; VECTORS],
    corrections: [[Lanes; NEAR]; VECTORS],
}

/// One of the surfaces that meet at a pixel of the coarse level: its phase at the first fine pixel in rad, and its slopes in rad
/// per fine pixel.
#[derive(Debug, Clone, Copy, Default)]
struct Surface {
    phase: f32,
    along: f32,
    down: f32,
    modulation: f32,
}

impl Surface {
    /// Phase of the surface at the fine pixel (x, y) of the block; the first pixel is (0, 0).
    fn at(&self, x: f32, y: f32) -> f32 {
        self.phase + self.along * x + self.down * y
    }
}

/// Input of upsampling.
#[derive(Clone, Copy)]
pub(in crate::joint) struct Levels<'a> {
    pub coarse: &'a Scene<'a>,
    pub fine: &'a Scene<'a>,
    /// Phase, discontinuities, slopes and photometry of the coarse level.
    pub found: &'a CoarseLevel,
    /// Fringe numbers divided by the first.
    pub ratios: [f32; 4],
    /// 1 for lit pixels of the fine level.
    pub lit: &'a [f32],
}

impl Upsampler {
    /// Computes absolute phase (rad) and modulation of every pixel of the fine level.
    pub fn run(&self, levels: Levels<'_>, phase: &mut [f32], modulation: &mut [f32]) {
        let Levels { coarse, fine, found, lit, .. } = levels;
        let (grid, stride) = (coarse.grid, fine.grid.stride);
        let factor = stride / grid.stride;
        let out = phase.par_chunks_mut(factor * stride).zip(modulation.par_chunks_mut(factor * stride));
        out.enumerate().for_each_init(
            || self.slots.take(),
            |rows, (row, (phase, modulation))| {
                let rows = &mut **rows;
                let near = around(row, grid.height);
                let phases = near.map(|y| coarse.row(&found.phase, y));
                let lights = near.map(|y| coarse.row(&found.modulation, y));
                for (from, to) in [(phases, &mut *phase), (lights, &mut *modulation)] {
                    for (i, out) in to.chunks_exact_mut(stride).enumerate() {
                        interpolate(from, i, factor, &mut rows.mix, out);
                    }
                }
                CoarseRow { levels, row, factor }.decide(rows, phase, modulation);
                let lit = &lit[row * factor * stride..];
                modulation.iter_mut().zip(lit).for_each(|(modulation, lit)| *modulation *= lit);
            },
        );
    }
}

/// Interpolates bilinearly the fine row `i` of the `factor` rows of a coarse row.
fn interpolate(rows: [&[f32]; 3], i: usize, factor: usize, mix: &mut Vec<f32>, out: &mut [f32]) {
    let columns = rows[0].len();
    mix.resize(columns + 2, 0.0);
    let place = (i as f32 + 0.5) / factor as f32 - 0.5;
    let other = if place < 0.0 { rows[0] } else { rows[2] };
    blend(rows[1], other, place.abs(), &mut mix[1..=columns]);
    (mix[0], mix[columns + 1]) = (mix[1], mix[columns]);
    spread(factor, mix, out);
}

/// One row of coarse pixels. Pixels near discontinuities and shadows are decided one by one.
struct CoarseRow<'a> {
    levels: Levels<'a>,
    row: usize,
    factor: usize,
}

impl CoarseRow<'_> {
    fn decide(&self, rows: &mut Rows, phase: &mut [f32], modulation: &mut [f32]) {
        let Levels { coarse, found, .. } = self.levels;
        let width = coarse.grid.width;
        let marks = lanes(coarse.row(&found.discontinuities, self.row)).iter().enumerate();
        // Most vectors have no discontinuity.
        for (i, marks) in marks.filter(|(_, marks)| marks.iter().any(|&mark| mark > 0.0)) {
            let columns = (i * LANES..((i + 1) * LANES).min(width)).filter(|x| marks[x % LANES] > 0.0);
            columns.for_each(|column| self.block(column, &mut rows.around, phase, modulation));
        }
    }

    /// Decides the fine pixels of one coarse pixel.
    fn block(&self, column: usize, around: &mut Around, phase: &mut [f32], modulation: &mut [f32]) {
        let (factor, stride) = (self.factor, self.levels.fine.grid.stride);
        let mut found = [Surface::default(); NEAR];
        let count = self.surfaces(column, &mut found);
        let surfaces = &found[..count];
        if count > 1 {
            self.compare(column, surfaces, around);
        }
        for i in 0..factor * factor {
            let (y, x) = (i / factor, i % factor);
            let at = y * stride + column * factor + x;
            if at >= phase.len() {
                break; // below the last row of the image
            }
            (phase[at], modulation[at]) = match surfaces {
                [] => (0.0, 0.0),
                [only] => (only.at(x as f32, y as f32), only.modulation),
                _ => {
                    let best = around.best(x, y, factor + 2, count);
                    let place = (y + 1) * (factor + 2) + x + 1;
                    let correction = around.corrections[place / LANES][best][place % LANES];
                    (surfaces[best].at(x as f32, y as f32) + correction, surfaces[best].modulation)
                }
            };
        }
    }

    /// Offsets and amplitudes near a coarse pixel.
    fn fringes(&self, column: usize) -> CellFringes {
        let Levels { coarse, found, .. } = self.levels;
        let [row, column] = [self.row, column].map(|v| v / coarse.grid.step);
        found.photometry.cell(row, column)
    }

    /// Collects the different surfaces of the pixel and its neighbours, and returns their number.
    fn surfaces(&self, column: usize, surfaces: &mut [Surface; NEAR]) -> usize {
        let Levels { coarse, found, .. } = self.levels;
        let (grid, factor) = (coarse.grid, self.factor as f32);
        let slopes = found.slopes.at(self.row / grid.step, column / grid.step);
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
            let modulation = found.modulation[at];
            if modulation <= 0.0 {
                continue;
            }
            let offset = |d: usize| middle + (d as f32 - 1.0) * factor;
            let phase = found.phase[at] - along * offset(dx) - down * offset(dy);
            if surfaces[..count].iter().all(|other| (other.phase - phase).abs() > SAME_SURFACE_RAD) {
                surfaces[count] = Surface { phase, along, down, modulation };
                count += 1;
            }
        }
        count
    }

    /// Computes residuals and corrections of every surface at the pixels of a block and of its rim.
    fn compare(&self, column: usize, surfaces: &[Surface], around: &mut Around) {
        let (Levels { fine, lit: mask, ratios, .. }, factor) = (self.levels, self.factor);
        let (grid, side) = (fine.grid, factor + 2);
        let [first_x, first_y] = [column * factor, self.row * factor];
        let fringes = self.fringes(column);
        for vector in 0..(side * side).div_ceil(LANES) {
            let (mut light, mut lit) = ([[0.0; LANES]; 4], [0.0; LANES]);
            let [mut place_x, mut place_y] = [[0.0; LANES]; 2];
            let mut gathered = Gathered::default();
            for k in 0..LANES.min(side * side - vector * LANES) {
                let i = vector * LANES + k;
                let x = (first_x + i % side).saturating_sub(1).min(grid.width - 1);
                let y = (first_y + i / side).saturating_sub(1).min(grid.height - 1);
                let at = y * grid.stride + x;
                lit[k] = mask[at];
                fine.pair.into_iter().for_each(|pair| gathered.set(k, pair, at));
                light.iter_mut().zip(fine.light).for_each(|(light, plane)| light[k] = plane[at]);
                (place_x[k], place_y[k]) = (x as f32 - first_x as f32, y as f32 - first_y as f32);
            }
            for (k, surface) in surfaces.iter().enumerate() {
                let mut phase = [0.0; LANES];
                for x in 0..LANES {
                    phase[x] = surface.at(place_x[x], place_y[x]);
                }
                let pixels = Pixels { phase, lit, light: &light, modulation: surface.modulation };
                let out = [&mut around.squared_residuals[vector][k], &mut around.corrections[vector][k]];
                match fine.pair {
                    None => explain(&pixels, &fringes, Coaxial { ratios }, out),
                    Some(_) => explain(&pixels, &fringes, gathered.waves(ratios), out),
                }
            }
        }
    }
}

impl Around {
    /// The surface with the least sum of squared residuals over the pixel (x, y) of a block and its neighbours.
    fn best(&self, x: usize, y: usize, side: usize, count: usize) -> usize {
        let square = |n: usize, k: usize| {
            let at = (y + n / 3) * side + x + n % 3;
            self.squared_residuals[at / LANES][k][at % LANES]
        };
        let sum = |k: usize| -> f32 { (0..NEAR).map(|n| square(n, k)).sum() };
        let (mut best, mut least) = (0, sum(0));
        for k in 1..count {
            let sum = sum(k);
            if sum < least {
                (best, least) = (k, sum);
            }
        }
        best
    }
}

/// A vector of pixels with their phase on one surface, and the modulation of this surface.
struct Pixels<'a> {
    phase: Lanes,
    lit: Lanes,
    light: &'a [Lanes; 4],
    modulation: f32,
}

/// Fits the albedo and a small correction of the phase to the intensities of lit pixels; gives the squared residual and
/// the correction.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn explain<W: Waves>(
    pixels: &Pixels,
    fringes: &CellFringes,
    waves: W,
    [squared_residuals, corrections]: [&mut Lanes; 2],
) {
    let most = SQUARED_MISFIT_MAX * (0.25 * count(waves.ratios())) * pixels.modulation * pixels.modulation;
    let vector = waves.vector(0);
    for x in 0..LANES {
        let carriers = waves.carriers(&vector, x, pixels.phase[x]);
        let (mut mm, mut md, mut dd) = (1e-9f32, 0.0f32, 1e-9f32);
        let (mut ms, mut ds, mut ss) = (0.0f32, 0.0f32, 0.0f32);
        for c in 0..4 {
            let (a, b) = (fringes.offset[c], fringes.amplitude[c]);
            let (m, d, s) = (a + b * carriers.cosine[c], b * carriers.derivative[c], pixels.light[c][x]);
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
        let step = change / if albedo > ALBEDO_MIN { albedo } else { ALBEDO_MIN };
        let step = if step < CORRECTION_MAX_RAD { step } else { CORRECTION_MAX_RAD };
        let on = pixels.lit[x] > 0.0;
        squared_residuals[x] = if on { rest } else { 0.0 };
        corrections[x] =
            if on { if step > -CORRECTION_MAX_RAD { step } else { -CORRECTION_MAX_RAD } } else { 0.0 };
    }
}
