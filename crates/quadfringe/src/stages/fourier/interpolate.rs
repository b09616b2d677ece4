//! Interpolation of the phase at every pixel from the analytic signal of block means.

use crate::parallel::Aligned;
use crate::parallel::angle::{coarse_atan2, wrap};
use rustfft::num_complex::Complex32;

/// Working rows of [`Interpolation::run`]. They extend from the sample before the row to the sample after it.
#[derive(Debug, Default)]
pub(crate) struct Interpolation {
    phase: Aligned<f32>,
    /// Square of the modulation.
    power: Aligned<f32>,
    /// Change of the phase from each sample to the next.
    phase_step: Aligned<f32>,
    /// Change of the power from each sample to the next.
    power_step: Aligned<f32>,
}

impl Interpolation {
    /// Interpolates phase and power linearly between the centres of samples of an analytic signal, each a mean of
    /// `PIXELS` pixels. The phase is not wrapped. `power` keeps the smaller of its value and the square of the
    /// modulation. The signal is periodic and continues beyond the row.
    #[inline(always)]
    pub fn run<const PIXELS: usize>(&mut self, ring: &[Complex32], phase: &mut [f32], power: &mut [f32]) {
        let Self { phase: phases, power: powers, phase_step, power_step } = self;
        let samples = phase.len().div_ceil(PIXELS) + 2;
        for row in [&mut *phases, &mut *powers, &mut *phase_step, &mut *power_step] {
            row.resize(samples);
        }
        let first = Polar::of(ring[ring.len() - 1]);
        (phases[0], powers[0]) = (first.phase, first.power);
        for ((z, phase), power) in ring.iter().zip(&mut phases[1..]).zip(&mut powers[1..]) {
            let Polar { phase: angle, power: square } = Polar::of(*z);
            (*phase, *power) = (angle, square);
        }
        for ((step, here), next) in phase_step.iter_mut().zip(&**phases).zip(&phases[1..]) {
            *step = wrap(next - here);
        }
        for ((step, here), next) in power_step.iter_mut().zip(&**powers).zip(&powers[1..]) {
            *step = next - here;
        }
        draw::<PIXELS>(phases, phase_step, phase, |phase, _| phase);
        draw::<PIXELS>(powers, power_step, power, lesser);
    }

    /// [`Self::run`] for every width that [`Blocks`](crate::stages::Blocks) can have.
    #[inline(always)]
    pub fn run_for(&mut self, pixels: usize, ring: &[Complex32], phase: &mut [f32], power: &mut [f32]) {
        match pixels {
            1 => self.run::<1>(ring, phase, power),
            2 => self.run::<2>(ring, phase, power),
            _ => self.run::<4>(ring, phase, power),
        }
    }
}

/// Draws straight lines from the centre of each sample to the centre of the next; `join` combines them with the present
/// values of the pixels. `PIXELS` pixels lie between two centres, and half as many before the first.
#[inline(always)]
fn draw<const PIXELS: usize>(
    starts: &[f32],
    steps: &[f32],
    pixels: &mut [f32],
    join: impl Fn(f32, f32) -> f32,
) {
    let along = |i: usize| if PIXELS == 1 { 1.0 } else { (i as f32 + 0.5) / PIXELS as f32 };
    let cut = PIXELS / 2;
    let (head, rest) = pixels.split_at_mut(cut);
    for (i, pixel) in head.iter_mut().enumerate() {
        *pixel = join(starts[0] + along(PIXELS - cut + i) * steps[0], *pixel);
    }
    let first = usize::from(cut > 0);
    let (whole, tail) = rest.as_chunks_mut::<PIXELS>();
    let last = first + whole.len();
    for ((pixels, start), step) in whole.iter_mut().zip(&starts[first..]).zip(&steps[first..]) {
        for (i, pixel) in pixels.iter_mut().enumerate() {
            *pixel = join(start + along(i) * step, *pixel);
        }
    }
    for (i, pixel) in tail.iter_mut().enumerate() {
        *pixel = join(starts[last] + along(i) * steps[last], *pixel);
    }
}

/// A sample of the analytic signal.
struct Polar {
    phase: f32,
    /// Square of the modulation.
    power: f32,
}

impl Polar {
    #[inline(always)]
    fn of(z: Complex32) -> Self {
        Self { phase: coarse_atan2(z.im, z.re), power: z.re * z.re + z.im * z.im }
    }
}

/// The smaller of two numbers without a branch; `b` if either is NaN.
#[inline(always)]
pub(crate) fn lesser(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts::TAU;

    fn check<const PIXELS: usize>(bound: f32) {
        // With an odd length, the last pixels lie beyond the last centre.
        const WIDTH: usize = 1021;
        let at = |x: f32| TAU * x / 29.0 + 2.0 * (TAU * x / 300.0).sin();
        let middle = |sample: f32| PIXELS as f32 * sample + (PIXELS as f32 - 1.0) / 2.0;
        let count = WIDTH.div_ceil(PIXELS) + 1;
        let mut ring: Vec<_> =
            (0..count).map(|m| Complex32::from_polar(0.25, at(middle(m as f32)))).collect();
        ring.push(Complex32::from_polar(0.25, at(middle(-1.0))));
        let (mut phase, mut modulation) = (vec![0.0; WIDTH], vec![1.0; WIDTH]);
        modulation[5] = 0.01;
        Interpolation::default().run::<PIXELS>(&ring, &mut phase, &mut modulation);
        for (x, phase) in phase.iter().enumerate() {
            assert!(wrap(phase - at(x as f32)).abs() < bound, "{PIXELS} {x}");
            let least = if x == 5 { 0.01 } else { 0.0625 };
            assert!((modulation[x] - least).abs() < 1e-6, "{PIXELS} {x}");
        }
    }

    #[test]
    fn the_phase_is_known_at_every_pixel() {
        check::<1>(1e-4);
        check::<2>(1e-3);
        check::<4>(4e-3);
    }
}
