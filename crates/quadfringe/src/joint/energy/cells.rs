//! The cells of a shot: means of a few pixels, which the tiles read, and the way back to the pixels.

use super::average::{Surfaces, mean, surfaces};
use super::gaps::{Gaps, Maps};
use super::tile::Tile;
use crate::joint::cells::{blend, spread};
use crate::joint::infrared::wave;
use crate::joint::params::energy::{SIDE, USABLE_MIN};
use crate::joint::scene::{PhaseMap, Scene};
use crate::parallel::lanes::LANES;
use rayon::prelude::*;

/// Maps of cells in padded rows.
#[derive(Debug, Default)]
pub(super) struct Cells {
    pub height: usize,
    pub width: usize,
    /// Pixels along a side of a cell.
    pub factor: usize,
    stride: usize,
    /// Means of linear light; after the fit the albedo times `inside`.
    light: [Vec<f32>; 4],
    /// After the fit the contrast times `inside`; before it, the first is 1 for torn cells (`Surfaces::More`).
    contrast: [Vec<f32>; 4],
    /// Mean phase at the start, rad; after the fit the correction times `inside`.
    phase: Vec<f32>,
    /// 1 for cells that can be used in the fit; after it the variance times `inside`.
    usable: Vec<f32>,
    /// 1 for cells whose pixels are all lit and lie on one surface, and for those in narrow gaps between them; after the fit for those
    /// that it reaches.
    inside: Vec<f32>,
    gaps: Gaps,
    /// Of a calibrated pair, the tangent of the infrared phase at the mean phase: its value at a phase of 0, and its slope.
    infrared: [Vec<f32>; 2],
}

/// What the fit has found for one cell.
#[derive(Debug, Default)]
pub(super) struct CellFit {
    /// Change of the phase, rad.
    pub correction: f32,
    /// Variance of the phase, rad^2.
    pub variance: f32,
    /// Light without fringes, linear.
    pub albedo: [f32; 4],
    pub contrast: [f32; 4],
}

impl CellFit {
    pub fn divided_by(self, sum: f32) -> Self {
        Self {
            correction: self.correction / sum,
            variance: self.variance / sum,
            albedo: self.albedo.map(|albedo| albedo / sum),
            contrast: self.contrast.map(|contrast| contrast / sum),
        }
    }
}

/// Albedo and contrast of R, G, B, IR along a row of pixels; 0 far from all cells of the fit.
#[derive(Debug, Default)]
pub(in crate::joint) struct FringeRows {
    pub albedo: [Vec<f32>; 4],
    pub contrast: [Vec<f32>; 4],
    /// Albedo of the cells above, at and below, one value for all pixels of a cell, 0 outside the lit cells. Pixel `x` is at
    /// `x + cell_px`.
    pub cells: [[Vec<f32>; 4]; 3],
    /// Pixels along a side of a cell.
    pub cell_px: usize,
    /// Row of cells in the middle of `cells`; `None` before the first row of a shot.
    middle: Option<usize>,
    rows: Rows,
}

impl FringeRows {
    /// Forgets the rows of an earlier shot.
    pub fn clear(&mut self) {
        self.middle = None;
    }
}

/// Working rows.
#[derive(Debug, Default)]
pub(in crate::joint) struct Rows {
    mix: Vec<f32>,
    sum: Vec<f32>,
    weight: Vec<f32>,
}

impl Cells {
    /// Averages the pixels of a scene.
    pub fn average(&mut self, scene: &Scene<'_>, map: PhaseMap<'_>, factor: usize) {
        let grid = scene.grid;
        (self.height, self.width, self.factor) = (grid.height / factor, grid.width / factor, factor);
        self.stride = (grid.stride / factor).next_multiple_of(LANES);
        let size = self.stride * self.height;
        let Self { light: [red, green, blue, infrared], phase, usable, inside, stride, width, .. } = self;
        let torn = &mut self.contrast[0];
        let planes = [red, green, blue, infrared, phase, usable, inside, torn].map(|plane| {
            plane.resize(size, 0.0);
            plane.par_chunks_mut(*stride)
        });
        let [red, green, blue, infrared, phase, usable, inside, torn] = planes;
        let rows =
            red.zip(green).zip(blue.zip(infrared)).zip(phase.zip(usable).zip(inside.zip(torn))).enumerate();
        rows.for_each(|(y, (((red, green), (blue, infrared)), ((phase, usable), (inside, torn))))| {
            let light = [red, green, blue, infrared].into_iter().zip(scene.light);
            for (out, plane) in light.chain([(&mut *usable, scene.usable), (phase, map.phase)]) {
                mean((0..factor).map(|i| scene.row(plane, y * factor + i)), factor, out);
            }
            inside.fill(0.0);
            torn.fill(0.0);
            let cells = inside[..*width].iter_mut().zip(&mut torn[..*width]).zip(&mut usable[..*width]);
            for (x, ((inside, torn), usable)) in cells.enumerate() {
                match surfaces(scene, map, factor, [y, x]) {
                    Surfaces::None => (),
                    Surfaces::One => *inside = 1.0,
                    Surfaces::More => *torn = 1.0,
                }
                *usable = if *usable >= USABLE_MIN { *inside } else { 0.0 };
            }
        });
        let Self { height, width, stride, phase, inside, contrast, gaps, .. } = self;
        // They are not usable, because their light is none of the surface.
        gaps.close(Maps { inside, torn: &contrast[0], phase, stride: *stride }, [*height, *width]);
        self.draw_tangents(scene);
    }

    /// Mean phase of a cell at the start, rad; not a number outside the lit cells.
    pub fn start(&self, y: usize, x: usize) -> f32 {
        let at = y * self.stride + x;
        if self.inside[at] > 0.0 { self.phase[at] } else { f32::NAN }
    }

    /// The tangents of the infrared phase of a pair at the mean phases.
    fn draw_tangents(&mut self, scene: &Scene<'_>) {
        let (Self { infrared, phase, stride, factor, .. }, Some(pair)) = (self, scene.pair) else { return };
        let [offset, slope] = infrared.each_mut().map(|plane| {
            plane.resize(phase.len(), 0.0);
            plane.par_chunks_mut(*stride)
        });
        let (middle, factor) = (*factor / 2, *factor);
        let rows = offset.zip(slope).zip(phase.par_chunks(*stride)).enumerate();
        rows.for_each(|(y, ((offset, slope), phase))| {
            let terms = pair.terms(scene.grid, y * factor + middle);
            let out = offset.iter_mut().zip(slope).zip(phase).enumerate();
            for (x, ((offset, slope), phase)) in out.take(scene.grid.stride / factor) {
                // The middle of a cell with an even side lies between two pixels.
                let (here, before) = (x * factor + middle, x * factor + (factor - 1) / 2);
                let mean = terms.map(|line| 0.5 * (line[here] + line[before]));
                let found = wave(mean, *phase);
                (*offset, *slope) = (found.phase - found.slope * phase, found.slope);
            }
        });
    }

    /// Fills a tile whose first cell is `[top, left]`; gives whether it has any cell that can be used.
    pub fn load(&self, [top, left]: [usize; 2], tile: &mut Tile) -> bool {
        let Self { height, width, stride, light, phase, usable, inside, .. } = self;
        let count = SIDE.min(width - left);
        let mut any = false;
        tile.pair = !self.infrared[0].is_empty();
        for y in 0..SIDE {
            tile.clear(y);
            if top + y >= *height {
                continue;
            }
            let from = (top + y) * stride + left;
            let range = from..from + count;
            let [red, green, blue, infrared] = &mut tile.light;
            let planes = [red, green, blue, infrared].into_iter().zip(light);
            let planes = planes.chain([
                (&mut tile.start, phase),
                (&mut tile.usable, usable),
                (&mut tile.inside, inside),
                (&mut tile.torn, &self.contrast[0]),
            ]);
            planes.for_each(|(to, from)| to.row_mut(y)[..count].copy_from_slice(&from[range.clone()]));
            if tile.pair {
                let planes = tile.infrared.iter_mut().zip(&self.infrared);
                planes.for_each(|(to, from)| to.row_mut(y)[..count].copy_from_slice(&from[range.clone()]));
            }
            any |= usable[range].iter().any(|&usable| usable > 0.0);
        }
        any
    }

    /// Replaces phase, usability and light by correction, variance, albedo and contrast, each times `inside`.
    pub fn replace(&mut self, found: impl Fn(usize, usize) -> Option<CellFit> + Sync) {
        let Self { light, contrast, phase, usable, inside, stride, width, .. } = self;
        for plane in contrast.iter_mut() {
            plane.resize(inside.len(), 0.0);
        }
        let mut planes = [phase, usable].into_iter().chain(light).chain(contrast).chain([inside]);
        let mut planes: [_; 11] =
            std::array::from_fn(|_| planes.next().expect("eleven planes").chunks_mut(*stride));
        let rows: Vec<[&mut [f32]; 11]> = (0..self.height)
            .map(|_| planes.each_mut().map(|rows| rows.next().expect("as many rows as cells are high")))
            .collect();
        rows.into_par_iter().enumerate().for_each(|(y, mut rows)| {
            let [values @ .., inside] = &mut rows;
            // The padding is interpolated, too.
            values.iter_mut().for_each(|row| row[*width..].fill(0.0));
            for x in 0..*width {
                let fit = found(y, x).filter(|_| inside[x] > 0.0);
                inside[x] = f32::from(u8::from(fit.is_some()));
                let CellFit { correction, variance, albedo, contrast } = fit.unwrap_or_default();
                let fitted = [correction, variance].into_iter().chain(albedo).chain(contrast);
                values.iter_mut().zip(fitted).for_each(|(row, value)| row[x] = value);
            }
        });
    }

    /// Mean square of the correction, rad^2.
    pub fn correction(&self) -> f32 {
        let sum = |map: &[f32]| map.iter().map(|value| f64::from(value * value)).sum::<f64>();
        (sum(&self.phase) / sum(&self.inside).max(1.0)) as f32
    }

    /// Variance along row `y` of the scene, 0 where there is no lit cell.
    pub fn variance<'a>(&self, scene: &Scene<'_>, y: usize, rows: &'a mut Rows) -> &'a [f32] {
        self.mean(&self.usable, scene, y, rows)
    }

    /// Correction of the phase along row `y` of the scene, 0 where there is no lit cell.
    pub(super) fn corrections<'a>(&self, scene: &Scene<'_>, y: usize, rows: &'a mut Rows) -> &'a [f32] {
        self.mean(&self.phase, scene, y, rows)
    }

    /// Mean albedo of R and B along row `y` of the scene, 0 where there is no lit cell.
    pub fn brightness(&self, scene: &Scene<'_>, y: usize, rows: &mut Rows, out: &mut Vec<f32>) {
        let [red, _, blue, _] = &self.light;
        out.clear();
        out.extend_from_slice(self.mean(red, scene, y, rows));
        out.iter_mut()
            .zip(self.mean(blue, scene, y, rows))
            .for_each(|(out, blue)| *out = 0.5 * (*out + blue));
    }

    /// Albedo and contrast along row `y` of the scene.
    pub fn fringes(&self, scene: &Scene<'_>, y: usize, out: &mut FringeRows) {
        let FringeRows { albedo, contrast, cells, cell_px, middle, rows } = out;
        *cell_px = self.factor;
        let here = (y / self.factor).min(self.height - 1);
        if middle.replace(here) != Some(here) {
            let around = [here.saturating_sub(1), here, (here + 1).min(self.height - 1)];
            for (row, out) in around.into_iter().zip(cells) {
                for (map, out) in self.light.iter().zip(out) {
                    repeat(&map[row * self.stride..][..self.stride], self.factor, scene.grid.stride, out);
                }
            }
        }
        self.between(&self.inside, scene, y, &mut rows.mix, &mut rows.weight);
        let maps = self.light.iter().chain(&self.contrast).zip(albedo.iter_mut().chain(contrast));
        for (map, out) in maps {
            self.between(map, scene, y, &mut rows.mix, out);
            for (value, weight) in out.iter_mut().zip(&rows.weight) {
                *value = if *weight > 0.0 { *value / weight } else { 0.0 };
            }
        }
    }

    /// Interpolates a map bilinearly along row `y` of the scene, between lit cells alone; 0 where there is none.
    fn mean<'a>(&self, map: &[f32], scene: &Scene<'_>, y: usize, rows: &'a mut Rows) -> &'a [f32] {
        let Rows { mix, sum, weight } = rows;
        self.between(map, scene, y, mix, sum);
        self.between(&self.inside, scene, y, mix, weight);
        for (sum, weight) in sum.iter_mut().zip(weight) {
            *sum = if *weight > 0.0 { *sum / *weight } else { 0.0 };
        }
        sum
    }

    /// Interpolates one map, which is 0 outside the lit cells.
    fn between(&self, map: &[f32], scene: &Scene<'_>, y: usize, mix: &mut Vec<f32>, out: &mut Vec<f32>) {
        let Self { height, stride, factor, .. } = self;
        let place = (y as f32 + 0.5) / *factor as f32 - 0.5;
        let above = place.floor();
        let row = |at: f32| at.clamp(0.0, (height - 1) as f32) as usize * stride;
        let (a, b) = (&map[row(above)..][..*stride], &map[row(above + 1.0)..][..*stride]);
        mix.resize(stride + 2, 0.0);
        out.resize(scene.grid.stride.max(stride * factor), 0.0);
        blend(a, b, place - above, &mut mix[1..=*stride]);
        (mix[0], mix[stride + 1]) = (mix[1], mix[*stride]);
        spread(*factor, mix, out);
    }
}

/// Writes the value of each cell `factor` times, for `length` pixels and one cell of zeros at both ends.
fn repeat(row: &[f32], factor: usize, length: usize, out: &mut Vec<f32>) {
    out.clear();
    out.resize(length + 2 * factor, 0.0);
    for (pixels, value) in out[factor..factor + length].chunks_mut(factor).zip(row) {
        pixels.fill(*value);
    }
}
