//! Whether the images of a stack are what their places say.

use crate::{Error, Result};

/// Two-step error that may remain after correction, rad; captures in order leave about 0.03.
const RMS_MAX_RAD: f64 = 0.3;
/// One step may err this many times the median step, and this much beyond it, before it is out of place.
const STEP_EXCESS: f64 = 2.0;
const STEP_EXCESS_RAD: f64 = 0.12;
/// What every stack has to be.
const ORDERED: &str =
    "images in the order of their phase steps, I_s = a + b cos(Phi + 2 pi s / N), s = 0..N-1";

/// Whatever the response, a stack in order leaves a small error and no step stands out.
///
/// # Errors
/// [`Error::Value`] that names the step to look at.
pub(super) fn check_order(rms_rad: &[f64]) -> Result<()> {
    let total = root_mean_square(rms_rad);
    let mut sorted = rms_rad.to_vec();
    sorted.sort_by(f64::total_cmp);
    let median = sorted[sorted.len() / 2];
    let (step, worst) = suspect(rms_rad);
    let excess = (worst * worst - median * median).max(0.0).sqrt();
    if total <= RMS_MAX_RAD && (worst <= STEP_EXCESS * median || excess <= STEP_EXCESS_RAD) {
        return Ok(());
    }
    let found = format!(
        "images that no response explains: two steps give a phase {total:.2} rad (RMS) off that of all steps, \
         {worst:.2} rad with step {step} and {median:.2} rad with the median step; look for images that are swapped, \
         missing or doubled near step {step}, a scene or exposure that changed, or noise as strong as the fringes"
    );
    Err(Error::value("stack", ORDERED, found))
}

/// The refusal of a stack most of whose pixels vary in another way than fringes do.
pub(super) fn disordered(disordered: usize, usable: usize) -> Error {
    let found = format!(
        "{disordered} pixels that vary otherwise and {usable} that vary so; sort the images by their phase step, give \
         one whole period of one fringe frequency, and keep the scene still"
    );
    Error::value("stack", ORDERED, found)
}

/// The step most likely to be out of place and its RMS error: it errs both as first step and as partner.
fn suspect(rms_rad: &[f64]) -> (usize, f64) {
    let n = rms_rad.len();
    let both = |s: usize| rms_rad[s].hypot(rms_rad[(s + n - n / 4) % n]);
    let step = (0..n).max_by(|&a, &b| both(a).total_cmp(&both(b)));
    step.map_or((0, 0.0), |s| (s, rms_rad[s]))
}

pub(super) fn root_mean_square(values: &[f64]) -> f64 {
    (values.iter().map(|r| r * r).sum::<f64>() / values.len() as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_step_out_of_place_is_named() {
        let mut rms_rad = [0.03; 12];
        assert!(check_order(&rms_rad).is_ok());
        (rms_rad[7], rms_rad[4]) = (0.3, 0.3);
        let text = check_order(&rms_rad).unwrap_err().to_string();
        assert!(text.contains("near step 7"), "{text}");
    }
}
