//! Checks that the images of a stack are in the order of their phase steps.

use crate::condition::params::{RMS_MAX_RAD, STEP_EXCESS, STEP_EXCESS_RAD};
use crate::{Error, Result};

/// The requirement on every stack, for error messages.
const ORDERED: &str =
    "images in the order of their phase steps, I_s = a + b cos(Phi + 2 pi s / N), s = 0..N-1";

/// Checks that the two-step error is small and that no step has a much larger error than the others. Both hold for an
/// ordered stack after its response is corrected.
///
/// # Errors
/// [`Error::Value`], which names the suspicious step.
pub(super) fn check_order(rms_rad: &[f64]) -> Result<()> {
    let total = root_mean_square(rms_rad);
    let mut sorted = rms_rad.to_vec();
    sorted.sort_by(f64::total_cmp);
    let median = sorted[sorted.len() / 2];
    let Suspect { step, rms_rad: worst } = suspect(rms_rad);
    let excess = (worst * worst - median * median).max(0.0).sqrt();
    if total <= RMS_MAX_RAD && (worst <= STEP_EXCESS * median || excess <= STEP_EXCESS_RAD) {
        return Ok(());
    }
    let found = format!(
        "images that no response explains: the two-step phase differs by {total:.2} rad (RMS) from that of all steps, by \
         {worst:.2} rad with step {step} and by {median:.2} rad with the median step; look for images that are swapped, \
         missing or doubled near step {step}, a scene or exposure that changed, or noise as strong as the fringes"
    );
    Err(Error::value("stack", ORDERED, found))
}

/// Error for a stack in which too many pixels do not vary as fringes do.
pub(super) fn disordered(disordered: usize, usable: usize) -> Error {
    let found = format!(
        "{disordered} pixels that do not vary in this order and {usable} that do; sort the images by their phase step, give \
         one whole period of one fringe frequency, and keep the scene still"
    );
    Error::value("stack", ORDERED, found)
}

/// The step that is most likely out of order, and the RMS error of its two-step phase.
struct Suspect {
    step: usize,
    rms_rad: f64,
}

/// Finds the step that is most likely out of order: such a step causes a large error both as the first of two steps and
/// as the second.
fn suspect(rms_rad: &[f64]) -> Suspect {
    let n = rms_rad.len();
    let both = |s: usize| rms_rad[s].hypot(rms_rad[(s + n - n / 4) % n]);
    let step = (0..n).max_by(|&a, &b| both(a).total_cmp(&both(b)));
    step.map_or(Suspect { step: 0, rms_rad: 0.0 }, |step| Suspect { step, rms_rad: rms_rad[step] })
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
