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

use super::output::OutputRow;
use multiversion::multiversion;
use std::f32::consts::PI;

/// Least margin up to which margins are counted as strays.
const FAR_MARGIN_MIN: f32 = 0.25;

/// Steps of the table of probabilities, a power of two.
const STEPS: usize = 1024;
/// A number of this size has its last bit at 1: what is added to it is rounded and stands in the last bits.
const WHOLE: f32 = 8_388_608.0;

/// Least temperature of costs, in units of the greatest that counts: costs are whole numbers, 333 at most.
const TEMPERATURE_MIN: f32 = 1.0 / 333.0;

/// Variance of a step over `noise^2 / J`. The albedo of a pixel is the mean of nine with the weights 1 2 1 in both directions, so
/// of the share `x` of the information that it would take when fitted to the pixel alone, `1 - (2 * 4/16 - (6/16)^2) x` of the
/// noise is left where `J` counts `1 - x`. Four fringes have `x = (a^2 + b^2 / 4) / (4 a^2 + 2 b^2)`: 0.21 to 0.25 from full to no
/// contrast, and the variance is 1.17 to 1.21 times as much.
const ALBEDO_LOSS: f32 = 1.18;

/// What the best method is off by on a smooth surface without any noise, rad: `python benches/round_trip.py`, plane and peaks.
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

/// Standard deviation of a two-step phase from red and from blue times `equal`, when both have the noise given: a change of
/// either turns the phase by its part across the phasor.
#[inline(always)]
pub(super) fn two_step_deviation([red, blue]: [f32; 2], equal: f32, noise: f32) -> f32 {
    let square = red * red + blue * blue;
    let across = blue * blue + red * red * equal * equal;
    noise * across.sqrt() / if square > 1e-12 { square } else { 1e-12 }
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

/// Orders that were chosen point by point: probability of another one by the margin, 1 for beats in the middle between two orders
/// and 0 for a toss-up.
#[derive(Debug, Clone)]
pub(super) struct MarginOdds {
    /// NaN from `STEPS` on.
    table: Box<[f32; 2 * STEPS]>,
}

impl MarginOdds {
    /// From margins of many pixels. Most beats are off by a normal deviation, of which the median tells the size; one that is `d`
    /// off would be `2 pi - d` off from the order beyond. The others, beside edges, are off by anything: as many margins as lie
    /// where a normal deviation hardly gets (four of them) tell how many there are, and their orders are as good as random.
    pub fn new(margins: &mut [f32]) -> Self {
        let mut apart: Vec<f32> = margins.iter().map(|margin| PI * (1.0 - margin)).collect();
        let sigma = deviation(&mut apart).max(0.02);
        let far = (1.0 - 4.0 * sigma / PI).max(FAR_MARGIN_MIN);
        let beyond = margins.iter().filter(|margin| **margin < far).count() as f32;
        let stray = (beyond / (far * margins.len().max(1) as f32)).min(1.0);
        let probability = |step: usize| {
            let apart = PI * (1.0 - step as f32 / (STEPS - 1) as f32);
            let normal = (2.0 * PI).sqrt() / sigma * (-0.5 * (apart / sigma).powi(2)).exp();
            let random = stray / (stray + (1.0 - stray) * normal).max(f32::MIN_POSITIVE);
            let lead = 2.0 * PI * (PI - apart) / (sigma * sigma);
            let toss = 1.0 / (1.0 + lead.min(80.0).exp());
            1.0 - (1.0 - random) * (1.0 - toss)
        };
        let known_or_not = |step| if step < STEPS { probability(step) } else { f32::NAN };
        Self { table: Box::new(std::array::from_fn(known_or_not)) }
    }

    /// Probabilities of another order of a row; NaN for NaN. Vectors find the places in the table, so that what is left
    /// for single numbers is to fetch them.
    #[inline(always)]
    pub fn another(&self, margins: &[f32], out: &mut [f32]) {
        const BLOCK: usize = 64;
        let mut steps = [0u32; BLOCK];
        for (out, margins) in out.chunks_mut(BLOCK).zip(margins.chunks(BLOCK)) {
            for (step, margin) in steps.iter_mut().zip(margins) {
                let known = (margin.clamp(0.0, 1.0) * (STEPS - 1) as f32 + WHOLE).to_bits() % STEPS as u32;
                *step = if margin.is_nan() { STEPS as u32 } else { known };
            }
            for (out, step) in out.iter_mut().zip(&steps) {
                *out = self.table[*step as usize % (2 * STEPS)];
            }
        }
    }
}

/// What the rows of a shot that are decoded one by one have in common, found from a few of them.
#[derive(Debug, Clone)]
pub(super) struct Sureness {
    /// Standard deviation of the intensities.
    pub noise: f32,
    pub odds: MarginOdds,
}

impl Sureness {
    /// Before anything is known: uncertainties come in units of the noise.
    pub fn none() -> Self {
        Self { noise: 1.0, odds: MarginOdds { table: Box::new([0.0; 2 * STEPS]) } }
    }

    /// From second differences of intensities down columns, which see little of the fringes, and from margins of orders.
    pub fn new(bends: &mut [f32], margins: &mut [f32]) -> Self {
        Self { noise: deviation(bends) / 6f32.sqrt(), odds: MarginOdds::new(margins) }
    }

    /// Uncertainty and odds of a row that was decoded before they were known.
    pub fn tell(&self, row: &mut OutputRow<'_>) {
        row.sigma.iter_mut().for_each(|sigma| *sigma *= self.noise);
        self.odds.another(row.quality, row.wrong);
    }
}

/// Standard deviation of normal values around 0 from the median of their size; 0 of nothing.
fn deviation(values: &mut [f32]) -> f32 {
    values.iter_mut().for_each(|value| *value = value.abs());
    let middle = values.len() / 2;
    if values.is_empty() {
        return 0.0;
    }
    let (_, median, _) = values.select_nth_unstable_by(middle, f32::total_cmp);
    *median / 0.6745
}
