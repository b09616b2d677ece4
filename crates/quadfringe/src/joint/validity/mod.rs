//! Step 8: validity. A hole is better than a wrong point: pixels become no data unless light, model and neighbourhood agree.

mod check;
mod close_steps;
mod components;
mod discontinuities;
mod evidence;
mod regrow;
mod support;

use super::cells::{RowMaps, TaskWork};
use super::noise::NoiseByLight;
use super::params::validity::{COMPONENT_SIDE, NEIGHBOURS_MIN, SEED_SIDE};
use super::scene::Scene;
use crate::Reason;
use crate::decode::output::hole_unless;
use crate::parallel::slots::Slots;
use check::{CheckRow, VerdictRow, check_row};
use close_steps::CloseSteps;
use components::{Components, SizeLimits};
use discontinuities::{Discontinuities, remove_narrow};
pub(super) use evidence::{Evidence, Limits, PixelFit};
use multiversion::multiversion;
use rayon::prelude::*;
pub(super) use regrow::GROWN;
use regrow::{Consistent, Regrow};
use support::Support;

/// The validity mask of a shot, with working maps.
#[derive(Debug, Default)]
pub(super) struct Validity {
    /// 1 for valid pixels, 0 elsewhere.
    pub valid: Vec<u8>,
    discontinuities: Discontinuities,
    close_steps: CloseSteps,
    /// First not 0 at or next to an order jump, then 1 for pixels that pass the limits; then 1 for pixels of components that may grow, and 1 or [`GROWN`] for those added.
    pub components: Vec<u8>,
    /// What says that a pixel may be added to a component.
    consistent: Vec<Consistent>,
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
    on_one_surface: Vec<bool>,
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
            light: scene.light,
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
        self.consistent.resize(grid.pixels(), Consistent::No);
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
                let Rows { maps, spare, sums, order_quality, noise: variance, on_one_surface } =
                    &mut slot.rows;
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
                evidence.energy.on_one_surface(y, grid.width, on_one_surface);
                let known = CheckRow::of(scene, evidence, y, variance, order_quality, on_one_surface);
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

/// The phase of valid pixels, NaN elsewhere.
#[multiversion(targets("x86_64+avx2"))]
pub(super) fn copy_valid(valid: &[u8], phase: &[f32], out: &mut [f32]) {
    for (out, (valid, phase)) in out.iter_mut().zip(valid.iter().zip(phase)) {
        *out = *phase + hole_unless(*valid != 0);
    }
}
