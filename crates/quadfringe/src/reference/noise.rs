//! Step 2: the noise of the intensities, from what the fits leave (R3) or, with few steps, from second differences (R4).

use super::demodulate::{SetPlan, SetRow, Source, Wave};
use super::params::{KEPT_SHARE, NOISE_MIN, RESIDUAL_STEPS_MIN, SAMPLE_STRIDE};
use crate::condition::Sample;
use std::f64::consts::TAU;

/// Squares of noise of one fringe number in the sampled rows, each with the expectation of the variance of an intensity.
#[derive(Debug, Clone, Default)]
pub(super) struct NoiseSamples {
    /// For each frequency from 2 to N / 2 that the fit leaves. The highest frequency of an even N is real, the others complex.
    residuals: Vec<Vec<f32>>,
    /// Second differences of the phase along the row.
    bends: Vec<f32>,
}

impl NoiseSamples {
    /// Adds the pixels of row `y`, whose fringes are known.
    pub fn add<T: Sample>(
        &mut self,
        source: Source<'_, '_, T>,
        y: usize,
        fringes: &SetRow,
        modulation_min: f32,
    ) {
        let Source { images, k, plan, light, .. } = source;
        let steps = plan.waves.len();
        let rows: Vec<_> = (0..steps).map(|s| images.row(k, s, y)).collect();
        let usable = |x: usize| fringes.modulation[x] >= modulation_min && fringes.is_sound(x, light);
        self.residuals.resize(steps / 2 - usize::from(steps > 1), Vec::new());
        for x in (1..rows[0].len().saturating_sub(1)).step_by(SAMPLE_STRIDE).filter(|x| usable(*x)) {
            if [x - 1, x + 1].into_iter().all(usable) {
                let [before, here, after] = [x - 1, x, x + 1].map(|x| f64::from(fringes.turns[x]));
                let bend = before - 2.0 * here + after;
                let bend_rad = TAU * (bend - bend.round()) * f64::from(fringes.modulation[x]);
                self.bends.push((bend_rad * bend_rad / (6.0 * f64::from(plan.gain()))) as f32);
            }
            for (samples, frequency) in self.residuals.iter_mut().zip(2..) {
                let power =
                    power_at(frequency, rows.iter().map(|row| f64::from(light.of(row[x]))), &plan.waves);
                samples.push((power / steps as f64) as f32);
            }
        }
    }

    pub fn join(&mut self, other: Self) {
        self.bends.extend(other.bends);
        self.residuals.resize(self.residuals.len().max(other.residuals.len()), Vec::new());
        for (samples, more) in self.residuals.iter_mut().zip(other.residuals) {
            samples.extend(more);
        }
    }

    /// Variance of an intensity; `None` without samples. Harmonics of the fringes only add to a frequency, so the least of all
    /// frequencies is nearest to the noise.
    fn variance(&mut self, steps: usize) -> Option<f64> {
        let highest = if steps.is_multiple_of(2) { steps / 2 } else { usize::MAX };
        let mut found: Vec<f64> = Vec::new();
        for (samples, frequency) in self.residuals.iter_mut().zip(2..) {
            found.extend(trimmed_mean(samples, if frequency == highest { Law::Square } else { Law::Pair }));
        }
        if steps < RESIDUAL_STEPS_MIN {
            found.extend(trimmed_mean(&mut self.bends, Law::Square));
        }
        found.into_iter().reduce(f64::min)
    }
}

/// Squared size of a frequency of the samples of a pixel.
fn power_at(frequency: usize, samples: impl Iterator<Item = f64>, waves: &[Wave]) -> f64 {
    let (mut real, mut imaginary) = (0.0, 0.0);
    for (s, value) in samples.enumerate() {
        let Wave { cos, sin, .. } = waves[frequency * s % waves.len()];
        real += value * cos;
        imaginary += value * sin;
    }
    real * real + imaginary * imaginary
}

/// Standard deviation of the intensities as a fraction of full scale, from the fringe numbers with the most steps, whose
/// residuals contain the fewest harmonics.
pub(super) fn noise_of(samples: &mut [NoiseSamples], plans: &[SetPlan]) -> f32 {
    let most = plans.iter().map(|plan| plan.waves.len()).max().unwrap_or(0);
    let used = samples.iter_mut().zip(plans).filter(|(_, plan)| plan.waves.len() == most);
    let found: Vec<f64> = used.filter_map(|(samples, _)| samples.variance(most)).collect();
    let mean = found.iter().sum::<f64>() / found.len().max(1) as f64;
    (mean.sqrt() as f32).max(NOISE_MIN)
}

/// How a square of normal values is distributed.
#[derive(Debug, Clone, Copy)]
enum Law {
    /// The square of one normal value.
    Square,
    /// Half the sum of the squares of two normal values.
    Pair,
}

impl Law {
    /// Mean of the smallest [`KEPT_SHARE`] of values whose mean is 1.
    fn kept_mean(self) -> f64 {
        match self {
            // Below the quantile q, the exponential law has the mean (share + (1 - share) ln(1 - share)) / share.
            Self::Pair => (KEPT_SHARE + (1.0 - KEPT_SHARE) * (1.0 - KEPT_SHARE).ln()) / KEPT_SHARE,
            // The quantile is 1.2816^2 for the share 0.8, where the normal density is 0.1755.
            Self::Square => (KEPT_SHARE - 2.0 * 1.281_552 * 0.175_498) / KEPT_SHARE,
        }
    }
}

/// Mean of values, robust against a fifth of greater ones.
fn trimmed_mean(values: &mut [f32], law: Law) -> Option<f64> {
    let kept = (KEPT_SHARE * values.len() as f64) as usize;
    if kept == 0 {
        return None;
    }
    values.select_nth_unstable_by(kept - 1, f32::total_cmp);
    let mut smallest = values[..kept].to_vec();
    // Sums of floats depend on their order, and selection leaves it to the implementation.
    smallest.sort_unstable_by(f32::total_cmp);
    Some(smallest.into_iter().map(f64::from).sum::<f64>() / kept as f64 / law.kept_mean())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values of a law at evenly spread quantiles.
    fn law(inverse: impl Fn(f64) -> f64) -> Vec<f32> {
        (0..20_000).map(|i| inverse((f64::from(i) + 0.5) / 20_000.0) as f32).collect()
    }

    #[test]
    fn the_mean_of_the_smallest_gives_the_mean_of_all() {
        let mut pair = law(|share| -(1.0 - share).ln());
        let found = trimmed_mean(&mut pair, Law::Pair).expect("values");
        assert!((found - 1.0).abs() < 2e-3, "{found}");
        // Squares of a normal value, by summing twelve uniform ones would be inexact: invert its error function by search.
        let mut square = law(|share| {
            let (mut low, mut high) = (0.0f64, 6.0f64);
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                *(if inside(middle) < share { &mut low } else { &mut high }) = middle;
            }
            low * low
        });
        let found = trimmed_mean(&mut square, Law::Square).expect("values");
        assert!((found - 1.0).abs() < 2e-3, "{found}");
        assert!(trimmed_mean(&mut [], Law::Pair).is_none());
    }

    /// Share of a normal law inside `z`, by Simpson's rule.
    fn inside(z: f64) -> f64 {
        let density = |x: f64| (-0.5 * x * x).exp() / TAU.sqrt();
        let step = z / 64.0;
        let weight = |i: i32| if i == 0 || i == 64 { 1.0 } else { f64::from(2 + 2 * (i % 2)) };
        2.0 * step / 3.0 * (0..=64).map(|i| weight(i) * density(step * f64::from(i))).sum::<f64>()
    }
}
