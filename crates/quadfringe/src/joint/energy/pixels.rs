//! From the cells back to the pixels. Every pixel takes the phase of the surface through the cells around it: detail of the start that is
//! finer than a cell is noise, or texture that the windows of the start have mixed (J44). Near discontinuities its phase at the start
//! only tells on which of these surfaces it lies (J45).

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

/// The fitted surface of a shot, by cells.
#[derive(Debug, Default)]
pub(super) struct Surfaces {
    /// Pixels along a side of a cell.
    side: usize,
    height: usize,
    width: usize,
    /// Fitted phase, rad; not a number outside the cells of the fit.
    fitted: Vec<f32>,
    /// Variance of the second differences of the phase, rad^2.
    bend: Vec<f32>,
    /// Whether a cell and those around lie on one surface.
    smooth: Vec<bool>,
}

/// The surfaces that meet in a cell: through the cells around, row by row, and through the cell.
type Meeting = [Quadric; 9];

impl Surfaces {
    /// Takes the fitted phases. `fit` gives what the fit has found for a cell.
    pub fn find(&mut self, cells: &Cells, fit: impl Fn(usize, usize) -> Option<Surface> + Sync) {
        (self.side, self.height, self.width) = (cells.factor, cells.height, cells.width);
        let (size, width) = (self.height * self.width, self.width.max(1));
        for plane in [&mut self.fitted, &mut self.bend] {
            plane.clear();
            plane.resize(size, 0.0);
        }
        let rows = self.fitted.par_chunks_mut(width).zip(self.bend.par_chunks_mut(width)).enumerate();
        rows.for_each(|(y, (fitted, bend))| {
            for (x, (fitted, bend)) in fitted.iter_mut().zip(bend).enumerate() {
                let found = fit(y, x);
                *fitted = found.as_ref().map_or(f32::NAN, |fit| cells.start(y, x) + fit.correction);
                *bend = found.map_or(0.0, |fit| fit.bend);
            }
        });
        self.mark();
    }

    /// Marks the cells on one surface.
    fn mark(&mut self) {
        let mut smooth = std::mem::take(&mut self.smooth);
        smooth.clear();
        smooth.resize(self.fitted.len(), false);
        smooth.par_chunks_mut(self.width.max(1)).enumerate().for_each(|(y, smooth)| {
            for (x, smooth) in smooth.iter_mut().enumerate() {
                *smooth = is_one_surface(&self.patch([y, x]), self.bend[y * self.width + x]);
            }
        });
        self.smooth = smooth;
    }

    /// Whether the pixels of row `y` lie among cells of one surface.
    pub fn marks(&self, y: usize) -> impl Iterator<Item = bool> {
        let row = y / self.side.max(1) * self.width;
        let cells = self.smooth.get(row..row + self.width).unwrap_or_default();
        cells.iter().flat_map(|smooth| repeat_n(*smooth, self.side)).chain(repeat(false))
    }

    /// Gives the pixels the phase of their surface. Those without any, and dark ones, are moved as the cells around are. Where `cells`
    /// move them too far, the modulation becomes 0.
    pub fn write(&self, scene: &Scene<'_>, cells: &Cells, pixels: &mut Pixels) {
        let stride = scene.grid.stride;
        let band = self.side.max(1) * stride;
        let Pixels { phase, modulation, reasons } = pixels;
        let planes = phase.par_chunks_mut(band).zip(modulation.par_chunks_mut(band));
        let bands = planes.zip(reasons.par_chunks_mut(band)).enumerate();
        bands.for_each_init(Work::default, |work, (row, ((phase, modulation), reasons))| {
            let Work { rows, corrections } = work;
            corrections.clear();
            for i in 0..phase.len() / stride {
                corrections.extend_from_slice(&cells.corrections(scene, row * self.side + i, rows)[..stride]);
            }
            self.write_band(row, stride, corrections, phase, modulation);
            for ((modulation, reason), correction) in modulation.iter_mut().zip(reasons).zip(corrections) {
                if correction.abs() > MOVED_MAX_RAD && *modulation > 0.0 {
                    *modulation = 0.0;
                    *reason = if *reason == Reason::Returned { Reason::Misfit } else { *reason };
                }
            }
        });
    }

    /// Writes the pixels of a row of cells.
    fn write_band(
        &self,
        row: usize,
        stride: usize,
        corrections: &[f32],
        phase: &mut [f32],
        modulation: &[f32],
    ) {
        let side = self.side as f32;
        for (y, phase) in phase.chunks_mut(stride).enumerate() {
            let inside = if row < self.height { self.width * self.side } else { 0 };
            let aside = phase[inside..].iter_mut().zip(&corrections[y * stride..][inside..]);
            aside.for_each(|(phase, correction)| *phase += correction);
        }
        if row >= self.height {
            return;
        }
        for column in 0..self.width {
            let rows = phase.len() / stride;
            let pixels = || {
                let places = (0..rows).flat_map(|y| (0..self.side).map(move |x| [x, y]));
                places.map(|[x, y]| (y * stride + column * self.side + x, [x as f32, y as f32]))
            };
            if self.smooth[row * self.width + column] {
                let surface = Quadric::through(&self.patch([row, column]));
                pixels().for_each(|(at, place)| phase[at] = surface.at(place, side));
                continue;
            }
            // Most cells without one surface are dark.
            let meeting = pixels().any(|(at, _)| modulation[at] > 0.0).then(|| self.meeting([row, column]));
            for (at, place) in pixels() {
                let lit = meeting.as_ref().filter(|_| modulation[at] > 0.0);
                let found = lit.and_then(|meeting| nearest(meeting, place, side, phase[at]));
                phase[at] = found.unwrap_or(phase[at] + corrections[at]);
            }
        }
    }

    /// Fitted phases of a cell and those around.
    fn patch(&self, [row, column]: [usize; 2]) -> Patch {
        let value = |dy: usize, dx: usize| {
            let (y, x) = ((row + dy).wrapping_sub(1), (column + dx).wrapping_sub(1));
            if y < self.height && x < self.width { self.fitted[y * self.width + x] } else { f32::NAN }
        };
        std::array::from_fn(|dy| std::array::from_fn(|dx| value(dy, dx)))
    }

    fn meeting(&self, [row, column]: [usize; 2]) -> Meeting {
        std::array::from_fn(|n| {
            let at = [(row + n / 3).wrapping_sub(1), (column + n % 3).wrapping_sub(1)];
            if at[0] >= self.height || at[1] >= self.width {
                return Quadric::NONE;
            }
            let (patch, index) = (self.patch(at), at[0] * self.width + at[1]);
            if self.smooth[index] {
                Quadric::through(&patch)
            } else {
                Quadric::beside_discontinuity(&patch, self.bend[index])
            }
        })
    }
}

/// Working memory of a band.
#[derive(Debug, Default)]
struct Work {
    rows: Rows,
    corrections: Vec<f32>,
}

/// The phase at a pixel of a cell on the one of the surfaces that explains its phase at the `start` best; none if that is far from all
/// of them. A surface is known the better the nearer its cell is: differences count by the square of this distance.
fn nearest(meeting: &Meeting, [x, y]: [f32; 2], side: f32, start: f32) -> Option<f32> {
    let (mut least, mut best) = (f32::INFINITY, None);
    for (n, surface) in meeting.iter().enumerate() {
        let pixel = [x - ((n % 3) as f32 - 1.0) * side, y - ((n / 3) as f32 - 1.0) * side];
        let phase = surface.at(pixel, side);
        let apart = (phase - start).abs();
        let square: f32 = from_middle(pixel, side).map(|distance| distance * distance).iter().sum();
        if apart < SAME_SURFACE_RAD && apart * square < least {
            (least, best) = (apart * square, Some(phase));
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three rows of eight cells of a slope with a step, or with a hole.
    fn surfaces(change: f32) -> Surfaces {
        let fitted = (0..24).map(|i| 0.6 * (i % 8) as f32 + if i % 8 > 4 { change } else { 0.0 }).collect();
        let mut surfaces =
            Surfaces { side: 4, height: 3, width: 8, fitted, bend: vec![1e-4; 24], smooth: Vec::new() };
        surfaces.mark();
        surfaces
    }

    /// The phases of a row of pixels after that of cells in the middle is written.
    fn written(surfaces: &Surfaces, start: &[f32], correction: f32) -> Vec<f32> {
        let mut phase = start.repeat(4);
        surfaces.write_band(1, 32, &[correction; 128], &mut phase, &[1.0; 128]);
        phase[32..64].to_vec()
    }

    #[test]
    fn a_step_or_a_missing_cell_ends_the_surface() {
        let smooth = |change: f32| -> Vec<bool> { surfaces(change).marks(6).step_by(4).take(8).collect() };
        assert_eq!(smooth(0.0), [false, true, true, true, true, true, true, false]);
        assert_eq!(smooth(0.3), [false, true, true, true, false, false, true, false]);
        assert_eq!(smooth(f32::NAN), [false, true, true, true, false, false, false, false]);
    }

    #[test]
    fn a_pixel_at_a_step_takes_the_surface_that_its_start_is_on() {
        let surfaces = surfaces(2.0);
        let slope = |x: usize| 0.6 * ((x as f32 + 0.5) / 4.0 - 0.5);
        let mut phase: Vec<f32> = (0..32).map(|x| slope(x) + if x > 18 { 2.0 } else { 0.0 } + 0.1).collect();
        phase[17] += 1.8;
        let truth: Vec<f32> = (0..32).map(|x| slope(x) + if x > 18 { 2.0 } else { 0.0 }).collect();
        let phase = written(&surfaces, &phase, 0.0);
        for x in (0..32).filter(|x| *x != 17) {
            assert!((phase[x] - truth[x]).abs() < 1e-4, "{x}: {} {}", phase[x], truth[x]);
        }
        // Its phase is nearer to the surface behind the step.
        assert!((phase[17] - slope(17) - 2.0).abs() < 1e-4, "{}", phase[17]);
    }

    #[test]
    fn a_pixel_far_from_all_surfaces_is_moved_as_its_cells_are() {
        assert_eq!(written(&surfaces(f32::NAN), &[9.0; 32], 0.05)[21], 9.05);
    }
}
