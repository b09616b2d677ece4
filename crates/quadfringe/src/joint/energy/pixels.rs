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

/// Which of the 3 x 3 cells around a cell lie on one surface with it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) enum Around {
    /// Not all that have a fit.
    #[default]
    Apart,
    /// All that have a fit, at least one in each pair of opposite neighbours.
    Partly,
    /// All nine.
    Wholly,
}

/// The fitted phase of 3 x 3 cells, rad.
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
    /// The columns of the cells in this row that lie on one surface with those around, and the phases of these.
    patches: Vec<(usize, Patch)>,
}

impl Cells {
    /// Gives pixels among cells of one surface the phase of the surface through these, and writes for each cell which of those `around`
    /// it lie on one surface with it. `fit` gives what the fit has found for a cell.
    pub fn write_surface(
        &self,
        scene: &Scene<'_>,
        fit: impl Fn(usize, usize) -> Option<Surface> + Sync,
        phase: &mut [f32],
        around: &mut Vec<Around>,
    ) {
        let stride = scene.grid.stride;
        around.clear();
        around.resize(self.height * self.width, Around::Apart);
        let marks = around.par_chunks_mut(self.width.max(1));
        let bands = phase.par_chunks_mut(self.factor * stride).zip(marks).enumerate();
        bands.for_each_init(Work::default, |work, (row, (phase, marks))| {
            if row == 0 || row + 1 >= self.height {
                return;
            }
            self.load_lines(row, &fit, work);
            work.find_patches(marks);
            for (i, phase) in phase.chunks_mut(stride).enumerate() {
                let down = parabola(i, self.factor);
                for (x, patch) in &work.patches {
                    let three = [0, 1, 2].map(|k| mix(down, patch.map(|line| line[k])));
                    for (i, phase) in phase[x * self.factor..][..self.factor].iter_mut().enumerate() {
                        *phase = mix(parabola(i, self.factor), three);
                    }
                }
            }
        });
    }

    /// Which cells around the pixels of row `y` lie on one surface.
    pub fn marks(&self, around: &[Around], y: usize) -> impl Iterator<Item = Around> {
        let row = y / self.factor * self.width;
        let cells = around.get(row..row + self.width).unwrap_or_default();
        cells.iter().flat_map(|mark| repeat_n(*mark, self.factor)).chain(repeat(Around::Apart))
    }

    /// Adds the interpolated correction to the phase of the pixels that have not got that of the surface. Where it is too large, the
    /// modulation becomes 0.
    pub fn correct(&self, scene: &Scene<'_>, around: &[Around], pixels: &mut Pixels) {
        let stride = scene.grid.stride;
        let Pixels { phase, modulation, reasons } = pixels;
        let planes = phase.par_chunks_mut(stride).zip(modulation.par_chunks_mut(stride));
        let rows = planes.zip(reasons.par_chunks_mut(stride)).enumerate();
        rows.for_each_init(Rows::default, |rows, (y, ((phase, modulation), reasons))| {
            let pixels = phase.iter_mut().zip(modulation).zip(reasons);
            let moves = self.corrections(scene, y, rows).iter().zip(self.marks(around, y));
            for (((phase, modulation), reason), (correction, around)) in pixels.zip(moves) {
                *phase += if around == Around::Apart { *correction } else { 0.0 };
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
    /// Finds the cells through which no second difference is larger than the bending of the tile explains.
    fn find_patches(&mut self, marks: &mut [Around]) {
        let Self { lines, patches, .. } = self;
        patches.clear();
        for x in 1..marks.len().saturating_sub(1) {
            let known = lines.each_ref().map(|Line { fitted, .. }| [fitted[x - 1], fitted[x], fitted[x + 1]]);
            let patch = continued(known);
            if is_one_surface(&patch, CURVED_MAX * CURVED_MAX * lines[1].bend[x]) {
                let whole = known.as_flattened().iter().all(|phase| phase.is_finite());
                marks[x] = if whole { Around::Wholly } else { Around::Partly };
                patches.push((x, patch));
            }
        }
    }
}

/// Continues the surface straight into neighbours without a fit; not a number where both of an opposite pair have none.
fn continued(mut patch: Patch) -> Patch {
    let middle = patch[1][1];
    for (y, x) in [(0, 1), (1, 0), (1, 2), (2, 1)] {
        if !patch[y][x].is_finite() {
            patch[y][x] = 2.0 * middle - patch[2 - y][2 - x];
        }
    }
    for (y, x) in [(0, 0), (0, 2), (2, 0), (2, 2)] {
        if !patch[y][x].is_finite() {
            patch[y][x] = patch[1][x] + patch[y][1] - middle;
        }
    }
    patch
}

/// Whether no squared second difference along a row or a column exceeds `most`. A comparison with no number is false.
fn is_one_surface(patch: &Patch, most: f32) -> bool {
    let gentle = |three: [f32; 3]| (three[0] - 2.0 * three[1] + three[2]).powi(2) <= most;
    patch.iter().all(|row| gentle(*row)) && (0..3).all(|x| gentle(patch.map(|row| row[x])))
}

/// Weights of three cells at pixel `i` of the middle one, for the parabola whose means over the pixels are those of the cells.
fn parabola(i: usize, pixels: usize) -> [f32; 3] {
    let side = pixels as f32;
    let place = (i as f32 + 0.5) / side - 0.5;
    let half_square = 0.5 * (place * place - (1.0 - 1.0 / (side * side)) / 12.0);
    [half_square - 0.5 * place, 1.0 - 2.0 * half_square, half_square + 0.5 * place]
}

fn mix(weights: [f32; 3], values: [f32; 3]) -> f32 {
    weights.iter().zip(values).map(|(weight, value)| weight * value).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_surface_has_the_means_of_its_cells_and_follows_a_parabola() {
        for pixels in [1, 2, 4] {
            let curve = |x: f32| 0.3 + 0.2 * x - 0.07 * x * x;
            let mean = |cell: usize| {
                (0..pixels).map(|i| curve((cell * pixels + i) as f32)).sum::<f32>() / pixels as f32
            };
            let three = [mean(0), mean(1), mean(2)];
            for i in 0..pixels {
                let (found, truth) = (mix(parabola(i, pixels), three), curve((pixels + i) as f32));
                assert!((found - truth).abs() < 1e-4, "{pixels} {i}: {found} {truth}");
            }
        }
    }

    /// What lies around the cells of a row of the slope 0.6 rad, from column 5 on higher by `change`.
    fn around(change: f32) -> [Around; 8] {
        let line = || Line {
            fitted: (0..8).map(|x| 0.6 * x as f32 + if x > 4 { change } else { 0.0 }).collect(),
            bend: vec![1e-4; 8],
        };
        let mut work = Work { lines: [line(), line(), line()], ..Work::default() };
        let mut marks = [Around::Apart; 8];
        work.find_patches(&mut marks);
        for (x, patch) in &work.patches {
            let straight = patch.iter().all(|line| (line[2] - line[1] - 0.6).abs() < 1e-5);
            assert!(straight, "{x}: {patch:?}");
        }
        marks
    }

    #[test]
    fn a_step_ends_the_surface_and_a_missing_cell_does_not() {
        use Around::{Apart, Partly, Wholly};
        assert_eq!(around(0.0), [Apart, Wholly, Wholly, Wholly, Wholly, Wholly, Wholly, Apart]);
        assert_eq!(around(0.3), [Apart, Wholly, Wholly, Wholly, Apart, Apart, Wholly, Apart]);
        assert_eq!(around(f32::NAN), [Apart, Wholly, Wholly, Wholly, Partly, Apart, Apart, Apart]);
    }

    #[test]
    fn a_corner_continues_its_sides_and_a_lone_cell_does_not_continue() {
        let plane = |y: usize, x: usize| 0.5 * x as f32 - 0.2 * y as f32;
        let whole: Patch = std::array::from_fn(|y| std::array::from_fn(|x| plane(y, x)));
        let mut patch = whole;
        (patch[0][0], patch[0][1], patch[2][2]) = (f32::NAN, f32::NAN, f32::NAN);
        let pairs = |found: Patch| found.concat().into_iter().zip(whole.concat());
        assert!(pairs(continued(patch)).all(|(found, truth)| (found - truth).abs() < 1e-6));
        patch[2][1] = f32::NAN;
        assert!(!is_one_surface(&continued(patch), 1.0));
    }
}
