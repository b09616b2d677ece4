//! Which pixels can be trusted: a hole is better than a lie.

use super::islands::{mark_seams, remove_islands, remove_slivers};
use super::nodes::Nodes;
use crate::demod::scene::{RowMaps, Scene};
use crate::demod::window::Window;
use rayon::prelude::*;

/// Greatest square of a pixel's own misfit, in units of what its neighbours may have on average.
const OWN_MISFIT_MAX: f32 = 3.0;
/// Trusted pixels of the 25 around that make a pixel part of a surface; a straight edge leaves 15.
const NEIGHBOURS_MIN: u8 = 10;
/// Least side of a region that is a surface, in fringe periods.
const ISLAND_SIDE: f64 = 0.25;

/// What there is to judge by.
pub(super) struct Findings<'a> {
    pub phase: &'a [f32],
    pub modulation: &'a [f32],
    /// Mean square misfit of the four channels.
    pub misfit: &'a [f32],
    pub window: &'a Window<'a>,
    pub nodes: &'a Nodes,
    pub quality_min: f32,
}

/// The verdict on every pixel.
#[derive(Debug, Clone, Default)]
pub(super) struct Judge {
    /// Absolute phase of what can be trusted, NaN elsewhere.
    pub phase: Vec<f32>,
    /// Quality of the order of what is lit, NaN elsewhere.
    pub quality: Vec<f32>,
    seams: Vec<bool>,
    counts: Vec<u8>,
    parents: Vec<u32>,
}

impl Judge {
    pub fn run(&mut self, scene: &Scene<'_>, findings: &Findings<'_>) {
        let width = scene.width;
        mark_seams(findings.phase, |i| findings.modulation[i] > 0.0, width, &mut self.seams);
        let backing = findings.nodes.backing(scene);
        self.phase.resize(scene.pixels(), 0.0);
        self.quality.resize(scene.pixels(), 0.0);
        let seams = &self.seams;
        self.phase.par_chunks_mut(width).zip(self.quality.par_chunks_mut(width)).enumerate().for_each_init(
            Scratch::default,
            |scratch, (y, (phase, quality))| {
                findings.agrees(scene, y, scratch);
                let [backing] = scratch.maps.sample(scene, y, [&backing]);
                for x in 0..width {
                    let at = y * width + x;
                    let margin = findings.nodes.margin(y, x).filter(|_| findings.modulation[at] > 0.0);
                    quality[x] = margin.map_or(f32::NAN, |margin| margin * backing[x]);
                    let sure = quality[x] >= findings.quality_min && scratch.agrees[x] && !seams[at];
                    phase[x] = if sure { findings.phase[at] } else { f32::NAN };
                }
            },
        );
        remove_slivers(&mut self.phase, width, NEIGHBOURS_MIN, &mut self.counts);
        let least = (ISLAND_SIDE * scene.period_px).powi(2) as usize;
        remove_islands(&mut self.phase, width, least, &mut self.parents);
    }
}

#[derive(Default)]
struct Scratch {
    maps: RowMaps,
    sums: Vec<f32>,
    agrees: Vec<bool>,
}

impl Findings<'_> {
    /// Pixels of a row whose four channels, with their neighbours', agree with the model of the chosen order; a wrong
    /// order has G and IR wrong.
    fn agrees(&self, scene: &Scene<'_>, y: usize, scratch: &mut Scratch) {
        let width = scene.width;
        let rows = [y.saturating_sub(1), y, (y + 1).min(scene.height() - 1)].map(|row| row * width);
        let Scratch { sums, agrees, .. } = scratch;
        sums.clear();
        sums.extend((0..width).map(|x| rows.iter().map(|row| self.misfit[row + x]).sum::<f32>()));
        agrees.clear();
        agrees.extend((0..width).map(|x| {
            let sum = sums[x.saturating_sub(1)] + sums[x] + sums[(x + 1).min(width - 1)];
            let most = self.window.tolerance(y * width + x);
            sum <= 9.0 * most && self.misfit[y * width + x] <= OWN_MISFIT_MAX * most
        }));
    }
}
