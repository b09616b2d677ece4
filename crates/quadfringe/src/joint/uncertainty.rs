//! How sure a pixel is: the standard deviation of its phase, and the probability that its order is another one.
//!
//! The phase of the best method is a weighted mean of least-squares steps, one from each pixel of a window. A pixel whose
//! intensities have the standard deviation `noise` knows its phase to `noise^2 / J`, with `J` the sum of its squared
//! derivatives of the four intensities by the phase, albedo eliminated. A mean with weights `w J` has the variance
//! `noise^2 sum(w^2 J) / sum(w J)^2`; `sum(w J)` is what the window adds up anyway, and `sum(w^2 J)` is a fixed share of it
//! wherever `J` varies little in the window, also where an edge cuts the window in half. To the noise is added what the
//! channels disagree on beyond it, and what the method itself is off by.
//!
//! Orders are judged by how far the next one is behind, as `exp(-lead / temperature)`. The temperature is what the evidence
//! of the shot misses the chosen orders by: it holds the noise, the texture and the edges of this very shot.

use multiversion::multiversion;

/// Least temperature of costs, in units of the greatest that counts: costs are whole numbers, 333 at most.
const TEMPERATURE_MIN: f32 = 1.0 / 333.0;

/// Variance of a step over `noise^2 / J`. The albedo of a pixel is the mean of nine with the weights 1 2 1 in both directions, so
/// of the share `x` of the information that it would take when fitted to the pixel alone, `1 - (2 * 4/16 - (6/16)^2) x` of the
/// noise is left where `J` counts `1 - x`. Four fringes have `x = (a^2 + b^2 / 4) / (4 a^2 + 2 b^2)`: 0.21 to 0.25 from full to no
/// contrast, and the variance is 1.17 to 1.21 times as much.
const ALBEDO_LOSS: f32 = 1.18;

/// What the best method is off by on a smooth surface without any noise, rad: `python evaluation/round_trip.py`, plane and peaks.
const METHOD_RAD: f32 = 8e-4;

/// Noise of the phases that a window has averaged.
pub(super) struct PhaseNoise {
    variance: f32,
}

impl PhaseNoise {
    /// For intensities with the standard deviation `noise`, in a window whose squared weights are `share` of its weights.
    pub fn new(noise: f32, share: f32) -> Self {
        Self { variance: ALBEDO_LOSS * noise * noise * share }
    }

    /// Standard deviation in rad of a row, in place of the weights that the window has added up; `disagreement` is the variance
    /// by which the channels disagree beyond noise.
    pub fn row(&self, disagreement: &[f32], row: &mut [f32]) {
        deviations(self.variance, disagreement, row);
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn deviations(variance: f32, disagreement: &[f32], row: &mut [f32]) {
    for (value, more) in row.iter_mut().zip(disagreement) {
        let by_noise = variance / if *value > 1e-12 { *value } else { 1e-12 };
        *value = (by_noise + more + METHOD_RAD * METHOD_RAD).sqrt();
    }
}

/// Orders that were chosen by costs with spatial support.
#[derive(Debug, Clone, Copy)]
pub(super) struct CostOdds {
    /// Temperature of the shot and mean misfit of its nodes, in units of the greatest misfit that counts.
    temperature: f32,
    mean: f32,
    /// The same units in a lead of 1.
    per_lead: f32,
}

impl CostOdds {
    /// `misfits` are those of all lit nodes at their orders, in units of the greatest that counts; a lead of 1 is worth so many
    /// contradicting `nodes`; as many nodes as `together` take their evidence from one window, and so speak with one voice.
    ///
    /// A squared misfit of `n` normal terms has the mean `n T / 2` and the variance `n T^2 / 2` at temperature T, whatever `n`
    /// is: the noise of many pixels lifts the misfit without making it vary. Misfits of edges vary as much as they are large.
    pub fn new(misfits: impl Iterator<Item = f32>, nodes: f32, together: f32) -> Self {
        let (mut count, mut sum, mut squares) = (1e-9, 0.0, 0.0);
        for misfit in misfits.map(f64::from) {
            (count, sum, squares) = (count + 1.0, sum + misfit, squares + misfit * misfit);
        }
        let mean = sum / count;
        let temperature = mean.min((squares / count - mean * mean) / mean.max(1e-9)) as f32;
        let per_lead = nodes / together.max(1.0);
        Self { temperature: temperature.max(TEMPERATURE_MIN), mean: mean as f32, per_lead }
    }

    /// Probability that the order of a node is another one. A node whose own evidence contradicts its order, far more than is
    /// usual in the shot, is hotter by as much.
    pub fn another(&self, lead: f32, misfit: f32) -> f32 {
        let temperature = self.temperature + (misfit - 2.0 * self.mean).max(0.0);
        1.0 / (1.0 + (self.per_lead * lead.max(0.0) / temperature).min(80.0).exp())
    }
}
