//! The best chain: a guide that uses surroundings, a joint fit of every pixel, and a judgement of each.

use super::expand::{Expander, FACTOR_MAX};
use super::guide::Guide;
use super::judge::{Findings, Judge};
use super::level::Level;
use super::output::Finish;
use super::uncertainty::PhaseNoise;
use super::{Decoded, Options};
use crate::condition::{Plan, Sample};
use crate::demod::agreement::Agreement;
use crate::demod::carrier;
use crate::demod::cells::{Grid, LANES, RowMaps};
use crate::demod::motion::Motion;
use crate::demod::scene::Scene;
use crate::demod::window::Window;
use crate::{FringeCode, Shot};
use ndarray::{ArrayView2, s};
use rayon::prelude::*;

/// Cells in a fringe period, at least.
const CELLS: f64 = 3.4;
/// Pixels in a fringe period of the image that guides, at least.
const GUIDE_PERIOD_PX: f64 = 12.0;
/// Pixels that interpolated light reaches into a shadow.
const MOSAIC_BLUR_PX: usize = 2;

/// Times that the light of a moving surface is brought to one instant and decoded again.
const MOTION_ROUNDS: usize = 3;

pub(super) struct Best {
    shape: [usize; 2],
    stride: usize,
    ratios: [f32; 3],
    full: Level,
    shrunk: Level,
    guide: Guide,
    expander: Expander,
    found: Vec<f32>,
    phase: Vec<f32>,
    modulation: Vec<f32>,
    judge: Judge,
    agreement: Agreement,
    /// Probability that the order of a node is another one.
    another: Vec<f32>,
    motion: Motion,
    /// Light as it was seen, when it has to be brought to one instant.
    seen: [Vec<f32>; 4],
}

impl Best {
    pub fn new(code: &FringeCode, shape: [usize; 2]) -> Self {
        let stride = shape[1].next_multiple_of(FACTOR_MAX * LANES);
        let mut full = Level::default();
        full.resize(stride * shape[0]);
        let numbers = code.numbers();
        Self {
            shape,
            stride,
            ratios: numbers.map(|n| (n / numbers[0]) as f32),
            full,
            shrunk: Level::default(),
            guide: Guide::new(code),
            expander: Expander::default(),
            found: Vec::new(),
            phase: Vec::new(),
            modulation: Vec::new(),
            judge: Judge::default(),
            agreement: Agreement::default(),
            another: Vec::new(),
            motion: Motion::default(),
            seen: Default::default(),
        }
    }

    pub fn run<T: Sample>(
        &mut self,
        plan: &Plan,
        shot: &Shot<'_, T>,
        options: &Options,
        finish: &Finish<'_>,
        out: &mut Decoded,
    ) {
        // 1. Linear light (S1).
        self.condition(plan, shot);
        let period_px = options.period_px.unwrap_or_else(|| period_px(&self.full.light[0], self.shape));
        let grid = Grid::with_stride(self.shape, self.stride, period_px / CELLS);
        let blur_px = if shot.mosaic().is_some() { MOSAIC_BLUR_PX } else { 0 };
        let factor = factor(period_px, &grid);

        let ratios = self.ratios;
        let motion = options.channel_instants_us.map(|instants| (ratios, instants.map(|t| 1e-6 * t)));
        if motion.is_some() {
            self.seen.clone_from(&self.full.light);
        }
        let mut rounds = if motion.is_some() { MOTION_ROUNDS } else { 0 };
        let (noise, share) = loop {
            // 2. to 4. Where light falls, beats, fringe orders, backgrounds: on as few pixels as tell them.
            if factor == 1 {
                self.guide.run(&mut self.full, (&grid, period_px, 1), blur_px, ratios, options);
                std::mem::swap(&mut self.phase, &mut self.guide.phase);
                std::mem::swap(&mut self.modulation, &mut self.guide.modulation);
            } else {
                let coarse = grid.shrunk(factor);
                self.shrunk.shrink(&self.full, [&coarse, &grid], factor);
                let how = (&coarse, period_px / factor as f64, factor);
                self.guide.run(&mut self.shrunk, how, blur_px.div_ceil(factor), ratios, options);
                self.expand([&coarse, &grid], period_px, blur_px);
            }

            // 4. All four channels measure the same column.
            let scene = self.full.scene(&grid, period_px, 1);
            let Guide { slopes, noise, backgrounds, joint, .. } = &mut self.guide;
            let window = Window::new(&scene, slopes, &self.modulation, *noise);
            joint.step(&scene, backgrounds, &window, ratios, &mut self.phase);
            let Some(motion) = motion.filter(|_| rounds > 0) else { break (*noise, window.share()) };

            // What moves is brought to one instant and decoded again.
            if rounds == MOTION_ROUNDS {
                self.motion.rest(&scene);
            }
            rounds -= 1;
            self.motion.measure(&scene, motion, backgrounds, &self.phase, &self.modulation);
            let Level { light, usable, .. } = &mut self.full;
            let seen = self.seen.each_ref().map(Vec::as_slice);
            let seen = Scene { light: seen, usable, grid: &grid, period_px, factor: 1 };
            let light = light.each_mut().map(Vec::as_mut_slice);
            self.motion.settle(&seen, motion, backgrounds, &self.phase, light);
        };

        // 5. What is not sure is no data.
        let scene = self.full.scene(&grid, period_px, 1);
        let Guide { backgrounds, orders, joint, .. } = &self.guide;
        let findings = Findings {
            phase: &self.phase,
            modulation: &self.modulation,
            misfit: &joint.misfit,
            noise,
            orders,
            quality_min: options.quality_min,
        };
        self.judge.run(&scene, &findings);
        if let Some((_, instants)) = motion {
            self.motion.rule_out(&scene, instants, &mut self.judge.sure);
        }

        // 6. How sure the rest is. Needed: the noise, the share of squared weights in the window and the information it has
        // added up, backgrounds and final phase, leads and misfits of the orders.
        self.agreement.measure(&scene, (ratios, noise), backgrounds, &self.phase, &self.modulation);
        orders.another(&scene, &mut self.another);
        self.write(&scene, &PhaseNoise::new(noise, share), finish, out);
    }

    /// From the guide to every pixel.
    fn expand(&mut self, [coarse, grid]: [&Grid; 2], period_px: f64, blur_px: usize) {
        for plane in [&mut self.found, &mut self.phase, &mut self.modulation] {
            plane.resize(grid.pixels(), 0.0);
        }
        let guide = &mut self.guide;
        guide.finder.refind(grid, self.full.light.each_ref().map(Vec::as_slice), &mut self.found);
        guide.noise = guide.finder.noise;
        (0..blur_px).for_each(|_| guide.finder.shrink(grid, &mut self.found));
        self.full.restrict(grid, &self.found);
        let factor = grid.step / coarse.step;
        let shrunk = self.shrunk.scene(coarse, period_px / factor as f64, factor);
        let scenes = [&shrunk, &self.full.scene(grid, period_px, 1)];
        let out = [self.phase.as_mut_slice(), &mut self.modulation];
        self.expander.run(scenes, guide, self.ratios, &self.full.lit, out);
    }

    /// Planes of linear light; `lit` is 0 for glare and for what one chip does not see, `usable` for pixels that are saturated.
    fn condition<T: Sample>(&mut self, plan: &Plan, shot: &Shot<'_, T>) {
        let ([_, width], stride) = (self.shape, self.stride);
        let Level { light, lit, usable } = &mut self.full;
        let [red, green, blue, infrared] = light.each_mut().map(|plane| plane.par_chunks_mut(stride));
        let saturation = usable.par_chunks_mut(stride).zip(lit.par_chunks_mut(stride));
        let rows = red.zip(green).zip(blue.zip(infrared)).zip(saturation).enumerate();
        rows.for_each_init(
            || (vec![false; width], vec![false; width]),
            |(unsaturated, glare), (y, (((red, green), (blue, infrared)), (usable, lit)))| {
                plan.saturation_row(shot, y, unsaturated, glare);
                let mut rows = [red, green, blue, infrared].map(|row| &mut row[..width]);
                plan.row(shot, y, &mut rows);
                for x in 0..width {
                    // A pixel that the infrared chip does not see takes no part in any fit.
                    let seen = rows[3][x].is_finite();
                    if !seen {
                        rows.iter_mut().for_each(|row| row[x] = 0.0);
                    }
                    usable[x] = f32::from(u8::from(seen && unsaturated[x]));
                    lit[x] = f32::from(u8::from(seen && !glare[x]));
                }
            },
        );
    }

    fn write(&self, scene: &Scene<'_>, noise: &PhaseNoise, finish: &Finish<'_>, out: &mut Decoded) {
        let grid = scene.grid;
        out.rows().enumerate().for_each_init(RowMaps::default, |maps, (y, mut row)| {
            let at = y * grid.stride..y * grid.stride + grid.width;
            let known = self.judge.sure[at.clone()].iter().zip(&self.phase[at.clone()]);
            for (out, (sure, own)) in row.phase.iter_mut().zip(known) {
                *out = if *sure != 0 { *own } else { f32::NAN };
            }
            row.modulation.copy_from_slice(&self.guide.joint.modulation[at.clone()]);
            row.quality.copy_from_slice(&self.judge.quality[at.clone()]);
            let disagreement = self.agreement.row(scene, y, maps);
            noise.row(&self.guide.joint.information[at], disagreement, row.sigma);
            let nodes = &self.another[y / grid.step * grid.columns..];
            row.wrong.chunks_mut(grid.step).zip(nodes).for_each(|(wrong, node)| wrong.fill(*node));
            finish.row(y, &mut row);
        });
    }
}

/// How many times fewer pixels along a side still show the fringes.
fn factor(period_px: f64, grid: &Grid) -> usize {
    let mut factor = 1;
    while factor < FACTOR_MAX.min(grid.step) && period_px >= 2.0 * GUIDE_PERIOD_PX * factor as f64 {
        factor *= 2;
    }
    factor
}

/// Fringe period across the fringes, from the red image; a sixteenth of the image when nothing stands out.
fn period_px(red: &[f32], [height, width]: [usize; 2]) -> f64 {
    let stride = red.len() / height;
    let red = ArrayView2::from_shape((height, stride), red).expect("a plane is whole");
    let found = carrier(red.slice(s![.., ..width])).period_px();
    let shorter = width.min(height) as f64;
    if found.is_finite() { found.clamp(4.0, shorter.max(8.0)) } else { width as f64 / 16.0 }
}
