//! How sure a pixel is: the standard deviation of its phase, and the probability that its order is another one.
//!
//! The phase of the best method is a weighted mean of least-squares steps, one from each pixel of a window. A pixel whose
//! intensities have the standard deviation `noise` knows its phase to `noise^2 / J`, with `J` the sum of its squared
//! derivatives of the four intensities by the phase, albedo eliminated. A mean with weights `w J` has the variance
//! `noise^2 sum(w^2 J) / sum(w J)^2`; `sum(w J)` is what the window adds up anyway, and `sum(w^2 J)` is a fixed share of it
//! wherever `J` varies little in the window, also where an edge cuts the window in half.
//!
//! Orders are judged by how far the next one is behind, as `exp(-lead / temperature)`. The temperature is what the evidence
//! of the shot misses the chosen orders by on average: it holds the noise, the texture and the edges of this very shot.

use multiversion::multiversion;
use std::f32::consts::PI;

/// Steps of the table of probabilities.
const STEPS: usize = 1024;

/// Noise of the phases that a window has averaged.
pub(super) struct PhaseNoise {
    variance: f32,
}

impl PhaseNoise {
    /// For intensities with the standard deviation `noise`, in a window whose squared weights are `share` of its weights.
    pub fn new(noise: f32, share: f32) -> Self {
        Self { variance: noise * noise * share }
    }

    /// Standard deviation in rad of a row, from the weights that the window has added up.
    pub fn row(&self, information: &[f32], out: &mut [f32]) {
        deviations(self.variance, information, out);
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn deviations(variance: f32, information: &[f32], out: &mut [f32]) {
    for (out, &known) in out.iter_mut().zip(information) {
        *out = (variance / if known > 1e-12 { known } else { 1e-12 }).sqrt();
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

/// Probability of another order by the lead of the one that was chosen, a lead in [0, 1].
#[derive(Debug, Clone)]
pub(super) struct Odds {
    table: Vec<f32>,
}

impl Odds {
    /// A lead of 1 is so many temperatures.
    fn new(temperatures: f32) -> Self {
        let lead = |step: usize| step as f32 / STEPS as f32;
        Self {
            table: (0..=STEPS)
                .map(|step| 1.0 / (1.0 + (temperatures * lead(step)).min(80.0).exp()))
                .collect(),
        }
    }

    /// Orders chosen by costs with spatial support. `misfits` are those of all lit nodes at their orders, in units of the
    /// greatest that counts; a lead of 1 is worth so many contradicting `nodes`; as many nodes as `together` take
    /// their evidence from one window, and so speak with one voice.
    pub fn of_costs(misfits: impl Iterator<Item = f32>, nodes: f32, together: f32) -> Self {
        let (sum, count) =
            misfits.fold((0.0, 0.0), |(sum, count), misfit| (sum + f64::from(misfit), count + 1.0));
        let temperature = (sum / f64::max(count, 1.0)) as f32;
        Self::new(nodes / (together.max(1.0) * temperature.max(1e-3)))
    }

    /// Orders chosen point by point, from margins of many pixels: 1 for a beat in the middle between two orders, 0 for a toss-up.
    /// A beat that is `d` off would be `2 pi - d` off from the order beyond, and of two normal deviations the lesser is the
    /// likelier by `exp((4 pi^2 - 4 pi d) / (2 variance))`.
    pub fn of_margins(margins: &mut [f32]) -> Self {
        margins.iter_mut().for_each(|margin| *margin = PI * (1.0 - *margin));
        let beats = deviation(margins);
        Self::new(2.0 * PI * PI / (beats * beats).max(1e-3))
    }

    /// Probability of another order; NaN for NaN.
    #[inline(always)]
    pub fn another(&self, lead: f32) -> f32 {
        let step = (lead.clamp(0.0, 1.0) * STEPS as f32) as usize;
        if lead.is_nan() { f32::NAN } else { self.table[step] }
    }
}

/// What the rows of a shot that are decoded one by one have in common, found from a few of them.
#[derive(Debug, Clone)]
pub(super) struct Sureness {
    /// Standard deviation of the intensities.
    pub noise: f32,
    pub odds: Odds,
}

impl Sureness {
    /// Before anything is known.
    pub fn none() -> Self {
        Self { noise: 0.0, odds: Odds::new(0.0) }
    }

    /// From second differences of intensities down columns, which see little of the fringes, and from margins of orders.
    pub fn new(bends: &mut [f32], margins: &mut [f32]) -> Self {
        Self { noise: deviation(bends) / 6f32.sqrt(), odds: Odds::of_margins(margins) }
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
