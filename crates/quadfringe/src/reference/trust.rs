//! Step 4: what the phases of the sampled pixels say about all of them: by how much the fringe numbers disagree beyond noise
//! (R7), and how many pixels are strays, whose phases contradict every column (R8).

use super::params::{ROUNDS, STRAYS_MAX, STRAYS_MIN, STRAYS_START};

/// The agreement of the phases at one pixel.
#[derive(Debug, Clone, Copy)]
pub(super) struct Agreement {
    /// Cost of the cheapest order by noise alone.
    pub cost: f32,
    /// Mean variance of the phases by noise alone, in rad^2.
    pub variance_rad2: f32,
}

/// Quantile of the chi square law at the quantile `z` of the normal law, by Wilson and Hilferty (1931); good to 3 %.
pub(super) fn chi_square(freedom: usize, z: f64) -> f64 {
    let freedom = freedom as f64;
    let spread = 2.0 / (9.0 * freedom);
    freedom * (1.0 - spread + z * spread.sqrt()).powi(3)
}

/// Standard deviation of a phase beyond noise in rad, for which the median cost is that of a chi square of `freedom` degrees.
pub(super) fn disagreement_rad(samples: &[Agreement], freedom: usize) -> f32 {
    if samples.is_empty() || freedom == 0 {
        return 0.0;
    }
    let expected = chi_square(freedom, 0.0);
    let mut costs = vec![0.0; samples.len()];
    let mut median = |beyond: f64| {
        for (cost, sample) in costs.iter_mut().zip(samples) {
            let variance = f64::from(sample.variance_rad2);
            *cost = f64::from(sample.cost) * variance / (variance + beyond);
        }
        let middle = costs.len() / 2;
        *costs.select_nth_unstable_by(middle, f64::total_cmp).1
    };
    if median(0.0) <= expected {
        return 0.0;
    }
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..ROUNDS {
        let middle = 0.5 * (low + high);
        *(if median(middle) > expected { &mut low } else { &mut high }) = middle;
    }
    (high.sqrt()) as f32
}

/// Share of strays among pixels with this evidence: the share whose mean probability of a stray it is.
pub(super) fn stray_share(evidence: &[f32]) -> f32 {
    let mut share = STRAYS_START;
    for _ in 0..ROUNDS {
        let probability = |evidence: &f32| share / (share + (1.0 - share) * f64::from(*evidence));
        let mean = evidence.iter().map(probability).sum::<f64>() / evidence.len().max(1) as f64;
        share = mean.clamp(STRAYS_MIN, STRAYS_MAX);
    }
    share as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_disagreement_explains_the_median_cost() {
        // Costs that are ten times those of noise: nine tenths of the variance is disagreement.
        let sample = |i: u32| Agreement { cost: 10.0 * 1.386 * (i as f32 / 500.0), variance_rad2: 1e-4 };
        let samples: Vec<_> = (0..1000).map(sample).collect();
        assert!((disagreement_rad(&samples, 2) - 0.03).abs() < 1e-3);
        assert_eq!(disagreement_rad(&samples[..100], 2), 0.0);
        assert_eq!(disagreement_rad(&[], 2), 0.0);
    }

    #[test]
    fn strays_are_counted() {
        let evidence: Vec<f32> = (0..1000).map(|i| if i % 10 == 0 { 1e-9 } else { 1e4 }).collect();
        assert!((stray_share(&evidence) - 0.1).abs() < 1e-3);
        assert!(stray_share(&[1e4; 50]) < 1e-4);
    }
}
