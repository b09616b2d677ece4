//! Mean residuals around every cell. They exceed the noise near an edge of the texture, where offsets and amplitudes are still
//! wrong and the phases of neighbouring pixels differ for the same reason.

use super::cells::{CellMaps, CellWindow, RowMaps, TaskWork};
use super::params::phase::WIDTH;
use super::params::pyramid::SAMPLED_ROWS;
use super::scene::Scene;
use crate::parallel::lanes::{LANES, Lanes, add, lanes, take};
use crate::parallel::slots::Slots;
use multiversion::multiversion;

/// Mean square residual in linear light on the cells.
#[derive(Debug)]
pub(super) struct Residuals {
    maps: CellMaps,
    slots: Slots<TaskWork<()>>,
}

impl Default for Residuals {
    fn default() -> Self {
        Self { maps: CellMaps::new(1), slots: Slots::default() }
    }
}

impl Residuals {
    /// Averages the mean squared residuals of the pixels, in linear light squared. `modulation` is 0 where there is no
    /// light. The content of `sums` is lost.
    pub fn measure(
        &mut self,
        scene: &Scene<'_>,
        squared_residual: &[f32],
        modulation: &[f32],
        sums: &mut CellMaps,
    ) {
        scene.grid.window_sums::<2, ()>(
            CellWindow { sigma_cells: scene.cells(WIDTH), sampled_rows: SAMPLED_ROWS },
            &self.slots,
            sums,
            &mut self.maps,
            |(), y, sums| add_lit(scene.row(squared_residual, y), scene.row(modulation, y), sums),
            |_, [count, squares], out| {
                for (out, (square, n)) in out.iter_mut().zip(squares.iter().zip(count)) {
                    *out = square / n.max(1e-6);
                }
            },
        );
    }

    /// Mean squared residual along row `y` of the measured scene, or of a finer image of it.
    pub fn row<'a>(&self, scene: &Scene<'_>, y: usize, maps: &'a mut RowMaps) -> &'a [f32] {
        let [row] = maps.sample(scene.grid, &self.maps, 0, y);
        row
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn add_lit(squared_residual: &[f32], modulation: &[f32], sums: &mut [[Lanes; 2]]) {
    let pixels = [squared_residual, modulation].map(lanes);
    for (i, sums) in sums.iter_mut().enumerate() {
        let [square, modulation] = take(&pixels, i);
        let mut terms = [[0.0; LANES]; 2];
        for x in 0..LANES {
            let lit = modulation[x] > 0.0;
            (terms[0][x], terms[1][x]) = if lit { (1.0, square[x]) } else { (0.0, 0.0) };
        }
        add(sums, &terms);
    }
}

#[cfg(test)]
mod tests {
    use super::super::cells::Grid;
    use super::*;

    #[test]
    fn squares_are_averaged_over_lit_pixels_near_by() {
        let grid = Grid::new([64, 128], 4.0);
        let plane = |value: &dyn Fn(usize) -> f32| -> Vec<f32> {
            (0..grid.pixels()).map(|i| value(i % 128)).collect()
        };
        // Every second column is dark, and its residuals do not count.
        let modulation = plane(&|x| if x % 2 == 0 { 0.4 } else { 0.0 });
        let square = plane(&|x| {
            if x % 2 == 1 {
                1.0
            } else if x < 64 {
                1e-4
            } else {
                4e-4
            }
        });
        let light = vec![0.5; grid.pixels()];
        let scene =
            Scene { light: [&light; 4], usable: &light, grid: &grid, period_px: 25.0, factor: 1, pair: None };
        let mut residuals = Residuals::default();
        residuals.measure(&scene, &square, &modulation, &mut CellMaps::default());
        let mut maps = RowMaps::default();
        let row = residuals.row(&scene, 30, &mut maps);
        for x in 0..128 {
            let off = match x {
                0..48 => row[x] / 1e-4 - 1.0,
                80..128 => row[x] / 4e-4 - 1.0,
                _ => continue,
            };
            assert!(off.abs() < 1e-3, "{x} {}", row[x]);
        }
        assert!((1.5e-4..3.5e-4).contains(&row[64]), "{}", row[64]);
    }
}
