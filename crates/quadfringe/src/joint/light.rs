//! Step 1, planes of linear light (S1), and the fringe period of step 2.

use super::model::has_quadrature;
use super::params::pyramid::{PERIOD_FALLBACK_SHARE, PERIOD_MIN_PX};
use super::pyramid::Level;
use crate::condition::{LIGHT_MAX, Plan, Sample, Saturated};
use crate::stages::{difference_carrier, quadrature_carrier};
use crate::{Reason, Shot};
use multiversion::multiversion;
use ndarray::{ArrayView2, s};
use rayon::prelude::*;

/// Writes the linear light of a shot into the planes of a level, which of its channels are saturated, and which pixels the
/// infrared chip does not see, in rows as wide as those of the level. B alone takes the place of IR, which is dark.
pub(super) fn linear_light<T: Sample>(
    plan: &Plan,
    shot: &Shot<'_, T>,
    [height, width]: [usize; 2],
    ratios: [f32; 4],
    level: &mut Level,
    marks: Marks<'_>,
) {
    let stride = level.lit.len() / height;
    let Marks { saturated, reasons } = marks;
    saturated.resize(stride * height, Saturated::default());
    reasons.resize(stride * height, Reason::Returned);
    let [red, green, blue, infrared] = level.light.each_mut().map(|plane| plane.par_chunks_mut(stride));
    let marks = saturated.par_chunks_mut(stride).zip(reasons.par_chunks_mut(stride));
    let rows = red.zip(green).zip(blue.zip(infrared)).zip(marks).enumerate();
    rows.for_each(|(y, (((red, green), (blue, infrared)), (saturated, reasons)))| {
        let rows = [red, green, blue, infrared].map(|row| &mut row[..width]);
        linear_row(plan, shot, y, rows, &mut saturated[..width], &mut reasons[..width]);
    });
    if !has_quadrature(ratios) {
        level.light.swap(2, 3);
        saturated.par_iter_mut().for_each(|saturated| *saturated = saturated.blue_as_infrared());
    }
}

/// What is known of the pixels of a shot before any fit.
pub(super) struct Marks<'a> {
    pub saturated: &'a mut Vec<Saturated>,
    pub reasons: &'a mut Vec<Reason>,
}

#[multiversion(targets("x86_64+avx2"))]
fn linear_row<T: Sample>(
    plan: &Plan,
    shot: &Shot<'_, T>,
    y: usize,
    mut rows: [&mut [f32]; 4],
    saturated: &mut [Saturated],
    reasons: &mut [Reason],
) {
    plan.saturated_row(shot, y, saturated);
    plan.row(shot, y, &mut rows);
    // The inverse of a response or of crosstalk can raise light without bound.
    rows.iter_mut()
        .flat_map(|row| row.iter_mut())
        .for_each(|light| *light = light.clamp(-LIGHT_MAX, LIGHT_MAX));
    let [.., infrared] = rows;
    for (reason, infrared) in reasons.iter_mut().zip(infrared.iter()) {
        // A pixel that the infrared chip does not see takes no part in any fit.
        *reason = if infrared.is_finite() { Reason::Returned } else { Reason::NoImage };
    }
    plan.continue_infrared(y, infrared);
}

/// Fringe period across the fringes in pixels, from the planes of red and blue, or of three colours with different fringe
/// numbers; a fixed share of the image width if no carrier stands out.
pub(super) fn fringe_period_px(light: &[Vec<f32>; 4], [height, width]: [usize; 2], ratios: [f32; 4]) -> f64 {
    let [red, green, blue, third] = light.each_ref().map(|plane| {
        let stride = plane.len() / height;
        ArrayView2::from_shape((height, stride), plane).expect("a plane is whole").slice_move(s![.., ..width])
    });
    let found = if has_quadrature(ratios) {
        quadrature_carrier(red, blue)
    } else {
        difference_carrier(red, [green, third])
    };
    let found = found.period_px();
    let shorter = width.min(height) as f64;
    if found.is_finite() {
        found.clamp(PERIOD_MIN_PX, shorter.max(2.0 * PERIOD_MIN_PX))
    } else {
        width as f64 * PERIOD_FALLBACK_SHARE
    }
}
