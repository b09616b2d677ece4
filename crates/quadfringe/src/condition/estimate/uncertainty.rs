//! Standard error of an estimated exponent, and the second harmonic that the light keeps.
//!
//! The estimate minimises a sum over tiles, each of which pulls it a little. Its covariance follows from the scatter of
//! these pulls and from the curvature of the sum (the sandwich of M-estimators: Huber and Ronchetti, "Robust Statistics",
//! 2009), so that texture counts as it is and no model of the noise is needed.

use super::samples::{Samples, Trace};
use super::{Response, Trial};
use crate::condition::params::{DIFFERENCE_EXPONENT, DIFFERENCE_OFFSET, HARMONIC_OF_TEXTURE};
use std::f64::consts::TAU;

/// Standard error of the exponent of a response that fits these samples; infinite when they do not determine it.
///
/// `copies` is the number of samples that see the same pixels, as overlapping tiles do.
pub(super) fn exponent_sd(samples: &Samples, response: &Response, copies: f64) -> f64 {
    let costs = |de: f64, d_offset: f64| {
        let trial = Trial {
            offset: f64::from(response.offset) + d_offset,
            exponent: f64::from(response.exponent) + de,
            knee: f64::from(response.knee),
        };
        samples.costs(&trial.response())
    };
    let step = [DIFFERENCE_EXPONENT * f64::from(response.exponent), DIFFERENCE_OFFSET];
    let (middle, up, down) = (costs(0.0, 0.0), costs(step[0], 0.0), costs(-step[0], 0.0));
    let along_exponent = Pull::new(&middle, &up, &down, step[0]);
    let alone = copies * along_exponent.square(&along_exponent) / along_exponent.curvature.powi(2);
    let alone = if along_exponent.curvature > 0.0 { alone.sqrt() } else { f64::INFINITY };
    if f64::from(response.offset) <= step[1] {
        return alone; // the offset is at its bound, where it cannot move along
    }
    let along_offset = Pull::new(&middle, &costs(0.0, step[1]), &costs(0.0, -step[1]), step[1]);
    let corner = |a: f64, b: f64| costs(a * step[0], b * step[1]).iter().sum::<f64>();
    let mixed = (corner(1.0, 1.0) - corner(1.0, -1.0) - corner(-1.0, 1.0) + corner(-1.0, -1.0))
        / (4.0 * step[0] * step[1]);
    let [a, d] = [along_exponent.curvature, along_offset.curvature];
    let determinant = a * d - mixed * mixed;
    if a <= 0.0 || d <= 0.0 || determinant <= 0.0 {
        return alone;
    }
    // The exponent moves by the first row of the inverse curvature times the pulls.
    let (weight, other) = (d / determinant, -mixed / determinant);
    let variance = weight * weight * along_exponent.square(&along_exponent)
        + 2.0 * weight * other * along_exponent.square(&along_offset)
        + other * other * along_offset.square(&along_offset);
    (copies * variance.max(0.0)).sqrt().max(alone)
}

/// Slopes of the costs of all samples along one number of the response, and the curvature of their sum.
struct Pull {
    slopes: Vec<f64>,
    curvature: f64,
}

impl Pull {
    fn new(middle: &[f64], up: &[f64], down: &[f64], step: f64) -> Self {
        let slopes: Vec<f64> = up.iter().zip(down).map(|(u, d)| (u - d) / (2.0 * step)).collect();
        let bend = |((m, u), d): ((&f64, &f64), &f64)| u - 2.0 * m + d;
        let curvature = middle.iter().zip(up).zip(down).map(bend).sum::<f64>() / (step * step);
        Self { slopes, curvature }
    }

    /// Sum of the products of the slopes, which are zero on average at the minimum.
    fn square(&self, other: &Self) -> f64 {
        let n = self.slopes.len() as f64;
        let mean = |slopes: &[f64]| slopes.iter().sum::<f64>() / n;
        let (a, b) = (mean(&self.slopes), mean(&other.slopes));
        self.slopes.iter().zip(&other.slopes).map(|(x, y)| (x - a) * (y - b)).sum()
    }
}

/// Second harmonic of a trace over its first, relative to the phase of the first.
struct Harmonic {
    /// In the phase in which a power of light has it: positive for a gamma above 1, negative below. Texture has either sign.
    aligned: f64,
    /// A quarter period from there, where texture has it and a response has not.
    across: f64,
}

/// Median over the traces of the second harmonic over the first, in the phase in which a power of light has it. 0 without
/// traces.
pub(super) fn second_harmonic(traces: &[Trace<'_>], response: &Response) -> f64 {
    median(harmonics(traces, response).map(|harmonic| harmonic.aligned).collect())
}

/// Second harmonic over the first that the texture of these traces may pretend. 0 without traces.
pub(super) fn harmonic_of_texture(traces: &[Trace<'_>], response: &Response) -> f64 {
    let across = harmonics(traces, response).map(|harmonic| harmonic.across.abs());
    HARMONIC_OF_TEXTURE * median(across.collect()).powi(2)
}

fn median(mut values: Vec<f64>) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

fn harmonics(traces: &[Trace<'_>], response: &Response) -> impl Iterator<Item = Harmonic> {
    traces.iter().filter_map(|trace| harmonic_of(trace, response))
}

fn harmonic_of(trace: &Trace<'_>, response: &Response) -> Option<Harmonic> {
    let (mut first, mut second) = ([0.0f64; 2], [0.0f64; 2]);
    let steps = trace.steps.len() as f64;
    for (s, &value) in trace.steps.iter().enumerate() {
        let light = f64::from(response.linear(value));
        let (sin, cos) = (TAU * s as f64 / steps).sin_cos();
        let (sin2, cos2) = (2.0 * sin * cos, cos * cos - sin * sin);
        first = [first[0] + light * cos, first[1] - light * sin];
        second = [second[0] + light * cos2, second[1] - light * sin2];
    }
    let power = first[0] * first[0] + first[1] * first[1];
    // second conj(first^2), over the cube of the length of first
    let square = [first[0] * first[0] - first[1] * first[1], 2.0 * first[0] * first[1]];
    let over = power.powf(1.5);
    (power > 0.0).then(|| Harmonic {
        aligned: (second[0] * square[0] + second[1] * square[1]) / over,
        across: (second[1] * square[0] - second[0] * square[1]) / over,
    })
}

/// The response between linear light and an estimate whose light keeps no second harmonic, if the estimate turns its sign.
///
/// Room light and offsets bend the fit: it may go beyond the exponent at which the fringes are sinusoidal.
pub(super) fn without_excess(traces: &[Trace<'_>], found: Response, least: f64) -> Response {
    let at = |exponent: f32| second_harmonic(traces, &Response { exponent, ..found });
    let (before, after) = (at(1.0), at(found.exponent));
    if before * after >= 0.0 || after.abs() <= least {
        return found;
    }
    let (mut near, mut far) = (1.0f32, found.exponent);
    for _ in 0..12 {
        let middle = f32::midpoint(near, far);
        if at(middle) * before > 0.0 { near = middle } else { far = middle }
    }
    Response { exponent: f32::midpoint(near, far), ..found }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::{Array1, Array2};

    fn stack(gamma: f64, ambient: f64) -> Array1<f32> {
        Array1::from_shape_fn(16, |s| {
            let light = 0.5 + 0.45 * (0.3 + TAU * s as f64 / 16.0).cos();
            (ambient + 0.9 * light.powf(gamma)) as f32
        })
    }

    fn traces(stacks: &Array2<f32>) -> Vec<Trace<'_>> {
        let harmonic = [0.3f32.cos(), 0.3f32.sin()];
        stacks.outer_iter().map(|steps| Trace { steps, harmonic }).collect()
    }

    #[test]
    fn the_sign_of_the_second_harmonic_is_that_of_the_gamma() {
        for (gamma, sign) in [(2.2, 1.0), (0.6, -1.0)] {
            let bent = stack(gamma, 0.0).insert_axis(ndarray::Axis(0));
            let harmonic = second_harmonic(&traces(&bent), &Response::default());
            assert!(harmonic * sign > 0.1, "{gamma} {harmonic}");
            let straight = Response { exponent: (1.0 / gamma) as f32, ..Response::default() };
            assert!(second_harmonic(&traces(&bent), &straight).abs() < 1e-4);
        }
    }

    #[test]
    fn only_texture_has_a_second_harmonic_across() {
        let bent = stack(1.8, 0.0).insert_axis(ndarray::Axis(0));
        assert!(harmonic_of_texture(&traces(&bent), &Response::default()) < 1e-6);
        let across = |s: usize| 0.03 * (0.6 + TAU * s as f64 / 8.0).sin() as f32;
        let textured = Array2::from_shape_fn((1, 16), |(_, s)| bent[[0, s]] + across(s));
        assert!(harmonic_of_texture(&traces(&textured), &Response::default()) > 0.01);
    }

    #[test]
    fn a_correction_that_goes_too_far_is_taken_back() {
        let bent = stack(1.6, 0.0).insert_axis(ndarray::Axis(0));
        let kept = without_excess(&traces(&bent), Response { exponent: 0.4, ..Response::default() }, 0.01);
        assert!((kept.exponent - 1.0 / 1.6).abs() < 1e-3, "{kept:?}");
        let mild = Response { exponent: 0.7, ..Response::default() };
        assert_eq!(without_excess(&traces(&bent), mild, 0.01), mild);
    }

    #[test]
    fn more_samples_determine_the_exponent_better() {
        let sd = |count: usize| {
            let scattered = |i: usize| 1.6 + 0.1 * ((i * 37 % 11) as f64 / 5.0 - 1.0);
            let mut stacks = Array2::zeros((count, 16));
            for (i, mut row) in stacks.outer_iter_mut().enumerate() {
                row.assign(&stack(scattered(i), 0.0));
            }
            let response = Response { exponent: 1.0 / 1.6, ..Response::default() };
            exponent_sd(&Samples::new(&traces(&stacks)), &response, 1.0)
        };
        let ratio = sd(110) / sd(440);
        assert!((ratio - 2.0).abs() < 0.1, "{ratio}");
        // The exponents of single samples scatter by 0.025.
        assert!((sd(110) * 110f64.sqrt() - 0.025).abs() < 0.01, "{}", sd(110));
    }
}
