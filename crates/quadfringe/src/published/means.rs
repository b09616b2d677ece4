//! Phase at every pixel of fringes that are known as means of pixels.

use crate::parallel::Aligned;
use crate::parallel::angle::{coarse_atan2, wrap};
use rustfft::num_complex::Complex32;

/// Working rows of [`Means::spread`]: from the sample before the first to the one after the last.
#[derive(Debug, Default)]
pub(super) struct Means {
    phase: Aligned<f32>,
    /// Square of the modulation.
    power: Aligned<f32>,
    /// What both grow by from one sample to the next.
    growth: [Aligned<f32>; 2],
}

impl Means {
    /// Phases of an analytic signal whose samples are means of so many `PIXELS`, on straight lines between their middles and
    /// not wrapped, and the lesser of `powers` and the square of the modulation. The signal is a ring that goes on beyond the row.
    #[inline(always)]
    pub fn spread<const PIXELS: usize>(
        &mut self,
        ring: &[Complex32],
        phase: &mut [f32],
        modulation: &mut [f32],
    ) {
        let Self { phase: turns, power, growth: [turning, growing] } = self;
        let samples = phase.len().div_ceil(PIXELS) + 2;
        for row in [&mut *turns, &mut *power, &mut *turning, &mut *growing] {
            row.resize(samples);
        }
        (turns[0], power[0]) = polar(ring[ring.len() - 1]);
        for ((z, turns), power) in ring.iter().zip(&mut turns[1..]).zip(&mut power[1..]) {
            (*turns, *power) = polar(*z);
        }
        for ((growth, here), next) in turning.iter_mut().zip(&**turns).zip(&turns[1..]) {
            *growth = wrap(next - here);
        }
        for ((growth, here), next) in growing.iter_mut().zip(&**power).zip(&power[1..]) {
            *growth = next - here;
        }
        draw::<PIXELS>([turns, turning], phase, |phase, _| phase);
        draw::<PIXELS>([power, growing], modulation, lesser);
    }
}

/// Straight lines from the middle of each sample to that of the next, joined with what the pixels hold. As many pixels lie between
/// two middles as in a sample, and half as many before the first.
#[inline(always)]
fn draw<const PIXELS: usize>(
    [starts, growth]: [&[f32]; 2],
    pixels: &mut [f32],
    join: impl Fn(f32, f32) -> f32,
) {
    let along = |i: usize| if PIXELS == 1 { 1.0 } else { (i as f32 + 0.5) / PIXELS as f32 };
    let cut = PIXELS / 2;
    let (head, rest) = pixels.split_at_mut(cut);
    for (i, pixel) in head.iter_mut().enumerate() {
        *pixel = join(starts[0] + along(PIXELS - cut + i) * growth[0], *pixel);
    }
    let first = usize::from(cut > 0);
    let (whole, tail) = rest.as_chunks_mut::<PIXELS>();
    let last = first + whole.len();
    for ((pixels, start), growth) in whole.iter_mut().zip(&starts[first..]).zip(&growth[first..]) {
        for (i, pixel) in pixels.iter_mut().enumerate() {
            *pixel = join(start + along(i) * growth, *pixel);
        }
    }
    for (i, pixel) in tail.iter_mut().enumerate() {
        *pixel = join(starts[last] + along(i) * growth[last], *pixel);
    }
}

/// Phase and square of the modulation.
#[inline(always)]
fn polar(z: Complex32) -> (f32, f32) {
    (coarse_atan2(z.im, z.re), z.re * z.re + z.im * z.im)
}

#[inline(always)]
pub(super) fn lesser(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts::TAU;

    fn check<const PIXELS: usize>(bound: f32) {
        // An odd length: the last pixels lie beyond the last middle.
        const WIDTH: usize = 1021;
        let at = |x: f32| TAU * x / 29.0 + 2.0 * (TAU * x / 300.0).sin();
        let middle = |sample: f32| PIXELS as f32 * sample + (PIXELS as f32 - 1.0) / 2.0;
        let count = WIDTH.div_ceil(PIXELS) + 1;
        let mut ring: Vec<_> =
            (0..count).map(|m| Complex32::from_polar(0.25, at(middle(m as f32)))).collect();
        ring.push(Complex32::from_polar(0.25, at(middle(-1.0))));
        let (mut phase, mut modulation) = (vec![0.0; WIDTH], vec![1.0; WIDTH]);
        modulation[5] = 0.01;
        Means::default().spread::<PIXELS>(&ring, &mut phase, &mut modulation);
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
