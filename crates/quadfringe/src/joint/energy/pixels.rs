//! From the cells back to the pixels. Every pixel takes the phase of the surface through the cells around it: detail of the start that is
//! finer than a cell is noise, or texture that the windows of the start have mixed (J44). Near discontinuities its phase at the start
//! only tells which of these surfaces is its own (J45).

use super::cells::{Cells, Rows};
use super::quadric::{Patch, Quadric, from_middle, is_one_surface};
use crate::Reason;
use crate::joint::params::energy::MOVED_MAX_RAD;
use crate::joint::params::validity::SAME_SURFACE_RAD;
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

/// The surfaces through the cells of a shot.
#[derive(Debug, Default)]
pub(super) struct Surfaces {
    /// Pixels along a side of a cell.
    side: usize,
    height: usize,
    width: usize,
    cells: Vec<CellSurface>,
}

#[derive(Debug, Clone, Copy)]
struct CellSurface {
    quadric: Quadric,
    /// Whether the cells around lie on it, too.
    smooth: bool,
}

/// Rows of cells.
#[derive(Debug, Default)]
struct Lines {
    /// Fitted phase above, at and below a row, rad; not a number outside the cells of the fit.
    fitted: [Vec<f32>; 3],
    /// Variance of the second differences in the row, rad^2.
    bend: Vec<f32>,
}

impl Surfaces {
    /// Finds the surface through every cell. `fit` gives what the fit has found for a cell.
    pub fn find(&mut self, cells: &Cells, fit: impl Fn(usize, usize) -> Option<Surface> + Sync) {
        let Self { side, height, width, cells: surfaces } = self;
        (*side, *height, *width) = (cells.factor, cells.height, cells.width);
        surfaces.clear();
        surfaces.resize(*height * *width, CellSurface { quadric: Quadric::NONE, smooth: false });
        surfaces.par_chunks_mut((*width).max(1)).enumerate().for_each_init(
            Lines::default,
            |lines, (row, surfaces)| {
                lines.load(cells, row, &fit);
                for (x, surface) in surfaces.iter_mut().enumerate() {
                    *surface = lines.surface(x);
                }
            },
        );
    }

    /// Whether the pixels of row `y` lie among cells of one surface.
    pub fn marks(&self, y: usize) -> impl Iterator<Item = bool> {
        let row = y / self.side.max(1) * self.width;
        let cells = self.cells.get(row..row + self.width).unwrap_or_default();
        cells.iter().flat_map(|cell| repeat_n(cell.smooth, self.side)).chain(repeat(false))
    }

    /// Gives the pixels the phase of their surface. Those without any, and dark ones, are moved as the cells around are. Where `cells` move them too
    /// far, the modulation becomes 0.
    pub fn write(&self, scene: &Scene<'_>, cells: &Cells, pixels: &mut Pixels) {
        let stride = scene.grid.stride;
        let Pixels { phase, modulation, reasons } = pixels;
        let planes = phase.par_chunks_mut(stride).zip(modulation.par_chunks_mut(stride));
        let rows = planes.zip(reasons.par_chunks_mut(stride)).enumerate();
        rows.for_each_init(Rows::default, |rows, (y, ((phase, modulation), reasons))| {
            let corrections = cells.corrections(scene, y, rows);
            self.write_row(y, corrections, phase, modulation);
            for ((modulation, reason), correction) in modulation.iter_mut().zip(reasons).zip(corrections) {
                if correction.abs() > MOVED_MAX_RAD && *modulation > 0.0 {
                    *modulation = 0.0;
                    *reason = if *reason == Reason::Returned { Reason::Misfit } else { *reason };
                }
            }
        });
    }

    fn write_row(&self, y: usize, corrections: &[f32], phase: &mut [f32], modulation: &[f32]) {
        let (row, side) = (y / self.side, self.side);
        let down = (y % side) as f32;
        let inside = if row < self.height { self.width * side } else { 0 };
        for (column, pixels) in phase[..inside].chunks_exact_mut(side).enumerate() {
            let CellSurface { quadric, smooth } = self.cells[row * self.width + column];
            for (x, phase) in pixels.iter_mut().enumerate() {
                let (at, place) = (column * side + x, [x as f32, down]);
                *phase = if smooth {
                    quadric.at(place, side as f32)
                } else {
                    let lit = Some(*phase).filter(|_| modulation[at] > 0.0);
                    let nearest = lit.and_then(|start| self.nearest([row, column], place, start));
                    nearest.unwrap_or(*phase + corrections[at])
                };
            }
        }
        let aside = phase[inside..].iter_mut().zip(&corrections[inside..]);
        aside.for_each(|(phase, correction)| *phase += correction);
    }

    /// The phase at a pixel of a cell on the one of the surfaces around that explains its phase at the `start` best; none if that is far
    /// from all of them. A surface is known the better the nearer its cell is: differences count by the square of this distance.
    fn nearest(&self, [row, column]: [usize; 2], [x, y]: [f32; 2], start: f32) -> Option<f32> {
        let side = self.side as f32;
        let (mut least, mut best) = (f32::INFINITY, None);
        for near_row in row.saturating_sub(1)..(row + 2).min(self.height) {
            for near_column in column.saturating_sub(1)..(column + 2).min(self.width) {
                let pixel = [
                    x + (column as f32 - near_column as f32) * side,
                    y + (row as f32 - near_row as f32) * side,
                ];
                let phase = self.cells[near_row * self.width + near_column].quadric.at(pixel, side);
                let apart = (phase - start).abs();
                let square: f32 = from_middle(pixel, side).map(|distance| distance * distance).iter().sum();
                if apart < SAME_SURFACE_RAD && apart * square < least {
                    (least, best) = (apart * square, Some(phase));
                }
            }
        }
        best
    }
}

impl Lines {
    /// Loads the lines around a row of cells.
    fn load(&mut self, cells: &Cells, row: usize, fit: &impl Fn(usize, usize) -> Option<Surface>) {
        let Self { fitted, bend } = self;
        bend.clear();
        for (k, fitted) in fitted.iter_mut().enumerate() {
            fitted.clear();
            let y = (row + k).checked_sub(1).filter(|&y| y < cells.height);
            for x in 0..cells.width {
                let found = y.and_then(|y| Some((cells.start(y, x), fit(y, x)?)));
                fitted.push(found.as_ref().map_or(f32::NAN, |(start, fit)| start + fit.correction));
                if k == 1 {
                    bend.push(found.map_or(0.0, |(_, fit)| fit.bend));
                }
            }
        }
    }

    /// The surface through the cell in column `x`.
    fn surface(&self, x: usize) -> CellSurface {
        let value = |line: &Vec<f32>, k: usize| {
            (x + k).checked_sub(1).and_then(|x| line.get(x).copied()).unwrap_or(f32::NAN)
        };
        let patch: Patch = self.fitted.each_ref().map(|line| [0, 1, 2].map(|k| value(line, k)));
        let bend = self.bend[x];
        let smooth = is_one_surface(&patch, bend);
        let quadric =
            if smooth { Quadric::through(&patch) } else { Quadric::beside_discontinuity(&patch, bend) };
        CellSurface { quadric, smooth }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lines of eight cells of a slope with a step, or with a hole.
    fn lines(change: f32) -> Lines {
        let line = || (0..8).map(|x| 0.6 * x as f32 + if x > 4 { change } else { 0.0 }).collect();
        Lines { fitted: [line(), line(), line()], bend: vec![1e-4; 8] }
    }

    fn surfaces(change: f32) -> Surfaces {
        let lines = lines(change);
        let cells = (0..8).map(|x| lines.surface(x)).collect();
        Surfaces { side: 4, height: 1, width: 8, cells }
    }

    #[test]
    fn a_step_or_a_missing_cell_ends_the_surface() {
        let smooth = |change: f32| -> Vec<bool> { surfaces(change).marks(2).step_by(4).take(8).collect() };
        assert_eq!(smooth(0.0), [false, true, true, true, true, true, true, false]);
        assert_eq!(smooth(0.3), [false, true, true, true, false, false, true, false]);
        assert_eq!(smooth(f32::NAN), [false, true, true, true, false, false, false, false]);
    }

    #[test]
    fn a_pixel_at_a_step_takes_the_surface_that_its_start_is_on() {
        let surfaces = surfaces(2.0);
        let slope = |x: usize| 0.6 * ((x as f32 + 0.5) / 4.0 - 0.5);
        let mut phase: Vec<f32> = (0..32).map(|x| slope(x) + if x > 18 { 2.0 } else { 0.0 } + 0.1).collect();
        phase[17] += 1.5;
        let truth: Vec<f32> = (0..32).map(|x| slope(x) + if x > 18 { 2.0 } else { 0.0 }).collect();
        surfaces.write_row(1, &[0.0; 32], &mut phase, &[1.0; 32]);
        for x in (0..32).filter(|x| *x != 17) {
            assert!((phase[x] - truth[x]).abs() < 1e-4, "{x}: {} {}", phase[x], truth[x]);
        }
        // Its phase is nearer to the surface behind the step.
        assert!((phase[17] - slope(17) - 2.0).abs() < 1e-4, "{}", phase[17]);
    }

    #[test]
    fn a_pixel_far_from_all_surfaces_is_moved_as_its_cells_are() {
        let mut phase = vec![9.0; 32];
        surfaces(f32::NAN).write_row(1, &[0.05; 32], &mut phase, &[1.0; 32]);
        assert_eq!(phase[21], 9.05);
    }
}
