//! Step 8: validity. A hole is better than a wrong point: pixels become no data unless light, model and neighbourhood agree.

mod close_steps;
mod components;
mod discontinuities;
mod regrow;
mod support;

use super::cells::{RowMaps, TaskWork};
use super::neighbours::{around, sum_of_nine};
use super::noise::NoiseByLight;
use super::orders::Orders;
use super::params::validity::{
    COMPONENT_SIDE, MISFIT_MAX, NEIGHBOURS_MIN, PIXEL_MISFIT_MAX, PIXEL_RESIDUAL_NOISES_MAX,
    RESIDUAL_NOISES_MAX, SEED_SIDE,
};
use super::regions::RegionOrders;
use super::scene::{PhaseMap, Scene};
use crate::Reason;
use crate::decode::output::hole_unless;
use crate::parallel::slots::Slots;
use close_steps::CloseSteps;
use components::{Components, SizeLimits};
use discontinuities::{Discontinuities, remove_narrow};
use multiversion::multiversion;
use rayon::prelude::*;
pub(super) use regrow::GROWN;
use regrow::Regrow;
use support::Support;

/// Results of the fit of step 6 for every pixel by itself, row by row without padding.
#[derive(Clone, Copy)]
pub(super) struct PixelFit<'a> {
    /// Mean squared residual of the four channels, in linear light squared.
    pub squared_residual: &'a [f32],
    /// Modulation in linear light by the albedo of the pixel.
    pub modulation: &'a [f32],
}

/// What decides the mask of a shot.
#[derive(Clone, Copy)]
pub(super) struct Evidence<'a> {
    pub map: PhaseMap<'a>,
    pub pixel: PixelFit<'a>,
    pub orders: &'a Orders,
    pub regions: &'a RegionOrders,
    /// Fringe numbers divided by the first.
    pub ratios: [f32; 4],
    pub limits: Limits,
}

/// Limits of a shot.
#[derive(Debug, Clone, Copy)]
pub(super) struct Limits {
    /// Standard deviation of the intensities in linear light.
    pub noise: f32,
    /// Least quality of a valid order.
    pub quality_min: f32,
}

/// The validity mask of a shot, with working maps.
#[derive(Debug, Default)]
pub(super) struct Validity {
    /// 1 for valid pixels, 0 elsewhere.
    pub valid: Vec<u8>,
    discontinuities: Discontinuities,
    close_steps: CloseSteps,
    /// First not 0 at or next to an order jump, then 1 for pixels that pass the limits; then 1 for pixels of components that may grow, [`GROWN`] for those added.
    pub components: Vec<u8>,
    /// 1 for pixels whose intensities agree with their order.
    consistent: Vec<u8>,
    noise: NoiseByLight,
    support: Support,
    labelling: Components,
    regrow: Regrow,
    slots: Slots<TaskWork<Rows>>,
}

/// Working rows of one task.
#[derive(Debug, Default)]
struct Rows {
    maps: RowMaps,
    spare: Vec<f32>,
    sums: Vec<f32>,
    order_quality: Vec<f32>,
    noise: Vec<f32>,
}

impl Validity {
    /// Find the valid pixels of an absolute phase; `quality`, without padding, receives the quality of the orders of lit pixels, NaN
    /// elsewhere, and `reasons` why a pixel with fringes is not valid, unless it has a reason already.
    pub fn run(
        &mut self,
        scene: &Scene<'_>,
        evidence: Evidence<'_>,
        quality: &mut [f32],
        reasons: &mut [Reason],
    ) {
        let (grid, map) = (scene.grid, evidence.map);
        self.discontinuities.mark(grid, map, &mut self.components);
        self.close_steps.mark(grid, map);
        self.support.measure(scene, evidence.orders);
        self.check_pixels(scene, evidence, quality, reasons);
        remove_narrow(grid, NEIGHBOURS_MIN, &self.components, &mut self.valid);
        let pixels = |side: f64| (side * scene.period_px).powi(2) as usize;
        let limits = SizeLimits { least: pixels(COMPONENT_SIDE), seed: pixels(SEED_SIDE) };
        self.labelling.remove_small(grid, map.phase, limits, &mut self.valid, &mut self.components);
        let candidates = regrow::Candidates {
            phase: map.phase,
            consistent: &self.consistent,
            at_jump: self.discontinuities.at_jump(),
        };
        self.regrow.run(grid, &candidates, &mut self.valid, &mut self.components);
    }

    /// Limits of every pixel by itself and with its eight neighbours.
    fn check_pixels(
        &mut self,
        scene: &Scene<'_>,
        evidence: Evidence<'_>,
        quality: &mut [f32],
        reasons: &mut [Reason],
    ) {
        let (limits, grid) = (evidence.limits, scene.grid);
        self.consistent.resize(grid.pixels(), 0);
        let Self { components, consistent, close_steps, noise, support, slots, .. } = self;
        let close_steps = &*close_steps;
        noise.measure(scene.light, grid, evidence.ratios);
        let noise = &*noise;
        let masks = components.par_chunks_mut(grid.stride).zip(consistent.par_chunks_mut(grid.stride));
        let masks = masks.zip(reasons.par_chunks_mut(grid.stride));
        let rows = quality.par_chunks_mut(grid.width).zip(masks).enumerate();
        rows.for_each_init(
            || slots.take(),
            |slot, (y, (quality, ((passed, consistent), reasons)))| {
                let Rows { maps, spare, sums, order_quality, noise: variance } = &mut slot.rows;
                noise.row(scene.rows(y), variance);
                let support = &support.row(grid, y, maps)[..grid.width];
                let close = close_steps.row(grid, y);
                quality_of_orders(
                    scene,
                    evidence,
                    y,
                    Surroundings { support, close, of_region: spare },
                    order_quality,
                );
                let known = CheckRow::of(scene, evidence, y, variance, order_quality);
                let out = VerdictRow { quality, passed, consistent, reasons };
                check_row(&known, limits, [spare, sums], out);
            },
        );
    }
}

/// What surrounds the pixels of a row.
struct Surroundings<'a> {
    /// Support of the orders by the neighbourhood.
    support: &'a [f32],
    /// Not 0 for cells close to a step of about one turn.
    close: &'a [u8],
    /// Working row: the support that counts for an order by a region.
    of_region: &'a mut Vec<f32>,
}

/// Writes the quality of the orders of row `y`: by its nodes, whose leads count as much as their support, and by its regions.
fn quality_of_orders(
    scene: &Scene<'_>,
    evidence: Evidence<'_>,
    y: usize,
    Surroundings { support, close, of_region }: Surroundings<'_>,
    out: &mut Vec<f32>,
) {
    let step = scene.grid.step;
    out.clear();
    for node in evidence.orders.verdicts(scene, y / step) {
        out.extend(std::iter::repeat_n(if node.lit { node.lead } else { 0.0 }, step));
    }
    out.iter_mut().zip(support).for_each(|(quality, support)| *quality *= support);
    of_region.clear();
    of_region.extend_from_slice(support);
    let cells = of_region.chunks_mut(step).zip(close).filter(|(_, close)| **close != 0);
    cells.for_each(|(support, _)| support.fill(0.0));
    evidence.regions.parts(y, |pixels, found| {
        found.raise(&of_region[pixels.clone()], &mut out[pixels]);
    });
}

/// Input of the check of one row.
struct CheckRow<'a> {
    /// Of the rows above, at and below.
    squared_residual: [&'a [f32]; 3],
    /// Modulation by the albedo of the neighbourhood.
    modulation: &'a [f32],
    /// Modulation by the albedo of the pixel.
    pixel_modulation: &'a [f32],
    /// Variance of the noise relative to that of the shot.
    noise: &'a [f32],
    order_quality: &'a [f32],
}

impl<'a> CheckRow<'a> {
    /// Row `y` of a scene, with the variance of the noise and the quality of the orders along it.
    fn of(scene: &Scene<'_>, evidence: Evidence<'a>, y: usize, noise: &'a [f32], quality: &'a [f32]) -> Self {
        let Evidence { map, pixel, .. } = evidence;
        let (height, width) = (scene.grid.height, scene.grid.width);
        Self {
            squared_residual: around(y, height).map(|y| &pixel.squared_residual[y * width..][..width]),
            modulation: &scene.row(map.modulation, y)[..width],
            pixel_modulation: &pixel.modulation[y * width..][..width],
            noise: &noise[..width],
            order_quality: &quality[..width],
        }
    }
}

/// Verdicts on the pixels of a row.
struct VerdictRow<'a> {
    quality: &'a mut [f32],
    /// First not 0 for pixels at or next to an order jump.
    passed: &'a mut [u8],
    consistent: &'a mut [u8],
    /// Why a pixel with fringes is not valid, if it is not; other reasons stay.
    reasons: &'a mut [Reason],
}

/// A pixel passes if its order has enough quality, it lies at no order jump, and the residuals of it and its neighbours are small; a
/// wrong order leaves residuals in G and IR. It is consistent if its residual alone is small.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn check_row(known: &CheckRow, limits: Limits, [spare, sums]: [&mut Vec<f32>; 2], out: VerdictRow) {
    let width = known.modulation.len();
    sums.resize(width, 0.0);
    sum_of_nine(known.squared_residual, width, spare, sums);
    let (here, near) = (&known.squared_residual[1][..width], &sums[..width]);
    let (modulation, pixel_modulation) = (&known.modulation[..width], &known.pixel_modulation[..width]);
    let noise = &known.noise[..width];
    let order_quality = &known.order_quality[..width];
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
        quality[x] = order_quality[x] + hole_unless(lit);
        let certain = lit & (order_quality[x] >= limits.quality_min);
        let apart = passed[x] != 0;
        passed[x] = u8::from(certain & agrees & !apart);
        let doubt = if certain { Reason::SmallPiece } else { Reason::DoubtfulOrder };
        let doubt = if agrees { doubt } else { Reason::Misfit };
        let doubt = if apart { Reason::Discontinuity } else { doubt };
        let open = lit & (reasons[x] == Reason::Returned);
        reasons[x] = if open { doubt } else { reasons[x] };
        consistent[x] = u8::from(lit & (here[x] <= floors[0] * noise[x] + pixel_share * pixel_share));
    }
}

/// The phase of valid pixels, NaN elsewhere.
#[multiversion(targets("x86_64+avx2"))]
pub(super) fn copy_valid(valid: &[u8], phase: &[f32], out: &mut [f32]) {
    for (out, (valid, phase)) in out.iter_mut().zip(valid.iter().zip(phase)) {
        *out = *phase + hole_unless(*valid != 0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_residual_of_a_dim_pixel_is_relative_to_its_light() {
        // The same residual, a quarter of the modulation, of a pixel as bright as its neighbours and of one in a narrow shadow.
        let (mut squared_residual, mut pixel_modulation) = ([0.0; 16], [0.4; 16]);
        (squared_residual[4], squared_residual[12], pixel_modulation[12]) = (0.01, 0.01, 0.1);
        let (mut quality, mut passed, mut consistent) = ([0.0; 16], [0; 16], [0; 16]);
        let mut reasons = [Reason::Returned; 16];
        let known = CheckRow {
            squared_residual: [&[0.0; 16], &squared_residual, &[0.0; 16]],
            modulation: &[0.4; 16],
            pixel_modulation: &pixel_modulation,
            noise: &[1.0; 16],
            order_quality: &[1.0; 16],
        };
        let out = VerdictRow {
            quality: &mut quality,
            passed: &mut passed,
            consistent: &mut consistent,
            reasons: &mut reasons,
        };
        check_row(&known, Limits { noise: 0.01, quality_min: 0.1 }, [&mut Vec::new(), &mut Vec::new()], out);
        for marks in [passed, consistent] {
            assert!((0..16).all(|x| marks[x] == u8::from(x != 12)), "{marks:?}");
        }
        assert_eq!((reasons[12], reasons[0]), (Reason::Misfit, Reason::SmallPiece));
    }
}
