//! Colours of a print: the albedo of every channel at every pixel.
//!
//! Background and modulation share one albedo, `I_c = rho_c (1 + k_c cos)`, and the contrast `k_c` is that of the light, not of the
//! ink: it varies slowly. So once the phase is known a pixel tells the albedo of every channel, as surely as its fringe is bright
//! there, and the mean over the pixels around that have the same albedo in all channels, as far as noise lets tell, has no window
//! on two colours (a bilateral mean; Tomasi and Manduchi, ICCV 1998).

use super::carriers;
use crate::demod::cells::{CellMaps, CellWork, Grid, RowMaps};
use crate::demod::lanes::{LANES, lanes, lanes_mut, put, take};
use crate::demod::scene::Scene;
use crate::demod::slopes::Slopes;
use crate::slots::Slots;
use multiversion::multiversion;
use rayon::prelude::*;

/// Width (sigma) over which the contrast is averaged, in fringe periods.
const CONTRAST: f32 = 1.5;
/// How far the mean reaches, and its width (sigma), in fringe periods.
const REACH: f32 = 0.6;
const WIDTH: f32 = 0.3;
/// Steps to the furthest pixel of the mean, at most.
const STEPS: usize = 3;
/// Relative error of an albedo by those of phase and contrast.
const ERROR: f32 = 0.015;
/// What the sum of squared differences of four channels, in units of what is expected, may be before a pixel counts less, and the
/// excess at which it counts no more.
const EXPECTED: f32 = 4.0;
const EXCESS: f32 = 16.0;
/// Steps of an albedo of 1; twice that is the greatest. What noise leaves of a mean is coarser by far.
const LEVELS: f32 = 32768.0;
/// Rows of one task.
const BLOCK: usize = 32;

/// Albedo of every pixel, and working maps.
#[derive(Debug)]
pub(super) struct Colours {
    /// Albedos of R, G, B, IR in padded rows, in units of 1/[`LEVELS`].
    planes: [Vec<u16>; 4],
    /// Length of these rows; 0 when the pixels take the backgrounds of their cells.
    stride: usize,
    /// 1 and the contrast of every channel.
    contrasts: CellMaps,
    sums: CellMaps,
    slots: Slots<(Rows, CellWork)>,
}

impl Default for Colours {
    fn default() -> Self {
        Self {
            planes: Default::default(),
            stride: 0,
            contrasts: CellMaps::new(8),
            sums: CellMaps::default(),
            slots: Slots::default(),
        }
    }
}

/// Rows of one task.
#[derive(Debug, Default)]
struct Rows {
    maps: RowMaps,
    losses: RowMaps,
    /// Light times its model, and the square of the model, of three rows.
    ring: [[Vec<f32>; 8]; 3],
    spare: Vec<f32>,
    /// Albedo and precision of four channels, row by row, with room to both sides.
    known: Vec<f32>,
}

/// Another pixel of the mean: rows down, columns right, both from the first, and weight.
type Tap = ([usize; 2], f32);

impl Colours {
    /// The pixels take the backgrounds of their cells.
    pub fn forget(&mut self) {
        self.stride = 0;
    }

    /// Whether the pixels of `scene` have colours of their own.
    pub fn known(&self, scene: &Scene<'_>) -> bool {
        self.stride == scene.grid.stride
    }

    /// Backgrounds and modulations of row `y`, with contrasts on `grid`.
    pub fn sample<'a>(&self, grid: &Grid, y: usize, maps: &'a mut RowMaps) -> [&'a mut [f32]; 8] {
        let mut rows = maps.sample_mut::<8>(grid, &self.contrasts, 0, y);
        for c in 0..4 {
            let (backgrounds, modulations) = rows[2 * c..].split_at_mut(1);
            let albedo = &self.planes[c][y * grid.stride..][..grid.stride];
            colour(albedo, backgrounds[0], modulations[0]);
        }
        rows
    }

    /// Measure them by a phase (rad) and where there is light; `backgrounds` give the contrasts, and intensities have the standard
    /// deviation `noise`.
    pub fn measure(
        &mut self,
        (grid, backgrounds): (&Grid, &CellMaps),
        scene: &Scene<'_>,
        (ratios, slopes): ([f32; 3], &Slopes),
        [phase, modulation]: [&[f32]; 2],
        noise: f32,
    ) {
        self.contrast(grid, backgrounds, scene);
        let Self { planes, stride, contrasts, slots, .. } = self;
        *stride = grid.stride;
        let (taps, reach) = taps(scene.period_px as f32);
        let wide = grid.stride + 2 * reach;
        planes.iter_mut().for_each(|plane| plane.resize(grid.pixels(), 0));
        let [red, green, blue, infrared] =
            planes.each_mut().map(|plane| plane.par_chunks_mut(BLOCK * grid.stride));
        red.zip(green).zip(blue.zip(infrared)).enumerate().for_each_init(
            || slots.take(),
            |slot, (block, ((red, green), (blue, infrared)))| {
                let Rows { maps, losses, ring, spare, known } = &mut slot.0;
                let (first, count) = (block * BLOCK, red.len() / grid.stride);
                // Rows from `first - reach` on; those beyond the border stay 0, and count nothing.
                let rows = first.saturating_sub(reach)..(first + count + reach).min(grid.height);
                let below = rows.start + reach - first;
                known.clear();
                known.resize(8 * wide * (count + 2 * reach), 0.0);
                let mut model = |y: usize, out: &mut [Vec<f32>; 8]| {
                    out.iter_mut().for_each(|row| row.resize(grid.stride, 0.0));
                    let model = maps.sample::<8>(grid, contrasts, 0, y);
                    let contrasts = [1, 3, 5, 7].map(|k| model[k]);
                    let [phase, modulation] = [phase, modulation].map(|plane| scene.row(plane, y));
                    let pixels =
                        [phase, modulation, scene.row(scene.usable, y), slopes.loss(scene, y, losses)];
                    project(contrasts, pixels, scene.rows(y), ratios, out.each_mut().map(Vec::as_mut_slice));
                };
                model(rows.start.saturating_sub(1), &mut ring[0]);
                model(rows.start, &mut ring[1]);
                for (i, y) in rows.enumerate() {
                    model((y + 1).min(grid.height - 1), &mut ring[(i + 2) % 3]);
                    let out = &mut known[8 * wide * (below + i)..][..8 * wide];
                    for c in 0..4 {
                        let (albedo, precision) = out[2 * c * wide..][..2 * wide].split_at_mut(wide);
                        let inner = [albedo, precision].map(|row| &mut row[reach..reach + grid.stride]);
                        let [products, squares] =
                            [c, 4 + c].map(|k| [0, 1, 2].map(|j| ring[(i + j) % 3][k].as_slice()));
                        divide([products, squares], grid.width, noise, spare, inner);
                    }
                }
                for i in 0..count {
                    let at = i * grid.stride..(i + 1) * grid.stride;
                    let out = [
                        &mut red[at.clone()],
                        &mut green[at.clone()],
                        &mut blue[at.clone()],
                        &mut infrared[at],
                    ];
                    average(&taps, (&known[8 * wide * i..], wide, reach), out);
                }
            },
        );
    }

    /// Contrasts of the light, from backgrounds that colours have as well.
    fn contrast(&mut self, grid: &Grid, backgrounds: &CellMaps, scene: &Scene<'_>) {
        let Self { contrasts, sums, slots, .. } = self;
        grid.smooth::<8, Rows>(
            CONTRAST * scene.period_px as f32 / grid.step as f32,
            slots,
            sums,
            contrasts,
            |row, k| Some(backgrounds.line(row, k)),
            |_, sums, out| {
                let columns = sums[0].len();
                for (pair, out) in sums.chunks_exact(2).zip(out.chunks_exact_mut(2 * columns)) {
                    let (whole, contrast) = out.split_at_mut(columns);
                    whole.fill(1.0);
                    for (contrast, (b, a)) in contrast.iter_mut().zip(pair[1].iter().zip(pair[0])) {
                        *contrast = b / a.max(1e-6);
                    }
                }
            },
        );
    }
}

/// The pixels of the mean around one, and how far they reach.
fn taps(period_px: f32) -> (Vec<Tap>, usize) {
    let spacing = (REACH * period_px / STEPS as f32).round().max(1.0) as usize;
    let sigma = WIDTH * period_px;
    let line = || 0..=2 * STEPS;
    let all = line().flat_map(|down| line().map(move |right| [down, right]));
    let near = all.filter_map(|steps| {
        let square = steps.map(|s| (s as f32 - STEPS as f32).powi(2)).iter().sum::<f32>();
        let weight = (-0.5 * square * (spacing as f32 / sigma).powi(2)).exp();
        (square <= (STEPS * STEPS) as f32).then(|| (steps.map(|s| s * spacing), weight))
    });
    (near.collect(), spacing * STEPS)
}

/// Light times its model for an albedo of 1, channel by channel, and the squares of that model; 0 for what has none.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn project(
    contrasts: [&[f32]; 4],
    pixels: [&[f32]; 4],
    light: [&[f32]; 4],
    ratios: [f32; 3],
    out: [&mut [f32]; 8],
) {
    let (contrasts, pixels, light) = (contrasts.map(lanes), pixels.map(lanes), light.map(lanes));
    let mut out = out.map(lanes_mut);
    for i in 0..pixels[0].len() {
        let (contrasts, light) = (take(&contrasts, i), take(&light, i));
        let [phase, modulation, usable, loss] = take(&pixels, i);
        let mut found = [[0.0; LANES]; 8];
        for x in 0..LANES {
            let (cosines, _) = carriers(phase[x], ratios, loss[x]);
            let on = if modulation[x] > 0.0 { usable[x] } else { 0.0 };
            for c in 0..4 {
                let model = 1.0 + contrasts[c][x] * cosines[c];
                let model = if model > 0.0 { on * model } else { 0.0 };
                (found[c][x], found[4 + c][x]) = (model * light[c][x], model * model);
            }
        }
        put(&mut out, i, &found);
    }
}

/// Albedo and its precision from products and squares of three rows, over a pixel and its eight neighbours.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn divide(
    rows: [[&[f32]; 3]; 2],
    width: usize,
    noise: f32,
    spare: &mut Vec<f32>,
    [albedo, precision]: [&mut [f32]; 2],
) {
    sum_of_nine(rows[0], width, spare, albedo);
    sum_of_nine(rows[1], width, spare, precision);
    let variance = noise * noise;
    for (albedo, precision) in albedo[..width].iter_mut().zip(&mut precision[..width]) {
        let square = *precision;
        let known = *albedo / if square > 1e-3 { square } else { 1e-3 };
        *albedo = known;
        *precision = square / (variance + square * (ERROR * ERROR * known * known + 1e-8));
    }
}

#[inline(always)]
fn sum_of_nine(rows: [&[f32]; 3], width: usize, spare: &mut Vec<f32>, out: &mut [f32]) {
    spare.resize(width + 2, 0.0);
    let [a, b, c] = rows.map(|row| &row[..width]);
    let middle = &mut spare[1..=width];
    for x in 0..width {
        middle[x] = a[x] + b[x] + c[x];
    }
    (spare[0], spare[width + 1]) = (0.0, 0.0);
    let [left, middle, right] = [0, 1, 2].map(|k| &spare[k..k + width]);
    for (x, out) in out[..width].iter_mut().enumerate() {
        *out = left[x] + middle[x] + right[x];
    }
}

/// Background, and modulation in the place of the contrast, by an albedo.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn colour(albedo: &[u16], background: &mut [f32], contrast: &mut [f32]) {
    for (albedo, (a, b)) in albedo.iter().zip(background.iter_mut().zip(contrast)) {
        *a = f32::from(*albedo) * (1.0 / LEVELS);
        *b *= *a;
    }
}

/// Pixels that are averaged side by side: with more the sums would not stay in registers.
const SIDE: usize = LANES / 2;

/// Mean albedo over the pixels around that have the same in all channels.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn average(taps: &[Tap], (known, wide, reach): (&[f32], usize, usize), out: [&mut [u16]; 4]) {
    let out = out.map(|row| row.as_chunks_mut::<SIDE>().0);
    let at = |row: usize, column: usize| -> [[f32; SIDE]; 8] {
        let rows = &known[8 * row * wide + column..];
        std::array::from_fn(|k| *rows[k * wide..].first_chunk().expect("rows are padded"))
    };
    for i in 0..out[0].len() {
        let own = at(reach, reach + i * SIDE);
        let mut sums = [[0.0; SIDE]; 8];
        for &([down, right], near) in taps {
            sums = join(sums, near, own, at(down, i * SIDE + right));
        }
        for c in 0..4 {
            for x in 0..SIDE {
                let weight = sums[2 * c + 1][x];
                let albedo = LEVELS * sums[2 * c][x] / if weight > 1e-20 { weight } else { 1e-20 };
                out[c][i][x] = albedo as u16;
            }
        }
    }
}

/// Adds other pixels, as far as they have the same albedo, to sums of weighted albedos and of weights.
#[inline(always)]
fn join(
    mut sums: [[f32; SIDE]; 8],
    near: f32,
    own: [[f32; SIDE]; 8],
    other: [[f32; SIDE]; 8],
) -> [[f32; SIDE]; 8] {
    let mut weight = [0.0; SIDE];
    for x in 0..SIDE {
        let mut apart = -EXPECTED;
        for c in 0..4 {
            let (mine, theirs) = (own[2 * c + 1][x], other[2 * c + 1][x]);
            let sure = if mine < theirs { mine } else { theirs };
            let gap = own[2 * c][x] - other[2 * c][x];
            // Of two variances the greater one stands for about two thirds of their sum.
            apart += 0.7 * sure * gap * gap;
        }
        let excess = if apart > 0.0 { apart * (1.0 / EXCESS) } else { 0.0 };
        let fits = if excess < 1.0 { 1.0 - excess } else { 0.0 };
        weight[x] = near * fits * fits;
    }
    for c in 0..4 {
        for x in 0..SIDE {
            let weight = weight[x] * other[2 * c + 1][x];
            sums[2 * c][x] += weight * other[2 * c][x];
            sums[2 * c + 1][x] += weight;
        }
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_distr::{Distribution, StandardNormal};
    use rand_pcg::{Pcg64Mcg, rand_core::SeedableRng};
    use std::f32::consts::TAU;

    const RATIOS: [f32; 3] = [1.0, 35.0 / 36.0, 30.0 / 36.0];
    const CONTRASTS: [f32; 4] = [0.8, 0.7, 0.9, 0.6];
    const INKS: [[f32; 4]; 2] = [[0.5, 0.2, 0.6, 0.4], [0.3, 0.5, 0.2, 0.4]];
    const EDGE: usize = 128;

    /// Colours found of two inks that meet in a column, under noise; cells mix both inks over ten pixels.
    struct Print {
        grid: Grid,
        colours: Colours,
    }

    impl Print {
        fn new(noise: f32, usable: impl Fn(usize) -> f32) -> Self {
            let grid = Grid::new([64, 256], 4.0);
            let mut random = Pcg64Mcg::seed_from_u64(3);
            let ink = |x: usize| INKS[usize::from(x >= EDGE)];
            let phase: Vec<f32> = (0..grid.pixels()).map(|i| 40.0 + TAU * (i % 256) as f32 / 25.0).collect();
            let light: [Vec<f32>; 4] = std::array::from_fn(|c| {
                let clean =
                    |i: usize| ink(i % 256)[c] * (1.0 + CONTRASTS[c] * carriers(phase[i], RATIOS, 0.0).0[c]);
                let mut draw = || -> f32 { StandardNormal.sample(&mut random) };
                (0..grid.pixels()).map(|i| clean(i) + noise * draw()).collect()
            });
            let mut maps = CellMaps::new(8);
            maps.fill::<8>(&grid, |_, lines| {
                for (k, line) in lines.into_iter().enumerate() {
                    for (column, value) in line.iter_mut().enumerate() {
                        let across = ((4.0 * column as f32 + 2.0 - 118.0) / 20.0).clamp(0.0, 1.0);
                        let mixed = INKS[0][k / 2] + (INKS[1][k / 2] - INKS[0][k / 2]) * across;
                        *value = mixed * if k % 2 == 0 { 1.0 } else { CONTRASTS[k / 2] };
                    }
                }
            });
            let usable: Vec<f32> = (0..grid.pixels()).map(usable).collect();
            let modulation = vec![0.2; grid.pixels()];
            let planes = light.each_ref().map(Vec::as_slice);
            let scene = Scene { light: planes, usable: &usable, grid: &grid, period_px: 25.0, factor: 1 };
            let mut colours = Colours::default();
            let how = (RATIOS, &Slopes::flat(&grid));
            colours.measure((&grid, &maps), &scene, how, [&phase, &modulation], noise);
            Self { grid, colours }
        }

        /// Background and modulation of a channel in row 30 over what they ought to be.
        fn ratios(&self, c: usize, columns: impl Iterator<Item = usize>) -> Vec<[f32; 2]> {
            let mut maps = RowMaps::default();
            let rows = self.colours.sample(&self.grid, 30, &mut maps);
            let truth = |x: usize| INKS[usize::from(x >= EDGE)][c];
            columns
                .map(|x| [rows[2 * c][x] / truth(x), rows[2 * c + 1][x] / (truth(x) * CONTRASTS[c])])
                .collect()
        }
    }

    #[test]
    fn beside_an_edge_every_pixel_has_the_colour_of_its_side() {
        let print = Print::new(1e-3, |_| 1.0);
        for c in 0..4 {
            // A pixel and its neighbours see both colours in the two columns at the edge.
            let columns = (20..236).filter(|x| !(EDGE - 1..=EDGE).contains(x));
            for (at, ratios) in print.ratios(c, columns).into_iter().enumerate() {
                assert!(ratios.iter().all(|ratio| (ratio - 1.0).abs() < 0.03), "{c} {at} {ratios:?}");
            }
        }
    }

    #[test]
    fn colours_are_means_where_only_noise_tells_pixels_apart() {
        let noise = 0.02;
        let print = Print::new(noise, |_| 1.0);
        for c in 0..4 {
            let errors = print.ratios(c, 24..108).into_iter().map(|[a, _]| (a - 1.0).powi(2));
            let rms = (errors.sum::<f32>() / 84.0).sqrt();
            // One pixel knows its albedo as well as noise over light; hundreds stand together.
            assert!(rms < 0.25 * noise / INKS[0][c], "{c} {rms}");
        }
    }

    #[test]
    fn what_cannot_be_used_takes_the_colour_around() {
        let hole = |i: usize| (28..33).contains(&(i / 256)) && (60..65).contains(&(i % 256));
        let print = Print::new(1e-3, |i| if hole(i) { 0.0 } else { 1.0 });
        for c in 0..4 {
            for [a, b] in print.ratios(c, 58..67) {
                assert!((a - 1.0).abs() < 0.02 && (b - 1.0).abs() < 0.02, "{c} {a} {b}");
            }
        }
    }
}
