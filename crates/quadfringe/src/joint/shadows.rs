//! Step 6 for a pair: pixels that the visible projector lights and the infrared one does not. Their dark infrared light is no
//! trough of a fringe (J33), and would bend the phase. They become no data, with the reason of a shadow.

use super::cells::{Grid, RowMaps};
use super::infrared::{Waves, with_waves};
use super::model::FringeRows;
use super::neighbours::{around, sum_of_nine};
use super::params::shadows::{FIELD_RIM_COLUMNS, FRINGE_NOISES, SHARE_MIN};
use super::photometry::Photometry;
use super::scene::{PhaseMap, PixelRow, Scene};
use crate::encoding::FourChannel;
use crate::parallel::lanes::{LANES, lanes, lanes_mut, put, take};
use crate::parallel::slots::Slots;
use multiversion::multiversion;
use rayon::prelude::*;
use std::f64::consts::TAU;

/// What the search goes by.
#[derive(Clone, Copy)]
pub(super) struct Search<'a> {
    /// Fringe numbers divided by the first.
    pub ratios: [f32; 4],
    pub photometry: &'a Photometry,
    pub map: PhaseMap<'a>,
    /// Standard deviation of the intensities, in linear light.
    pub noise: f32,
}

/// The search for shadows, with its working planes.
#[derive(Debug)]
pub(super) struct Shadows {
    /// Infrared phases at the ends of the field that count as lit, rad.
    field_rad: [f32; 2],
    /// Infrared fringes that the model expects, in linear light above their trough.
    expected: Vec<f32>,
    /// Observed light above the trough, less the least share of the expected one.
    pub excess: Vec<f32>,
    /// 0 for pixels in shadow, 1 for all others.
    pub lit: Vec<f32>,
    slots: Slots<Rows>,
}

/// Rows of one task.
#[derive(Debug, Default)]
struct Rows {
    maps: RowMaps,
    spare: Vec<f32>,
    expected: Vec<f32>,
}

impl Shadows {
    pub fn new(code: &FourChannel) -> Self {
        let per_column = TAU * code.infrared / code.projector_width as f64;
        let last = code.projector_width as f64 - 1.0;
        let field_rad =
            [FIELD_RIM_COLUMNS, last - FIELD_RIM_COLUMNS].map(|column| (per_column * column) as f32);
        let [expected, excess, lit] = [const { Vec::new() }; 3];
        Self { field_rad, expected, excess, lit, slots: Slots::default() }
    }

    /// Finds the shadows of the infrared projector at an absolute phase. Tells whether there are any.
    pub fn find(&mut self, scene: &Scene<'_>, search: Search<'_>) -> bool {
        let (grid, noise) = (scene.grid, search.noise);
        self.expect_fringes(scene, search);
        let Self { expected, excess, lit, slots, .. } = self;
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

    /// Computes what the model expects at every pixel, and what is seen of it.
    fn expect_fringes(&mut self, scene: &Scene<'_>, search: Search<'_>) {
        let Search { ratios, photometry, map, .. } = search;
        let grid = scene.grid;
        let Self { field_rad, expected, excess, slots, .. } = self;
        let field_rad = *field_rad;
        for plane in [&mut *expected, &mut *excess] {
            plane.resize(grid.pixels(), 0.0);
        }
        let rows = expected.par_chunks_mut(grid.stride).zip(excess.par_chunks_mut(grid.stride)).enumerate();
        rows.for_each_init(
            || slots.take(),
            |slot, (y, (expected, excess))| {
                let fringes = photometry.sample_in_place(scene, y, &mut slot.maps);
                let (pixels, out) = (scene.pixel_row(map, y), [expected, excess]);
                with_waves!(scene, y, ratios, |waves| {
                    expect(&fringes, &pixels, scene.rows(y), waves, field_rad, out);
                });
            },
        );
    }
}

/// Sets the modulation of pixels in shadow to 0, and tells which were not dark before.
pub(super) fn darken(grid: &Grid, lit: &[f32], modulation: &mut [f32], mut lost: impl FnMut(usize)) {
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
    field_rad: [f32; 2],
    out: [&mut [f32]; 2],
) {
    let pixels = [pixels.phase, pixels.modulation, pixels.usable].map(lanes);
    let (offset, amplitude, light) =
        (fringes.offset.map(lanes), fringes.amplitude.map(lanes), light.map(lanes));
    let mut out = out.map(lanes_mut);
    for i in 0..pixels[0].len() {
        let (offset, amplitude, light) = (take(&offset, i), take(&amplitude, i), take(&light, i));
        let [phase, modulation, usable] = take(&pixels, i);
        let vector = waves.vector(i);
        let mut found = [[0.0; LANES]; 2];
        for x in 0..LANES {
            let carriers = waves.carriers(&vector, x, phase[x]);
            let red = offset[0][x] + amplitude[0][x] * carriers.cosine[0];
            let blue = offset[2][x] + amplitude[2][x] * carriers.cosine[2];
            let albedo = (red * light[0][x] + blue * light[2][x]) / (red * red + blue * blue + 1e-9);
            let expected = albedo * amplitude[3][x] * (1.0 + carriers.cosine[3]);
            let observed = light[3][x] - albedo * (offset[3][x] - amplitude[3][x]);
            let on = (modulation[x] > 0.0) & (usable[x] > 0.0);
            let infrared = waves.infrared(&vector, x, phase[x]).phase;
            let inside = (infrared > field_rad[0]) & (infrared < field_rad[1]);
            // Outside the image of the projector, as if more were expected than nine pixels can show.
            let [expected, observed] = if inside { [expected, observed] } else { [1e3, 0.0] };
            found[0][x] = if on { expected } else { 0.0 };
            found[1][x] = if on { observed - SHARE_MIN * expected } else { 0.0 };
        }
        put(&mut out, i, &found);
    }
}
