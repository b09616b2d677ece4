//! A surface of the second order through cells.

use crate::joint::params::energy::CURVED_MAX;

/// The fitted phase of 3 x 3 cells, rad; not a number outside the cells of the fit.
pub(super) type Patch = [[f32; 3]; 3];

/// A surface of the second order, from the middle of a cell and in cells: right and down.
#[derive(Debug, Clone, Copy)]
pub(super) struct Quadric {
    /// Mean over the cell, rad.
    mean: f32,
    slope: [f32; 2],
    /// Halves of the second derivatives along both directions.
    bend: [f32; 2],
    twist: f32,
}

impl Quadric {
    /// No surface: its phase is not a number.
    pub const NONE: Self = Self { mean: f32::NAN, slope: [0.0; 2], bend: [0.0; 2], twist: 0.0 };

    /// The surface whose means over nine cells come nearest to those of the patch, by least squares.
    pub fn through(patch: &Patch) -> Self {
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

    /// The plane through the middle cell of a patch with a discontinuity, where second differences of one surface have the variance
    /// `bend`. Where a row or a column has a larger one, the slope is that to the side where the phase changes less.
    pub fn beside_discontinuity(patch: &Patch, bend: f32) -> Self {
        let slope = |three: [f32; 3]| {
            let [before, after] = [three[1] - three[0], three[2] - three[1]];
            if is_gentle(three, bend) {
                0.5 * (before + after)
            } else if before.is_nan() || after.abs() < before.abs() {
                after
            } else {
                before
            }
        };
        let slope = [slope(patch[1]), slope(patch.map(|row| row[1]))];
        if slope.iter().any(|slope| slope.is_nan()) {
            return Self::NONE;
        }
        Self { mean: patch[1][1], slope, ..Self::NONE }
    }

    /// Its value at pixel `[x, y]` from the first one of a cell with this many pixels along a side.
    #[inline(always)]
    pub fn at(&self, pixel: [f32; 2], side: f32) -> f32 {
        let [x, y] = from_middle(pixel, side);
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

/// The place of a pixel from the middle of a cell, in cells.
#[inline(always)]
pub(super) fn from_middle(pixel: [f32; 2], side: f32) -> [f32; 2] {
    pixel.map(|i| (i + 0.5) / side - 0.5)
}

/// Whether no second difference along a row or a column is larger than bending with this variance explains. A comparison with no number
/// is false.
pub(super) fn is_one_surface(patch: &Patch, bend: f32) -> bool {
    patch.iter().all(|row| is_gentle(*row, bend)) && (0..3).all(|x| is_gentle(patch.map(|row| row[x]), bend))
}

fn is_gentle(three: [f32; 3], bend: f32) -> bool {
    (three[0] - 2.0 * three[1] + three[2]).powi(2) <= CURVED_MAX * CURVED_MAX * bend
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
                let found = quadric.at([x as f32, y as f32], side as f32);
                let truth = surface((side + x) as f32, (side + y) as f32);
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
            (0..16).map(|i| quadric.at([(i % 4) as f32, (i / 4) as f32], 4.0).powi(2)).sum::<f32>() / 16.0
        };
        let left: f32 = (0..9).map(square).sum();
        assert!((0.5..0.62).contains(&left), "{left}");
    }

    #[test]
    fn beside_a_step_or_a_missing_cell_the_plane_is_that_of_its_side() {
        let plane = |x: f32, y: f32| 1.0 + 0.2 * x - 0.1 * y;
        let patch: Patch = std::array::from_fn(|y| std::array::from_fn(|x| plane(x as f32, y as f32)));
        let (mut step, mut hole) = (patch, patch);
        step.iter_mut().for_each(|row| row[2] += 2.0);
        hole[0] = [f32::NAN; 3];
        for patch in [step, hole] {
            assert!(!is_one_surface(&patch, 1e-4));
            let found = Quadric::beside_discontinuity(&patch, 1e-4).at([3.0, 0.0], 4.0);
            assert!((found - plane(1.375, 0.625)).abs() < 1e-5, "{found}");
        }
        let mut alone = [[f32::NAN; 3]; 3];
        alone[1][1] = 1.0;
        assert!(Quadric::beside_discontinuity(&alone, 1e-4).at([0.0; 2], 4.0).is_nan());
    }
}
