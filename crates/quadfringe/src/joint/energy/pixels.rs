//! Detail of the start that is finer than the cells (J44). Where the cells around a pixel lie on one surface, it is noise, or texture
//! that the windows of the start have mixed, and the pixel takes the surface through the cells. At the discontinuities of the surface
//! the pixels keep it.

use super::cells::Cells;
use crate::joint::params::energy::CURVED_MAX;
use crate::joint::scene::Scene;
use rayon::prelude::*;

/// Working lines, one value for each cell.
#[derive(Debug, Default)]
struct Work {
    /// Fitted phases of the cells above, at and below; not a number outside the cells of the fit.
    fitted: [Vec<f32>; 3],
    /// Whether the cells around lie on one surface.
    smooth: Vec<bool>,
    /// Phase of the surface of the start along a row of pixels, its mean over the columns of a cell.
    means: Vec<f32>,
}

impl Cells {
    /// Replaces the phase of the start, in pixels among cells of one surface, by that of the surface through the cells. The cells have
    /// their fit.
    pub fn smooth_start(&self, scene: &Scene<'_>, phase: &mut [f32]) {
        let stride = scene.grid.stride;
        let bands = phase.par_chunks_mut(self.factor * stride).enumerate();
        bands.for_each_init(Work::default, |work, (row, phase)| {
            if row == 0 || row + 1 >= self.height {
                return;
            }
            for (k, line) in work.fitted.iter_mut().enumerate() {
                self.load_fitted(row + k - 1, line);
            }
            work.find_smooth(self.row(&self.bend, row));
            if !work.smooth.contains(&true) {
                return;
            }
            for (i, phase) in phase.chunks_mut(stride).enumerate() {
                self.take_surface([row, i], work, phase);
            }
        });
    }

    /// One row of a map.
    fn row<'a>(&self, map: &'a [f32], y: usize) -> &'a [f32] {
        &map[y * self.stride..][..self.width]
    }

    /// Loads the fitted phases of a row of cells.
    fn load_fitted(&self, y: usize, line: &mut Vec<f32>) {
        let [phase, correction, inside] =
            [&self.phase, &self.correction, &self.inside].map(|map| self.row(map, y));
        let cells = phase.iter().zip(correction).zip(inside);
        line.clear();
        line.extend(
            cells.map(|((phase, correction), &lit)| if lit > 0.0 { phase + correction } else { f32::NAN }),
        );
    }

    /// Replaces the phase of pixels in row `i` of a row of cells by that of the parabolas along rows and columns that have the means of
    /// the cells.
    fn take_surface(&self, [row, i]: [usize; 2], work: &mut Work, phase: &mut [f32]) {
        let Work { smooth, means, .. } = work;
        let down = parabola(i, self.factor);
        means.clear();
        let three = [row - 1, row, row + 1].map(|y| self.row(&self.phase, y));
        means.extend((0..self.width).map(|x| mix(down, three.map(|line| line[x]))));
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
    /// a fit; `bend` is the variance of the second differences of their phases (J26), rad^2.
    fn find_smooth(&mut self, bend: &[f32]) {
        let Self { fitted: [above, here, below], smooth, .. } = self;
        let width = here.len();
        smooth.clear();
        smooth.extend((0..width).map(|x| {
            let most = CURVED_MAX * CURVED_MAX * bend[x];
            // A comparison with no number is false.
            let gentle = |three: [f32; 3]| (three[0] - 2.0 * three[1] + three[2]).powi(2) <= most;
            let inner = x > 0 && x + 1 < width;
            inner
                && [&*above, here, below].iter().all(|line| gentle([line[x - 1], line[x], line[x + 1]]))
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
            let line = || (0..8).map(|x| 0.6 * x as f32 + if x > 4 { change } else { 0.0 }).collect();
            let mut work = Work { fitted: [line(), line(), line()], ..Work::default() };
            work.find_smooth(&[1e-4; 8]);
            work.smooth
        };
        assert_eq!(smooth(0.0), [false, true, true, true, true, true, true, false]);
        assert_eq!(smooth(0.3), [false, true, true, true, false, false, true, false]);
        assert_eq!(smooth(f32::NAN), [false, true, true, true, false, false, false, false]);
    }
}
