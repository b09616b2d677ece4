//! Estimate of the response of projector and camera from an N-step capture, without ground truth.
//!
//! The phase of N steps over one period hardly depends on the response; the phase of two steps a quarter period apart
//! does. The estimate is the response whose inverse makes the two phases agree. Their difference is the error of a
//! single-shot measurement, so noise and nonlinearity have the same weights as in a measurement. On noisy captures the
//! exponent is therefore slightly above 1 / gamma. On gamma in fringe projection: Guo, He and Chen, "Gamma correction for
//! digital fringe projection profilometry", Applied Optics 43, 2906 (2004).

mod order;
mod samples;
mod select;
mod shot;
mod simplex;
mod tile_phase;
mod uncertainty;

use super::params::{
    EXPONENTS, KNEE_GAIN, KNEE_GAIN_RAD2, KNEE_MAX, OFFSET_MAX, OFFSET_MAX_LEAST, START_EXPONENT, START_KNEE,
    START_OFFSET, STEP_EXPONENT, STEP_KNEE, STEP_OFFSET, STEPS_MIN,
};
use super::{Response, Sample};
use crate::{Error, Result};
use ndarray::ArrayView3;
use order::{check_order, root_mean_square};
use samples::Samples;
use select::select;
pub use shot::estimate_response_of_shot;
use simplex::minimise;
use uncertainty::{exponent_sd, second_harmonic};

/// An estimated response and its quality.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct ResponseEstimate {
    /// Inverse response, ready for a conditioner.
    pub response: Response,
    /// RMS error of the two-step phase from the captured intensities, rad.
    pub two_step_rms_before_rad: f64,
    /// RMS error of the two-step phase after the response is inverted, rad. Noise and drift remain.
    pub two_step_rms_after_rad: f64,
    /// Number of pixels (or tiles) that the estimate uses.
    pub pixels: usize,
    /// Standard error of the exponent, from the scatter of the pixels (or tiles).
    pub exponent_sd: f64,
    /// Second harmonic of the fringes over the first, from the captured intensities: positive for a gamma above 1.
    pub second_harmonic_before: f64,
    /// The same after the response is inverted. The sign of `second_harmonic_before` means too little correction, the
    /// other one too much.
    pub second_harmonic_after: f64,
}

/// Inverse response from stacks of equally spaced phase steps over one period, each `(steps, rows, columns)`, in
/// fractions of full scale (255 of 8 bit is 1.0). Subtract the dark level before, if it is known.
///
/// Take at least five steps; a multiple of four (8, 12, 16) separates the harmonics best. Several stacks of the same size
/// and exposure are pooled; their fringe numbers and objects may differ. Any object works; one with dark and bright areas
/// that fills the image without saturation works best. The knee is 0 unless the captures show one. The result does not
/// depend on the number of threads.
///
/// # Errors
/// [`Error::Value`] for no stack, fewer than 5 steps, intensities outside [0, 1], fewer than 1000 usable pixels (too
/// dark, saturated, without fringes) or images out of order; [`Error::Shape`] when stacks differ in size;
/// [`Error::NotFinite`] for NaN or infinity.
///
/// ```
/// use ndarray::Array3;
/// use quadfringe::condition::estimate_response;
/// use std::f32::consts::TAU;
/// let stack = Array3::from_shape_fn((12, 40, 50), |(s, y, x)| {
///     let albedo = 0.5 + 0.01 * y as f32;
///     let projected = 0.5 + 0.4 * (0.3 * x as f32 + TAU * s as f32 / 12.0).cos();
///     albedo * projected.powf(2.2)
/// });
/// let estimate = estimate_response(&[stack.view()])?;
/// assert!((estimate.response.exponent - 1.0 / 2.2).abs() < 0.01);
/// assert!(estimate.two_step_rms_after_rad < 0.01);
/// # Ok::<(), quadfringe::Error>(())
/// ```
pub fn estimate_response(stacks: &[ArrayView3<'_, f32>]) -> Result<ResponseEstimate> {
    check(stacks)?;
    let traces = select(stacks)?;
    let offset_max = offset_bound(&traces);
    let samples = Samples::new(&traces);
    let response = fit(&samples, offset_max);
    let before = samples.rms_rad(&Response::default());
    let after = samples.rms_rad(&response);
    check_order(&after)?;
    Ok(ResponseEstimate {
        response,
        two_step_rms_before_rad: root_mean_square(&before),
        two_step_rms_after_rad: root_mean_square(&after),
        pixels: samples.len(),
        exponent_sd: exponent_sd(&samples, &response, 1.0),
        second_harmonic_before: second_harmonic(&traces, &Response::default()),
        second_harmonic_after: second_harmonic(&traces, &response),
    })
}

/// Offset, exponent and knee with the least cost. The knee is 0 unless it lowers the cost enough.
fn fit(samples: &Samples, offset_max: f64) -> Response {
    let cost = |trial: Trial| {
        if trial.is_inside(offset_max) { samples.cost(&trial.response()) } else { f64::INFINITY }
    };
    let with_knee = |[offset, exponent, knee]: [f64; 3]| Trial { offset, exponent, knee };
    let without = |[offset, exponent]: [f64; 2]| Trial { offset, exponent, knee: 0.0 };
    let [offset, step] = [START_OFFSET, STEP_OFFSET].map(|offset| offset.min(offset_max / 2.0));
    let (start, steps) = ([offset, START_EXPONENT, START_KNEE], [step, STEP_EXPONENT, STEP_KNEE]);
    let bent = minimise(start, steps, |point| cost(with_knee(point)));
    let plain = minimise([offset, START_EXPONENT], [step, STEP_EXPONENT], |point| cost(without(point)));
    if plain.cost * (1.0 - KNEE_GAIN) <= bent.cost + KNEE_GAIN_RAD2 {
        without(plain.point).response()
    } else {
        with_knee(bent.point).response()
    }
}

/// A response that the search tries, in double precision.
#[derive(Clone, Copy)]
struct Trial {
    offset: f64,
    exponent: f64,
    knee: f64,
}

impl Trial {
    fn is_inside(self, offset_max: f64) -> bool {
        (0.0..=offset_max).contains(&self.offset)
            && EXPONENTS.contains(&self.exponent)
            && (0.0..=KNEE_MAX).contains(&self.knee)
    }

    fn response(self) -> Response {
        let Self { offset, exponent, knee } = self;
        Response { offset: offset as f32, exponent: exponent as f32, knee: knee as f32 }
    }
}

/// Greatest offset that is tried: the first percentile over the pixels of their darkest step, so that few pixels become
/// negative.
fn offset_bound(traces: &[samples::Trace<'_>]) -> f64 {
    let darkest = |t: &samples::Trace<'_>| t.steps.iter().copied().fold(1.0, f32::min);
    let mut floor: Vec<f32> = traces.iter().map(darkest).collect();
    floor.sort_by(f32::total_cmp);
    f64::from(floor[floor.len() / 100]).clamp(OFFSET_MAX_LEAST, OFFSET_MAX)
}

fn check(stacks: &[ArrayView3<'_, f32>]) -> Result<()> {
    let Some(first) = stacks.first() else {
        return Err(Error::value("stacks", "at least one stack of phase steps", "none"));
    };
    for (i, stack) in stacks.iter().enumerate() {
        if stack.shape() != first.shape() {
            return Err(Error::shape(format!("stack {i}"), first.shape(), stack.shape()));
        }
        if stack.shape()[0] < STEPS_MIN {
            let expected = format!("at least {STEPS_MIN} phase steps along the first axis, best 8, 12 or 16");
            return Err(Error::value(format!("stack {i}"), expected, stack.shape()[0]));
        }
        for (s, image) in stack.outer_iter().enumerate() {
            f32::greatest(&image, &format!("stack {i}, step {s}"))?;
            if let Some(value) = image.iter().find(|v| !(0.0..=1.0).contains(*v)) {
                let expected = "fractions of full scale in [0, 1] (divide 8 bit by 255, 12 bit by 4095, 16 bit by 65535)";
                return Err(Error::value(format!("stack {i}, step {s}"), expected, value));
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests;
