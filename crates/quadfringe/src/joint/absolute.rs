//! Steps 2 to 7: the absolute phase of every pixel, and what repeats these steps with other light.

use super::memory::OutputMemory;
use super::motion::Timing;
use super::params::{motion, saturation};
use super::phase::PhaseModel;
use super::pyramid::Levels;
use super::scene::Frame;
use super::window::Window;
use super::{CoarseLevel, Joint};

impl Joint {
    /// Steps 2 to 6.
    pub(super) fn absolute_phase(&mut self, frame: &Frame<'_>, moving: bool, memory: &mut OutputMemory<'_>) {
        let Self { shape, pyramid, coarse, ratios, saturation, pixels, .. } = self;
        saturation.write_masks(*shape, *ratios, &mut pyramid.full, &mut pixels.reasons);
        pyramid.shrink(frame);
        let level = &mut pyramid.coarse;
        // 2. Mask of lit pixels.
        let (reach_px, least) = (frame.coarse_reach_px(), frame.modulation_min);
        coarse.find_light(level, frame.coarse, reach_px, least, memory.scratch.lend());
        // 3. Coarse level: wrapped phase of R and B (S2), beats of G and IR (S3).
        let scene = level.scene(frame.coarse);
        coarse.fit_fringes(&scene, &level.lit, least);
        // 4. Fringe orders (S4).
        coarse.choose_orders(&scene, *ratios);
        coarse.leave_out_shadows(level, frame.coarse, *ratios);
        // 5. and 6. Photometry and phase from all four channels, alternating.
        let scene = level.scene(frame.coarse);
        coarse.refine(&scene, *ratios, moving, memory.scratch.lend());
        pyramid.restore(frame);
        // 6. Phase at full resolution.
        self.upsample(frame, memory);
        self.coarse.leave_out_fine_shadows(&mut self.pyramid.full, frame, self.ratios, &mut self.pixels);
        self.fit_phase(frame, memory);
    }

    /// Step 6: upsamples phase and modulation from the coarse level to every pixel.
    fn upsample(&mut self, frame: &Frame<'_>, memory: &mut OutputMemory<'_>) {
        let (grid, coarse) = (frame.full.grid, &mut self.coarse);
        if frame.coarse.factor == 1 {
            std::mem::swap(&mut self.pixels.phase, &mut coarse.phase);
            std::mem::swap(&mut self.pixels.modulation, &mut coarse.modulation);
            return;
        }
        for plane in [&mut self.pixels.phase, &mut self.pixels.modulation] {
            plane.resize(grid.pixels(), 0.0);
        }
        let (scratch, lit) = (&mut *memory.scratch.first, &mut *memory.scratch.second);
        let light = self.pyramid.full.light.each_ref().map(Vec::as_slice);
        coarse.lit_mask.find_again(grid, light, lit);
        coarse.noise = coarse.lit_mask.noise;
        coarse.lit_mask.erode(grid, frame.reach_px, scratch, lit);
        self.pyramid.full.restrict(grid, lit);
        let [coarse_scene, scene] = self.pyramid.scenes(frame);
        coarse.photometry.sharpen(&coarse_scene, self.ratios);
        let lit = &self.pyramid.full.lit;
        let levels = Levels { coarse: &coarse_scene, fine: &scene, found: coarse, ratios: self.ratios, lit };
        self.upsampler.run(levels, &mut self.pixels.phase, &mut self.pixels.modulation);
    }

    /// Step 6: fits the phase at full resolution.
    fn fit_phase(&mut self, frame: &Frame<'_>, memory: &mut OutputMemory<'_>) {
        let (scene, ratios) = (self.pyramid.full.scene(frame.full), self.ratios);
        let CoarseLevel { slopes, noise, photometry, phase_fit, .. } = &mut self.coarse;
        let window = Window::new(&scene, slopes, &self.pixels.modulation, *noise);
        let OutputMemory { scratch, found } = memory;
        let model = PhaseModel { scene: &scene, photometry, ratios, window };
        phase_fit.step(model, &mut self.pixels.phase, scratch.lend(), found);
    }

    /// Step 6: restores saturated light and repeats steps 2 to 6, if there is enough of it.
    pub(super) fn restore_saturated(
        &mut self,
        frame: &Frame<'_>,
        moving: bool,
        memory: &mut OutputMemory<'_>,
    ) {
        if !self.saturation.restores {
            return;
        }
        self.saturation.begin(&self.pyramid.full);
        for round in 1..=saturation::ROUNDS {
            let Self { pyramid, coarse, ratios, saturation: saturated, pixels, .. } = self;
            saturated.restore(&mut pyramid.full, frame.full, *ratios, &coarse.photometry, pixels.map());
            if round == saturation::ROUNDS {
                saturated.keep(&pixels.phase);
            }
            self.absolute_phase(frame, moving, memory);
        }
        self.saturation.compare(&self.pixels.phase);
    }

    /// Step 7: estimates the motion, brings the light to one instant and repeats steps 2 to 6.
    pub(super) fn compensate_motion(
        &mut self,
        frame: &Frame<'_>,
        timing: Timing,
        memory: &mut OutputMemory<'_>,
    ) {
        self.motion.begin(&self.pyramid.full.scene(frame.full));
        for _ in 0..motion::ROUNDS {
            let map = self.pixels.map();
            self.motion.step(&mut self.pyramid.full, frame.full, timing, &self.coarse.photometry, map);
            self.absolute_phase(frame, true, memory);
        }
    }
}
