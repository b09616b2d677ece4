//! Steps 9 and 10: the maps of the result, row by row.

use super::cells::RowMaps;
use super::energy::{self, Energy};
use super::illumination::LitMask;
use super::params::uncertainty::{GROWN_PROBABILITY_MIN, SETTLED_PROBABILITY_MIN};
use super::reasons::Reasons;
use super::regions::RegionOrders;
use super::saturation::Saturation;
use super::scene::{Pixels, Scene};
use super::uncertainty::PhaseNoise;
use super::validity::{self, Validity};
use crate::decode::output::{Decoded, Finish};
use rayon::prelude::*;

/// What the steps before have found.
#[derive(Clone, Copy)]
pub(super) struct Results<'a> {
    pub pixels: &'a Pixels,
    pub validity: &'a Validity,
    pub lit_mask: &'a LitMask,
    pub saturation: &'a Saturation,
    pub energy: &'a Energy,
    pub regions: &'a RegionOrders,
    /// Fringe numbers divided by the first.
    pub ratios: [f32; 4],
    /// Wrong-order probability of every node.
    pub wrong_order: &'a [f32],
}

impl Results<'_> {
    /// Writes the maps.
    pub fn write(self, scene: &Scene<'_>, noise: &PhaseNoise, finish: &Finish<'_>, out: &mut Decoded) {
        let Self { pixels, validity, lit_mask, saturation, energy, regions, ratios, wrong_order } = self;
        let (grid, reasons) = (scene.grid, Reasons { pixels, validity, lit_mask });
        out.rows().enumerate().for_each_init(
            Default::default,
            |(maps, rows): &mut (RowMaps, energy::Rows), (y, mut row)| {
                let at = y * grid.stride..y * grid.stride + grid.width;
                validity::copy_valid(&validity.valid[at.clone()], &pixels.phase[at], row.phase);
                reasons.write(scene, y, maps, row.reason);
                let variance = energy.variance(scene, y, rows);
                noise.deviations(variance, row.sigma);
                saturation.widen(scene, y, ratios, row.sigma);
                let nodes = &wrong_order[y / grid.step * grid.columns..];
                row.wrong.chunks_mut(grid.step).zip(nodes).for_each(|(wrong, node)| wrong.fill(*node));
                let components = &validity.components[y * grid.stride..];
                regions.parts(y, |pixels, found| {
                    for (wrong, component) in row.wrong[pixels.clone()].iter_mut().zip(&components[pixels]) {
                        let grown = *component == validity::GROWN;
                        let least = if grown { GROWN_PROBABILITY_MIN } else { SETTLED_PROBABILITY_MIN };
                        *wrong = found.wrong_order(*wrong, least);
                    }
                });
                finish.row(y, &mut row);
            },
        );
    }
}
