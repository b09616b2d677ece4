//! The best chain: local fit, orders with support, joint fit, and a judgement of every pixel.

use super::judge::{Findings, Judge, MISFIT_MAX};
use super::orders::{Orders, Wrapped};
use super::output::Finish;
use super::uncertainty::PhaseNoise;
use super::{Decoded, Options};
use crate::condition::{Plan, Sample};
use crate::demod::agreement::Agreement;
use crate::demod::backgrounds::Backgrounds;
use crate::demod::carrier;
use crate::demod::cells::{Grid, RowMaps};
use crate::demod::joint::Joint;
use crate::demod::light::LightFinder;
use crate::demod::local_fit::{LocalFit, PixelMaps};
use crate::demod::motion::Motion;
use crate::demod::scene::Scene;
use crate::demod::slopes::Slopes;
use crate::demod::window::{Window, noise};
use crate::{FringeCode, Shot};
use ndarray::{ArrayView2, s};
use rayon::prelude::*;

/// Cells in a fringe period, at least.
const CELLS: f64 = 4.5;

/// Pixels that interpolated light reaches into a shadow.
const MOSAIC_BLUR_PX: usize = 2;

/// Times that the light of a moving surface is brought to one instant and decoded again.
const MOTION_ROUNDS: usize = 3;

pub(super) struct Best {
    shape: [usize; 2],
    ratios: [f32; 3],
    light: [Vec<f32>; 4],
    lit: Vec<f32>,
    usable: Vec<f32>,
    modulation: Vec<f32>,
    wrapped: Vec<f32>,
    phase: Vec<f32>,
    finder: LightFinder,
    fit: LocalFit,
    slopes: Slopes,
    orders: Orders,
    backgrounds: Backgrounds,
    joint: Joint,
    agreement: Agreement,
    /// Probability that the order of a node is another one.
    another: Vec<f32>,
    motion: Motion,
    /// Light as it was seen, when it has to be brought to one instant.
    seen: [Vec<f32>; 4],
    judge: Judge,
}

impl Best {
    pub fn new(code: &FringeCode, shape: [usize; 2]) -> Self {
        let pixels = Grid::new(shape, 1.0).pixels();
        let plane = || vec![0.0; pixels];
        let numbers = code.numbers();
        Self {
            shape,
            ratios: numbers.map(|n| (n / numbers[0]) as f32),
            light: [plane(), plane(), plane(), plane()],
            lit: plane(),
            usable: plane(),
            modulation: plane(),
            wrapped: plane(),
            phase: plane(),
            finder: LightFinder::default(),
            fit: LocalFit::default(),
            slopes: Slopes::default(),
            orders: Orders::new(code),
            backgrounds: Backgrounds::new(),
            joint: Joint::default(),
            agreement: Agreement::default(),
            another: Vec::new(),
            motion: Motion::default(),
            seen: Default::default(),
            judge: Judge::default(),
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
        // 1. Linear light (S1), and where it comes from the projector.
        self.condition(plan, shot);
        let light = self.light.each_ref().map(Vec::as_slice);
        let period_px = options.period_px.unwrap_or_else(|| period_px(light[0], self.shape));
        let grid = Grid::new(self.shape, period_px / CELLS);
        self.finder.find(&grid, light, period_px, 2.0 * options.modulation_min, &mut self.modulation);
        if shot.mosaic().is_some() {
            // Interpolated between the samples of a mosaic, light reaches into the shadow beside it.
            (0..MOSAIC_BLUR_PX).for_each(|_| self.finder.shrink(&grid, &mut self.modulation));
        }
        let found = self.modulation.par_chunks(grid.stride);
        let masks = self.lit.par_chunks_mut(grid.stride).zip(self.usable.par_chunks_mut(grid.stride));
        masks.zip(found).for_each(|((lit, usable), found)| {
            for ((lit, usable), found) in lit.iter_mut().zip(usable).zip(found) {
                *lit *= found;
                *usable *= *lit;
            }
        });
        let motion = options.channel_instants_us.map(|instants| (self.ratios, instants.map(|t| 1e-6 * t)));
        if motion.is_some() {
            self.seen = self.light.clone();
        }
        let mut rounds = if motion.is_some() { MOTION_ROUNDS } else { 0 };
        let (noise, share) = loop {
            let light = self.light.each_ref().map(Vec::as_slice);
            let scene = Scene { light, usable: &self.usable, grid: &grid, period_px };

            // 2. Two-step phase of R and B (S2), beats of G and IR against it (S3).
            let maps = PixelMaps { phase: &mut self.wrapped, modulation: &mut self.modulation };
            self.fit.run(&scene, &self.lit, options.modulation_min, maps);
            let noise = noise(&scene, &self.wrapped, &self.modulation);
            let relative_noise = relative(noise, &self.modulation);
            self.slopes.measure(&scene, &self.wrapped, &self.modulation);

            // 3. Fringe orders: by beats from windows and by what every pixel sees itself (S4).
            let known = Wrapped {
                phase: &self.wrapped,
                modulation: &self.modulation,
                fit: &self.fit,
                backgrounds: None,
                slopes: &self.slopes,
            };
            self.orders.choose(&scene, &known, &mut self.phase);
            self.backgrounds.start(&scene, &self.fit);
            self.backgrounds.fit(
                &scene,
                self.ratios,
                &self.phase,
                &self.modulation,
                (MISFIT_MAX, relative_noise),
            );
            let known = Wrapped { backgrounds: Some(&self.backgrounds), ..known };
            self.orders.choose(&scene, &known, &mut self.phase);

            // 4. All four channels measure the same column.
            let window = Window::new(&scene, &self.slopes, &self.modulation, noise);
            for window in [window.near(), window] {
                self.backgrounds.fit(
                    &scene,
                    self.ratios,
                    &self.phase,
                    &self.modulation,
                    (MISFIT_MAX, relative_noise),
                );
                self.joint.step(&scene, &self.backgrounds, &window, self.ratios, &mut self.phase);
            }

            // What moves is brought to one instant and decoded again.
            let Some(motion) = motion.filter(|_| rounds > 0) else { break (noise, window.share()) };
            if rounds == MOTION_ROUNDS {
                self.motion.rest(&scene);
            }
            rounds -= 1;
            self.motion.measure(&scene, motion, &self.backgrounds, &self.phase, &self.modulation);
            let light = self.seen.each_ref().map(Vec::as_slice);
            let seen = Scene { light, usable: &self.usable, grid: &grid, period_px };
            let light = self.light.each_mut().map(Vec::as_mut_slice);
            self.motion.settle(&seen, motion, &self.backgrounds, &self.phase, light);
        };

        // 5. What is not sure is no data.
        let light = self.light.each_ref().map(Vec::as_slice);
        let scene = Scene { light, usable: &self.usable, grid: &grid, period_px };
        let findings = Findings {
            phase: &self.phase,
            modulation: &self.modulation,
            misfit: &self.joint.misfit,
            noise,
            orders: &self.orders,
            quality_min: options.quality_min,
        };
        self.judge.run(&scene, &findings);
        if let Some((_, instants)) = motion {
            self.motion.rule_out(&scene, instants, &mut self.judge.sure);
        }

        // 6. How sure the rest is. Needed: the noise, the share of squared weights in the window and the information it has
        // added up, backgrounds and final phase, leads and misfits of the orders.
        let known = (self.ratios, noise);
        self.agreement.measure(&scene, known, &self.backgrounds, &self.phase, &self.modulation);
        let noise = PhaseNoise::new(noise, share);
        self.orders.another(&scene, &mut self.another);
        self.write(&scene, &noise, finish, out);
    }

    /// Planes of linear light; `lit` is 0 for glare, `usable` for pixels that are saturated.
    fn condition<T: Sample>(&mut self, plan: &Plan, shot: &Shot<'_, T>) {
        let [_, width] = self.shape;
        let stride = width.next_multiple_of(crate::demod::cells::LANES);
        let [red, green, blue, infrared] = self.light.each_mut().map(|plane| plane.par_chunks_mut(stride));
        let saturation = self.usable.par_chunks_mut(stride).zip(self.lit.par_chunks_mut(stride));
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
                    lit[x] = f32::from(u8::from(!glare[x]));
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
            row.modulation.copy_from_slice(&self.modulation[at.clone()]);
            row.quality.copy_from_slice(&self.judge.quality[at.clone()]);
            let disagreement = self.agreement.row(scene, y, maps);
            noise.row(&self.joint.information[at], disagreement, row.sigma);
            let nodes = &self.another[y / grid.step * grid.columns..];
            row.wrong.chunks_mut(grid.step).zip(nodes).for_each(|(wrong, node)| wrong.fill(*node));
            finish.row(y, &mut row);
        });
    }
}

/// Noise over the mean modulation of what is lit.
fn relative(noise: f32, modulation: &[f32]) -> f32 {
    let lit = modulation.iter().step_by(31).filter(|&&m| m > 0.0);
    let (sum, count) = lit.fold((0.0, 0.0), |(sum, count), m| (sum + m, count + 1.0));
    noise * count / f32::max(sum, 1e-6)
}

/// Fringe period across the fringes, from the red image; a sixteenth of the image when nothing stands out.
fn period_px(red: &[f32], [height, width]: [usize; 2]) -> f64 {
    let stride = red.len() / height;
    let red = ArrayView2::from_shape((height, stride), red).expect("a plane is whole");
    let found = carrier(red.slice(s![.., ..width])).period_px();
    let shorter = width.min(height) as f64;
    if found.is_finite() { found.clamp(4.0, shorter.max(8.0)) } else { width as f64 / 16.0 }
}
