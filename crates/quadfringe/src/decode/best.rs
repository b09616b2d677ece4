//! The best chain: local fit, noise-aware phase, orders with support.

use super::{Decoded, Options};
use crate::angle::{atan2, round, wrap_positive};
use crate::condition::{Plan, Sample};
use crate::demod::carrier;
use crate::demod::grid::Grid;
use crate::demod::joint::Joint;
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
/// Greatest misfit of the four channels, root mean square: in units of the noise, and of the modulation.
const NOISE_MAX: f32 = 1.5;
const MISFIT_MAX: f32 = 0.15;
/// Fringe period in pixels from which on orders are chosen on every second pixel.
const COARSE_FROM_PX: f64 = 14.0;

pub(super) struct Best {
    support: Support,
    numbers: [f64; 3],
    columns_per_turn: f32,
    columns: f32,
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
            columns_per_turn: code.period_px(0) as f32,
            columns: code.projector_width() as f32,
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
            evidence: Vec::new(),
            sums: Array3::zeros((0, 0, 0)),
            orders: SupportMaps::default(),
        }
    }

    pub fn run<T: Sample>(&mut self, plan: &Plan, shot: &Shot<'_, T>, options: &Options, out: &mut Decoded) {
        self.condition(plan, shot);
        let width = self.shape[1];
        let light = self.light.each_ref().map(Vec::as_slice);
        let planes = Planes { light, usable: &self.usable, width };
        let period = options.period_px.unwrap_or_else(|| period_px(&planes));
        let grid = Grid::new(self.shape[0], width, ((period / 8.0) as usize).clamp(1, 16));
        find_light(&grid, &planes, period, 2.0 * options.modulation_min, &mut self.lit);
        self.usable.par_iter_mut().zip(&self.lit).for_each(|(usable, lit)| *usable &= lit);
        let planes = Planes { light, usable: &self.usable, width };
        let fit = LocalFit::new(grid, &planes, period, &mut self.maps);
        find_modulation(&fit, &self.maps, &self.lit, width, options.modulation_min, &mut self.modulation);
        wrapped_phase(&self.maps, &mut self.rough);
        let noise = noise(&self.rough, &self.modulation, width);
        self.noise = noise;
        let slopes = fit.slopes(&planes, &self.maps, &self.modulation);
        let window = Window::new(&fit.grid, &slopes, &self.modulation, width, period, noise);
        window.smooth(&self.rough, &mut self.phase);
        let stride = if period < COARSE_FROM_PX { 1 } else { 2 };
        gather(&fit, &self.phase, &self.modulation, self.shape, stride, &mut self.evidence);
        self.support.choose(&self.evidence, width.div_ceil(stride), &mut self.sums, &mut self.orders);
        self.lift(stride);
        let light = self.light.each_ref().map(Vec::as_slice);
        let planes = Planes { light, usable: &self.usable, width };
        let window = Window::new(&fit.grid, &slopes, &self.modulation, width, period, noise);
        let numbers = self.numbers;
        self.joint.run(&fit.grid, &window, &planes, numbers, period, &mut self.maps.albedo, &mut self.phase);
        self.write(stride, options, out);
    }

    /// Step 1: linear light.
    fn condition<T: Sample>(&mut self, plan: &Plan, shot: &Shot<'_, T>) {
        let width = self.shape[1];
        let [red, green, blue, infrared] = &mut self.light;
        red.par_chunks_mut(width)
            .zip(green.par_chunks_mut(width))
            .zip(blue.par_chunks_mut(width).zip(infrared.par_chunks_mut(width)))
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

    /// Wrapped to absolute: every pixel takes the order of its node, one more or less where the wrapped phase turns
    /// over in between.
    fn lift(&mut self, stride: usize) {
        let width = self.shape[1];
        let columns = width.div_ceil(stride);
        let (evidence, orders) = (&self.evidence, &self.orders.order);
        self.phase.par_chunks_mut(width).enumerate().for_each(|(y, phase)| {
            for (x, value) in phase.iter_mut().enumerate() {
                let node = y / stride * columns + x / stride;
                let own = wrap_positive(*value);
                let other = f32::from(evidence[node].phase) * (TAU / 65536.0);
                let turned = round((other - own) / TAU);
                *value = own + TAU * (f32::from(orders[node]) + turned);
            }
        });
    }

    /// Pixels whose four channels, with their neighbours', agree with the model of the chosen order; a wrong order has G
    /// and IR wrong.
    fn agrees(&self, y: usize, noise: f32, mean: &mut Vec<f32>, out: &mut Vec<bool>) {
        let [height, width] = self.shape;
        let rows = [y.saturating_sub(1), y, (y + 1).min(height - 1)].map(|row| row * width);
        let misfit = &self.joint.misfit;
        mean.clear();
        mean.extend((0..width).map(|x| rows.iter().map(|row| misfit[row + x]).sum::<f32>()));
        out.clear();
        out.extend((0..width).map(|x| {
            let sum = mean[x.saturating_sub(1)] + mean[x] + mean[(x + 1).min(width - 1)];
            let modulation = self.modulation[y * width + x];
            let most = (NOISE_MAX * noise).powi(2) + (MISFIT_MAX * modulation).powi(2);
            sum <= 9.0 * most
        }));
    }

    fn write(&self, stride: usize, options: &Options, out: &mut Decoded) {
        let width = self.shape[1];
        let columns = width.div_ceil(stride);
        let field = -1.5..self.columns + 0.5;
        let noise = self.noise;
        out.rows().enumerate().for_each_init(|| (Vec::new(), Vec::new()), |(mean, agrees), (y, [phase, modulation, quality])| {
            self.agrees(y, noise, mean, agrees);
            let from = y * width;
            for x in 0..width {
                let node = y / stride * columns + x / stride;
                let absolute = self.phase[from + x];
                let lit = self.modulation[from + x] > 0.0;
                let margin = self.orders.margin[node].min(1.0);
                let inside = field.contains(&(absolute / TAU * self.columns_per_turn));
                let sure = lit && agrees[x] && self.evidence[node].lit && inside && margin >= options.quality_min;
                phase[x] = if sure { absolute } else { f32::NAN };
                modulation[x] = self.modulation[from + x];
                quality[x] = if lit { margin } else { f32::NAN };
            }
        });
    }
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
    evidence
        .par_chunks_mut(columns)
        .enumerate()
        .for_each_init(RowMaps::default, |row_maps, (row, nodes)| {
            let y = row * stride;
            let [g, ir] = [fit.beat(1), fit.beat(3)];
            let slow = row_maps.sample(&fit.grid, y, [g[0], g[1], ir[0], ir[1]], width);
            for (node, x) in nodes.iter_mut().zip((0..width).step_by(stride)) {
                let beat = |re: usize| Evidence::turns(-atan2(slow[re + 1][x], slow[re][x]));
                *node = Evidence {
                    phase: Evidence::turns(wrap_positive(phase[y * width + x])),
                    beats: [beat(0), beat(2)],
                    lit: modulation[y * width + x] > 0.0,
                };
            }
        });
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
    let strength = |channel: usize| -> Vec<f32> {
        let h = &fit.channels[channel];
        h.p.iter().zip(&h.q).map(|(p, q)| p.hypot(*q)).collect()
    };
    let (red, blue) = (strength(0), strength(2));
    modulation
        .par_chunks_mut(width)
        .enumerate()
        .for_each_init(RowMaps::default, |row_maps, (y, out)| {
            let slow = [&fit.channels[0].a, &red, &fit.channels[2].a, &blue];
            let [a_r, b_r, a_b, b_b] = row_maps.sample(&fit.grid, y, slow, width);
            for x in 0..width {
                let seen = 0.5 * maps.albedo[y * width + x] * (b_r[x] + b_b[x]);
                let contrast = b_r[x] > CONTRAST_MIN * a_r[x] && b_b[x] > CONTRAST_MIN * a_b[x];
                out[x] = if lit[y * width + x] && contrast && seen >= least { seen } else { 0.0 };
            }
        });
}
