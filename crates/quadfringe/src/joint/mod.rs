//! The joint method, the default. THE RECIPE: from the images of one exposure to absolute phase and millimetres.
//!
//! ```text
//! 1  linear light                                                        (S1)  condition
//! 2  fringe period; mask of lit pixels; noise                                  stages::quadrature_carrier, illumination, noise
//! 3  coarse level: wrapped phase, beats of G and IR by local fits    (S2, S3)  pyramid, local_fit, slopes
//! 4  fringe orders by semi-global matching                               (S4)  orders
//! 5  photometry: offset and amplitude of every channel                         photometry
//! 6  phase from all four channels, coarse level, then full resolution          phase, window, pyramid::upsample
//!    saturated light from the model, then steps 2 to 6 again                   saturation
//!    minimum of the energy (J16); shadows of a pair of projectors (J33)         energy; infrared, shadows
//! 7  motion between the channels (optional)                                    motion
//! 8  orders of regions (J38); validity: doubtful pixels become no data         regions, validity
//! 9  uncertainty, and the probability of a wrong order                         uncertainty; energy::variance
//! 10 heights                                                             (S7)  decode::output, height
//! 11 albedo of every pixel (optional)                                          albedo
//! ```
//!
//! The steps share the model of the intensities (`model`), a grid of cells for slowly varying quantities (`cells`), and the tuned
//! numbers (`params`). `docs/method/joint.md` derives the steps and numbers them in the same way.

mod absolute;
mod albedo;
mod cells;
mod coarse;
mod connected;
mod disjoint;
mod energy;
mod illumination;
mod infrared;
mod levels;
mod light;
mod local_fit;
mod memory;
mod model;
mod motion;
mod neighbours;
mod noise;
mod orders;
mod params;
mod phase;
mod photometry;
mod pyramid;
mod reasons;
mod regions;
mod residuals;
mod results;
mod saturation;
mod scene;
mod shadows;
mod slopes;
mod smooth;
mod uncertainty;
mod validity;
mod window;

use crate::Shot;
use crate::condition::{Plan, Sample};
use crate::decode::options::Options;
use crate::decode::output::{Decoded, Finish};
use crate::encoding::FourChannel;
use crate::height::PairTable;
use crate::parallel::lanes::LANES;
use albedo::{Albedo, Known};
use cells::Grid;
use coarse::CoarseLevel;
use energy::{Energy, Prior};
use infrared::PairPhase;
use light::{Marks, fringe_period_px, linear_light};
use memory::OutputMemory;
use motion::{Motion, Timing};
use noise::{least_modulation, noise_of_difference};
use params::pyramid::{CELLS_PER_PERIOD, FACTOR_MAX};
use pyramid::{Pyramid, Upsampler};
use regions::RegionOrders;
use results::Results;
use saturation::Saturation;
use scene::{Frame, PhaseMap, Pixels};
use uncertainty::PhaseNoise;
use validity::{PixelFit, Validity};
use window::Window;

/// Decoder for the joint method: the results of its steps, and their working memory.
pub(crate) struct Joint {
    shape: [usize; 2],
    /// Length of a row of pixels including padding.
    stride: usize,
    /// Fringe numbers of R, G, B, IR divided by the first, as [`FourChannel::ratios`] gives them.
    ratios: [f32; 4],
    energy: Energy,
    albedo: Albedo,
    pyramid: Pyramid,
    coarse: CoarseLevel,
    regions: RegionOrders,
    saturation: Saturation,
    upsampler: Upsampler,
    pixels: Pixels,
    motion: Motion,
    validity: Validity,
    /// Wrong-order probability of every node.
    wrong_order: Vec<f32>,
    /// Working planes, for results that have no map that can serve as such.
    spare: Vec<f32>,
}

impl Joint {
    pub fn new(code: &FourChannel, shape: [usize; 2]) -> Self {
        let stride = shape[1].next_multiple_of(FACTOR_MAX * LANES);
        Self {
            shape,
            stride,
            ratios: code.ratios(),
            energy: Energy::default(),
            albedo: Albedo::default(),
            pyramid: Pyramid::new(stride * shape[0]),
            coarse: CoarseLevel::new(code),
            regions: RegionOrders::new(code),
            saturation: Saturation::default(),
            upsampler: Upsampler::default(),
            pixels: Pixels::default(),
            motion: Motion::default(),
            validity: Validity::default(),
            wrong_order: Vec::new(),
            spare: Vec::new(),
        }
    }

    /// Makes all later shots take the infrared phase along the camera rays of a pair.
    pub fn unwrap_along_rays(&mut self, table: &PairTable) {
        self.pyramid.full.pair = Some(PairPhase::new(table, self.stride));
        self.coarse.lit_mask.see_visible_light_alone();
    }

    pub fn run<T: Sample>(
        &mut self,
        plan: &Plan,
        shot: &Shot<'_, T>,
        options: &Options,
        finish: &Finish<'_>,
        out: &mut Decoded,
    ) {
        // 1. Linear light of the four channels (S1).
        self.linearise(plan, shot);
        // 2. The fringe period scales all windows, cells and the coarse level.
        let found = || fringe_period_px(&self.pyramid.full.light, self.shape, self.ratios);
        let period_px = options.period_px_or(found);
        let grid = Grid::with_stride(self.shape, self.stride, period_px / CELLS_PER_PERIOD);
        let coarse_grid = grid.shrunk(pyramid::factor(period_px, &grid));
        let least = || least_modulation(&self.pyramid.full.light[0], &grid);
        let modulation_min = options.modulation_min.unwrap_or_else(least);
        let frame = Frame::new([&grid, &coarse_grid], period_px, modulation_min, shot.mosaic().is_some());
        // 2. to 6. Absolute phase.
        let mut spare = std::mem::take(&mut self.spare);
        let mut memory = OutputMemory::new(out, &mut spare, grid.pixels());
        let instants = options.channel_instants_us().map(|times| motion::in_places(times, self.ratios));
        self.absolute_phase(&frame, instants.is_some(), &mut memory);
        self.restore_saturated(&frame, instants.is_some(), &mut memory);
        // 7. Motion between the channels.
        if let Some(instants) = instants {
            self.compensate_motion(&frame, Timing { instants, ratios: self.ratios }, &mut memory);
        }
        self.spare = spare;
        // 6. Minimum of the energy (J16), after step 7, because it would explain a part of the motion.
        self.minimise(&frame, options.detail().unwrap_or(1.0));
        // 8. Validity.
        self.validate(&frame, instants, options.quality_min, out);
        // 9. Uncertainty and the probability of a wrong order. 10. Heights (S7).
        let noise = self.uncertainty(&frame);
        self.write(&frame, &noise, finish, out);
        // 11. Albedo.
        self.write_albedo(&frame, out);
    }

    /// Step 1: linear light, and whether the shot was exposed too long.
    fn linearise<T: Sample>(&mut self, plan: &Plan, shot: &Shot<'_, T>) {
        let Self { shape, stride, ratios, pyramid, saturation, pixels, .. } = self;
        let marks = Marks { saturated: &mut saturation.saturated, reasons: &mut pixels.reasons };
        linear_light(plan, shot, *shape, *ratios, &mut pyramid.full, marks);
        saturation.judge(&pyramid.full.light, *stride, *ratios);
    }

    /// Step 6: the minimum of the energy, with this `detail`.
    fn minimise(&mut self, frame: &Frame<'_>, detail: f32) {
        let scene = self.pyramid.full.scene(frame.full);
        let [red, green, ..] = scene.light;
        // Texture finer than a cell, as of a cloth, is no noise: the albedo of the cell takes it up.
        let noise = self.coarse.noise.min(noise_of_difference([red, green], scene.grid));
        let prior = Prior { ratios: self.ratios, noise, detail };
        self.energy.minimise(&scene, prior, &mut self.pixels);
        let Pixels { phase, modulation, .. } = &mut self.pixels;
        // 8. Orders of regions, by the phase of the energy.
        let energy = &self.energy;
        let brightness =
            |y: usize, work: &mut energy::Rows, out: &mut Vec<f32>| energy.brightness(&scene, y, work, out);
        self.regions.settle(&scene, self.coarse.noise, &brightness, modulation, phase);
    }

    /// Step 8: the mask of valid pixels, and the quality of the order of every lit pixel.
    fn validate(
        &mut self,
        frame: &Frame<'_>,
        instants: Option<[f32; 4]>,
        quality_min: f32,
        out: &mut Decoded,
    ) {
        let scene = self.pyramid.full.scene(frame.full);
        let pixel = PixelFit {
            squared_residual: out.wrong_order_probability.as_slice().expect("checked layout"),
            modulation: out.modulation.as_slice().expect("checked layout"),
        };
        let Pixels { phase, modulation, reasons } = &mut self.pixels;
        let map = PhaseMap { phase, modulation };
        let quality = out.quality.as_slice_mut().expect("checked layout");
        let limits = validity::Limits { noise: self.coarse.noise, quality_min };
        let (orders, regions, ratios) = (&self.coarse.orders, &self.regions, self.ratios);
        let energy = &self.energy;
        let evidence = validity::Evidence { map, pixel, orders, regions, energy, ratios, limits };
        self.validity.run(&scene, evidence, quality, reasons);
        self.saturation.invalidate(ratios, &mut self.validity.valid);
        if let Some(instants) = instants {
            self.motion.invalidate_fast(&scene, instants, &mut self.validity.valid, reasons);
        }
    }

    /// Step 9: the noise of the phase, the excess of the residuals, and the probability of a wrong order.
    fn uncertainty(&mut self, frame: &Frame<'_>) -> PhaseNoise {
        let scene = self.pyramid.full.scene(frame.full);
        let CoarseLevel { noise, orders, slopes, .. } = &self.coarse;
        orders.wrong_order_probability(&scene, &mut self.wrong_order);
        let window = Window::new(&scene, slopes, &self.pixels.modulation, *noise);
        PhaseNoise::new(*noise, window.share(), &self.energy)
    }

    /// Steps 9 and 10, row by row: the maps of the result.
    fn write(&self, frame: &Frame<'_>, noise: &PhaseNoise, finish: &Finish<'_>, out: &mut Decoded) {
        let Self { pixels, validity, saturation, energy, wrong_order, coarse, regions, .. } = self;
        let lit_mask = &coarse.lit_mask;
        let found = Results {
            pixels,
            validity,
            lit_mask,
            saturation,
            energy,
            regions,
            ratios: self.ratios,
            wrong_order,
        };
        found.write(&self.pyramid.full.scene(frame.full), noise, finish, out);
    }

    /// Step 11: the albedo of every pixel, if it is wanted.
    fn write_albedo(&mut self, frame: &Frame<'_>, out: &mut Decoded) {
        let Self { pixels: Pixels { phase, .. }, validity, ratios, coarse, .. } = self;
        if let Some(albedo) = &mut out.albedo {
            let known = Known { phase, valid: &validity.valid, ratios: *ratios, noise: coarse.noise };
            let (scene, out) = (self.pyramid.full.scene(frame.full), albedo.as_slice_mut());
            self.albedo.write(&scene, &self.energy, known, out.expect("checked layout"));
        }
    }
}
