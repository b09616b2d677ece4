//! All that needs surroundings: light, beats, orders, backgrounds. It runs on an image whose fringes are no wider than
//! they have to be, and guides the pixels of the full one.

use super::orders::{Orders, Wrapped};
use super::params::{BEND_MAX, MISFIT_MAX};
use super::pyramid::Level;
use crate::FringeCode;
use crate::decode::options::Options;
use crate::joint::cells::Grid;
use crate::joint::illumination::LightFinder;
use crate::joint::local_fit::{LocalFit, PixelMaps};
use crate::joint::phase::{Found, Joint};
use crate::joint::photometry::{Backgrounds, Fit};
use crate::joint::residuals::Residuals;
use crate::joint::scene::{Scene, around};
use crate::joint::slopes::Slopes;
use crate::joint::window::{Window, noise};
use multiversion::multiversion;
use rayon::prelude::*;

/// Further rounds of backgrounds and phase: on a print, where windows see several colours, and elsewhere.
const PRINT_ROUNDS: usize = 3;
const ROUNDS: usize = 2;
/// Share of the lit pixels beside edges of colours that makes a print.
const PRINTED: f32 = 0.03;
/// How much backgrounds believe the phase of a wide window, next to what the light says of it.
const TRUST: f32 = 0.08;
/// Share of such a window that has to be lit: where an edge cuts it the mean lies aside. On a print, whose colours tear the phase
/// everywhere, it would leave too little.
const LIT_MIN: f32 = 0.9;
/// The same where channels were seen one after another: with more, the ripple of slow motion goes sooner, but what moves too fast
/// to be told passes for something slower.
const MOVING_TRUST: f32 = 0.01;

/// What is known of a shot with the help of surroundings.
pub(super) struct Guide {
    /// Absolute phase of every pixel in rad.
    pub phase: Vec<f32>,
    /// Modulation of R and B in linear light, 0 where there is no light.
    pub modulation: Vec<f32>,
    /// 1 beside tears of the surface, shadows and borders.
    pub torn: Vec<f32>,
    /// Standard deviation of the intensities.
    pub noise: f32,
    pub finder: LightFinder,
    pub slopes: Slopes,
    pub orders: Orders,
    pub backgrounds: Backgrounds,
    pub joint: Joint,
    pub residuals: Residuals,
    /// Whether there are edges of colours.
    pub printed: bool,
    wrapped: Vec<f32>,
    sound: Vec<f32>,
    fit: LocalFit,
}

impl Guide {
    pub fn new(code: &FringeCode) -> Self {
        Self {
            phase: Vec::new(),
            modulation: Vec::new(),
            torn: Vec::new(),
            noise: 0.0,
            finder: LightFinder::default(),
            slopes: Slopes::default(),
            orders: Orders::new(code),
            backgrounds: Backgrounds::new(),
            joint: Joint::default(),
            residuals: Residuals::default(),
            printed: false,
            wrapped: Vec::new(),
            sound: Vec::new(),
            fit: LocalFit::default(),
        }
    }

    /// Decode `level`, whose light may reach `blur_px` pixels into a shadow, up to the first round of the joint fit. What two
    /// `lent` planes held is lost.
    pub fn run(
        &mut self,
        level: &mut Level,
        (grid, period_px, factor): (&Grid, f64, usize),
        blur_px: usize,
        ratios: [f32; 3],
        options: &Options,
        [lent, more]: [&mut [f32]; 2],
    ) {
        let planes =
            [&mut self.phase, &mut self.modulation, &mut self.wrapped, &mut self.torn, &mut self.sound];
        for plane in planes {
            plane.resize(grid.pixels(), 0.0);
        }
        let light = level.light.each_ref().map(Vec::as_slice);
        let finder = &mut self.finder;
        finder.find(grid, light, (period_px, 2.0 * options.modulation_min), &mut self.modulation);
        finder.shrink(grid, blur_px, lent, &mut self.modulation);
        level.restrict(grid, &self.modulation);
        let scene = level.scene(grid, period_px, factor);

        // 2. Two-step phase of R and B (S2), beats of G and IR against it (S3).
        let maps = PixelMaps { phase: &mut self.wrapped, modulation: &mut self.modulation };
        self.fit.run(&scene, &level.lit, options.modulation_min, maps);
        self.noise = noise(&scene, &self.wrapped, &self.modulation);
        let relative_noise = relative(self.noise, &self.modulation);
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
        self.backgrounds.start(&scene, &self.fit, &self.slopes, ratios);
        let fit = Fit { misfit_max: MISFIT_MAX, relative_noise, rows: 2, trust: 0.0, lit_min: 0.0 };
        self.backgrounds.fit(&scene, ratios, [&self.phase, &self.modulation], &self.slopes, &fit);
        let known = Wrapped { backgrounds: Some(&self.backgrounds), ..known };
        self.orders.choose(&scene, &known, &mut self.phase);

        // 4. All four channels measure the same column.
        let fit = Fit { rows: 4, ..fit };
        self.printed = false;
        self.measure(&scene, ratios, [&mut *lent, &mut *more]);
        self.backgrounds.fit(&scene, ratios, [&self.phase, &self.sound], &self.slopes, &fit);
        // What motion makes of the light is not to be explained by other backgrounds.
        if options.channel_instants_us.is_some() {
            self.refit(&scene, ratios, &Fit { trust: MOVING_TRUST, ..fit }, [&mut *lent, &mut *more]);
            self.measure(&scene, ratios, [lent, more]);
            self.slopes.refine(&scene, &self.phase, &self.sound);
            return;
        }
        self.choose(&scene, ratios);
        for round in 0..PRINT_ROUNDS {
            if !self.printed && round >= ROUNDS {
                break;
            }
            let lit_min = if self.printed { 0.0 } else { LIT_MIN };
            self.refit(&scene, ratios, &Fit { trust: TRUST, lit_min, ..fit }, [&mut *lent, &mut *more]);
            if self.printed {
                self.choose(&scene, ratios);
            }
            self.measure(&scene, ratios, [&mut *lent, &mut *more]);
        }
        // The phase of a print still follows its colours, and its slopes would too.
        if !self.printed {
            self.slopes.refine(&scene, &self.phase, &self.sound);
        }
    }

    /// Phase by the backgrounds as they are, and its tears; what is missed goes where the wrapped phase was.
    fn measure(&mut self, scene: &Scene<'_>, ratios: [f32; 3], lent: [&mut [f32]; 2]) {
        let mut window = Window::new(scene, &self.slopes, &self.modulation, self.noise).near();
        if self.printed {
            window = window.loosened(&self.residuals);
        }
        let misfit = self.wrapped.chunks_exact_mut(scene.grid.stride).collect();
        let mut found = Found { misfit, ..Found::nothing(scene.grid.height) };
        self.joint.step(scene, (&self.backgrounds, ratios), &window, &mut self.phase, lent, &mut found);
        self.find_tears(scene.grid);
    }

    /// Backgrounds by the phase of a wide window, which follows the surface and not what wrong backgrounds make of it.
    fn refit(&mut self, scene: &Scene<'_>, ratios: [f32; 3], fit: &Fit, lent: [&mut [f32]; 2]) {
        self.residuals.measure(scene, &self.wrapped, &self.modulation);
        self.slopes.measure(scene, &self.phase, &self.sound);
        let window = Window::new(scene, &self.slopes, &self.modulation, self.noise).wide();
        let window = window.loosened(&self.residuals);
        self.wrapped.copy_from_slice(&self.phase);
        let found = &mut Found::nothing(scene.grid.height);
        self.joint.step(scene, (&self.backgrounds, ratios), &window, &mut self.wrapped, lent, found);
        self.backgrounds.fit(scene, ratios, [&self.wrapped, &self.sound], &self.slopes, fit);
    }

    /// Lets every pixel of an object of several colours take the backgrounds of the side that explains it, and notes
    /// whether enough of them moved for a print.
    fn choose(&mut self, scene: &Scene<'_>, ratios: [f32; 3]) {
        let pixels = [self.phase.as_slice(), &self.modulation];
        self.printed = self.backgrounds.choose(scene, ratios, pixels, &self.slopes, self.noise) > PRINTED;
    }

    fn find_tears(&mut self, grid: &Grid) {
        let Self { phase, modulation, torn, sound, .. } = self;
        let out = torn.par_chunks_mut(grid.stride).zip(sound.par_chunks_mut(grid.stride)).enumerate();
        out.for_each(|(y, (torn, sound))| {
            let near = around(y, grid.height);
            let [phases, lights] =
                [&*phase, &*modulation].map(|plane| near.map(|y| &plane[y * grid.stride..][..grid.stride]));
            tears(phases, lights, grid.width, torn, sound);
        });
    }
}

/// `torn` is 1 where a pixel and its neighbours are not one lit surface; `sound` is the modulation elsewhere.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn tears(phase: [&[f32]; 3], light: [&[f32]; 3], width: usize, torn: &mut [f32], sound: &mut [f32]) {
    torn.fill(1.0);
    sound.fill(0.0);
    let n = width - 2;
    let [a, b, c] = phase.map(|row| [0, 1, 2].map(|k| &row[k..k + n]));
    let lit = light.map(|row| [0, 1, 2].map(|k| &row[k..k + n]));
    let (torn, sound) = (&mut torn[1..=n], &mut sound[1..=n]);
    for x in 0..n {
        let twice = 2.0 * b[1][x];
        let bend = |p: f32, q: f32| (p + q - twice).abs();
        let upper = |p: f32, q: f32| if p > q { p } else { q };
        let lower = |p: f32, q: f32| if p < q { p } else { q };
        let straight = upper(bend(b[0][x], b[2][x]), bend(a[1][x], c[1][x]));
        let diagonal = upper(bend(a[0][x], c[2][x]), bend(a[2][x], c[0][x]));
        let dark = lit.map(|row| lower(lower(row[0][x], row[1][x]), row[2][x]));
        let least = lower(lower(dark[0], dark[1]), dark[2]);
        let whole = (upper(straight, diagonal) < BEND_MAX) & (least > 0.0);
        (torn[x], sound[x]) = if whole { (0.0, lit[1][1][x]) } else { (1.0, 0.0) };
    }
}

/// Noise over the mean modulation of what is lit.
fn relative(noise: f32, modulation: &[f32]) -> f32 {
    let lit = modulation.iter().step_by(31).filter(|&&m| m > 0.0);
    let (sum, count) = lit.fold((0.0, 0.0), |(sum, count), m| (sum + m, count + 1.0));
    noise * count / f32::max(sum, 1e-6)
}
