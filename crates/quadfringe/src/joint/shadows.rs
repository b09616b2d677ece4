//! Step 6 for a pair: pixels that the visible projector lights and the infrared one does not. Their dark infrared light is no
//! trough of a fringe (J33), and would bend the phase. They become no data, with the reason of a shadow.

use super::Joint;
use super::cells::{Grid, RowMaps};
use super::infrared::{Waves, with_waves};
use super::model::FringeRows;
use super::neighbours::{around, sum_of_nine};
use super::params::shadows::{FRINGE_NOISES, REACH_PX, SHARE_MIN};
use super::photometry::Photometry;
use super::scene::{Frame, PhaseMap, PixelRow, Scene};
use crate::Reason;
use crate::parallel::lanes::{LANES, lanes, lanes_mut, put, take};
use crate::parallel::slots::Slots;
use multiversion::multiversion;
use rayon::prelude::*;

/// Where shadows are searched on a level.
#[derive(Clone, Copy)]
enum Where<'a> {
    Everywhere,
    /// Near pixels of the coarse level, planes of its grid, that are dark.
    NearDark(&'a Grid, &'a [f32]),
}

/// The search for shadows, with its working planes.
#[derive(Debug, Default)]
pub(super) struct Shadows {
    /// Infrared fringes that the model expects, in linear light above their trough.
    expected: Vec<f32>,
    /// Observed light above the trough, less the least share of the expected one.
    excess: Vec<f32>,
    /// 0 for pixels in shadow, 1 for all others.
    lit: Vec<f32>,
    slots: Slots<Rows>,
}

/// Rows of one task.
#[derive(Debug, Default)]
struct Rows {
    maps: RowMaps,
    spare: Vec<f32>,
    expected: Vec<f32>,
    /// The vectors of pixels that are searched.
    active: Vec<bool>,
}

impl Where<'_> {
    /// Marks the vectors of row `y` that are searched; tells whether there are any.
    fn choose(self, grid: &Grid, y: usize, active: &mut Vec<bool>) -> bool {
        active.clear();
        match self {
            Self::Everywhere => active.resize(grid.stride / LANES, true),
            Self::NearDark(coarse, modulation) => {
                let factor = grid.stride / coarse.stride;
                let rows = around((y / factor).min(coarse.height - 1), coarse.height);
                let rows = rows.map(|y| &modulation[y * coarse.stride..][..coarse.width]);
                let side = LANES / factor;
                active.extend((0..grid.stride / LANES).map(|i| {
                    let near = (i * side).saturating_sub(1).min(coarse.width)
                        ..((i + 1) * side + 1).min(coarse.width);
                    rows.iter().any(|row| row[near.clone()].contains(&0.0))
                }));
            }
        }
        active.contains(&true)
    }
}

impl Shadows {
    /// Finds the shadows of the infrared projector at an absolute phase; `noise` is the standard deviation of the intensities.
    /// Tells whether there are any.
    fn find(
        &mut self,
        scene: &Scene<'_>,
        place: Where<'_>,
        ratios: [f32; 3],
        photometry: &Photometry,
        map: PhaseMap<'_>,
        noise: f32,
    ) -> bool {
        let grid = scene.grid;
        self.expect_fringes(scene, place, ratios, photometry, map);
        let Self { expected, excess, lit, slots } = self;
        lit.resize(grid.pixels(), 0.0);
        let (expected, excess, slots) = (&*expected, &*excess, &*slots);
        lit.par_chunks_mut(grid.stride).enumerate().for_each_init(
            || slots.take(),
            |slot, (y, lit)| {
                let Rows { spare, expected: fringes, .. } = &mut **slot;
                fringes.resize(grid.stride, 0.0);
                let near = |plane| around(y, grid.height).map(|y| scene.row(plane, y));
                sum_of_nine(near(expected), grid.width, spare, fringes);
                sum_of_nine(near(excess), grid.width, spare, lit);
                for (lit, fringes) in lit.iter_mut().zip(fringes) {
                    let dark = (*lit < 0.0) & (*fringes > FRINGE_NOISES * noise);
                    *lit = if dark { 0.0 } else { 1.0 };
                }
            },
        );
        lit.par_chunks(grid.stride).any(|row| row[..grid.width].contains(&0.0))
    }

    /// Computes what the model expects at every pixel that is searched, and what is seen of it.
    fn expect_fringes(
        &mut self,
        scene: &Scene<'_>,
        place: Where<'_>,
        ratios: [f32; 3],
        photometry: &Photometry,
        map: PhaseMap<'_>,
    ) {
        let grid = scene.grid;
        let Self { expected, excess, slots, .. } = self;
        for plane in [&mut *expected, &mut *excess] {
            plane.resize(grid.pixels(), 0.0);
        }
        let rows = expected.par_chunks_mut(grid.stride).zip(excess.par_chunks_mut(grid.stride)).enumerate();
        rows.for_each_init(
            || slots.take(),
            |slot, (y, (expected, excess))| {
                let Rows { maps, active, .. } = &mut **slot;
                if !place.choose(grid, y, active) {
                    expected.fill(0.0);
                    excess.fill(0.0);
                    return;
                }
                let fringes = photometry.sample_in_place(scene, y, maps);
                let (pixels, out) = (scene.pixel_row(map, y), [expected, excess]);
                with_waves!(scene, y, ratios, |waves| {
                    expect(&fringes, &pixels, scene.rows(y), waves, active, out);
                });
            },
        );
    }
}

impl Joint {
    /// Step 6 on the coarse level: removes the shadows of the infrared projector of a pair.
    pub(super) fn leave_out_coarse_shadows(&mut self, frame: &Frame<'_>) {
        let (Self { coarse, pyramid, ratios, .. }, grid) = (self, frame.coarse.grid);
        if pyramid.coarse.pair.is_none() {
            return;
        }
        let map = PhaseMap { phase: &coarse.phase, modulation: &coarse.modulation };
        let shadows = &mut coarse.shadows;
        let scene = pyramid.coarse.scene(frame.coarse);
        let found = shadows.find(&scene, Where::Everywhere, *ratios, &coarse.photometry, map, coarse.noise);
        if !found {
            return;
        }
        coarse.lit_mask.erode(
            grid,
            REACH_PX.div_ceil(frame.coarse.factor),
            &mut shadows.excess,
            &mut shadows.lit,
        );
        pyramid.coarse.restrict(grid, &shadows.lit);
        darken(grid, &shadows.lit, &mut coarse.modulation, |_| ());
    }

    /// The same at full resolution, next to what is dark on the coarse level.
    pub(super) fn leave_out_shadows(&mut self, frame: &Frame<'_>) {
        let (Self { coarse, pyramid, pixels, ratios, .. }, grid) = (self, frame.full.grid);
        // Without a coarse level, all is found already.
        if pyramid.full.pair.is_none() || frame.coarse.factor == 1 {
            return;
        }
        let shadows = &mut coarse.shadows;
        let scene = pyramid.full.scene(frame.full);
        let place = Where::NearDark(frame.coarse.grid, &coarse.modulation);
        if !shadows.find(&scene, place, *ratios, &coarse.photometry, pixels.map(), coarse.noise) {
            return;
        }
        coarse.lit_mask.erode(grid, REACH_PX, &mut shadows.excess, &mut shadows.lit);
        pyramid.full.restrict(grid, &shadows.lit);
        let reasons = &mut pixels.reasons;
        darken(grid, &shadows.lit, &mut pixels.modulation, |at| {
            if reasons[at] == Reason::Returned {
                reasons[at] = Reason::Shadow;
            }
        });
    }
}

/// Sets the modulation of pixels in shadow to 0, and tells which were not dark before.
fn darken(grid: &Grid, lit: &[f32], modulation: &mut [f32], mut lost: impl FnMut(usize)) {
    for y in 0..grid.height {
        for at in y * grid.stride..y * grid.stride + grid.width {
            if lit[at] == 0.0 && modulation[at] > 0.0 {
                modulation[at] = 0.0;
                lost(at);
            }
        }
    }
}

/// Expected infrared fringes above their trough, and what is observed of them above the least share; both are 0 for pixels that
/// take no part. The albedo is that of R and B.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn expect<W: Waves>(
    fringes: &FringeRows,
    pixels: &PixelRow,
    light: [&[f32]; 4],
    waves: W,
    active: &[bool],
    out: [&mut [f32]; 2],
) {
    let pixels = [pixels.phase, pixels.modulation, pixels.usable].map(lanes);
    let (offset, amplitude, light) =
        (fringes.offset.map(lanes), fringes.amplitude.map(lanes), light.map(lanes));
    let mut out = out.map(lanes_mut);
    for i in 0..pixels[0].len() {
        if !active[i] {
            put(&mut out, i, &[[0.0; LANES]; 2]);
            continue;
        }
        let (offset, amplitude, light) = (take(&offset, i), take(&amplitude, i), take(&light, i));
        let [phase, modulation, usable] = take(&pixels, i);
        let vector = waves.vector(i);
        let mut found = [[0.0; LANES]; 2];
        for x in 0..LANES {
            let carriers = waves.carriers(vector, x, phase[x], 0.0);
            let (mut mm, mut ms) = (1e-9f32, 0.0f32);
            for c in [0, 2] {
                let m = offset[c][x] + amplitude[c][x] * carriers.cosine[c];
                mm += m * m;
                ms += m * light[c][x];
            }
            let albedo = ms / mm;
            let expected = albedo * amplitude[3][x] * (1.0 + carriers.cosine[3]);
            let observed = light[3][x] - albedo * (offset[3][x] - amplitude[3][x]);
            let on = (modulation[x] > 0.0) & (usable[x] > 0.0);
            found[0][x] = if on { expected } else { 0.0 };
            found[1][x] = if on { observed - SHARE_MIN * expected } else { 0.0 };
        }
        put(&mut out, i, &found);
    }
}
