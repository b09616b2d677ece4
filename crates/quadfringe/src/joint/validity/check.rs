//! Limits of the pixels of a row by themselves and with their eight neighbours.

use super::evidence::{Evidence, Limits};
use super::regrow::Consistent;
use crate::Reason;
use crate::decode::output::hole_unless;
use crate::joint::neighbours::{around, sum_of_nine};
use crate::joint::params::validity::{
    MISFIT_MAX, PIXEL_MISFIT_MAX, PIXEL_RESIDUAL_NOISES_MAX, RESIDUAL_NOISES_MAX,
};
use crate::joint::scene::Scene;
use multiversion::multiversion;

/// Input of the check of one row.
pub(super) struct CheckRow<'a> {
    /// Of the rows above, at and below.
    squared_residual: [&'a [f32]; 3],
    /// Modulation by the albedo of the neighbourhood.
    modulation: &'a [f32],
    /// Modulation by the albedo of the pixel.
    pixel_modulation: &'a [f32],
    /// Variance of the noise relative to that of the shot.
    noise: &'a [f32],
    order_quality: &'a [f32],
    /// Whether the cells of the energy around a pixel lie on one surface.
    on_one_surface: &'a [bool],
}

impl<'a> CheckRow<'a> {
    /// Row `y` of a scene, with the variance of the noise and the quality of the orders along it.
    pub fn of(
        scene: &Scene<'_>,
        evidence: Evidence<'a>,
        y: usize,
        noise: &'a [f32],
        quality: &'a [f32],
        on_one_surface: &'a [bool],
    ) -> Self {
        let Evidence { map, pixel, .. } = evidence;
        let (height, width) = (scene.grid.height, scene.grid.width);
        Self {
            squared_residual: around(y, height).map(|y| &pixel.squared_residual[y * width..][..width]),
            modulation: &scene.row(map.modulation, y)[..width],
            pixel_modulation: &pixel.modulation[y * width..][..width],
            noise: &noise[..width],
            order_quality: &quality[..width],
            on_one_surface: &on_one_surface[..width],
        }
    }
}

/// Verdicts on the pixels of a row.
pub(super) struct VerdictRow<'a> {
    pub quality: &'a mut [f32],
    /// First not 0 for pixels at or next to an order jump.
    pub passed: &'a mut [u8],
    pub consistent: &'a mut [Consistent],
    /// Why a pixel with fringes is not valid, if it is not; other reasons stay.
    pub reasons: &'a mut [Reason],
}

/// A pixel passes if its order has enough quality, it lies at no order jump, and the residuals of it and its neighbours are small; a
/// wrong order leaves residuals in G and IR. It is consistent if its residual alone is small, or if it lies on one surface with the cells
/// around and its order has enough quality: their light determines its phase, and print that is finer than the windows of the photometry
/// may leave any residual, or have spoilt the phase from which the energy has moved it.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
pub(super) fn check_row(
    known: &CheckRow,
    limits: Limits,
    [spare, sums]: [&mut Vec<f32>; 2],
    out: VerdictRow,
) {
    let width = known.modulation.len();
    sums.resize(width, 0.0);
    sum_of_nine(known.squared_residual, width, spare, sums);
    let (here, near) = (&known.squared_residual[1][..width], &sums[..width]);
    let (modulation, pixel_modulation) = (&known.modulation[..width], &known.pixel_modulation[..width]);
    let noise = &known.noise[..width];
    let (order_quality, on_one_surface) = (&known.order_quality[..width], &known.on_one_surface[..width]);
    let (quality, passed, consistent) =
        (&mut out.quality[..width], &mut out.passed[..width], &mut out.consistent[..width]);
    let reasons = &mut out.reasons[..width];
    let floors = [RESIDUAL_NOISES_MAX, PIXEL_RESIDUAL_NOISES_MAX]
        .map(|most| (most * limits.noise) * (most * limits.noise));
    for x in 0..width {
        let lit = modulation[x] > 0.0;
        let share = MISFIT_MAX * modulation[x];
        let pixel_share = PIXEL_MISFIT_MAX * pixel_modulation[x];
        let agrees = near[x] <= 9.0 * (floors[0] * noise[x] + share * share)
            && here[x] <= floors[1] * noise[x] + pixel_share * pixel_share;
        // The energy has moved the phase too far for the pixel to pass by itself.
        let moved = reasons[x] == Reason::Misfit;
        quality[x] = order_quality[x] + hole_unless(lit | moved);
        let certain = (lit | moved) & (order_quality[x] >= limits.quality_min);
        let apart = passed[x] != 0;
        passed[x] = u8::from(lit & certain & agrees & !apart);
        let open = lit & (reasons[x] == Reason::Returned);
        reasons[x] = if open { first_failure(apart, agrees, certain) } else { reasons[x] };
        let explained = lit & (here[x] <= floors[0] * noise[x] + pixel_share * pixel_share);
        let by_surface = if certain & on_one_surface[x] { Consistent::BySurface } else { Consistent::No };
        consistent[x] = if explained { Consistent::ByLight } else { by_surface };
    }
}

/// The first test that a pixel fails; if it passes all, its neighbours or the component are too few.
#[inline(always)]
fn first_failure(apart: bool, agrees: bool, certain: bool) -> Reason {
    let doubt = if certain { Reason::SmallPiece } else { Reason::DoubtfulOrder };
    let doubt = if agrees { doubt } else { Reason::Misfit };
    if apart { Reason::Discontinuity } else { doubt }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What the check finds for a row of 16 pixels.
    struct Found {
        passed: [u8; 16],
        consistent: [Consistent; 16],
        reasons: [Reason; 16],
    }

    /// Pixels 4 and 12 have the same residual, a quarter of the modulation around them. Pixel 4 is as bright as its neighbours, and pixel
    /// 12 lies in a narrow shadow. The energy has moved pixel 8.
    fn found(on_one_surface: bool) -> Found {
        let (mut squared_residual, mut pixel_modulation) = ([0.0; 16], [0.4; 16]);
        (squared_residual[4], squared_residual[12], pixel_modulation[12]) = (0.01, 0.01, 0.1);
        let (mut quality, mut passed, mut consistent) = ([0.0; 16], [0; 16], [Consistent::No; 16]);
        let mut reasons = [Reason::Returned; 16];
        reasons[8] = Reason::Misfit;
        let mut modulation = [0.4; 16];
        modulation[8] = 0.0;
        let known = CheckRow {
            squared_residual: [&[0.0; 16], &squared_residual, &[0.0; 16]],
            modulation: &modulation,
            pixel_modulation: &pixel_modulation,
            noise: &[1.0; 16],
            order_quality: &[1.0; 16],
            on_one_surface: &[on_one_surface; 16],
        };
        let out = VerdictRow {
            quality: &mut quality,
            passed: &mut passed,
            consistent: &mut consistent,
            reasons: &mut reasons,
        };
        check_row(&known, Limits { noise: 0.01, quality_min: 0.1 }, [&mut Vec::new(), &mut Vec::new()], out);
        Found { passed, consistent, reasons }
    }

    #[test]
    fn the_residual_of_a_dim_pixel_is_relative_to_its_light() {
        let Found { passed, consistent, reasons } = found(false);
        for x in (0..16).filter(|&x| x != 8) {
            let expected = if x == 12 { (0, Consistent::No) } else { (1, Consistent::ByLight) };
            assert_eq!((passed[x], consistent[x]), expected, "{x}");
        }
        assert_eq!((reasons[12], reasons[0]), (Reason::Misfit, Reason::SmallPiece));
    }

    #[test]
    fn a_pixel_on_one_surface_may_be_added_whatever_its_residual_but_does_not_vouch_for_its_order() {
        let Found { passed, consistent, .. } = found(true);
        for x in 0..16 {
            let by_surface = x == 8 || x == 12;
            let expected = if by_surface { (0, Consistent::BySurface) } else { (1, Consistent::ByLight) };
            assert_eq!((passed[x], consistent[x]), expected, "{x}");
        }
    }

    #[test]
    fn a_pixel_that_was_moved_too_far_needs_a_surface_around_it() {
        let Found { passed, consistent, reasons } = found(false);
        assert_eq!((passed[8], consistent[8], reasons[8]), (0, Consistent::No, Reason::Misfit));
    }
}
