//! Steps 2 to 6 on the coarse level: mask, beats, orders and photometry, which all need a neighbourhood. The phase at full
//! resolution starts from their results.

use super::cells::CellMaps;
use super::illumination::LitMask;
use super::local_fit::{Lit, LocalFit, PixelMaps};
use super::model::absent;
use super::noise::noise_of_phase;
use super::orders::{Orders, Wrapped};
use super::params::photometry as params;
use super::params::shadows::REACH_PX;
use super::phase::{FitRows, PhaseFit, PhaseModel};
use super::photometry::Photometry;
use super::pyramid::Level;
use super::residuals::Residuals;
use super::scene::{Frame, PhaseMap, Pixels, ScaledGrid, Scene, Scratch};
use super::shadows::{Search, Shadows, darken};
use super::slopes::Slopes;
use super::smooth::mark_discontinuities;
use super::window::Window;
use crate::Reason;
use crate::encoding::FourChannel;

/// The steps on the coarse level, and their results.
pub(super) struct CoarseLevel {
    /// Absolute phase of every pixel in rad.
    pub phase: Vec<f32>,
    /// Modulation of R and B in linear light, 0 where there is no light.
    pub modulation: Vec<f32>,
    /// 1 near discontinuities of the surface, shadows and borders.
    pub discontinuities: Vec<f32>,
    /// Modulation of pixels that lie with their neighbours on one smooth, lit surface; 0 elsewhere.
    smooth_modulation: Vec<f32>,
    /// Working plane: first the wrapped phase of R and B; once orders are known, the squared residuals; during a refit, the
    /// phase of the wide window.
    work: Vec<f32>,
    /// Working memory of all sums over windows of cells.
    sums: CellMaps,
    /// Standard deviation of the intensities in linear light.
    pub noise: f32,
    pub lit_mask: LitMask,
    fit: LocalFit,
    pub slopes: Slopes,
    pub orders: Orders,
    pub photometry: Photometry,
    pub phase_fit: PhaseFit,
    pub residuals: Residuals,
    pub shadows: Shadows,
}

impl CoarseLevel {
    pub fn new(code: &FourChannel) -> Self {
        Self {
            phase: Vec::new(),
            modulation: Vec::new(),
            discontinuities: Vec::new(),
            smooth_modulation: Vec::new(),
            work: Vec::new(),
            sums: CellMaps::default(),
            noise: 0.0,
            lit_mask: LitMask::new(absent(code.ratios())),
            fit: LocalFit::new(code.ratios()),
            slopes: Slopes::default(),
            orders: Orders::new(code),
            photometry: Photometry::new(),
            phase_fit: PhaseFit::default(),
            residuals: Residuals::default(),
            shadows: Shadows::new(code),
        }
    }

    /// Step 2: finds the mask of lit pixels and removes the other pixels from the level. Interpolated light may reach
    /// `reach_px` pixels into a shadow.
    pub fn find_light(
        &mut self,
        level: &mut Level,
        grid: ScaledGrid<'_>,
        reach_px: usize,
        modulation_min: f32,
        scratch: Scratch<'_>,
    ) {
        let planes = [
            &mut self.phase,
            &mut self.modulation,
            &mut self.work,
            &mut self.discontinuities,
            &mut self.smooth_modulation,
        ];
        for plane in planes {
            plane.resize(grid.grid.pixels(), 0.0);
        }
        let light = level.light.each_ref().map(Vec::as_slice);
        // The range of a fringe is twice its modulation.
        self.lit_mask.find(grid, light, 2.0 * modulation_min, &mut self.sums, &mut self.modulation);
        self.lit_mask.erode(grid.grid, reach_px, scratch.first, &mut self.modulation);
        level.restrict(grid.grid, &self.modulation);
    }

    /// Step 3: wrapped phase of R and B (S2), beats of G and IR against it (S3), noise and slopes.
    pub fn fit_fringes(&mut self, scene: &Scene<'_>, lit: &[f32], modulation_min: f32) {
        let light = Lit { lit, least: modulation_min };
        let maps = PixelMaps { phase: &mut self.work, modulation: &mut self.modulation };
        self.fit.run(scene, light, maps, &mut self.sums);
        let map = PhaseMap { phase: &self.work, modulation: &self.modulation };
        // A phase that is fitted in a window does not show the noise of a pixel.
        self.noise = if self.fit.is_of_pixels() { noise_of_phase(scene, map) } else { self.lit_mask.noise };
        let maps = PixelMaps { phase: &mut self.work, modulation: &mut self.modulation };
        self.fit.fit_with_albedo(scene, light, self.noise, maps, &mut self.sums);
        let map = PhaseMap { phase: &self.work, modulation: &self.modulation };
        self.slopes.measure(scene, map, &mut self.sums);
    }

    /// Step 4: chooses fringe orders (S4) with the offsets and amplitudes of the local fit, then once more with the offsets and
    /// amplitudes that a fit to these orders gives.
    pub fn choose_orders(&mut self, scene: &Scene<'_>, ratios: [f32; 4]) {
        let map = PhaseMap { phase: &self.work, modulation: &self.modulation };
        let wrapped = Wrapped { map, fit: &self.fit, photometry: None, slopes: &self.slopes };
        self.orders.choose(scene, &wrapped, &mut self.phase);
        self.photometry.start(scene, &self.fit, &mut self.sums);
        let map = PhaseMap { phase: &self.phase, modulation: &self.modulation };
        self.photometry.fit(scene, ratios, map, 0.0, &mut self.sums);
        let wrapped = Wrapped { photometry: Some(&self.photometry), ..wrapped };
        self.orders.choose(scene, &wrapped, &mut self.phase);
    }

    /// Steps 5 and 6, alternating: fits offset and amplitude of every channel, and with them the phase from all four
    /// channels.
    pub fn refine(&mut self, scene: &Scene<'_>, ratios: [f32; 4], moving: bool, mut scratch: Scratch<'_>) {
        self.fit_phase(scene, ratios, false, scratch.lend());
        let map = PhaseMap { phase: &self.phase, modulation: &self.smooth_modulation };
        self.photometry.fit(scene, ratios, map, 0.0, &mut self.sums);
        if moving {
            // Offsets and amplitudes of another place could seem to explain the effect of motion, so no pixel may
            // choose another place.
            self.refit(scene, ratios, params::MOVING_PHASE_TRUST, scratch.lend());
            self.fit_phase(scene, ratios, false, scratch);
        } else {
            self.choose_places(scene, ratios);
            for _ in 0..params::ROUNDS {
                self.refit(scene, ratios, params::PHASE_TRUST, scratch.lend());
                self.choose_places(scene, ratios);
                self.fit_phase(scene, ratios, true, scratch.lend());
            }
        }
    }

    /// Step 6 on the coarse level: removes the shadows of the infrared projector of a pair.
    pub fn leave_out_shadows(&mut self, level: &mut Level, scaled: ScaledGrid<'_>, ratios: [f32; 4]) {
        let Self { shadows, phase, modulation, photometry, lit_mask, noise, .. } = self;
        let (map, noise) = (PhaseMap { phase, modulation }, *noise);
        let scene = level.scene(scaled);
        let search = Search { ratios, photometry, map, noise };
        if scene.pair.is_none() || !shadows.find(&scene, search) {
            return;
        }
        let reach = REACH_PX.div_ceil(scaled.factor);
        lit_mask.erode(scaled.grid, reach, &mut shadows.excess, &mut shadows.lit);
        level.restrict(scaled.grid, &shadows.lit);
        darken(scaled.grid, &shadows.lit, modulation, |_| ());
    }

    /// The same at full resolution. Without a coarse level, all is found already.
    pub fn leave_out_fine_shadows(
        &mut self,
        level: &mut Level,
        frame: &Frame<'_>,
        ratios: [f32; 4],
        pixels: &mut Pixels,
    ) {
        let Self { shadows, photometry, lit_mask, noise, .. } = self;
        let (scene, grid) = (level.scene(frame.full), frame.full.grid);
        let search = Search { ratios, photometry, map: pixels.map(), noise: *noise };
        if scene.pair.is_none() || frame.coarse.factor == 1 || !shadows.find(&scene, search) {
            return;
        }
        lit_mask.erode(grid, REACH_PX, &mut shadows.excess, &mut shadows.lit);
        level.restrict(grid, &shadows.lit);
        let Pixels { modulation, reasons, .. } = pixels;
        darken(grid, &shadows.lit, modulation, |at| {
            if reasons[at] == Reason::Returned {
                reasons[at] = Reason::Shadow;
            }
        });
    }

    /// Step 6 on the coarse level: fits the phase with the present photometry, and computes squared residuals and
    /// discontinuities. A `loosened` window needs the residuals of a refit.
    fn fit_phase(&mut self, scene: &Scene<'_>, ratios: [f32; 4], loosened: bool, scratch: Scratch<'_>) {
        let window = Window::new(scene, &self.slopes, &self.modulation, self.noise).near();
        let window = if loosened { window.loosened(&self.residuals) } else { window };
        let squared_residual = self.work.chunks_exact_mut(scene.grid.stride).collect();
        let mut found = FitRows { squared_residual, ..FitRows::none(scene.grid.height) };
        let model = PhaseModel { scene, photometry: &self.photometry, ratios, window };
        self.phase_fit.step(model, &mut self.phase, scratch, &mut found);
        let map = PhaseMap { phase: &self.phase, modulation: &self.modulation };
        mark_discontinuities(scene.grid, map, &mut self.discontinuities, &mut self.smooth_modulation);
    }

    /// Step 5: fits the photometry to the phase of a wide window. This phase follows the surface, while errors of the
    /// previous photometry average out. `phase_trust` is the weight of this phase.
    fn refit(&mut self, scene: &Scene<'_>, ratios: [f32; 4], phase_trust: f32, scratch: Scratch<'_>) {
        self.residuals.measure(scene, &self.work, &self.modulation, &mut self.sums);
        let map = PhaseMap { phase: &self.phase, modulation: &self.smooth_modulation };
        self.slopes.measure(scene, map, &mut self.sums);
        let window = Window::new(scene, &self.slopes, &self.modulation, self.noise).wide();
        let window = window.loosened(&self.residuals);
        self.work.copy_from_slice(&self.phase);
        let model = PhaseModel { scene, photometry: &self.photometry, ratios, window };
        self.phase_fit.step(model, &mut self.work, scratch, &mut FitRows::none(scene.grid.height));
        let map = PhaseMap { phase: &self.work, modulation: &self.smooth_modulation };
        self.photometry.fit(scene, ratios, map, phase_trust, &mut self.sums);
    }

    /// Step 5: each pixel takes offsets and amplitudes from the place that explains its intensities best.
    fn choose_places(&mut self, scene: &Scene<'_>, ratios: [f32; 4]) {
        let map = PhaseMap { phase: &self.phase, modulation: &self.modulation };
        self.photometry.choose_places(scene, ratios, map, self.noise);
    }
}
