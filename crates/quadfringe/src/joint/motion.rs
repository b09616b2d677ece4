//! Motion between the colours: a projector that shows R, G and B one after another inside a frame lets each channel see the
//! surface at an instant of its own.
//!
//! While the phase at a pixel changes by `v` per unit of time, channel c, seen at the instant `t_c`, is
//! `I_c = rho (a_c + b_c cos(k_c (Phi + v t_c) + delta_c))`. R and B leave quadrature - their circle becomes an ellipse, and the
//! phase gets a ripple of two waves in a fringe - and G and IR run ahead of both or fall behind. Of the four intensities of a
//! pixel two are left when phase and albedo are projected out, and those tell `v` over a window. With it, every plane is
//! brought to the instant 0 by what its model says that motion has changed.

use super::cells::{CellMaps, CellWork, RowMaps};
use super::photometry::{Backgrounds, carriers};
use super::scene::Scene;
use crate::parallel::angle::sin_cos;
use crate::parallel::lanes::{LANES, Lanes, add, lanes, lanes_mut, put, take};
use crate::parallel::slots::Slots;
use multiversion::multiversion;
use rayon::prelude::*;

/// Width (sigma) of the window in fringe periods: motion varies slowly over a surface.
const WINDOW: f32 = 0.5;
/// Rows of pixels that stand for a row of cells.
const SAMPLED_ROWS: usize = 4;

/// What a step is multiplied by. Backgrounds and phase were fitted as if nothing moved, and have taken up about half of what motion
/// does to the light, so that a plain step goes half of the way; any gain below 4 converges.
const GAIN: f32 = 2.0;

/// Greatest turn of B against R, rad; a quarter of a fringe is 1.57.
const TURN_MAX: f32 = 0.75;

/// Instants of the four channels, in any unit of time; 0 is the instant that everything is brought to.
pub(crate) type Instants = [f32; 4];

/// Velocity of the phase, cell by cell, and its working maps.
#[derive(Debug)]
pub(crate) struct Motion {
    /// Phase of the first fringe number per unit of time.
    velocity: CellMaps,
    change: CellMaps,
    sums: CellMaps,
    slots: Slots<([RowMaps; 2], CellWork)>,
}

impl Default for Motion {
    fn default() -> Self {
        Self {
            velocity: CellMaps::default(),
            change: CellMaps::new(1),
            sums: CellMaps::default(),
            slots: Slots::default(),
        }
    }
}

impl Motion {
    /// Forget the last shot.
    pub fn rest(&mut self, scene: &Scene<'_>) {
        self.velocity.fill::<1>(scene.grid, |_, [line]| line.fill(0.0));
    }

    /// Add to the velocity what light that was settled by it still shows; `phase` is absolute, `modulation` 0 where there is no
    /// light. A step of Gauss and Newton.
    pub fn measure(
        &mut self,
        scene: &Scene<'_>,
        (ratios, instants): ([f32; 3], Instants),
        backgrounds: &Backgrounds,
        phase: &[f32],
        modulation: &[f32],
    ) {
        let grid = scene.grid;
        grid.window_sums::<2, [RowMaps; 2]>(
            (scene.cells(WINDOW), SAMPLED_ROWS),
            &self.slots,
            &mut self.sums,
            &mut self.change,
            |maps, y, sums| {
                let model = backgrounds.sample(scene, y, &mut maps[0]);
                let pixels = [phase, modulation, scene.usable].map(|plane| scene.row(plane, y));
                add_motion(model, pixels, scene.rows(y), (ratios, instants), sums);
            },
            |_, [seen, known], out| {
                let found = out.iter_mut().zip(seen.iter().zip(known));
                found.for_each(|(out, (seen, known))| *out = seen / known.max(1e-9));
            },
        );
        let (before, change) = (std::mem::take(&mut self.velocity), &self.change);
        self.velocity.fill::<1>(grid, |row, [line]| {
            let both = before.line(row, 0).iter().zip(change.line(row, 0));
            line.iter_mut().zip(both).for_each(|(out, (before, change))| *out = before + GAIN * change);
        });
    }

    /// Bring the light of a scene, as it was seen, to the instant 0.
    pub fn settle(
        &self,
        scene: &Scene<'_>,
        (ratios, instants): ([f32; 3], Instants),
        backgrounds: &Backgrounds,
        phase: &[f32],
        out: [&mut [f32]; 4],
    ) {
        let grid = scene.grid;
        let [red, green, blue, infrared] = out.map(|plane| plane.par_chunks_mut(grid.stride));
        let rows = red.zip(green).zip(blue.zip(infrared)).enumerate();
        rows.for_each_init(
            || self.slots.take(),
            |slot, (y, ((red, green), (blue, infrared)))| {
                let [models, velocities] = &mut slot.0;
                let model = backgrounds.sample(scene, y, models);
                let [velocity] = velocities.sample(grid, &self.velocity, 0, y);
                let pixels = [scene.row(phase, y), velocity];
                bring(model, pixels, scene.rows(y), (ratios, instants), [red, green, blue, infrared]);
            },
        );
    }

    /// Takes from `sure` what moves too fast: where R and B have turned against each other by nearly a quarter of a fringe
    /// they show the same, and nothing tells how fast it was.
    pub fn rule_out(&self, scene: &Scene<'_>, [red, _, blue, _]: Instants, sure: &mut [u8]) {
        let grid = scene.grid;
        let most = TURN_MAX / (blue - red).abs().max(f32::MIN_POSITIVE);
        sure.par_chunks_mut(grid.stride).enumerate().for_each_init(
            || self.slots.take(),
            |slot, (y, sure)| {
                let [velocity] = slot.0[0].sample(grid, &self.velocity, 0, y);
                sure.iter_mut().zip(velocity).for_each(|(sure, v)| *sure &= u8::from(v.abs() <= most));
            },
        );
    }
}

/// Adds what every pixel sees of the motion, and how well it sees it: the derivative of its intensities by the velocity, less
/// what phase and albedo would explain of it.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn add_motion(
    model: [&[f32]; 8],
    pixels: [&[f32]; 3],
    light: [&[f32]; 4],
    (ratios, instants): ([f32; 3], Instants),
    sums: &mut [[Lanes; 2]],
) {
    let (model, pixels, light) = (model.map(lanes), pixels.map(lanes), light.map(lanes));
    for (i, sums) in sums.iter_mut().enumerate() {
        let (model, light) = (take(&model, i), take(&light, i));
        let [phase, modulation, usable] = take(&pixels, i);
        let mut terms = [[0.0; LANES]; 2];
        for x in 0..LANES {
            let (cosines, derivatives) = carriers(phase[x], ratios, 0.0);
            let (mut m, mut d, mut q) = ([0.0f32; 4], [0.0f32; 4], [0.0f32; 4]);
            let (mut mm, mut md, mut dd) = (1e-9f32, 0.0f32, 1e-9f32);
            let (mut mq, mut dq, mut ms) = (0.0f32, 0.0f32, 0.0f32);
            for c in 0..4 {
                let (a, b) = (model[2 * c][x], model[2 * c + 1][x]);
                (m[c], d[c]) = (a + b * cosines[c], b * derivatives[c]);
                q[c] = instants[c] * d[c];
                mm += m[c] * m[c];
                md += m[c] * d[c];
                dd += d[c] * d[c];
                mq += m[c] * q[c];
                dq += d[c] * q[c];
                ms += m[c] * light[c][x];
            }
            let determinant = mm * dd - md * md;
            let inverse = 1.0 / if determinant > 1e-12 { determinant } else { 1e-12 };
            let (albedo_part, phase_part) = ((dd * mq - md * dq) * inverse, (mm * dq - md * mq) * inverse);
            let albedo = ms / mm;
            let (mut seen, mut known) = (0.0f32, 0.0f32);
            for c in 0..4 {
                let rest = q[c] - albedo_part * m[c] - phase_part * d[c];
                seen += rest * light[c][x];
                known += rest * rest;
            }
            let weight = if modulation[x] > 0.0 { usable[x] * albedo } else { 0.0 };
            (terms[0][x], terms[1][x]) = (weight * seen, weight * albedo * known);
        }
        add(sums, &terms);
    }
}

/// Light of a row less what motion has added to it.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn bring(
    model: [&[f32]; 8],
    pixels: [&[f32]; 2],
    light: [&[f32]; 4],
    ([_, second, third], instants): ([f32; 3], Instants),
    out: [&mut [f32]; 4],
) {
    let (model, pixels, light) = (model.map(lanes), pixels.map(lanes), light.map(lanes));
    let mut out = out.map(lanes_mut);
    let factors = [1.0, second, 1.0, third];
    for i in 0..pixels[0].len() {
        let (model, mut found, [phase, velocity]) = (take(&model, i), take(&light, i), take(&pixels, i));
        for x in 0..LANES {
            let mut change = [0.0f32; 4];
            let (mut top, mut bottom) = (0.0f32, 1e-9f32);
            for c in 0..4 {
                let fringe = |phase: f32| {
                    let (s, c_) = sin_cos(factors[c] * phase);
                    if c == 2 { -s } else { c_ }
                };
                let moved = fringe(phase[x] + velocity[x] * instants[c]);
                change[c] = model[2 * c + 1][x] * (moved - fringe(phase[x]));
                let own = model[2 * c][x] + model[2 * c + 1][x] * moved;
                top += own * found[c][x];
                bottom += own * own;
            }
            let albedo = top / bottom;
            for c in 0..4 {
                found[c][x] -= albedo * change[c];
            }
        }
        put(&mut out, i, &found);
    }
}
