//! Compares interpolated mosaics with the images from which they were sampled.

use super::*;
use crate::Conditioner;
use crate::condition::linearise;
use ndarray::{Array2, ArrayView2, s};
use std::f32::consts::{FRAC_PI_2, TAU};

/// Mosaic that a chip of this pattern delivers for three planes.
fn sampled(planes: &[Array2<f32>; 3], pattern: BayerPattern) -> Array2<f32> {
    Array2::from_shape_fn(planes[0].dim(), |at| planes[pattern.channel(at.0, at.1).index()][at])
}

fn developed(planes: &[Array2<f32>; 3], pattern: BayerPattern) -> [Array2<f32>; 3] {
    let raw = sampled(planes, pattern);
    let shot = Shot::bayer(raw.view(), pattern, raw.view()).unwrap();
    let [red, green, blue, _] = linearise(&shot, &Conditioner::default()).unwrap();
    [red, green, blue]
}

/// Pixels at least `rim` pixels from the border.
fn inner(image: &Array2<f32>, rim: usize) -> ArrayView2<'_, f32> {
    let (rows, columns) = image.dim();
    image.slice(s![rim..rows - rim, rim..columns - rim])
}

fn rms(values: impl Iterator<Item = f32>) -> f32 {
    let (sum, count) = values.fold((0.0f64, 0), |(sum, n), v| (sum + f64::from(v).powi(2), n + 1));
    (sum / f64::from(count)).sqrt() as f32
}

#[test]
fn a_ramp_comes_back_up_to_the_borders_in_every_pattern_and_size() {
    for pattern in BayerPattern::ALL {
        for size in [(8, 8), (9, 11), (16, 19), (17, 150), (9, 263)] {
            let ramp =
                |a: f32, b: f32| Array2::from_shape_fn(size, |(y, x)| 0.3 + a * y as f32 + b * x as f32);
            let planes = [ramp(0.002, 0.001), ramp(-0.003, 0.002), ramp(0.001, -0.001)];
            for (got, expected) in developed(&planes, pattern).iter().zip(&planes) {
                let worst = got.iter().zip(expected).fold(0.0f32, |w, (a, b)| w.max((a - b).abs()));
                assert!(worst < 2e-6, "{pattern:?} {size:?}: {worst}");
            }
        }
        let grey = [0.2, 0.5, 0.7].map(|level| Array2::from_elem((2, 3), level));
        for (got, expected) in developed(&grey, pattern).iter().zip(&grey) {
            assert!(got.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-6), "{pattern:?}");
        }
    }
}

/// Compares the two-step phase of R and B and the amplitude of G with the truth. Bilinear interpolation has errors of
/// 0.018 rad at 20 px and 0.075 rad at 10 px.
#[test]
fn fringes_keep_phase_and_modulation() {
    let bounds = [(28.0, 2e-5, 3e-4), (20.0, 1.5e-4, 1e-3), (14.0, 1e-3, 4e-3), (10.0, 6e-3, 0.014)];
    for pattern in BayerPattern::ALL {
        for (period_px, phase_max, amplitude_max) in bounds {
            for tilt in [0.0f32, 0.6, 0.8, FRAC_PI_2] {
                let phase =
                    |y: usize, x: usize| TAU / period_px * (tilt.cos() * x as f32 + tilt.sin() * y as f32);
                let wave = |shift: f32| {
                    Array2::from_shape_fn((64, 160), |(y, x)| 0.5 + 0.4 * (phase(y, x) + shift).cos())
                };
                let planes = [wave(0.0), wave(0.3), wave(FRAC_PI_2)];
                let [red, green, blue] = developed(&planes, pattern);
                let error = Array2::from_shape_fn((64, 160), |(y, x)| {
                    let found = -(blue[[y, x]] - 0.5).atan2(red[[y, x]] - 0.5);
                    (found - phase(y, x) + 40.0 * TAU + TAU / 2.0) % TAU - TAU / 2.0
                });
                let phase_rms = rms(inner(&error, 8).iter().copied());
                let change = (&green - &planes[1]) / 0.4;
                let worst = inner(&change, 8).iter().fold(0.0f32, |w, v| w.max(v.abs()));
                let case = format!("{pattern:?} {period_px} px {tilt}: {phase_rms} rad, {worst}");
                assert!(phase_rms < phase_max && worst < amplitude_max, "{case}");
            }
        }
    }
}

#[test]
fn noise_is_never_amplified_inside() {
    let mut state = 7u32;
    let mut draw = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32 / (1 << 24) as f32 - 0.5
    };
    let planes = [(); 3].map(|()| Array2::from_shape_fn((200, 200), |_| draw()));
    let raw = rms(planes[0].iter().copied());
    for (plane, most) in developed(&planes, BayerPattern::Rggb).iter().zip([0.87, 0.86, 0.87]) {
        assert!(rms(inner(plane, 6).iter().copied()) < most * raw);
    }
}

#[test]
fn a_step_overshoots_by_less_than_a_sixth_and_only_near_by() {
    let step = Array2::from_shape_fn((40, 60), |(_, x)| if x < 30 { 0.1 } else { 0.9 });
    for plane in developed(&[step.clone(), step.clone(), step.clone()], BayerPattern::Gbrg) {
        for ((_, x), &v) in plane.indexed_iter() {
            assert!((-0.03..1.03).contains(&v), "{x}: {v}");
            assert!((24..36).contains(&x) || (v - step[[0, x]]).abs() < 1e-6, "{x}: {v}");
        }
    }
}

/// Dark level and response are applied to raw samples, before interpolation.
#[test]
fn samples_are_made_linear_before_they_are_mixed() {
    let light = |shift: f32| {
        Array2::from_shape_fn((32, 96), |(y, x)| {
            0.5 + 0.4 * (TAU / 24.0 * (x as f32 + 0.2 * y as f32) + shift).cos()
        })
    };
    let planes = [light(0.0), light(0.7), light(FRAC_PI_2)];
    let bent = planes.clone().map(|plane| plane.mapv(|v| 0.04 + v.sqrt() * 0.9));
    let conditioner = Conditioner {
        dark: [0.04; 4],
        response: [crate::Response { exponent: 2.0, ..Default::default() }; 4],
        ..Conditioner::default()
    };
    let raw = sampled(&bent, BayerPattern::Bggr);
    let shot = Shot::bayer(raw.view(), BayerPattern::Bggr, raw.view()).unwrap();
    let found = linearise(&shot, &conditioner).unwrap();
    for (got, expected) in found.iter().zip(&planes) {
        let difference = got - &expected.mapv(|v| 0.81 * v);
        assert!(inner(&difference, 6).iter().all(|d| d.abs() < 2e-4));
    }
}

#[test]
fn saturated_samples_mark_the_pixels_that_live_on_them() {
    let pattern = BayerPattern::Rggb;
    let marked = |at: (usize, usize)| {
        let mut raw = Array2::<u8>::from_elem((12, 12), 100);
        raw[at] = 255;
        let infrared = Array2::from_elem((12, 12), 100u8);
        let shot = Shot::bayer(raw.view(), pattern, infrared.view()).unwrap();
        let mut plan = Conditioner::default().plan().unwrap();
        plan.prepare(&shot);
        let mut saturated = [Saturated::default(); 12];
        let mut found = Vec::new();
        for y in 0..12 {
            plan.saturated_row(&shot, y, &mut saturated);
            assert!(saturated.iter().all(|found| found.count() < 2));
            found.extend((0..12).filter(|&x| saturated[x].count() > 0).map(|x| (y, x)));
        }
        found
    };
    let square: Vec<_> = (3..6).flat_map(|y| (5..8).map(move |x| (y, x))).collect();
    assert_eq!(marked((4, 6)), square);
    assert_eq!(marked((4, 7)), [(3, 7), (4, 6), (4, 7), (4, 8), (5, 7)]);
    assert_eq!(marked((0, 0)), [(0, 0), (0, 1), (1, 0), (1, 1)]);
}
