//! The best chain: a guide that uses surroundings, a joint fit of every pixel, and a judgement of each.

mod agreement;
mod cells;
mod coarse;
mod illumination;
mod local_fit;
mod motion;
mod orders;
mod params;
mod phase;
mod photometry;
mod pyramid;
mod residuals;
mod scene;
mod slopes;
mod uncertainty;
mod validity;
mod window;

use crate::condition::{Plan, Sample};
use crate::decode::options::Options;
use crate::decode::output::{Decoded, Finish, hole_unless};
use crate::parallel::lanes::LANES;
use crate::stages::carrier;
use crate::{FringeCode, Shot};
use agreement::Agreement;
use cells::{Grid, RowMaps};
use coarse::Guide;
use motion::{Instants, Motion};
use multiversion::multiversion;
use ndarray::{Array2, ArrayView2, s};
use phase::Found;
use photometry::Backgrounds;
use pyramid::Level;
use pyramid::upsample::{Expander, FACTOR_MAX};
use rayon::prelude::*;
use scene::Scene;
use uncertainty::PhaseNoise;
use validity::{Findings, Judge};
use window::Window;

/// Cells in a fringe period, at least.
const CELLS: f64 = 3.4;
/// Pixels in a fringe period of the image that guides, at least.
const GUIDE_PERIOD_PX: f64 = 6.0;
/// Pixels that interpolated light reaches into a shadow.
const MOSAIC_BLUR_PX: usize = 1;
/// Times that the light of a moving surface is brought to one instant and decoded again.
const MOTION_ROUNDS: usize = 3;

pub(crate) struct Joint {
    shape: [usize; 2],
    stride: usize,
    ratios: [f32; 3],
    full: Level,
    shrunk: Level,
    guide: Guide,
    expander: Expander,
    phase: Vec<f32>,
    modulation: Vec<f32>,
    agreement: Agreement,
    /// Probability that the order of a node is another one.
    another: Vec<f32>,
    motion: Motion,
    /// Light as it was seen, when it has to be brought to one instant.
    seen: [Vec<f32>; 4],
    judge: Judge,
    /// Two working planes, when the maps have none to lend.
    own: Vec<f32>,
}

/// Memory of maps that have not been written yet.
struct Unwritten<'a> {
    /// Two working planes that steps use one after the other, in the map of points.
    lent: [&'a mut [f32]; 2],
    /// What the joint fit finds: modulation in its own map, misfit in that of probabilities, information in that of
    /// uncertainty.
    found: Found<'a>,
}

impl<'a> Unwritten<'a> {
    fn new(out: &'a mut Decoded, own: &'a mut Vec<f32>, pixels: usize) -> Self {
        let width = out.phase_rad.ncols();
        let rows = |map: &'a mut Array2<f32>| {
            map.as_slice_mut().expect("checked layout").chunks_exact_mut(width).collect::<Vec<_>>()
        };
        let uncertainty = out.uncertainty_mm.as_mut().or(out.uncertainty_rad.as_mut()).expect("checked");
        let planes = match &mut out.xyz_mm {
            Some(xyz) if xyz.len() >= 2 * pixels => {
                &mut xyz.as_slice_mut().expect("checked layout")[..2 * pixels]
            }
            _ => {
                own.resize(2 * pixels, 0.0);
                own.as_mut_slice()
            }
        };
        let (first, second) = planes.split_at_mut(pixels);
        let found = Found {
            misfit: rows(&mut out.wrong_order_probability),
            modulation: rows(&mut out.modulation),
            information: rows(uncertainty),
        };
        Self { lent: [first, second], found }
    }

    fn lent(&mut self) -> [&mut [f32]; 2] {
        self.lent.each_mut().map(|plane| &mut **plane)
    }
}

impl Joint {
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
            phase: Vec::new(),
            modulation: Vec::new(),
            agreement: Agreement::default(),
            another: Vec::new(),
            motion: Motion::default(),
            seen: Default::default(),
            judge: Judge::default(),
            own: Vec::new(),
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

        // 2. to 4. From light to the absolute phase of every pixel.
        let instants = options.channel_instants_us.map(|instants| instants.map(|t| 1e-6 * t));
        let image = (&grid, period_px, factor(period_px, &grid));
        let mut own = std::mem::take(&mut self.own);
        let mut unwritten = Unwritten::new(out, &mut own, grid.pixels());
        match instants {
            None => self.measure(image, blur_px, options, &mut unwritten),
            Some(instants) => self.measure_moving(image, instants, blur_px, options, &mut unwritten),
        }
        self.own = own;

        // 5. What is not sure is no data.
        let scene = self.full.scene(&grid, period_px, 1);
        let Guide { noise, backgrounds, orders, .. } = &mut self.guide;
        let own = [&out.wrong_order_probability, &out.modulation];
        let findings = Findings {
            phase: &self.phase,
            modulation: &self.modulation,
            own: own.map(|map| map.as_slice().expect("checked layout")),
            noise: *noise,
            orders,
            quality_min: options.quality_min,
        };
        self.judge.run(&scene, &findings, out.quality.as_slice_mut().expect("checked layout"));
        if let Some(instants) = instants {
            self.motion.rule_out(&scene, instants, &mut self.judge.sure);
        }

        // 6. How sure the rest is.
        let noise = *noise;
        self.agreement.measure(&scene, (self.ratios, noise), backgrounds, &self.phase, &self.modulation);
        orders.another(&scene, &mut self.another);
        let window = Window::new(&scene, &self.guide.slopes, &self.modulation, noise);
        self.write(&scene, &PhaseNoise::new(noise, window.share()), finish, out);
        let maps = [&mut out.wrong_order_probability, &mut out.quality];
        let maps = maps.map(|map| map.as_slice_mut().expect("checked layout"));
        self.judge.settle(&grid, &self.phase, maps);
    }

    /// Absolute phase of every pixel. Where light falls, beats, fringe orders and backgrounds come from an image of `factor` times
    /// fewer pixels along a side.
    fn measure(
        &mut self,
        (grid, period_px, factor): (&Grid, f64, usize),
        blur_px: usize,
        options: &Options,
        unwritten: &mut Unwritten<'_>,
    ) {
        let lent = unwritten.lent();
        if factor == 1 {
            self.guide.run(&mut self.full, (grid, period_px, 1), blur_px, self.ratios, options, lent);
            std::mem::swap(&mut self.phase, &mut self.guide.phase);
            std::mem::swap(&mut self.modulation, &mut self.guide.modulation);
        } else {
            let coarse = grid.shrunk(factor);
            self.shrunk.shrink(&self.full, [&coarse, grid], factor);
            let how = (&coarse, period_px / factor as f64, factor);
            self.guide.run(&mut self.shrunk, how, blur_px.div_ceil(factor), self.ratios, options, lent);
            self.expand([&coarse, grid], period_px, blur_px, unwritten.lent());
        }
        // All four channels measure the same column.
        let scene = self.full.scene(grid, period_px, 1);
        let Guide { slopes, noise, backgrounds, joint, residuals, printed, .. } = &mut self.guide;
        let window = Window::new(&scene, slopes, &self.modulation, *noise);
        let Unwritten { lent: [first, second], found } = unwritten;
        let mut step =
            |backgrounds: &Backgrounds, window: Window<'_>, phase: &mut [f32], found: &mut Found<'_>| {
                joint.step(
                    &scene,
                    (backgrounds, self.ratios),
                    &window,
                    phase,
                    [&mut *first, &mut *second],
                    found,
                );
            };
        if !*printed {
            step(backgrounds, window, &mut self.phase, found);
            return;
        }
        // What is missed is judged by backgrounds that windows agree on: a colour of its own explains a pixel whatever its order.
        let mut missed = Found { misfit: std::mem::take(&mut found.misfit), ..Found::nothing(grid.height) };
        step(backgrounds, window.wide(), &mut self.phase, &mut missed);
        backgrounds.colour(&scene, self.ratios, [&self.phase, &self.modulation], slopes, *noise);
        found.misfit = Found::nothing(grid.height).misfit;
        // Without colours it is shape that the model misses, and that is not to be averaged away.
        step(backgrounds, window.loosened(residuals), &mut self.phase, found);
    }

    /// The same for channels that were seen at different `instants`: what moves is brought to one instant and decoded again.
    fn measure_moving(
        &mut self,
        image: (&Grid, f64, usize),
        instants: Instants,
        blur_px: usize,
        options: &Options,
        unwritten: &mut Unwritten<'_>,
    ) {
        let (grid, period_px, _) = image;
        let how = (self.ratios, instants);
        self.seen.clone_from(&self.full.light);
        for round in 0..=MOTION_ROUNDS {
            self.measure(image, blur_px, options, unwritten);
            let scene = self.full.scene(grid, period_px, 1);
            if round == 0 {
                self.motion.rest(&scene);
            }
            if round == MOTION_ROUNDS {
                break;
            }
            let backgrounds = &self.guide.backgrounds;
            self.motion.measure(&scene, how, backgrounds, &self.phase, &self.modulation);
            let Level { light, usable, .. } = &mut self.full;
            let seen = self.seen.each_ref().map(Vec::as_slice);
            let seen = Scene { light: seen, usable, grid, period_px, factor: 1 };
            let light = light.each_mut().map(Vec::as_mut_slice);
            self.motion.settle(&seen, how, backgrounds, &self.phase, light);
        }
    }

    /// From the guide to every pixel.
    fn expand(
        &mut self,
        [coarse, grid]: [&Grid; 2],
        period_px: f64,
        blur_px: usize,
        [lent, found]: [&mut [f32]; 2],
    ) {
        for plane in [&mut self.phase, &mut self.modulation] {
            plane.resize(grid.pixels(), 0.0);
        }
        let guide = &mut self.guide;
        let finder = &mut guide.finder;
        finder.refind(grid, self.full.light.each_ref().map(Vec::as_slice), found);
        guide.noise = finder.noise;
        finder.shrink(grid, blur_px, lent, found);
        self.full.restrict(grid, found);
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
                let rows = [red, green, blue, infrared].map(|row| &mut row[..width]);
                let masks = [&mut usable[..width], &mut lit[..width]];
                condition_row(plan, shot, y, [unsaturated, glare], rows, masks);
            },
        );
    }

    fn write(&self, scene: &Scene<'_>, noise: &PhaseNoise, finish: &Finish<'_>, out: &mut Decoded) {
        let grid = scene.grid;
        out.rows().enumerate().for_each_init(RowMaps::default, |maps, (y, mut row)| {
            let at = y * grid.stride..y * grid.stride + grid.width;
            sure_only(&self.judge.sure[at.clone()], &self.phase[at], row.phase);
            let disagreement = self.agreement.row(scene, y, maps);
            noise.row(disagreement, row.sigma);
            let nodes = &self.another[y / grid.step * grid.columns..];
            row.wrong.chunks_mut(grid.step).zip(nodes).for_each(|(wrong, node)| wrong.fill(*node));
            finish.row(y, &mut row);
        });
    }
}

/// Light of one row, and which pixels may take part in a fit and may be lit.
#[multiversion(targets("x86_64+avx2"))]
fn condition_row<T: Sample>(
    plan: &Plan,
    shot: &Shot<'_, T>,
    y: usize,
    [unsaturated, glare]: [&mut [bool]; 2],
    mut rows: [&mut [f32]; 4],
    [usable, lit]: [&mut [f32]; 2],
) {
    plan.saturation_row(shot, y, unsaturated, glare);
    plan.row(shot, y, &mut rows);
    let [.., infrared] = rows;
    // A pixel that the infrared chip does not see takes no part in any fit.
    let masks = usable.iter_mut().zip(lit).zip(unsaturated.iter().zip(glare.iter()));
    for (infrared, ((usable, lit), (unsaturated, glare))) in infrared.iter().zip(masks) {
        let seen = infrared.is_finite();
        *usable = if seen & *unsaturated { 1.0 } else { 0.0 };
        *lit = if seen & !*glare { 1.0 } else { 0.0 };
    }
    plan.continue_infrared(y, infrared);
}

/// The phase where it is sure.
#[multiversion(targets("x86_64+avx2"))]
fn sure_only(sure: &[u8], phase: &[f32], out: &mut [f32]) {
    for (out, (sure, phase)) in out.iter_mut().zip(sure.iter().zip(phase)) {
        *out = *phase + hole_unless(*sure != 0);
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
