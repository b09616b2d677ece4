//! From the cells back to the pixels (J44).
//!
//! Where the cells around a pixel lie on one surface, the pixel takes the phase of this surface: detail of the start that is finer than
//! the cells would be noise, or texture that the windows of the start have mixed. At the discontinuities of the surface the pixels keep
//! the detail of the start, and the correction of the cells is added to it.

use super::cells::{Cells, Rows};
use crate::Reason;
use crate::joint::params::energy::{CURVED_MAX, MOVED_MAX_RAD};
use crate::joint::scene::{Pixels, Scene};
use rayon::prelude::*;

/// Working rows.
#[derive(Debug, Default)]
struct Work {
    rows: Rows,
    /// For each cell of the row, whether the cells around it lie on one surface.
    smooth: Vec<bool>,
    /// Phase of the surface at the present row of pixels, one mean over the columns of each cell.
    means: Vec<f32>,
}

impl Cells {
    /// Gives the pixels the phase of the fit. Where it is too far from that at the start, the modulation becomes 0.
    pub fn correct(&self, scene: &Scene<'_>, pixels: &mut Pixels) {
        let stride = scene.grid.stride;
        let Pixels { phase, modulation, reasons } = pixels;
        let [phase, modulation] =
            [phase, modulation].map(|plane| plane.par_chunks_mut(self.factor * stride).enumerate());
        let rows = phase.zip(modulation).zip(reasons.par_chunks_mut(self.factor * stride));
        rows.for_each_init(Work::default, |work, (((row, phase), (_, modulation)), reasons)| {
            self.find_smooth(row, &mut work.smooth);
            let planes = phase.chunks_mut(stride).zip(modulation.chunks_mut(stride));
            for (i, ((phase, modulation), reasons)) in planes.zip(reasons.chunks_mut(stride)).enumerate() {
                self.interpolate(&self.correction, scene, row * self.factor + i, &mut work.rows);
                let found = work.rows.sum.iter().zip(&work.rows.weight);
                let pixels = phase.iter_mut().zip(modulation).zip(reasons);
                for (((phase, modulation), reason), (sum, weight)) in pixels.zip(found) {
                    let correction = if *weight > 0.0 { sum / weight } else { 0.0 };
                    *phase += correction;
                    if correction.abs() > MOVED_MAX_RAD && *modulation > 0.0 {
                        *modulation = 0.0;
                        *reason = if *reason == Reason::Returned { Reason::Misfit } else { *reason };
                    }
                }
                self.take_surface([row, i], work, phase);
            }
        });
    }

    /// Phase of a cell after the fit.
    fn fitted(&self, at: usize) -> f32 {
        self.start[at] + self.correction[at]
    }

    /// Finds the cells of a row that lie on one surface with the eight around them: all are lit, and no second difference through
    /// their middle is larger than the bending of the tile explains.
    fn find_smooth(&self, row: usize, smooth: &mut Vec<bool>) {
        let Self { height, width, stride, inside, bend, .. } = self;
        smooth.clear();
        smooth.resize(*width, false);
        if row == 0 || row + 1 >= *height {
            return;
        }
        for x in 1..width.saturating_sub(1) {
            let here = row * stride + x;
            let lit = [here - stride, here, here + stride]
                .iter()
                .all(|at| inside[at - 1..=at + 1].iter().all(|&inside| inside > 0.0));
            let most = CURVED_MAX * CURVED_MAX * bend[here];
            let bent = |at: usize, step: usize| {
                let second = self.fitted(at - step) - 2.0 * self.fitted(at) + self.fitted(at + step);
                second * second > most
            };
            smooth[x] = lit
                && ![here - stride, here, here + stride].iter().any(|&at| bent(at, 1))
                && ![here - 1, here, here + 1].iter().any(|&at| bent(at, *stride));
        }
    }

    /// Replaces the phase of the pixels of smooth cells, in row `i` of the pixels of a row of cells, by that of the parabola in either
    /// direction that has the means of the cells.
    fn take_surface(&self, [row, i]: [usize; 2], work: &mut Work, phase: &mut [f32]) {
        let Self { width, stride, factor, .. } = self;
        let Work { smooth, means, .. } = work;
        let parabolas = || (0..*factor).map(|i| parabola(i, *factor));
        if !smooth.contains(&true) {
            return;
        }
        let down = parabola(i, *factor);
        means.clear();
        means.extend((0..*width).map(|x| {
            let at = row * stride + x;
            mix(down, [at - stride, at, at + stride].map(|at| self.fitted(at)))
        }));
        for x in (1..*width).filter(|&x| smooth[x]) {
            let three = [means[x - 1], means[x], means[x + 1]];
            for (phase, along) in phase[x * factor..].iter_mut().zip(parabolas()) {
                *phase = mix(along, three);
            }
        }
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
}
