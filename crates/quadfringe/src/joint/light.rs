//! Step 1, planes of linear light (S1), and the fringe period of step 2.

use super::model::has_quadrature;
use super::params::pyramid::{PERIOD_FALLBACK_SHARE, PERIOD_MIN_PX};
use super::pyramid::Level;
use crate::condition::{Plan, Sample};
use crate::stages::{difference_carrier, quadrature_carrier};
use crate::{Reason, Shot};
use multiversion::multiversion;
use ndarray::{ArrayView2, s};
use rayon::prelude::*;

/// Writes the linear light of a shot into the planes of a level. The mask `lit` becomes 0 for glare and for pixels that the
/// infrared chip does not see; the mask `usable` becomes 0 also for saturated pixels. `reasons` tells one from the other, in
/// rows as wide as those of the level. B alone takes the place of IR, which is dark.
pub(super) fn linear_light<T: Sample>(
    plan: &Plan,
    shot: &Shot<'_, T>,
    shape: [usize; 2],
    ratios: [f32; 4],
    level: &mut Level,
    reasons: &mut Vec<Reason>,
) {
    let [height, width] = shape;
    let stride = level.lit.len() / height;
    let Level { light, lit, usable, .. } = level;
    reasons.resize(lit.len(), Reason::Returned);
    let [red, green, blue, infrared] = light.each_mut().map(|plane| plane.par_chunks_mut(stride));
    let masks = usable.par_chunks_mut(stride).zip(lit.par_chunks_mut(stride));
    let masks = masks.zip(reasons.par_chunks_mut(stride));
    let rows = red.zip(green).zip(blue.zip(infrared)).zip(masks).enumerate();
    rows.for_each_init(
        || Saturation { unsaturated: vec![false; width], glare: vec![false; width] },
        |saturation, (y, (((red, green), (blue, infrared)), ((usable, lit), reasons)))| {
            let rows = [red, green, blue, infrared].map(|row| &mut row[..width]);
            let [usable, lit] = [usable, lit].map(|row| &mut row[..width]);
            let masks = MaskRows { usable, lit, reasons: &mut reasons[..width] };
            linear_row(plan, shot, y, saturation, rows, masks);
        },
    );
    if !has_quadrature(ratios) {
        light.swap(2, 3);
    }
}

/// Saturation of a row of pixels.
struct Saturation {
    unsaturated: Vec<bool>,
    glare: Vec<bool>,
}

/// The masks of a row of pixels.
struct MaskRows<'a> {
    usable: &'a mut [f32],
    lit: &'a mut [f32],
    reasons: &'a mut [Reason],
}

#[multiversion(targets("x86_64+avx2"))]
fn linear_row<T: Sample>(
    plan: &Plan,
    shot: &Shot<'_, T>,
    y: usize,
    saturation: &mut Saturation,
    mut rows: [&mut [f32]; 4],
    masks: MaskRows<'_>,
) {
    let Saturation { unsaturated, glare } = saturation;
    plan.saturation_row(shot, y, unsaturated, glare);
    plan.row(shot, y, &mut rows);
    let [.., infrared] = rows;
    let MaskRows { usable, lit, reasons } = masks;
    let masks = usable.iter_mut().zip(lit).zip(reasons).zip(unsaturated.iter().zip(glare.iter()));
    for (infrared, (((usable, lit), reason), (unsaturated, glare))) in infrared.iter().zip(masks) {
        // A pixel that the infrared chip does not see takes no part in any fit.
        let seen = infrared.is_finite();
        *usable = if seen & *unsaturated { 1.0 } else { 0.0 };
        *lit = if seen & !*glare { 1.0 } else { 0.0 };
        let blind = if seen { Reason::Saturated } else { Reason::NoImage };
        *reason = if seen & *unsaturated { Reason::Returned } else { blind };
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
