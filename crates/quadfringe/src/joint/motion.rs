//! Step 7: motion between the colours. A projector that shows R, G and B one after another inside a frame lets each channel see the
//! surface at a different instant.
//!
//! While the phase at a pixel changes by `v` per unit of time, channel c, seen at the instant `t_c`, is
//! `I_c = rho (A_c + B_c cos(k_c (Phi + v t_c) + delta_c))`. R and B leave quadrature: their circle becomes an ellipse, and the
//! phase gets a ripple of two waves in a fringe. G and IR run ahead of both or fall behind. When phase and albedo are projected out,
//! two of the four intensities of a pixel remain, and they give `v` over a window. With it, every plane is brought to the instant
//! 0 by the change that the model predicts.

use super::cells::{CellMaps, CellWindow, RowMaps, TaskWork};
use super::infrared::{Waves, with_waves};
use super::model::{FringeRows, has_quadrature};
use super::params::motion::{GAIN, TURN_MAX, WINDOW};
use super::params::pyramid::SAMPLED_ROWS;
use super::photometry::Photometry;
use super::pyramid::Level;
use super::scene::{PhaseMap, PixelRow, ScaledGrid, Scene};
use crate::Reason;
use crate::parallel::lanes::{LANES, Lanes, add, lanes, lanes_mut, put, take};
use crate::parallel::slots::Slots;
use multiversion::multiversion;
use rayon::prelude::*;

/// When and how the channels saw the surface.
#[derive(Clone, Copy)]
pub(super) struct Timing {
    /// Instants of R, G, B, IR in any unit of time; 0 is the instant of the result.
    pub instants: [f32; 4],
    /// Fringe numbers over the first.
    pub ratios: [f32; 4],
}

/// Instants of R, G, B, IR, given in us, in seconds; B alone has the place of IR.
pub(super) fn in_places(instants_us: [f32; 4], ratios: [f32; 4]) -> [f32; 4] {
    let [red, green, blue, infrared] = instants_us.map(|t| 1e-6 * t);
    [red, green, blue, if has_quadrature(ratios) { infrared } else { blue }]
}

/// Rows of one task.
#[derive(Debug, Default)]
struct Rows {
    fringes: RowMaps,
    velocity: RowMaps,
}

/// Velocity of the phase on the cells, with working maps.
#[derive(Debug)]
pub(super) struct Motion {
    /// Change of the phase of R and B in rad per unit of time.
    velocity: CellMaps,
    change: CellMaps,
    sums: CellMaps,
    slots: Slots<TaskWork<Rows>>,
    /// Light of the shot before compensation.
    captured: [Vec<f32>; 4],
}

impl Default for Motion {
    fn default() -> Self {
        Self {
            velocity: CellMaps::default(),
            change: CellMaps::new(1),
            sums: CellMaps::default(),
            slots: Slots::default(),
            captured: Default::default(),
        }
    }
}

impl Motion {
    /// Starts a new shot with a velocity of 0, and keeps its light.
    pub fn begin(&mut self, scene: &Scene<'_>) {
        for (kept, light) in self.captured.iter_mut().zip(scene.light) {
            kept.clear();
            kept.extend_from_slice(light);
        }
        self.velocity.fill::<1>(scene.grid, |_, [line]| line.fill(0.0));
    }

    /// Improves the velocity, and brings the light of a level from that of the shot to the instant 0.
    pub fn step(
        &mut self,
        level: &mut Level,
        scaled: ScaledGrid<'_>,
        timing: Timing,
        photometry: &Photometry,
        map: PhaseMap<'_>,
    ) {
        self.measure(&level.scene(scaled), timing, photometry, map);
        let (Level { light, usable, pair, .. }, ScaledGrid { grid, period_px, factor }) = (level, scaled);
        let captured = self.captured.each_ref().map(Vec::as_slice);
        let scene = Scene { light: captured, usable, grid, period_px, factor, pair: pair.as_ref() };
        self.compensate(&scene, timing, photometry, map.phase, light.each_mut().map(Vec::as_mut_slice));
    }

    /// Improves the velocity by a Gauss-Newton step on compensated light, at an absolute phase.
    fn measure(&mut self, scene: &Scene<'_>, timing: Timing, photometry: &Photometry, map: PhaseMap<'_>) {
        let grid = scene.grid;
        grid.window_sums::<2, Rows>(
            CellWindow { sigma_cells: scene.cells(WINDOW), sampled_rows: SAMPLED_ROWS },
            &self.slots,
            &mut self.sums,
            &mut self.change,
            |rows, y, sums| {
                let fringes = photometry.sample(scene, y, &mut rows.fringes);
                let (pixels, instants) = (scene.pixel_row(map, y), timing.instants);
                with_waves!(scene, y, timing.ratios, |waves| {
                    add_motion(&fringes, &pixels, scene.rows(y), waves, instants, sums);
                });
            },
            |_, [numerator, information], out| {
                let found = out.iter_mut().zip(numerator.iter().zip(information));
                found.for_each(|(out, (numerator, information))| *out = numerator / information.max(1e-9));
            },
        );
        let (before, change) = (std::mem::take(&mut self.velocity), &self.change);
        self.velocity.fill::<1>(grid, |row, [line]| {
            let both = before.line(row, 0).iter().zip(change.line(row, 0));
            line.iter_mut().zip(both).for_each(|(out, (before, change))| *out = before + GAIN * change);
        });
    }

    /// Brings the light of a scene, as it was captured, to the instant 0.
    fn compensate(
        &self,
        scene: &Scene<'_>,
        timing: Timing,
        photometry: &Photometry,
        phase: &[f32],
        out: [&mut [f32]; 4],
    ) {
        let grid = scene.grid;
        let [red, green, blue, infrared] = out.map(|plane| plane.par_chunks_mut(grid.stride));
        let rows = red.zip(green).zip(blue.zip(infrared)).enumerate();
        rows.for_each_init(
            || self.slots.take(),
            |slot, (y, ((red, green), (blue, infrared)))| {
                let Rows { fringes, velocity } = &mut slot.rows;
                let fringes = photometry.sample(scene, y, fringes);
                let [velocity] = velocity.sample(grid, &self.velocity, 0, y);
                let moving = MovingRow { phase: scene.row(phase, y), velocity };
                let (out, instants) = ([red, green, blue, infrared].map(|row| &mut row[..]), timing.instants);
                with_waves!(scene, y, timing.ratios, |waves| {
                    compensate_row(&fringes, &moving, scene.rows(y), waves, instants, out);
                });
            },
        );
    }

    /// Removes from `valid` pixels that move too fast: where R and B have turned against each other by nearly a quarter of a fringe
    /// they show the same, and the velocity is ambiguous.
    pub fn invalidate_fast(
        &self,
        scene: &Scene<'_>,
        [red, _, blue, _]: [f32; 4],
        valid: &mut [u8],
        reasons: &mut [Reason],
    ) {
        let grid = scene.grid;
        let most = TURN_MAX / (blue - red).abs().max(f32::MIN_POSITIVE);
        let rows = valid.par_chunks_mut(grid.stride).zip(reasons.par_chunks_mut(grid.stride));
        rows.enumerate().for_each_init(
            || self.slots.take(),
            |slot, (y, (valid, reasons))| {
                let [velocity] = slot.rows.velocity.sample(grid, &self.velocity, 0, y);
                for ((valid, reason), v) in valid.iter_mut().zip(reasons).zip(velocity) {
                    if *valid != 0 && v.abs() > most {
                        (*valid, *reason) = (0, Reason::Moved);
                    }
                }
            },
        );
    }
}

/// One row of a moving phase: rad, and rad per unit of time.
struct MovingRow<'a> {
    phase: &'a [f32],
    velocity: &'a [f32],
}

/// Adds numerator and information of a step of the velocity.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn add_motion<W: Waves>(
    fringes: &FringeRows,
    pixels: &PixelRow,
    light: [&[f32]; 4],
    waves: W,
    instants: [f32; 4],
    sums: &mut [[Lanes; 2]],
) {
    let pixels = [pixels.phase, pixels.modulation, pixels.usable].map(lanes);
    let (offset, amplitude, light) =
        (fringes.offset.map(lanes), fringes.amplitude.map(lanes), light.map(lanes));
    for (i, sums) in sums.iter_mut().enumerate() {
        let (offset, amplitude, light) = (take(&offset, i), take(&amplitude, i), take(&light, i));
        let [phase, modulation, usable] = take(&pixels, i);
        let vector = waves.vector(i);
        let mut terms = [[0.0; LANES]; 2];
        for x in 0..LANES {
            let (mut m, mut d) = ([0.0f32; 4], [0.0f32; 4]);
            let carriers = waves.carriers(&vector, x, phase[x]);
            for c in 0..4 {
                let (a, b) = (offset[c][x], amplitude[c][x]);
                (m[c], d[c]) = (a + b * carriers.cosine[c], b * carriers.derivative[c]);
            }
            let seen = light.map(|light| light[x]);
            let weight = if modulation[x] > 0.0 { usable[x] } else { 0.0 };
            let found = motion_terms(m, d, seen, instants, weight);
            (terms[0][x], terms[1][x]) = (found.numerator, found.information);
        }
        add(sums, &terms);
    }
}

/// A step of the velocity by one pixel: numerator over information.
struct MotionTerms {
    numerator: f32,
    information: f32,
}

/// Terms of one pixel: the derivative of its intensities with respect to the velocity, less the part that
/// phase and albedo would explain. `m` is the model for an albedo of 1, `d` its derivative with respect to the phase.
#[inline(always)]
fn motion_terms(m: [f32; 4], d: [f32; 4], light: [f32; 4], instants: [f32; 4], usable: f32) -> MotionTerms {
    let mut q = [0.0f32; 4];
    let (mut mm, mut md, mut dd) = (1e-9f32, 0.0f32, 1e-9f32);
    let (mut mq, mut dq, mut ms) = (0.0f32, 0.0f32, 0.0f32);
    for c in 0..4 {
        q[c] = instants[c] * d[c];
        mm += m[c] * m[c];
        md += m[c] * d[c];
        dd += d[c] * d[c];
        mq += m[c] * q[c];
        dq += d[c] * q[c];
        ms += m[c] * light[c];
    }
    let determinant = mm * dd - md * md;
    let inverse = 1.0 / if determinant > 1e-12 { determinant } else { 1e-12 };
    let (albedo_part, phase_part) = ((dd * mq - md * dq) * inverse, (mm * dq - md * mq) * inverse);
    let albedo = ms / mm;
    let (mut numerator, mut information) = (0.0f32, 0.0f32);
    for c in 0..4 {
        let rest = q[c] - albedo_part * m[c] - phase_part * d[c];
        numerator += rest * light[c];
        information += rest * rest;
    }
    let weight = if usable > 0.0 { usable * albedo } else { 0.0 };
    MotionTerms { numerator: weight * numerator, information: weight * albedo * information }
}

/// Light of a row less the change by motion.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn compensate_row<W: Waves>(
    fringes: &FringeRows,
    moving: &MovingRow,
    light: [&[f32]; 4],
    waves: W,
    instants: [f32; 4],
    out: [&mut [f32]; 4],
) {
    let pixels = [moving.phase, moving.velocity].map(lanes);
    let (offset, amplitude, light) =
        (fringes.offset.map(lanes), fringes.amplitude.map(lanes), light.map(lanes));
    let mut out = out.map(lanes_mut);
    for i in 0..pixels[0].len() {
        let (offset, amplitude, mut found) = (take(&offset, i), take(&amplitude, i), take(&light, i));
        let [phase, velocity] = take(&pixels, i);
        let vector = waves.vector(i);
        for x in 0..LANES {
            let mut change = [0.0f32; 4];
            let (mut top, mut bottom) = (0.0f32, 1e-9f32);
            let still = waves.carriers(&vector, x, phase[x]).cosine;
            for c in 0..4 {
                let moved = waves.carriers(&vector, x, phase[x] + velocity[x] * instants[c]).cosine[c];
                change[c] = amplitude[c][x] * (moved - still[c]);
                let model = offset[c][x] + amplitude[c][x] * moved;
                top += model * found[c][x];
                bottom += model * model;
            }
            let albedo = top / bottom;
            for c in 0..4 {
                found[c][x] -= albedo * change[c];
            }
        }
        put(&mut out, i, &found);
    }
}
