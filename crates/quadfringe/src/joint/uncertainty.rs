//! Step 9: the standard deviation of the phase, and the probability that an order is wrong.
//!
//! Where the energy has a minimum, its cells have a variance. A pixel adds the noise of the window that found the phase at the start
//! of the energy, where it is finer than the cells. Elsewhere the window decides: a pixel whose intensities have the standard
//! deviation `noise` determines its phase with the variance `noise^2 / J`, where `J` is the sum of the squared derivatives of its four
//! intensities with respect to the phase, after the albedo is eliminated. A mean with weights `w J` has the variance `noise^2 sum(w^2
//! J) / sum(w J)^2`. The window computes `sum(w J)` anyway. `sum(w^2 J)` is a fixed share of it where `J` varies little in the window,
//! even if an edge cuts the window in half.
//!
//! The second cheapest order is less probable than the cheapest by the factor `exp(-lead / temperature)`, which gives
//! the wrong-order probability. The temperature is estimated from the costs of the chosen orders, and so depends on the
//! noise, texture and discontinuities of this shot.

use super::energy::Energy;
use super::params::uncertainty::{EVIDENCE, EXPONENT_MAX, FINE_SMOOTHNESS, METHOD_RAD, TEMPERATURE_MIN};
use multiversion::multiversion;
use std::f32::consts::PI;

/// Variance of a phase of which only the order is known, rad^2.
const ANY_PHASE: f32 = PI * PI / 3.0;

/// What the cells of the energy leave to the window that found the phase at its start.
pub(super) struct PhaseNoise {
    /// Variance by noise of a pixel, times its information.
    window: f32,
    /// Share of it that the cells do not smooth.
    fine: f32,
    /// Variance of a phase that the energy has not corrected, beyond noise.
    uncorrected: f32,
}

impl PhaseNoise {
    /// Noise of the phase if the intensities have the standard deviation `noise`. The sum of the squared weights of the window is
    /// the sum of its weights times `share`, and its standard deviation is `sigma_px`.
    pub fn new(noise: f32, share: f32, sigma_px: f32, energy: &Energy) -> Self {
        let uncorrected = energy.correction() + METHOD_RAD * METHOD_RAD;
        Self { uncorrected, ..Self::of_window(noise, share, sigma_px / energy.cell_px() as f32) }
    }

    fn of_window(noise: f32, share: f32, sigma_cells: f32) -> Self {
        let smooth = 1.0 + FINE_SMOOTHNESS * sigma_cells * sigma_cells;
        Self { window: noise * noise * share, fine: 1.0 / (smooth * smooth), uncorrected: 0.0 }
    }

    /// Replaces the information of a row, which the window has added up, by the standard deviation of the phase in rad.
    /// `variance` is that of the energy, in rad^2; where it is 0 the energy has left the phase alone.
    pub fn deviations(&self, variance: &[f32], row: &mut [f32]) {
        deviations(self, variance, row);
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn deviations(noise: &PhaseNoise, variance: &[f32], row: &mut [f32]) {
    let PhaseNoise { window, fine, uncorrected } = *noise;
    for (value, variance) in row.iter_mut().zip(variance) {
        let by_window = window / *value;
        // A window without information leaves any phase of a turn.
        let by_window = if by_window < ANY_PHASE { by_window } else { ANY_PHASE };
        let corrected = *variance + fine * by_window + METHOD_RAD * METHOD_RAD;
        *value = if *variance > 0.0 { corrected } else { by_window + uncorrected }.sqrt();
    }
}

/// How certain the order of a node is.
#[derive(Debug, Clone, Copy)]
pub(super) struct NodeVerdict {
    /// Cost of the second cheapest order minus cost of the cheapest, in units of the jump price, at most 1.
    pub lead: f32,
    /// Cost of the chosen order by the evidence of the node alone, as a share of the greatest cost, in [0, 1].
    pub order_cost: f32,
    /// Whether the node is lit and so has evidence.
    pub lit: bool,
}

/// Model of the probability that the order of a node is wrong, given its lead and cost.
#[derive(Debug, Clone, Copy)]
pub(super) struct WrongOrderModel {
    /// Temperature of the shot, in units of the greatest cost of a node.
    temperature: f32,
    /// Mean cost of the chosen orders, in the same unit.
    mean: f32,
    /// Number of nodes with independent evidence that a lead of 1 stands for, times its measured worth.
    nodes_per_lead: f32,
}

impl WrongOrderModel {
    /// Makes the model from the lit nodes of a shot. A lead of 1 stands for `jump_nodes` contradicting nodes. Of these,
    /// `shared` nodes in a row take their evidence from the same window and count as one.
    ///
    /// At the temperature T, a sum of `n` squared normal differences has the mean `n T / 2` and the variance `n T^2 / 2`: noise
    /// of many pixels raises the costs more than it makes them vary, and variance over mean is T for every `n`. Costs at
    /// discontinuities vary as much as they are large. The temperature is therefore the smaller of two numbers: the mean, and
    /// variance over mean.
    pub fn new(verdicts: impl Iterator<Item = NodeVerdict>, jump_nodes: f32, shared: f32) -> Self {
        let (mut count, mut sum, mut squares) = (1e-9, 0.0, 0.0);
        for cost in verdicts.map(|verdict| f64::from(verdict.order_cost)) {
            (count, sum, squares) = (count + 1.0, sum + cost, squares + cost * cost);
        }
        let mean = sum / count;
        let temperature = mean.min((squares / count - mean * mean) / mean.max(1e-9)) as f32;
        let nodes_per_lead = EVIDENCE * jump_nodes / shared.max(1.0);
        Self { temperature: temperature.max(TEMPERATURE_MIN), mean: mean as f32, nodes_per_lead }
    }

    /// Probability that the order of a node is wrong. If the cost of the order of a node exceeds twice the mean cost, the excess
    /// is added to the temperature of this node.
    pub fn probability(&self, NodeVerdict { lead, order_cost, .. }: NodeVerdict) -> f32 {
        let temperature = self.temperature + (order_cost - 2.0 * self.mean).max(0.0);
        1.0 / (1.0 + (self.nodes_per_lead * lead.max(0.0) / temperature).min(EXPONENT_MAX).exp())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Share of the variance of filtered noise that is left less its cell means, interpolated linearly, along lines and columns.
    fn exact_share(sigma: f32, cell: usize) -> f32 {
        let (radius, middle) = ((2.0 * sigma).ceil() as isize, 12 * cell as isize);
        let filtered = |x: isize| -> Vec<f32> {
            let weight = |j: isize| (-0.5 * ((j - x) as f32 / sigma).powi(2)).exp();
            (0..2 * middle).map(|j| if (j - x).abs() <= radius { weight(j) } else { 0.0 }).collect()
        };
        let add = |sum: &mut Vec<f32>, other: &[f32], share: f32| {
            sum.iter_mut().zip(other).for_each(|(sum, other)| *sum += share * other);
        };
        let mean = |first: isize| {
            let mut sum = vec![0.0; 2 * middle as usize];
            (0..cell as isize).for_each(|i| add(&mut sum, &filtered(first + i), 1.0 / cell as f32));
            sum
        };
        let dot = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f32>();
        let (mut both, mut smooth) = (0.0, 0.0);
        for i in 0..cell {
            let place = (i as f32 + 0.5) / cell as f32 - 0.5;
            let before = place.floor();
            let first = middle + before as isize * cell as isize;
            let mut between = vec![0.0; 2 * middle as usize];
            add(&mut between, &mean(first), 1.0 - (place - before));
            add(&mut between, &mean(first + cell as isize), place - before);
            let here = filtered(middle + i as isize);
            both += dot(&here, &between) / dot(&here, &here) / cell as f32;
            smooth += dot(&between, &between) / dot(&here, &here) / cell as f32;
        }
        1.0 - 2.0 * both * both + smooth * smooth
    }

    #[test]
    fn fine_noise_is_that_of_a_filtered_image() {
        for (sigma, cell) in [(1.125, 2), (2.55, 4), (1.5, 2), (3.5, 4), (4.125, 4)] {
            let noise = PhaseNoise::of_window(1.0, 1.0, sigma / cell as f32);
            let (stated, exact) = (noise.fine, exact_share(sigma, cell));
            assert!((0.8..1.25).contains(&(stated / exact)), "{sigma} {cell}: {stated} {exact}");
        }
    }

    #[test]
    fn a_phase_without_information_is_known_to_a_turn() {
        let mut row = [0.0, 1e-20];
        PhaseNoise::of_window(0.01, 0.5, 1.0).deviations(&[0.0, 0.0], &mut row);
        assert!(row.iter().all(|value| (value - PI / f32::sqrt(3.0)).abs() < 1e-5), "{row:?}");
    }

    #[test]
    fn a_phase_without_a_cell_is_as_uncertain_as_its_window_and_the_corrections_elsewhere() {
        let noise = PhaseNoise { uncorrected: 0.04, ..PhaseNoise::of_window(0.01, 0.5, 1.0) };
        let mut row = [0.005, 0.005];
        noise.deviations(&[0.0, 1e-4], &mut row);
        let by_window = 0.5e-4 / 0.005;
        assert!((row[0] - f32::sqrt(by_window + 0.04)).abs() < 1e-6, "{row:?}");
        let fine = 1.0 / (1.0 + FINE_SMOOTHNESS).powi(2);
        assert!(
            (row[1] - f32::sqrt(1e-4 + fine * by_window + METHOD_RAD * METHOD_RAD)).abs() < 1e-6,
            "{row:?}"
        );
    }
}
