//! The best chain: local fit, noise-aware phase, orders with support.

use super::islands::{mark_seams, remove_islands, remove_slivers};
use super::{Decoded, Options};
use crate::angle::{atan2, round, sin_cos, wrap_positive};
use crate::condition::{Plan, Sample};
use crate::demod::carrier;
use crate::demod::grid::Grid;
use crate::demod::joint::{Channels, Joint, fit as fit_channels};
use crate::demod::light::find_light;
use crate::demod::local_fit::{LocalFit, PixelMaps, Planes, RowMaps};
use crate::demod::window::{Window, noise};
use crate::unwrap::{Evidence, Support, SupportMaps};
use crate::{FringeCode, Shot};
use ndarray::{Array3, ArrayView2};
use rayon::prelude::*;
use std::f32::consts::TAU;

/// Least contrast (modulation over background) of light that comes from the projector.
const CONTRAST_MIN: f32 = 0.1;
/// Least mean square of the phasor of R and B in any direction: 1/2 for whole fringes, 0 when B repeats R.
const SPREAD_MIN: f32 = 0.02;
/// Greatest misfit of the four channels, root mean square: in units of the noise, and of the modulation.
const NOISE_MAX: f32 = 1.5;
const MISFIT_MAX: f32 = 0.2;
/// Greatest square of a pixel's own misfit, in units of what its neighbours may have on average.
const OWN_MISFIT_MAX: f32 = 3.0;
/// Trusted pixels of the 25 around that make a pixel part of a surface; a straight edge leaves 15.
const NEIGHBOURS_MIN: u8 = 10;
/// Fringe period in pixels from which on orders are chosen on every second pixel.
const COARSE_FROM_PX: f64 = 14.0;

pub(super) struct Best {
    support: Support,
    numbers: [f64; 3],
    shape: [usize; 2],
    light: [Vec<f32>; 4],
    lit: Vec<bool>,
    usable: Vec<bool>,
    maps: PixelMaps,
    modulation: Vec<f32>,
    rough: Vec<f32>,
    phase: Vec<f32>,
    joint: Joint,
    noise: f32,
    quality: Vec<f32>,
    memory: Vec<u32>,
    seams: Vec<bool>,
    counts: Vec<u8>,
    evidence: Vec<Evidence>,
    sums: Array3<u16>,
    orders: SupportMaps,
}

impl Best {
    pub fn new(code: &FringeCode, shape: [usize; 2]) -> Self {
        let pixels = shape[0] * shape[1];
        let plane = || vec![0.0; pixels];
        Self {
            support: Support::new(code),
            numbers: code.numbers(),
            shape,
            light: [plane(), plane(), plane(), plane()],
            lit: vec![false; pixels],
            usable: vec![false; pixels],
            maps: PixelMaps::default(),
            modulation: plane(),
            rough: plane(),
            phase: plane(),
            joint: Joint::default(),
            noise: 0.0,
            quality: plane(),
            memory: Vec::new(),
            seams: Vec::new(),
            counts: Vec::new(),
            evidence: Vec::new(),
            sums: Array3::zeros((0, 0, 0)),
            orders: SupportMaps::default(),
        }
    }

    pub fn run<T: Sample>(
        &mut self,
        plan: &Plan,
        shot: &Shot<'_, T>,
        options: &Options,
        out: &mut Decoded,
    ) {
        self.condition(plan, shot);
        let width = self.shape[1];
        let light = self.light.each_ref().map(Vec::as_slice);
        let planes = Planes {
            light,
            usable: &self.usable,
            width,
        };
        let period = options.period_px.unwrap_or_else(|| period_px(&planes));
        let grid = Grid::new(self.shape[0], width, ((period / 8.0) as usize).clamp(1, 16));
        find_light(
            &grid,
            &planes,
            period,
            2.0 * options.modulation_min,
            &mut self.lit,
        );
        self.usable
            .par_iter_mut()
            .zip(&self.lit)
            .for_each(|(usable, lit)| *usable &= lit);
        let planes = Planes {
            light,
            usable: &self.usable,
            width,
        };
        let fit = LocalFit::new(grid, &planes, period, &mut self.maps);
        find_modulation(
            &fit,
            &self.maps,
            &self.lit,
            width,
            options.modulation_min,
            &mut self.modulation,
        );
        wrapped_phase(&self.maps, &mut self.rough);
        let noise = noise(&self.rough, &self.modulation, width);
        self.noise = noise;
        let slopes = fit.slopes(&planes, &self.maps, &self.modulation);
        let window = Window::new(&fit.grid, &slopes, &self.modulation, width, period, noise);
        window.smooth(&self.rough, &mut self.phase);
        let stride = if period < COARSE_FROM_PX { 1 } else { 2 };
        gather(
            &fit,
            &self.phase,
            &self.modulation,
            self.shape,
            stride,
            &mut self.evidence,
        );
        self.support.choose(
            &self.evidence,
            width.div_ceil(stride),
            &mut self.sums,
            &mut self.orders,
        );
        lift(&self.evidence, &self.orders, stride, width, &mut self.phase);
        let channels = fit_channels(
            &fit.grid,
            &planes,
            self.numbers,
            period,
            &self.maps.albedo,
            &self.phase,
        );
        witness(
            &fit.grid,
            &channels,
            &planes,
            &self.phase,
            stride,
            &mut self.evidence,
        );
        self.support.choose(
            &self.evidence,
            width.div_ceil(stride),
            &mut self.sums,
            &mut self.orders,
        );
        lift(&self.evidence, &self.orders, stride, width, &mut self.phase);
        let window = Window::new(&fit.grid, &slopes, &self.modulation, width, period, noise);
        let numbers = self.numbers;
        self.joint.run(
            &fit.grid,
            &window,
            &planes,
            numbers,
            period,
            &mut self.maps.albedo,
            &mut self.phase,
        );
        self.judge(&fit.grid, stride, period, options);
        self.write(out);
    }

    /// Step 1: linear light.
    fn condition<T: Sample>(&mut self, plan: &Plan, shot: &Shot<'_, T>) {
        let width = self.shape[1];
        let [red, green, blue, infrared] = &mut self.light;
        red.par_chunks_mut(width)
            .zip(green.par_chunks_mut(width))
            .zip(
                blue.par_chunks_mut(width)
                    .zip(infrared.par_chunks_mut(width)),
            )
            .zip(self.usable.par_chunks_mut(width))
            .enumerate()
            .for_each(|(y, (((red, green), (blue, infrared)), usable))| {
                plan.usable_row(shot, y, usable);
                let mut rows = [red, green, blue, infrared];
                plan.row(shot, y, &mut rows);
                // A pixel that the infrared chip does not see takes no part in any fit.
                for (usable, light) in usable.iter_mut().zip(rows[3].iter_mut()) {
                    if !light.is_finite() {
                        (*usable, *light) = (false, 0.0);
                    }
                }
            });
    }

    /// Pixels whose four channels, with their neighbours', agree with the model of the chosen order; a wrong order has G
    /// and IR wrong.
    fn agrees(&self, y: usize, mean: &mut Vec<f32>, out: &mut Vec<bool>) {
        let [height, width] = self.shape;
        let rows = [y.saturating_sub(1), y, (y + 1).min(height - 1)].map(|row| row * width);
        let misfit = &self.joint.misfit;
        mean.clear();
        mean.extend((0..width).map(|x| rows.iter().map(|row| misfit[row + x]).sum::<f32>()));
        out.clear();
        out.extend((0..width).map(|x| {
            let sum = mean[x.saturating_sub(1)] + mean[x] + mean[(x + 1).min(width - 1)];
            let modulation = self.modulation[y * width + x];
            let most = (NOISE_MAX * self.noise).powi(2) + (MISFIT_MAX * modulation).powi(2);
            sum <= 9.0 * most && misfit[y * width + x] <= OWN_MISFIT_MAX * most
        }));
    }

    /// Absolute phase of the pixels that can be trusted, NaN elsewhere; quality of all that are lit.
    fn judge(&mut self, grid: &Grid, stride: usize, period_px: f64, options: &Options) {
        let width = self.shape[1];
        let columns = width.div_ceil(stride);
        let support = self.support_cells(grid, stride, period_px);
        mark_seams(
            &self.phase,
            |i| self.modulation[i] > 0.0,
            width,
            &mut self.seams,
        );
        let mut trusted = std::mem::take(&mut self.rough);
        let mut quality = std::mem::take(&mut self.quality);
        trusted
            .par_chunks_mut(width)
            .zip(quality.par_chunks_mut(width))
            .enumerate()
            .for_each_init(
                Default::default,
                |(mean, agrees, maps): &mut (Vec<f32>, Vec<bool>, RowMaps),
                 (y, (trusted, quality))| {
                    self.agrees(y, mean, agrees);
                    let [backing, ..] = maps.sample(grid, y, [&support; 4], width);
                    for x in 0..width {
                        let (node, at) = (y / stride * columns + x / stride, y * width + x);
                        let lit = self.modulation[at] > 0.0 && self.evidence[node].lit;
                        quality[x] = self.orders.margin[node].min(1.0) * backing[x].clamp(0.0, 1.0);
                        let sure = lit
                            && agrees[x]
                            && !self.seams[at]
                            && quality[x] >= options.quality_min;
                        trusted[x] = if sure { self.phase[at] } else { f32::NAN };
                        if !lit {
                            quality[x] = f32::NAN;
                        }
                    }
                },
            );
        remove_slivers(&mut trusted, width, NEIGHBOURS_MIN, &mut self.counts);
        let least = (period_px / 4.0).powi(2) as usize;
        remove_islands(&mut trusted, width, least, &mut self.memory);
        (self.rough, self.quality) = (trusted, quality);
    }

    /// Share of the surroundings whose own light speaks for the chosen order, on the cells.
    fn support_cells(&self, grid: &Grid, stride: usize, period_px: f64) -> Vec<f32> {
        let columns = self.shape[1].div_ceil(stride);
        let mut sums = [vec![1e-6f32; grid.cells()], vec![1e-6f32; grid.cells()]];
        for (i, (node, misfit)) in self.evidence.iter().zip(&self.orders.misfit).enumerate() {
            if node.lit {
                let (y, x) = (i / columns * stride, i % columns * stride);
                let cell = y / grid.step * grid.columns + x / grid.step;
                sums[0][cell] += 1.0;
                sums[1][cell] += 1.0 - misfit;
            }
        }
        grid.smooth_all(&mut sums, period_px as f32 / grid.step as f32);
        sums[1]
            .iter()
            .zip(&sums[0])
            .map(|(for_it, all)| for_it / all)
            .collect()
    }

    fn write(&self, out: &mut Decoded) {
        let width = self.shape[1];
        out.rows()
            .enumerate()
            .for_each(|(y, [phase, modulation, quality])| {
                let at = y * width..(y + 1) * width;
                phase.copy_from_slice(&self.rough[at.clone()]);
                modulation.copy_from_slice(&self.modulation[at.clone()]);
                quality.copy_from_slice(&self.quality[at]);
            });
    }
}

/// Wrapped to absolute: every pixel takes the order of its node, one more or less where the wrapped phase turns over in
/// between.
fn lift(
    evidence: &[Evidence],
    orders: &SupportMaps,
    stride: usize,
    width: usize,
    phase: &mut [f32],
) {
    let columns = width.div_ceil(stride);
    phase
        .par_chunks_mut(width)
        .enumerate()
        .for_each(|(y, phase)| {
            for (x, value) in phase.iter_mut().enumerate() {
                let node = y / stride * columns + x / stride;
                let own = wrap_positive(*value);
                let other = f32::from(evidence[node].phase) * (TAU / 65536.0);
                let turned = round((other - own) / TAU);
                *value = own + TAU * (f32::from(orders.order[node]) + turned);
            }
        });
}

/// What every node itself sees of G and IR: their cosines, once R and B have told the albedo.
fn witness(
    grid: &Grid,
    channels: &Channels,
    planes: &Planes<'_>,
    phase: &[f32],
    stride: usize,
    evidence: &mut [Evidence],
) {
    let width = planes.width;
    let columns = width.div_ceil(stride);
    evidence.par_chunks_mut(columns).enumerate().for_each_init(
        <[RowMaps; 2]>::default,
        |[visible, others], (row, nodes)| {
            let y = row * stride;
            let [r, g, b, ir] = channels;
            let [a_r, b_r, a_b, b_b] = visible.sample(grid, y, [&r.a, &r.p, &b.a, &b.p], width);
            let [a_g, b_g, a_i, b_i] = others.sample(grid, y, [&g.a, &g.p, &ir.a, &ir.p], width);
            let [red, green, blue, infrared] = planes.rows(y);
            for (node, x) in nodes.iter_mut().zip((0..width).step_by(stride)) {
                let (s, c) = sin_cos(phase[y * width + x]);
                let (model_r, model_b) = (a_r[x] + b_r[x] * c, a_b[x] - b_b[x] * s);
                let norm = (model_r * model_r + model_b * model_b).max(1e-6);
                let albedo = (red[x] * model_r + blue[x] * model_b) / norm;
                let cosine = |light: f32, a: f32, b: f32| {
                    let seen = (light - albedo * a) / (albedo * b).max(1e-6);
                    (seen.clamp(-2.0, 2.0) * 128.0) as i16
                };
                node.cosines = Some([
                    cosine(green[x], a_g[x], b_g[x]),
                    cosine(infrared[x], a_i[x], b_i[x]),
                ]);
            }
        },
    );
}

/// What every node knows of its order.
fn gather(
    fit: &LocalFit,
    phase: &[f32],
    modulation: &[f32],
    [height, width]: [usize; 2],
    stride: usize,
    evidence: &mut Vec<Evidence>,
) {
    let columns = width.div_ceil(stride);
    evidence.resize(height.div_ceil(stride) * columns, Evidence::default());
    evidence.par_chunks_mut(columns).enumerate().for_each_init(
        RowMaps::default,
        |row_maps, (row, nodes)| {
            let y = row * stride;
            let [g, ir] = [fit.beat(1), fit.beat(3)];
            let slow = row_maps.sample(&fit.grid, y, [g[0], g[1], ir[0], ir[1]], width);
            for (node, x) in nodes.iter_mut().zip((0..width).step_by(stride)) {
                let beat = |re: usize| Evidence::turns(-atan2(slow[re + 1][x], slow[re][x]));
                *node = Evidence {
                    phase: Evidence::turns(wrap_positive(phase[y * width + x])),
                    beats: [beat(0), beat(2)],
                    cosines: None,
                    lit: modulation[y * width + x] > 0.0,
                };
            }
        },
    );
}

fn wrapped_phase(maps: &PixelMaps, phase: &mut [f32]) {
    phase
        .par_iter_mut()
        .zip(maps.cos.par_iter().zip(&maps.sin))
        .for_each(|(phase, (&c, &s))| *phase = atan2(s, c));
}

/// Fringe period across the fringes, from the red image; a sixteenth of the image when nothing stands out.
fn period_px(planes: &Planes<'_>) -> f64 {
    let (height, width) = (planes.height(), planes.width);
    let red = ArrayView2::from_shape((height, width), planes.light[0]).expect("a plane is whole");
    let found = carrier(red).period_px();
    if found.is_finite() {
        found.clamp(4.0, width as f64 / 2.0)
    } else {
        width as f64 / 16.0
    }
}

/// Modulation of every pixel in linear light, 0 where too little of it comes from the projector.
fn find_modulation(
    fit: &LocalFit,
    maps: &PixelMaps,
    lit: &[bool],
    width: usize,
    least: f32,
    modulation: &mut [f32],
) {
    let strengths: [Vec<f32>; 4] = fit.channels.each_ref().map(|h| {
        let cells = h.a.iter().zip(h.p.iter().zip(&h.q)).zip(&fit.spread);
        cells
            .map(|((a, (p, q)), spread)| {
                let strength = p.hypot(*q);
                let fringes = strength > CONTRAST_MIN * a && *spread > SPREAD_MIN;
                if fringes { strength } else { 0.0 }
            })
            .collect()
    });
    modulation.par_chunks_mut(width).enumerate().for_each_init(
        RowMaps::default,
        |row_maps, (y, out)| {
            let [red, green, blue, infrared] =
                row_maps.sample(&fit.grid, y, strengths.each_ref(), width);
            for x in 0..width {
                let albedo = maps.albedo[y * width + x];
                let weakest = red[x].min(blue[x]).min(green[x]).min(infrared[x]);
                let enough = lit[y * width + x] && albedo * weakest >= least;
                out[x] = if enough {
                    0.5 * albedo * (red[x] + blue[x])
                } else {
                    0.0
                };
            }
        },
    );
}
