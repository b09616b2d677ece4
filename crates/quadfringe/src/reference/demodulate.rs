//! Step 1: phase and modulation of each fringe number at every pixel of a row.
//!
//! Equally spaced steps make the least-squares fit of `a + b cos(Phi + 2 pi s / N)` a discrete Fourier transform (R1). Where
//! samples are saturated, the fit is solved for the remaining ones (R2).

use super::images::StepImages;
use super::params::SATURATED_LOSS_MAX;
use super::plan::StepSet;
use crate::condition::{Response, Sample};
use crate::parallel::Aligned;
use crate::parallel::angle::atan2;
use std::f32::consts::TAU as TAU_F32;
use std::f64::consts::TAU;

/// Pixels that are searched together. Rows of a set are padded to a multiple of it.
pub(super) const BLOCK: usize = 64;

/// Weights of one step in the sums over all steps.
#[derive(Debug, Clone, Copy)]
pub(super) struct Wave {
    real: f32,
    imaginary: f32,
    pub cos: f64,
    pub sin: f64,
}

/// One fringe number, prepared.
#[derive(Debug, Clone)]
pub(super) struct SetPlan {
    pub waves: Vec<Wave>,
}

impl SetPlan {
    pub fn new(set: &StepSet) -> Self {
        let steps = set.steps as f64;
        let wave = |s: usize| {
            let (sin, cos) = (TAU * s as f64 / steps).sin_cos();
            Wave { real: (2.0 * cos / steps) as f32, imaginary: (-2.0 * sin / steps) as f32, cos, sin }
        };
        Self { waves: (0..set.steps).map(wave).collect() }
    }

    /// Variance of the phase in rad^2, for intensities of variance 1 and fringes of modulation 1, with all samples.
    pub fn gain(&self) -> f32 {
        2.0 / self.waves.len() as f32
    }
}

/// From raw intensities to linear light, as fractions of full scale.
#[derive(Debug, Clone)]
pub(super) struct Light {
    scale: f32,
    saturation: f32,
    response: Response,
    /// The response for every level of an integer type; empty if there is no response or no integer.
    table: Vec<f32>,
}

impl Light {
    pub fn new<T: Sample>(full_scale: f32, saturation: f32, response: Response) -> Self {
        let scale = 1.0 / full_scale;
        let levels = if response == Response::default() { 0 } else { T::LEVELS };
        let table = (0..levels).map(|level| response.linear(level as f32 * scale)).collect();
        Self { scale, saturation, response, table }
    }

    #[inline(always)]
    fn is_plain(&self) -> bool {
        self.response == Response::default()
    }

    #[inline(always)]
    pub fn of<T: Sample>(&self, raw: T) -> f32 {
        match raw.level() {
            Some(level) if !self.table.is_empty() => self.table[level],
            _ => self.response.linear(raw.intensity() * self.scale),
        }
    }
}

/// The images of one fringe number, and how they are read.
#[derive(Debug)]
pub(super) struct Source<'a, 'i, T> {
    pub images: &'a StepImages<'i, T>,
    /// Place of the fringe number.
    pub k: usize,
    pub plan: &'a SetPlan,
    pub light: &'a Light,
    /// Standard deviation of an intensity, fraction of full scale; 0 as long as it is not known.
    pub noise: f32,
}

impl<T> Clone for Source<'_, '_, T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<T> Copy for Source<'_, '_, T> {}

/// Fringes of one fringe number in a row, padded with zeros.
#[derive(Debug, Default)]
pub(super) struct SetRow {
    /// Wrapped phase in turns. Before that the imaginary part of the sum over the steps.
    pub turns: Aligned<f32>,
    /// Modulation, fraction of full scale; NaN where too few samples are not saturated. Before that the real part.
    pub modulation: Aligned<f32>,
    /// Variance of the phase in rad^2 for intensities of variance 1 and fringes of modulation 1.
    pub gain: Aligned<f32>,
    /// Brightest sample, fraction of full scale before the response.
    pub peak: Aligned<f32>,
}

impl SetRow {
    pub fn resize(&mut self, width: usize) {
        let padded = width.next_multiple_of(BLOCK);
        for row in [&mut self.turns, &mut self.modulation, &mut self.gain, &mut self.peak] {
            row.resize(padded);
        }
    }

    /// Fringes of row `y`.
    #[inline(always)]
    pub fn fill<T: Sample>(&mut self, source: Source<'_, '_, T>, y: usize) {
        let Source { images, k, plan, light, .. } = source;
        for row in [&mut self.turns, &mut self.modulation, &mut self.peak] {
            row.fill(0.0);
        }
        self.gain.fill(plan.gain());
        for (s, wave) in plan.waves.iter().enumerate() {
            self.add(&images.row(k, s, y), *wave, light);
        }
        for (turns, modulation) in self.turns.iter_mut().zip(&mut *self.modulation) {
            let (imaginary, real) = (*turns, *modulation);
            *turns = atan2(imaginary, real) * (1.0 / TAU_F32);
            *modulation = (real * real + imaginary * imaginary).sqrt();
        }
        if self.peak.iter().fold(false, |any, peak| any | (*peak >= light.saturation)) {
            self.refit(source, y);
        }
    }

    #[inline(always)]
    fn add<T: Sample>(&mut self, row: &[T], wave: Wave, light: &Light) {
        let sums = self.modulation.iter_mut().zip(&mut *self.turns).zip(&mut *self.peak);
        let pixels = sums.zip(row);
        if light.is_plain() {
            for (((real, imaginary), peak), raw) in pixels {
                let value = raw.intensity() * light.scale;
                *peak = if value > *peak { value } else { *peak };
                *real += value * wave.real;
                *imaginary += value * wave.imaginary;
            }
            return;
        }
        for (((real, imaginary), peak), raw) in pixels {
            let seen = raw.intensity() * light.scale;
            *peak = if seen > *peak { seen } else { *peak };
            let value = light.of(*raw);
            *real += value * wave.real;
            *imaginary += value * wave.imaginary;
        }
    }

    /// Fits the pixels with saturated samples without these, unless that would add more noise than they add bias (R2).
    #[cold]
    fn refit<T: Sample>(&mut self, source: Source<'_, '_, T>, y: usize) {
        let Source { images, k, plan, light, noise } = source;
        let rows: Vec<_> = (0..plan.waves.len()).map(|s| images.row(k, s, y)).collect();
        let limit = f64::from(light.response.linear(light.saturation));
        for x in (0..rows[0].len()).filter(|x| self.peak[*x] >= light.saturation) {
            let samples = rows.iter().map(|row| row[x]).zip(&plan.waves);
            let is_sound = |raw: &T| raw.intensity() * light.scale < light.saturation;
            let mut fit = Fit::default();
            let sound = samples.clone().filter(|(raw, _)| is_sound(raw));
            sound.for_each(|(raw, wave)| fit.add(*wave, f64::from(light.of(raw))));
            let loss_max = SATURATED_LOSS_MAX * f64::from(plan.gain());
            let found = fit.solve().filter(|found| found.gain <= loss_max).unwrap_or(Fringe::NONE);
            let clipped = samples.filter(|(raw, _)| !is_sound(raw));
            let cut: f64 = clipped.map(|(_, wave)| (found.at(*wave) - limit).max(0.0)).sum();
            let (bias, loss) = (f64::from(plan.gain()) * cut, found.gain - f64::from(plan.gain()));
            if bias * bias <= f64::from(noise * noise) * loss {
                continue;
            }
            self.turns[x] = (found.phase_rad / TAU) as f32;
            self.modulation[x] = found.modulation as f32;
            self.gain[x] = found.gain as f32;
        }
    }

    /// Whether no sample of a pixel is saturated.
    pub fn is_sound(&self, x: usize, light: &Light) -> bool {
        self.peak[x] < light.saturation
    }
}

/// A fringe that was fitted to some of the steps.
struct Fringe {
    background: f64,
    phase_rad: f64,
    modulation: f64,
    gain: f64,
}

impl Fringe {
    const NONE: Self =
        Self { background: f64::NAN, phase_rad: f64::NAN, modulation: f64::NAN, gain: f64::NAN };

    /// The light of a step.
    fn at(&self, Wave { cos, sin, .. }: Wave) -> f64 {
        let (phase_sin, phase_cos) = self.phase_rad.sin_cos();
        self.background + self.modulation * (phase_cos * cos - phase_sin * sin)
    }
}

/// Normal equations of `a + c cos(theta) - d sin(theta)` with `c = b cos(Phi)`, `d = b sin(Phi)`.
#[derive(Default)]
struct Fit {
    count: f64,
    cos: f64,
    sin: f64,
    cos_cos: f64,
    cos_sin: f64,
    sin_sin: f64,
    light: f64,
    light_cos: f64,
    light_sin: f64,
}

impl Fit {
    fn add(&mut self, Wave { cos, sin, .. }: Wave, light: f64) {
        self.count += 1.0;
        self.cos += cos;
        self.sin -= sin;
        self.cos_cos += cos * cos;
        self.cos_sin -= cos * sin;
        self.sin_sin += sin * sin;
        self.light += light;
        self.light_cos += light * cos;
        self.light_sin -= light * sin;
    }

    /// The fringe, from the equations without the background; `None` if too few samples determine it.
    fn solve(&self) -> Option<Fringe> {
        let mean = 1.0 / self.count;
        let cos_cos = self.cos_cos - self.cos * self.cos * mean;
        let cos_sin = self.cos_sin - self.cos * self.sin * mean;
        let sin_sin = self.sin_sin - self.sin * self.sin * mean;
        let (right_cos, right_sin) =
            (self.light_cos - self.light * self.cos * mean, self.light_sin - self.light * self.sin * mean);
        let determinant = cos_cos * sin_sin - cos_sin * cos_sin;
        // Without any sample the determinant is NaN.
        if determinant.is_nan() || determinant <= 1e-9 {
            return None;
        }
        let c = (sin_sin * right_cos - cos_sin * right_sin) / determinant;
        let d = (cos_cos * right_sin - cos_sin * right_cos) / determinant;
        let modulation = c.hypot(d);
        let (sin, cos) = (d / modulation, c / modulation);
        // The covariance of (c, d) is the inverse of the matrix; only its part across the phasor turns the phase.
        let gain = (sin * sin * sin_sin + 2.0 * sin * cos * cos_sin + cos * cos * cos_cos) / determinant;
        let background = mean * (self.light - c * self.cos - d * self.sin);
        Some(Fringe { background, phase_rad: d.atan2(c), modulation, gain })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fitted(steps: usize, left_out: &[usize]) -> Option<Fringe> {
        let plan = SetPlan::new(&StepSet::new(10.0, steps));
        let mut fit = Fit::default();
        for (s, wave) in plan.waves.iter().enumerate().filter(|(s, _)| !left_out.contains(s)) {
            fit.add(*wave, 0.6 + 0.3 * (1.1 + TAU * s as f64 / steps as f64).cos());
        }
        fit.solve()
    }

    #[test]
    fn a_fit_without_some_samples_finds_the_fringe() {
        for left_out in [&[][..], &[0], &[0, 7], &[0, 1, 2, 3, 4]] {
            let found = fitted(8, left_out).expect("three samples determine it");
            assert!((found.phase_rad - 1.1).abs() < 1e-9 && (found.modulation - 0.3).abs() < 1e-9);
            assert!(found.gain >= 0.25 - 1e-9 && (found.background - 0.6).abs() < 1e-9);
        }
        assert!((fitted(8, &[]).expect("all samples").gain - 0.25).abs() < 1e-9);
        assert!(fitted(8, &[0, 1, 2, 3, 4, 5]).is_none() && fitted(3, &[0, 1, 2]).is_none());
    }
}
