//! From the cells back to the pixels. Where the cells around a pixel lie on one surface, detail of the start that is finer than a cell
//! (J44) is noise, or texture that the windows of the start have mixed, and the pixel takes the surface through the cells. At the
//! discontinuities of the surface the pixels keep it.

use super::cells::{Cells, Rows};
use crate::Reason;
use crate::joint::params::energy::{CURVED_MAX, MOVED_MAX_RAD};
use crate::joint::scene::{Pixels, Scene};
use rayon::prelude::*;

/// What the fit has found for the surface at one cell.
#[derive(Debug, Default)]
pub(super) struct Surface {
    /// Change of the phase, rad.
    pub correction: f32,
    /// Variance of the second differences of the phase (J26), rad^2.
    pub bend: f32,
}

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
    /// Whether the cells around lie on one surface.
    smooth: Vec<bool>,
    /// Phase of the surface of the start along a row of pixels, its mean over the columns of a cell.
    means: Vec<f32>,
}

impl Cells {
    /// Replaces the phase of the start, in pixels among cells of one surface, by that of the surface through the cells, and marks these
    /// cells as `smooth`. `fit` gives what the fit has found for a cell.
    pub fn smooth_start(
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
            work.find_smooth();
            if !work.smooth.contains(&true) {
                return;
            }
            marks.copy_from_slice(&work.smooth);
            for (i, phase) in phase.chunks_mut(stride).enumerate() {
                self.take_surface([row, i], work, phase);
            }
        });
    }

    /// Writes for each of the `width` pixels of row `y` whether it lies among cells that are `smooth`.
    pub fn write_smooth(&self, smooth: &[bool], y: usize, width: usize, out: &mut Vec<bool>) {
        let row = y / self.factor * self.width;
        out.clear();
        if let Some(cells) = smooth.get(row..row + self.width) {
            out.extend(cells.iter().flat_map(|mark| std::iter::repeat_n(*mark, self.factor)));
        }
        out.resize(width, false);
    }

    /// Adds the interpolated correction to the phase of the pixels. Where it is too large, the modulation becomes 0.
    pub fn correct(&self, scene: &Scene<'_>, pixels: &mut Pixels) {
        let stride = scene.grid.stride;
        let Pixels { phase, modulation, reasons } = pixels;
        let planes = phase.par_chunks_mut(stride).zip(modulation.par_chunks_mut(stride));
        let rows = planes.zip(reasons.par_chunks_mut(stride)).enumerate();
        rows.for_each_init(Rows::default, |rows, (y, ((phase, modulation), reasons))| {
            let pixels = phase.iter_mut().zip(modulation).zip(reasons);
            for (((phase, modulation), reason), correction) in pixels.zip(self.corrections(scene, y, rows)) {
                *phase += correction;
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

    /// Replaces the phase of pixels in row `i` of a row of cells by that of the parabolas along rows and columns that have the means of
    /// the cells.
    fn take_surface(&self, [row, i]: [usize; 2], work: &mut Work, phase: &mut [f32]) {
        let Work { smooth, means, .. } = work;
        let down = parabola(i, self.factor);
        means.clear();
        means.extend((0..self.width).map(|x| mix(down, [row - 1, row, row + 1].map(|y| self.start(y, x)))));
        for x in (0..self.width).filter(|&x| smooth[x]) {
            let three = [means[x - 1], means[x], means[x + 1]];
            for (i, phase) in phase[x * self.factor..][..self.factor].iter_mut().enumerate() {
                *phase = mix(parabola(i, self.factor), three);
            }
        }
    }
}

impl Work {
    /// Finds the cells through which no second difference is larger than the bending of the tile explains, and whose neighbours have
    /// a fit.
    fn find_smooth(&mut self) {
        let Self { lines, smooth, .. } = self;
        let [above, here, below] = lines.each_ref().map(|line| &line.fitted);
        let width = here.len();
        smooth.clear();
        smooth.extend((0..width).map(|x| {
            let most = CURVED_MAX * CURVED_MAX * lines[1].bend[x];
            // A comparison with no number is false.
            let gentle = |three: [f32; 3]| (three[0] - 2.0 * three[1] + three[2]).powi(2) <= most;
            let inner = x > 0 && x + 1 < width;
            inner
                && [above, here, below].iter().all(|line| gentle([line[x - 1], line[x], line[x + 1]]))
                && (x - 1..=x + 1).all(|x| gentle([above[x], here[x], below[x]]))
        }));
    }
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

    #[test]
    fn a_step_or_a_missing_cell_ends_the_surface() {
        let smooth = |change: f32| {
            let line = || Line {
                fitted: (0..8).map(|x| 0.6 * x as f32 + if x > 4 { change } else { 0.0 }).collect(),
                bend: vec![1e-4; 8],
            };
            let mut work = Work { lines: [line(), line(), line()], ..Work::default() };
            work.find_smooth();
            work.smooth
        };
        assert_eq!(smooth(0.0), [false, true, true, true, true, true, true, false]);
        assert_eq!(smooth(0.3), [false, true, true, true, false, false, true, false]);
        assert_eq!(smooth(f32::NAN), [false, true, true, true, false, false, false, false]);
    }
}
