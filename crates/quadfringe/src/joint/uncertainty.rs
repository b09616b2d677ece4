//! Step 9: the standard deviation of the phase, and the probability that an order is wrong.
//!
//! The phase is a weighted mean of least-squares steps, one from each pixel of a window. A pixel whose intensities have the standard
//! deviation `noise` determines its phase with the variance `noise^2 / J`, where `J` is the sum of the squared derivatives of its four
//! intensities with respect to the phase, albedo eliminated. A mean with weights `w J` has the variance
//! `noise^2 sum(w^2 J) / sum(w J)^2`. The window adds up `sum(w J)` anyway; `sum(w^2 J)` is a fixed share of it wherever `J` varies
//! little in the window, also where an edge cuts the window in half. The disagreement of the channels beyond noise and the error
//! of the method itself are added.
//!
//! The probability of a wrong order is `exp(-lead / temperature)` of the second cheapest order against the cheapest. The
//! temperature is the cost that the evidence of the shot gives the chosen orders: it contains the noise, texture and
//! discontinuities of this shot.

use super::params::uncertainty::{ALBEDO_LOSS, EXPONENT_MAX, INFORMATION_MIN, METHOD_RAD, TEMPERATURE_MIN};
use multiversion::multiversion;

/// Noise of phases that a window has averaged.
pub(super) struct PhaseNoise {
    variance: f32,
}

impl PhaseNoise {
    /// For intensities with the standard deviation `noise`, in a window whose squared weights are `share` of its weights.
    pub fn new(noise: f32, share: f32) -> Self {
        Self { variance: ALBEDO_LOSS * noise * noise * share }
    }

    /// Standard deviation of a row in rad, in place of the information that the window has added up; `disagreement` is the variance
    /// in rad^2 by which the channels disagree beyond noise.
    pub fn deviations(&self, disagreement: &[f32], row: &mut [f32]) {
        deviations(self.variance, disagreement, row);
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn deviations(variance: f32, disagreement: &[f32], row: &mut [f32]) {
    for (value, disagreement) in row.iter_mut().zip(disagreement) {
        let by_noise = variance / if *value > INFORMATION_MIN { *value } else { INFORMATION_MIN };
        *value = (by_noise + disagreement + METHOD_RAD * METHOD_RAD).sqrt();
    }
}

/// How certain the order of a node is.
#[derive(Debug, Clone, Copy)]
pub(super) struct NodeVerdict {
    /// Cost of the second cheapest order less that of the cheapest, in units of the price of a change of surface, at most 1.
    pub lead: f32,
    /// Cost that the evidence of the node gives the chosen order, in [0, 1] of the greatest.
    pub order_cost: f32,
    /// Whether there is light to judge by.
    pub lit: bool,
}

/// From lead and cost of a node to the probability that its order is wrong.
#[derive(Debug, Clone, Copy)]
pub(super) struct WrongOrderModel {
    /// Temperature of the shot, in units of the greatest cost of a node.
    temperature: f32,
    /// Mean cost of the chosen orders, in the same unit.
    mean: f32,
    /// Nodes with independent evidence that a lead of 1 is worth.
    nodes_per_lead: f32,
}

impl WrongOrderModel {
    /// From the lit nodes of a shot. A lead of 1 is worth `jump_nodes` contradicting nodes; `shared` nodes in a row take their
    /// evidence from one window and count as one.
    ///
    /// A squared difference of `n` normal terms has the mean `n T / 2` and the variance `n T^2 / 2` at temperature T, whatever `n`
    /// is: the noise of many pixels raises costs without making them vary. Costs at discontinuities vary as much as they are large.
    /// Variance over mean therefore separates the two, and the smaller of mean and that ratio is the temperature.
    pub fn new(verdicts: impl Iterator<Item = NodeVerdict>, jump_nodes: f32, shared: f32) -> Self {
        let (mut count, mut sum, mut squares) = (1e-9, 0.0, 0.0);
        for cost in verdicts.map(|verdict| f64::from(verdict.order_cost)) {
            (count, sum, squares) = (count + 1.0, sum + cost, squares + cost * cost);
        }
        let mean = sum / count;
        let temperature = mean.min((squares / count - mean * mean) / mean.max(1e-9)) as f32;
        let nodes_per_lead = jump_nodes / shared.max(1.0);
        Self { temperature: temperature.max(TEMPERATURE_MIN), mean: mean as f32, nodes_per_lead }
    }

    /// Probability that the order of a node is wrong. A node whose evidence contradicts its order by more than twice the mean cost
    /// has a temperature higher by the excess.
    pub fn probability(&self, NodeVerdict { lead, order_cost, .. }: NodeVerdict) -> f32 {
        let temperature = self.temperature + (order_cost - 2.0 * self.mean).max(0.0);
        1.0 / (1.0 + (self.nodes_per_lead * lead.max(0.0) / temperature).min(EXPONENT_MAX).exp())
    }
}
