//! The uncertainty of a two-step phase, and the statistics of a shot from which it follows.

use crate::decode::output::OutputRow;
use crate::stages::{WrongOrderTable, deviation};

/// Statistics of a shot, taken from a few of its rows.
#[derive(Debug, Clone)]
pub(super) struct ShotStatistics {
    /// Standard deviation of the intensities, as a fraction of full scale.
    pub noise: f32,
    pub wrong_orders: WrongOrderTable,
}

impl ShotStatistics {
    /// Placeholder until the statistics are known: uncertainties are in units of the noise.
    pub fn unit_noise() -> Self {
        Self { noise: 1.0, wrong_orders: WrongOrderTable::empty() }
    }

    /// Computes the statistics from second differences of intensities along the columns, to which the fringes contribute
    /// little, and from margins of fringe orders. White noise of variance 1 has second differences of variance 1 + 4 + 1
    /// = 6.
    pub fn new(second_differences: &mut [f32], margins: &[f32]) -> Self {
        let noise = deviation(second_differences) / 6f32.sqrt();
        Self { noise, wrong_orders: WrongOrderTable::new(margins) }
    }

    /// Completes a row that was decoded before the statistics were known.
    pub fn complete(&self, row: &mut OutputRow<'_>) {
        row.sigma.iter_mut().for_each(|sigma| *sigma *= self.noise);
        self.wrong_orders.row(row.quality, row.wrong);
    }
}

/// Standard deviation in rad of a two-step phase. `red` and `blue` are the components of the phasor, where `blue` has
/// already been multiplied by `ratio`; before that both had the same `noise`. Only the part of the noise that is
/// perpendicular to the phasor changes the phase.
#[inline(always)]
pub(super) fn two_step_sigma(red: f32, blue: f32, ratio: f32, noise: f32) -> f32 {
    let square = red * red + blue * blue;
    let across = blue * blue + red * red * ratio * ratio;
    noise * across.sqrt() / if square > 1e-12 { square } else { 1e-12 }
}
