//! The best chain: local fit, orders with support, joint fit, and a judgement of every pixel.

use super::judge::{Findings, Judge};
use super::nodes::Nodes;
use super::output::Finish;
use super::{Decoded, Options};
use crate::condition::{Plan, Sample};
use crate::demod::carrier;
use crate::demod::grid::Grid;
use crate::demod::joint::Joint;
use crate::demod::light::find_light;
use crate::demod::local_fit::{LocalFit, PixelMaps};
use crate::demod::scene::Scene;
use crate::demod::window::{Window, noise};
use crate::unwrap::Support;
use crate::{FringeCode, Shot};
use ndarray::ArrayView2;
use rayon::prelude::*;

/// Cells in a fringe period.
const CELLS: f64 = 8.0;

pub(super) struct Best {
    shape: [usize; 2],
    light: [Vec<f32>; 4],
    unsaturated: Vec<bool>,
    glare: Vec<bool>,
    lit: Vec<bool>,
    usable: Vec<bool>,
    maps: PixelMaps,
    modulation: Vec<f32>,
    wrapped: Vec<f32>,
    phase: Vec<f32>,
    nodes: Nodes,
    joint: Joint,
    judge: Judge,
}

impl Best {
    pub fn new(code: &FringeCode, shape: [usize; 2]) -> Self {
        let pixels = shape[0] * shape[1];
        let plane = || vec![0.0; pixels];
        Self {
            shape,
            light: [plane(), plane(), plane(), plane()],
            unsaturated: vec![false; pixels],
            glare: vec![false; pixels],
            lit: vec![false; pixels],
            usable: vec![false; pixels],
            maps: PixelMaps::default(),
            modulation: plane(),
            wrapped: plane(),
            phase: plane(),
            nodes: Nodes::new(Support::new(code)),
            joint: Joint::new(code.numbers()),
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
        let grid = Grid::new(self.shape[0], self.shape[1], ((period_px / CELLS) as usize).clamp(1, 16));
        let everywhere =
            Scene { light, usable: &self.unsaturated, width: self.shape[1], grid: &grid, period_px };
        find_light(&everywhere, 2.0 * options.modulation_min, &mut self.lit);
        let lit = self.lit.par_iter_mut().zip(&self.glare);
        lit.for_each(|(lit, glare)| *lit &= !glare);
        let both = self.unsaturated.par_iter().zip(&self.lit);
        self.usable.par_iter_mut().zip(both).for_each(|(usable, (a, b))| *usable = *a && *b);
        let scene = Scene { usable: &self.usable, ..everywhere };

        // 2. Two-step phase of R and B (S2), beats of G and IR against it (S3).
        let fit = LocalFit::new(&scene, &mut self.maps);
        fit.modulation(&scene, &self.maps, &self.lit, options.modulation_min, &mut self.modulation);
        self.maps.phase(&mut self.wrapped);
        let noise = noise(&self.wrapped, &self.modulation, scene.width);
        let slopes = self.maps.slopes(&scene, &self.modulation);
        let window = Window::new(&scene, &slopes, &self.modulation, noise);
        window.smooth(&self.wrapped, &mut self.phase);

        // 3. Fringe orders: by beats from windows, then with what every pixel sees itself (S4).
        self.nodes.by_beats(&scene, fit.beats(), &self.modulation, &mut self.phase);
        let fringes = self.joint.fringes(&scene, &self.maps.albedo, &self.phase, |_| true);
        self.nodes.by_cosines(&scene, &fringes, &mut self.phase);

        // 4. All four channels measure the same column.
        self.joint.run(&scene, &window, &mut self.maps.albedo, &mut self.phase);

        // 5. What is not sure is no data.
        let findings = Findings {
            phase: &self.phase,
            modulation: &self.modulation,
            misfit: &self.joint.misfit,
            window: &window,
            nodes: &self.nodes,
            quality_min: options.quality_min,
        };
        self.judge.run(&scene, &findings);
        self.write(finish, out);
    }

    fn condition<T: Sample>(&mut self, plan: &Plan, shot: &Shot<'_, T>) {
        let width = self.shape[1];
        let [red, green, blue, infrared] = self.light.each_mut().map(|plane| plane.par_chunks_mut(width));
        let saturation = self.unsaturated.par_chunks_mut(width).zip(self.glare.par_chunks_mut(width));
        let rows = red.zip(green).zip(blue.zip(infrared)).zip(saturation).enumerate();
        rows.for_each(|(y, (((red, green), (blue, infrared)), (unsaturated, glare)))| {
            plan.saturation_row(shot, y, unsaturated, glare);
            let mut rows = [red, green, blue, infrared];
            plan.row(shot, y, &mut rows);
            // A pixel that the infrared chip does not see takes no part in any fit.
            for (x, unsaturated) in unsaturated.iter_mut().enumerate() {
                if !rows[3][x].is_finite() {
                    *unsaturated = false;
                    rows.iter_mut().for_each(|row| row[x] = 0.0);
                }
            }
        });
    }

    fn write(&self, finish: &Finish<'_>, out: &mut Decoded) {
        let width = self.shape[1];
        out.rows().enumerate().for_each(|(y, mut row)| {
            let at = y * width..(y + 1) * width;
            row.phase.copy_from_slice(&self.judge.phase[at.clone()]);
            row.modulation.copy_from_slice(&self.modulation[at.clone()]);
            row.quality.copy_from_slice(&self.judge.quality[at]);
            finish.row(y, &mut row);
        });
    }
}

/// Fringe period across the fringes, from the red image; a sixteenth of the image when nothing stands out.
fn period_px(red: &[f32], [height, width]: [usize; 2]) -> f64 {
    let red = ArrayView2::from_shape((height, width), red).expect("a plane is whole");
    let found = carrier(red).period_px();
    let shorter = width.min(height) as f64;
    if found.is_finite() { found.clamp(4.0, shorter.max(8.0)) } else { width as f64 / 16.0 }
}
