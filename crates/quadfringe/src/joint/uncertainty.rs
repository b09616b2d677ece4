//! Step 9: the standard deviation of the phase, and the probability that an order is wrong.
//!
//! Where the energy has a minimum, its cells have a variance. Elsewhere the window that found the phase at its start decides: a pixel
//! whose intensities have the standard deviation `noise` determines its phase with the variance `noise^2 / J`, where `J` is the sum of
//! the squared derivatives of its four intensities with respect to the phase, after the albedo is eliminated. A mean with weights `w J`
//! has the variance `noise^2 sum(w^2 J) / sum(w J)^2`. The window computes `sum(w J)` anyway. `sum(w^2 J)` is a fixed share of it where
//! `J` varies little in the window, even if an edge cuts the window in half.
//!
//! The second cheapest order is less probable than the cheapest by the factor `exp(-lead / temperature)`, which gives
//! the wrong-order probability. The temperature is estimated from the costs of the chosen orders, and so depends on the
//! noise, texture and discontinuities of this shot.

use super::energy::Energy;
use super::params::uncertainty::{EVIDENCE, EXPONENT_MAX, METHOD_RAD, TEMPERATURE_MIN};
use multiversion::multiversion;
use std::f32::consts::PI;

/// Variance of a phase of which only the order is known, rad^2.
const ANY_PHASE: f32 = PI * PI / 3.0;

/// Variance of a phase without a cell of the energy, from the window that found it.
pub(super) struct PhaseNoise {
    /// Variance by noise of a pixel, times its information.
    window: f32,
    /// Variance of a phase that the energy has not corrected, beyond noise.
    uncorrected: f32,
}

impl PhaseNoise {
    /// Noise of the phase if the intensities have the standard deviation `noise`. The sum of the squared weights of the window is
    /// the sum of its weights times `share`.
    pub fn new(noise: f32, share: f32, energy: &Energy) -> Self {
        Self { window: noise * noise * share, uncorrected: energy.correction() + METHOD_RAD * METHOD_RAD }
    }

    /// Replaces the information of a row, which the window has added up, by the standard deviation of the phase in rad.
    /// `variance` is that of the energy, in rad^2; where it is 0 the energy has left the phase alone.
    pub fn deviations(&self, variance: &[f32], row: &mut [f32]) {
        deviations(self, variance, row);
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn deviations(noise: &PhaseNoise, variance: &[f32], row: &mut [f32]) {
    let PhaseNoise { window, uncorrected } = *noise;
    for (value, variance) in row.iter_mut().zip(variance) {
        let by_window = window / *value;
        // A window without information leaves any phase of a turn.
        let by_window = if by_window < ANY_PHASE { by_window } else { ANY_PHASE };
        let corrected = *variance + METHOD_RAD * METHOD_RAD;
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

    #[test]
    fn a_phase_without_information_is_known_to_a_turn() {
        let mut row = [0.0, 1e-20];
        PhaseNoise { window: 0.5e-4, uncorrected: 0.0 }.deviations(&[0.0, 0.0], &mut row);
        assert!(row.iter().all(|value| (value - PI / f32::sqrt(3.0)).abs() < 1e-5), "{row:?}");
    }

    #[test]
    fn a_phase_without_a_cell_is_as_uncertain_as_its_window_and_the_corrections_elsewhere() {
        let noise = PhaseNoise { window: 0.5e-4, uncorrected: 0.04 };
        let mut row = [0.005, 0.005];
        noise.deviations(&[0.0, 1e-4], &mut row);
        assert!((row[0] - f32::sqrt(0.5e-4 / 0.005 + 0.04)).abs() < 1e-6, "{row:?}");
        assert!((row[1] - f32::sqrt(1e-4 + METHOD_RAD * METHOD_RAD)).abs() < 1e-6, "{row:?}");
    }
}
