//! From the cells back to the pixels. Where the cells around a pixel lie on one surface, the pixel takes the surface through them: detail
//! of the start that is finer than a cell is noise there, or texture that the windows of the start have mixed (J44). At the
//! discontinuities of the surface the pixels keep it, and are moved as their cells are.

use super::cells::{Cells, Rows};
use crate::Reason;
use crate::joint::params::energy::{CURVED_MAX, MOVED_MAX_RAD};
use crate::joint::scene::{Pixels, Scene};
use rayon::prelude::*;
use std::iter::{repeat, repeat_n};

/// What the fit has found for the surface at one cell.
#[derive(Debug, Default)]
pub(super) struct Surface {
    /// Change of the phase, rad.
    pub correction: f32,
    /// Variance of the second differences of the phase (J26), rad^2.
    pub bend: f32,
}

/// The fitted phase of 3 x 3 cells, rad; not a number outside the cells of the fit.
type Patch = [[f32; 3]; 3];

/// A row of cells.
#[derive(Debug, Default)]
struct Line {
    /// Fitted phase, rad; not a number outside the cells of the fit.
    fitted: Vec<f32>,
    bend: Vec<f32>,
}

/// Working lines.
#[derive(Debug, Default)]
struct Work {
    /// The row of cells for which the lines are loaded.
    row: Option<usize>,
    /// The rows of cells above, at and below.
    lines: [Line; 3],
    /// The cells in this row that lie on one surface with those around.
    surfaces: Vec<CellSurface>,
}

/// A cell that lies on one surface with those around, and this surface.
#[derive(Debug)]
struct CellSurface {
    column: usize,
    surface: Quadric,
}

impl Cells {
    /// Gives pixels among cells of one surface the phase of the surface through these, and marks these cells as `smooth`. `fit` gives
    /// what the fit has found for a cell.
    pub fn write_surface(
        &self,
        scene: &Scene<'_>,
        fit: impl Fn(usize, usize) -> Option<Surface> + Sync,
        phase: &mut [f32],
        smooth: &mut Vec<bool>,
    ) {
        let stride = scene.grid.stride;
        smooth.clear();
        smooth.resize(self.height * self.width, false);
        let marks = smooth.par_chunks_mut(self.width.max(1));
        let bands = phase.par_chunks_mut(self.factor * stride).zip(marks).enumerate();
        bands.for_each_init(Work::default, |work, (row, (phase, marks))| {
            if row == 0 || row + 1 >= self.height {
                return;
            }
            self.load_lines(row, &fit, work);
            work.find_surfaces(marks);
            for (i, phase) in phase.chunks_mut(stride).enumerate() {
                for CellSurface { column, surface } in &work.surfaces {
                    for (j, phase) in phase[column * self.factor..][..self.factor].iter_mut().enumerate() {
                        *phase = surface.at([j, i], self.factor);
                    }
                }
            }
        });
    }

    /// Whether the pixels of row `y` lie among cells that are `smooth`.
    pub fn marks(&self, smooth: &[bool], y: usize) -> impl Iterator<Item = bool> {
        let row = y / self.factor * self.width;
        let cells = smooth.get(row..row + self.width).unwrap_or_default();
        cells.iter().flat_map(|mark| repeat_n(*mark, self.factor)).chain(repeat(false))
    }

    /// Adds the interpolated correction to the phase of the pixels that have not got that of the surface. Where it is too large, the
    /// modulation becomes 0.
    pub fn correct(&self, scene: &Scene<'_>, smooth: &[bool], pixels: &mut Pixels) {
        let stride = scene.grid.stride;
        let Pixels { phase, modulation, reasons } = pixels;
        let planes = phase.par_chunks_mut(stride).zip(modulation.par_chunks_mut(stride));
        let rows = planes.zip(reasons.par_chunks_mut(stride)).enumerate();
        rows.for_each_init(Rows::default, |rows, (y, ((phase, modulation), reasons))| {
            let pixels = phase.iter_mut().zip(modulation).zip(reasons);
            let moves = self.corrections(scene, y, rows).iter().zip(self.marks(smooth, y));
            for (((phase, modulation), reason), (correction, smooth)) in pixels.zip(moves) {
                *phase += if smooth { 0.0 } else { *correction };
                if correction.abs() > MOVED_MAX_RAD && *modulation > 0.0 {
                    *modulation = 0.0;
                    *reason = if *reason == Reason::Returned { Reason::Misfit } else { *reason };
                }
            }
        });
    }

    /// Loads the lines around a row of cells. After the row before, one of them is new.
    fn load_lines(&self, row: usize, fit: &impl Fn(usize, usize) -> Option<Surface>, work: &mut Work) {
        let Work { row: before, lines, .. } = work;
        let known = if before.replace(row) == Some(row - 1) { 2 } else { 0 };
        lines.rotate_left(1);
        for (k, Line { fitted, bend }) in lines.iter_mut().enumerate().skip(known) {
            let y = row + k - 1;
            fitted.clear();
            bend.clear();
            for x in 0..self.width {
                let found = fit(y, x);
                fitted.push(found.as_ref().map_or(f32::NAN, |fit| self.start(y, x) + fit.correction));
                bend.push(found.map_or(0.0, |fit| fit.bend));
            }
        }
    }
}

impl Work {
    /// Finds the cells through which no second difference is larger than the bending of the tile explains, and whose neighbours have a
    /// fit.
    fn find_surfaces(&mut self, smooth: &mut [bool]) {
        let Self { lines, surfaces, .. } = self;
        surfaces.clear();
        for x in 1..smooth.len().saturating_sub(1) {
            let patch = lines.each_ref().map(|Line { fitted, .. }| [fitted[x - 1], fitted[x], fitted[x + 1]]);
            smooth[x] = is_one_surface(&patch, CURVED_MAX * CURVED_MAX * lines[1].bend[x]);
            if smooth[x] {
                surfaces.push(CellSurface { column: x, surface: Quadric::through(&patch) });
            }
        }
    }
}

/// Whether no squared second difference along a row or a column exceeds `most`. A comparison with no number is false.
fn is_one_surface(patch: &Patch, most: f32) -> bool {
    let gentle = |three: [f32; 3]| (three[0] - 2.0 * three[1] + three[2]).powi(2) <= most;
    patch.iter().all(|row| gentle(*row)) && (0..3).all(|x| gentle(patch.map(|row| row[x])))
}

/// A surface of the second order, from the middle of a cell and in cells: right and down.
#[derive(Debug)]
struct Quadric {
    /// Mean over the cell.
    mean: f32,
    slope: [f32; 2],
    /// Halves of the second derivatives along both directions.
    bend: [f32; 2],
    twist: f32,
}

impl Quadric {
    /// The surface whose means over nine cells come nearest to those of the patch, by least squares.
    fn through(patch: &Patch) -> Self {
        let mean = |three: [f32; 3]| (three[0] + three[1] + three[2]) / 3.0;
        let means = [[0, 1, 2].map(|x| mean(patch.map(|row| row[x]))), patch.map(mean)];
        let bend = means.map(|three| 0.5 * (three[0] - 2.0 * three[1] + three[2]));
        Self {
            // Over three cells, the mean of the square of the distance is 2/3 more than over the middle one.
            mean: mean(means[1]) - 2.0 / 3.0 * (bend[0] + bend[1]),
            slope: means.map(|three| 0.5 * (three[2] - three[0])),
            bend,
            twist: 0.25 * (patch[0][0] - patch[0][2] - patch[2][0] + patch[2][2]),
        }
    }

    /// Its value at pixel `[x, y]` of a cell with this many pixels along a side.
    fn at(&self, pixel: [usize; 2], side: usize) -> f32 {
        let side = side as f32;
        let [x, y] = pixel.map(|i| (i as f32 + 0.5) / side - 0.5);
        // Mean of the square of the distance over the pixels of a cell.
        let square = (1.0 - 1.0 / (side * side)) / 12.0;
        self.mean
            + self.slope[0] * x
            + self.slope[1] * y
            + self.bend[0] * (x * x - square)
            + self.bend[1] * (y * y - square)
            + self.twist * x * y
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_surface_through_the_means_of_cells_is_that_of_their_pixels() {
        let surface = |x: f32, y: f32| 0.3 + 0.2 * x - 0.1 * y - 0.07 * x * x + 0.02 * y * y + 0.05 * x * y;
        for side in [1, 2, 4] {
            let pixels = || (0..side * side).map(|i| [i % side, i / side]);
            let mean = |row: usize, column: usize| {
                let at = |[x, y]: [usize; 2]| surface((column * side + x) as f32, (row * side + y) as f32);
                pixels().map(at).sum::<f32>() / (side * side) as f32
            };
            let patch: Patch = std::array::from_fn(|y| std::array::from_fn(|x| mean(y, x)));
            let quadric = Quadric::through(&patch);
            for [x, y] in pixels() {
                let (found, truth) =
                    (quadric.at([x, y], side), surface((side + x) as f32, (side + y) as f32));
                assert!((found - truth).abs() < 1e-4, "{side} {x} {y}: {found} {truth}");
            }
        }
    }

    #[test]
    fn half_of_the_noise_of_single_cells_is_left() {
        let square = |at: usize| {
            let mut patch = Patch::default();
            patch[at / 3][at % 3] = 1.0;
            let quadric = Quadric::through(&patch);
            (0..16).map(|i| quadric.at([i % 4, i / 4], 4).powi(2)).sum::<f32>() / 16.0
        };
        let left: f32 = (0..9).map(square).sum();
        assert!((0.5..0.62).contains(&left), "{left}");
    }

    #[test]
    fn a_step_or_a_missing_cell_ends_the_surface() {
        let smooth = |change: f32| {
            let line = || Line {
                fitted: (0..8).map(|x| 0.6 * x as f32 + if x > 4 { change } else { 0.0 }).collect(),
                bend: vec![1e-4; 8],
            };
            let mut work = Work { lines: [line(), line(), line()], ..Work::default() };
            let mut marks = [false; 8];
            work.find_surfaces(&mut marks);
            marks
        };
        assert_eq!(smooth(0.0), [false, true, true, true, true, true, true, false]);
        assert_eq!(smooth(0.3), [false, true, true, true, false, false, true, false]);
        assert_eq!(smooth(f32::NAN), [false, true, true, true, false, false, false, false]);
    }
}
