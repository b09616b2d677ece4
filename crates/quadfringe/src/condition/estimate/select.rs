//! Selection of the pixels for the estimate, and the reasons if there are too few.

use super::order;
use super::samples::Trace;
use crate::condition::params::{
    BRIGHT_MAX, DISORDER, PIXELS_MAX, PIXELS_MIN, SPILL_PX, STACK_MODULATION_MIN, USABLE_PER_DISORDERED,
};
use crate::{Error, Result};
use ndarray::{Array2, ArrayView1, ArrayView2, ArrayView3, Axis, s};
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Whether a pixel can be used, or why it cannot.
#[derive(Clone, Copy)]
pub(super) enum Mark {
    Usable([f32; 2]),
    Saturated,
    Dark,
    Flat,
    Disordered,
}

/// The usable pixels of all stacks, thinned by a fixed stride.
///
/// # Errors
/// [`Error::Value`] with the reasons when fewer than 1000 pixels are left, or when too many pixels do not vary as
/// fringes do.
pub(super) fn select<'a>(stacks: &'a [ArrayView3<'a, f32>]) -> Result<Vec<Trace<'a>>> {
    let marks: Vec<Array2<Mark>> = stacks.iter().map(marks_of).collect();
    let usable: Vec<Trace<'a>> = stacks
        .iter()
        .zip(&marks)
        .flat_map(|(stack, marks)| marks.indexed_iter().map(move |at| (stack, at)))
        .filter_map(|(stack, ((y, x), mark))| match mark {
            Mark::Usable(harmonic) => Some(Trace { steps: stack.slice(s![.., y, x]), harmonic: *harmonic }),
            _ => None,
        })
        .collect();
    check_enough(&marks, usable.len())?;
    let stride = usable.len().div_ceil(PIXELS_MAX);
    Ok(usable.into_iter().step_by(stride).collect())
}

fn marks_of(stack: &ArrayView3<'_, f32>) -> Array2<Mark> {
    let (steps, rows, columns) = stack.dim();
    let waves = waves(steps);
    let peak = stack.fold_axis(Axis(0), 0.0f32, |&a, &b| a.max(b));
    let mut marks = Array2::from_elem((rows, columns), Mark::Flat);
    let mut lines: Vec<_> = marks.outer_iter_mut().collect();
    lines.par_iter_mut().enumerate().for_each(|(y, line)| {
        for (x, mark) in line.iter_mut().enumerate() {
            *mark = match mark_of(stack.slice(s![.., y, x]), &waves, peak[[y, x]], STACK_MODULATION_MIN) {
                Mark::Usable(_) if spilled(&peak.view(), y, x) => Mark::Saturated,
                other => other,
            };
        }
    });
    marks
}

/// Weights of the steps in the cosine and the sine of the first harmonic.
pub(super) fn waves(steps: usize) -> Vec<[f32; 2]> {
    (0..steps)
        .map(|s| (TAU * s as f64 / steps as f64).sin_cos())
        .map(|(sin, cos)| [2.0 * cos / steps as f64, -2.0 * sin / steps as f64].map(|w| w as f32))
        .collect()
}

pub(super) fn mark_of(
    steps: ArrayView1<'_, f32>,
    waves: &[[f32; 2]],
    peak: f32,
    modulation_min: f32,
) -> Mark {
    if peak >= BRIGHT_MAX {
        return Mark::Saturated;
    }
    let mean = steps.sum() / steps.len() as f32;
    let (mut harmonic, mut variance) = ([0.0f32; 2], 0.0f32);
    for (value, wave) in steps.iter().zip(waves) {
        let change = value - mean;
        harmonic[0] += change * wave[0];
        harmonic[1] += change * wave[1];
        variance += change * change / steps.len() as f32;
    }
    let power = harmonic[0] * harmonic[0] + harmonic[1] * harmonic[1];
    // The limit is four times the variance of the faintest usable fringes, so that noise on faint fringes does not
    // count as disorder.
    let strong = variance > 2.0 * modulation_min * modulation_min;
    if strong && variance - power / 2.0 > DISORDER * variance {
        Mark::Disordered
    } else if power > modulation_min * modulation_min {
        Mark::Usable(harmonic)
    } else if peak < 2.0 * modulation_min {
        Mark::Dark
    } else {
        Mark::Flat
    }
}

fn spilled(peak: &ArrayView2<'_, f32>, y: usize, x: usize) -> bool {
    let near = |i: usize, end: usize| i.saturating_sub(SPILL_PX)..(i + SPILL_PX + 1).min(end);
    let (ys, xs) = (near(y, peak.nrows()), near(x, peak.ncols()));
    peak.slice(s![ys, xs]).iter().any(|&p| p >= BRIGHT_MAX)
}

fn check_enough(marks: &[Array2<Mark>], usable: usize) -> Result<()> {
    let count = |is: fn(&Mark) -> bool| marks.iter().flatten().filter(|&m| is(m)).count();
    let disordered = count(|m| matches!(m, Mark::Disordered));
    if disordered > (usable + PIXELS_MIN) / USABLE_PER_DISORDERED {
        return Err(order::disordered(disordered, usable));
    }
    if usable >= PIXELS_MIN {
        return Ok(());
    }
    let reasons = [
        (
            count(|m| matches!(m, Mark::Saturated)),
            "saturated or next to a saturated pixel (shorten the exposure)",
        ),
        (count(|m| matches!(m, Mark::Dark)), "too dark (lengthen the exposure)"),
        (
            count(|m| matches!(m, Mark::Flat)),
            "lit but without fringes (check that the projector shows sharp fringes, and dim the room light)",
        ),
        (disordered, "not sinusoidal over the steps (check the order of the images)"),
    ];
    let listed = reasons.iter().filter(|(n, _)| *n > 0).map(|(n, why)| format!("{n} {why}"));
    let found = format!("{usable}; {}", listed.collect::<Vec<_>>().join(", "));
    let expected = format!(
        "at least {PIXELS_MIN} pixels with a fringe amplitude above {STACK_MODULATION_MIN} of full scale and no step above {BRIGHT_MAX:.2}"
    );
    Err(Error::value("stack", expected, found))
}
