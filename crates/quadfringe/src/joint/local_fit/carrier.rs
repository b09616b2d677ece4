//! Step 3 for three colours of different fringe numbers: the phasor of R without a channel in quadrature.
//!
//! In a window of about a fringe R is fitted as an offset plus cosine and sine of a plane wave. The coefficients turn the wave
//! into the phasor of R (J34), whose local frequency is closer to that of the fringes; so the fit is repeated with it.

use super::rows::{Rows, add_products, map, solve_row, sum, turn};
use crate::joint::cells::{CellMaps, CellWindow, RowMaps, TaskWork};
use crate::joint::params::local_fit::CARRIER_WINDOWS;
use crate::joint::params::pyramid::SAMPLED_ROWS;
use crate::joint::scene::Scene;
use crate::parallel::slots::Slots;
use std::f32::consts::TAU;

/// The phasor of R along the rows of a scene.
#[derive(Debug)]
pub(super) struct Carrier {
    /// Change of the phase of the plane wave per pixel along a row and along a column, in rad.
    per_px: [f32; 2],
    /// The fits, each against the phasor of those before.
    fits: [CellMaps; CARRIER_WINDOWS.len()],
}

impl Default for Carrier {
    fn default() -> Self {
        Self { per_px: [0.0; 2], fits: std::array::from_fn(|_| CellMaps::new(map::COUNT)) }
    }
}

impl Carrier {
    /// Finds the phasor in a scene.
    pub fn find(&mut self, scene: &Scene<'_>, slots: &Slots<TaskWork<Rows>>, sums: &mut CellMaps) {
        let [along, down] = direction(scene);
        let turn = TAU / scene.period_px as f32;
        self.per_px = [turn * along, turn * down];
        for (fit, width) in CARRIER_WINDOWS.into_iter().enumerate() {
            let mut found = std::mem::take(&mut self.fits[fit]);
            let before = &*self;
            scene.grid.window_sums::<{ sum::COUNT }, Rows>(
                CellWindow { sigma_cells: scene.cells(width), sampled_rows: SAMPLED_ROWS },
                slots,
                sums,
                &mut found,
                |Rows { maps, cos, sin, .. }, y, sums| {
                    before.phasor(scene, y, fit, maps, [cos, sin]);
                    add_products(scene.row(scene.usable, y), [cos, sin], scene.rows(y), sums);
                },
                |_, sums, out| solve_row(sums, [1.0; 4], out),
            );
            self.fits[fit] = found;
        }
    }

    /// The phasor of R along row `y`, as cosine and sine of its phase.
    pub fn row(&self, scene: &Scene<'_>, y: usize, maps: &mut RowMaps, phasor: [&mut Vec<f32>; 2]) {
        self.phasor(scene, y, self.fits.len(), maps, phasor);
    }

    /// The plane wave, turned by the first `fits`.
    fn phasor(
        &self,
        scene: &Scene<'_>,
        y: usize,
        fits: usize,
        maps: &mut RowMaps,
        [cos, sin]: [&mut Vec<f32>; 2],
    ) {
        let [along, down] = self.per_px;
        [&mut *cos, &mut *sin].into_iter().for_each(|row| row.resize(scene.grid.stride, 0.0));
        for (x, (cos, sin)) in cos.iter_mut().zip(sin.iter_mut()).enumerate() {
            (*sin, *cos) = (along * x as f32 + down * y as f32).sin_cos();
        }
        for fit in &self.fits[..fits] {
            let [p, q] = maps.sample(scene.grid, fit, map::P_R, y);
            turn([p, q], cos, sin);
        }
    }
}

/// Unit vector across the fringes, along a row and along a column, in the half-plane in which the phase grows along a row: the
/// principal axis of the gradients of R less G, in which the outline of objects and their albedo nearly cancel.
fn direction(scene: &Scene<'_>) -> [f32; 2] {
    let grid = scene.grid;
    let [red, green, ..] = scene.light;
    let step = ((scene.period_px / 8.0).round() as usize).max(1);
    let sum = |plane: &[f32]| plane.iter().sum::<f32>();
    let gain = sum(red) / sum(green).max(f32::MIN_POSITIVE);
    let at = |i: usize| red[i] - gain * green[i];
    let [mut xx, mut xy, mut yy] = [0.0f64; 3];
    for y in step..grid.height.saturating_sub(step) {
        for x in step..grid.width.saturating_sub(step) {
            let i = y * grid.stride + x;
            let across = f64::from(at(i + step) - at(i - step));
            let down = f64::from(at(i + step * grid.stride) - at(i - step * grid.stride));
            (xx, xy, yy) = (xx + across * across, xy + across * down, yy + down * down);
        }
    }
    let (sine, cosine) = (0.5 * (2.0 * xy).atan2(xx - yy)).sin_cos();
    [cosine as f32, sine as f32]
}
