//! Which pixels can be trusted: a hole is better than a lie.

mod components;
mod discontinuities;
mod propagate;
mod regrow;

use crate::decode::output::hole_unless;
use crate::joint::cells::{CellMaps, CellWork, Grid, RowMaps};
use crate::joint::orders::Orders;
use crate::joint::params::MISFIT_MAX;
use crate::joint::scene::{Scene, around};
use crate::parallel::slots::Slots;
use components::Islands;
use discontinuities::Tears;
use multiversion::multiversion;
use propagate::Odds;
use rayon::prelude::*;
use regrow::Growth;

/// Greatest misfit of the four channels, root mean square: in units of the noise, and of the modulation.
const NOISE_MAX: f32 = 1.5;
/// The same of a pixel by itself: in units of the noise and of its own modulation. A pixel in a narrow shadow is dim, and its
/// misfit small beside the light of its surroundings.
const OWN_NOISE_MAX: f32 = 3.0;
const OWN_MISFIT_MAX: f32 = 0.5;
/// Greatest misfit, in the same units, of what a surface may grow into: there less vouches for a pixel.
const GROWN_MISFIT_MAX: f32 = 0.35;
/// Trusted pixels of the 25 around that make a pixel part of a surface; a straight edge leaves 15.
const NEIGHBOURS_MIN: u8 = 10;
/// Least side of a region that is a surface, in fringe periods.
const ISLAND_SIDE: f64 = 0.25;
/// The same of one that is trusted to grow.
const GROWING_SIDE: f64 = 1.0;
/// Width (sigma) in fringe periods of the surroundings that back an order.
const BACKING: f32 = 1.0;

/// What there is to judge by.
pub(in crate::joint) struct Findings<'a> {
    /// Absolute phase in rad.
    pub phase: &'a [f32],
    /// 0 where there is no light.
    pub modulation: &'a [f32],
    /// Mean square misfit of the four channels, and modulation, of every pixel by itself, row by row without padding.
    pub own: [&'a [f32]; 2],
    /// Standard deviation of the intensities.
    pub noise: f32,
    pub orders: &'a Orders,
    pub quality_min: f32,
}

/// The verdict on every pixel.
#[derive(Debug, Default)]
pub(in crate::joint) struct Judge {
    /// 1 for what can be trusted, 0 elsewhere.
    pub sure: Vec<u8>,
    tears: Tears,
    seams: Vec<u8>,
    /// 1 for pixels of regions that are trusted to grow, [`regrow::GROWN`] for what they grew into.
    surfaces: Vec<u8>,
    odds: Odds,
    backing: CellMaps,
    sums: CellMaps,
    islands: Islands,
    /// 1 for pixels whose own light agrees with their order.
    agreeing: Vec<u8>,
    growth: Growth,
    slots: Slots<(Rows, CellWork)>,
}

/// Rows of one task.
#[derive(Debug, Default)]
struct Rows {
    maps: RowMaps,
    sums: Vec<f32>,
    margin: Vec<f32>,
}

impl Judge {
    /// Judge every pixel; `quality`, without padding, receives that of the order of what is lit, NaN elsewhere.
    pub fn run(&mut self, scene: &Scene<'_>, findings: &Findings<'_>, quality: &mut [f32]) {
        let grid = scene.grid;
        self.tears.mark(grid, findings.phase, findings.modulation, &mut self.seams);
        self.back(scene, findings.orders);
        self.surfaces.resize(grid.pixels(), 0);
        self.agreeing.resize(grid.pixels(), 0);
        let Self { surfaces, agreeing, seams, backing, slots, .. } = self;
        let masks = surfaces.par_chunks_mut(grid.stride).zip(agreeing.par_chunks_mut(grid.stride));
        let rows = quality.par_chunks_mut(grid.width).zip(masks).enumerate();
        rows.for_each_init(
            || slots.take(),
            |slot, (y, (quality, (sure, agreeing)))| {
                let Rows { maps, sums, margin } = &mut slot.0;
                let [backing] = maps.sample(grid, backing, 1, y);
                margin.clear();
                for (lead, _, lit) in findings.orders.verdict(scene, y / grid.step) {
                    margin.extend(std::iter::repeat_n(if lit { lead } else { 0.0 }, grid.step));
                }
                let [misfit, light] = findings.own;
                let near = around(y, grid.height).map(|row| &misfit[row * grid.width..][..grid.width]);
                let light = &light[y * grid.width..][..grid.width];
                let known = [scene.row(findings.modulation, y), light, margin, backing];
                let limits = [findings.noise, findings.quality_min];
                let out = [sure, agreeing];
                verdict(near, known, scene.row(seams, y), grid.width, limits, sums, quality, out);
            },
        );
        discontinuities::remove_slivers(grid, NEIGHBOURS_MIN, &self.surfaces, &mut self.sure);
        let sizes = [ISLAND_SIDE, GROWING_SIDE].map(|side| (side * scene.period_px).powi(2) as usize);
        let surfaces = &mut self.surfaces;
        self.islands.remove(grid, findings.phase, sizes, &mut self.sure, surfaces);
        self.growth.run(
            grid,
            findings.phase,
            [&self.agreeing, self.tears.torn()],
            [&mut self.sure, surfaces],
        );
    }

    /// What is known of the orders of whole surfaces settles the doubts of windows that see more than one of them, in the maps of
    /// the probability of another order and of quality, without padding.
    pub fn settle(&mut self, grid: &Grid, phase: &[f32], [wrong, quality]: [&mut [f32]; 2]) {
        self.odds.settle(grid, phase, &self.surfaces, [wrong, quality]);
    }

    /// Share of the surroundings whose own light speaks for the order chosen there.
    fn back(&mut self, scene: &Scene<'_>, orders: &Orders) {
        let grid = scene.grid;
        let mut agree = std::mem::take(&mut self.backing);
        agree.fill::<2>(grid, |row, [weight, agree]| {
            for ((weight, agree), (_, misfit, lit)) in
                weight.iter_mut().zip(agree).zip(orders.verdict(scene, row))
            {
                (*weight, *agree) = if lit { (1.0, 1.0 - misfit) } else { (0.0, 0.0) };
            }
        });
        self.backing = CellMaps::new(2);
        grid.smooth::<2, Rows>(
            scene.cells(BACKING),
            &self.slots,
            &mut self.sums,
            &mut self.backing,
            |row, k| Some(agree.line(row, k)),
            |_, [weight, agree], out| {
                let columns = weight.len();
                for i in 0..columns {
                    out[columns + i] = ((agree[i] + 1e-6) / (weight[i] + 1e-6)).clamp(0.0, 1.0);
                }
            },
        );
    }
}

/// Quality of the pixels of a row; which of them are sure, because they agree, with their neighbours, with the model of the
/// chosen order and lie at no seam; and which agree themselves. A wrong order has G and IR wrong.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
#[expect(clippy::too_many_arguments, reason = "one row of everything")]
fn verdict(
    misfit: [&[f32]; 3],
    [modulation, light, margin, backing]: [&[f32]; 4],
    seams: &[u8],
    width: usize,
    [noise, quality_min]: [f32; 2],
    sums: &mut Vec<f32>,
    quality: &mut [f32],
    [sure, agreeing]: [&mut [u8]; 2],
) {
    sums.resize(width + 2, 0.0);
    let [above, own, below] = misfit.map(|row| &row[..width]);
    let middle = &mut sums[1..=width];
    for x in 0..width {
        middle[x] = above[x] + own[x] + below[x];
    }
    (sums[0], sums[width + 1]) = (sums[1], sums[width]);
    let [left, middle, right] = [0, 1, 2].map(|k| &sums[k..k + width]);
    let (modulation, light) = (&modulation[..width], &light[..width]);
    let (margin, backing) = (&margin[..width], &backing[..width]);
    let (seams, quality) = (&seams[..width], &mut quality[..width]);
    let (sure, agreeing) = (&mut sure[..width], &mut agreeing[..width]);
    let floors = [NOISE_MAX, OWN_NOISE_MAX].map(|most| (most * noise) * (most * noise));
    for x in 0..width {
        let lit = modulation[x] > 0.0;
        let own_quality = margin[x] * backing[x];
        let share = MISFIT_MAX * modulation[x];
        let [own_share, grown_share] = [OWN_MISFIT_MAX, GROWN_MISFIT_MAX].map(|most| most * light[x]);
        let agrees = left[x] + middle[x] + right[x] <= 9.0 * (floors[0] + share * share)
            && own[x] <= floors[1] + own_share * own_share;
        quality[x] = own_quality + hole_unless(lit);
        let clear = lit & (own_quality >= quality_min);
        sure[x] = u8::from(clear & agrees & (seams[x] == 0));
        agreeing[x] = u8::from(lit & (own[x] <= floors[0] + grown_share * grown_share));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_dim_pixel_is_measured_by_its_own_light() {
        // The same misfit, a quarter of the modulation, of a pixel as bright as its surroundings and of one in a narrow shadow.
        let (mut misfit, mut light) = ([0.0; 16], [0.4; 16]);
        (misfit[4], misfit[12], light[12]) = (0.01, 0.01, 0.1);
        let (mut quality, mut sure, mut agreeing) = ([0.0; 16], [0; 16], [0; 16]);
        verdict(
            [&[0.0; 16], &misfit, &[0.0; 16]],
            [&[0.4; 16], &light, &[1.0; 16], &[1.0; 16]],
            &[0; 16],
            16,
            [0.01, 0.1],
            &mut Vec::new(),
            &mut quality,
            [&mut sure, &mut agreeing],
        );
        for marks in [sure, agreeing] {
            assert!((0..16).all(|x| marks[x] == u8::from(x != 12)), "{marks:?}");
        }
    }
}
