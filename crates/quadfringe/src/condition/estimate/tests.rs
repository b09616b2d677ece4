use super::*;
use ndarray::{Array3, s};
use rand_distr::{Distribution, Normal};
use rand_pcg::rand_core::SeedableRng;
use std::f64::consts::TAU;

/// A plane with dark and bright stripes, captured through `curve`, rounded to 8 bit.
fn capture(steps: usize, noise: f64, curve: impl Fn(f64) -> f64) -> Array3<f32> {
    let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(7);
    let normal = Normal::new(0.0, noise).unwrap();
    Array3::from_shape_fn((steps, 60, 80), |(s, y, x)| {
        let albedo = 0.3 + 0.7 * ((x / 7 + y / 5) % 4) as f64 / 3.0;
        let phase = 0.31 * x as f64 + 0.05 * y as f64 + TAU * s as f64 / steps as f64;
        let light = curve(0.5 + 0.4 * phase.cos());
        let value = albedo * light + normal.sample(&mut random);
        ((value.clamp(0.0, 1.0) * 255.0).round() / 255.0) as f32
    })
}

fn estimate(stack: &Array3<f32>) -> ResponseEstimate {
    estimate_response(&[stack.view()]).unwrap()
}

fn message(stack: &Array3<f32>) -> String {
    estimate_response(&[stack.view()]).unwrap_err().to_string()
}

#[test]
fn gamma_is_found_for_any_number_of_steps() {
    for steps in [5, 6, 7, 8, 10, 12, 13, 16] {
        let found = estimate(&capture(steps, 0.0, |v| v.powf(2.2)));
        // Rounding flattens the dark stripes, where the fringe minima have half a grey value.
        let Response { offset, exponent, knee } = found.response;
        assert!((exponent - 1.0 / 2.2).abs() < 0.035, "{steps} {found:?}");
        assert!(offset < 0.01 && knee == 0.0, "{steps} {found:?}");
        assert!(found.two_step_rms_before_rad > 0.15, "{steps} {found:?}");
        assert!(found.two_step_rms_after_rad < 0.03, "{steps} {found:?}");
    }
}

#[test]
fn linear_and_opposite_curves_are_found() {
    for gamma in [1.0, 0.6] {
        let found = estimate(&capture(12, 0.0, |v| v.powf(gamma)));
        let exponent = f64::from(found.response.exponent);
        assert!((exponent * gamma - 1.0).abs() < 0.03, "{gamma} {found:?}");
    }
}

#[test]
fn noise_and_ambient_light_are_survived() {
    let noisy = estimate(&capture(12, 0.01, |v| v.powf(2.2)));
    assert!((noisy.response.exponent * 2.2 - 1.0).abs() < 0.2, "{noisy:?}");
    let ambient = estimate(&capture(12, 0.004, |v| 0.03 + 0.95 * v.powf(2.2)));
    assert!((ambient.response.exponent * 2.2 - 1.0).abs() < 0.3, "{ambient:?}");
    let hard = estimate(&capture(12, 0.03, |v| v.powf(2.2)));
    assert!(hard.two_step_rms_after_rad < hard.two_step_rms_before_rad, "{hard:?}");
    for found in [noisy, ambient] {
        assert!(found.two_step_rms_after_rad < 0.6 * found.two_step_rms_before_rad, "{found:?}");
    }
}

#[test]
fn a_knee_is_found_and_undone() {
    let truth = Response { offset: 0.0, exponent: 0.5, knee: 0.6 };
    let captured = |linear: f64| {
        let (mut low, mut high) = (0.0f32, 1.0f32);
        for _ in 0..30 {
            let middle = (low + high) / 2.0;
            let below = f64::from(truth.linear(middle)) < linear;
            if below { low = middle } else { high = middle }
        }
        f64::from(low)
    };
    let mut stack = capture(12, 0.002, |v| v);
    stack.mapv_inplace(|v| captured(f64::from(v) * 1.1) as f32);
    let found = estimate(&stack);
    assert!((found.response.knee - truth.knee).abs() < 0.1, "{found:?}");
    assert!((found.response.exponent - truth.exponent).abs() < 0.05, "{found:?}");
}

#[test]
fn stacks_are_pooled() {
    let stack = capture(8, 0.004, |v| v.powf(1.8));
    let once = estimate(&stack);
    let twice = estimate_response(&[stack.view(), stack.view()]).unwrap();
    assert_eq!(twice.pixels, 2 * once.pixels);
    assert!((twice.response.exponent - once.response.exponent).abs() < 1e-3);
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let stack = capture(12, 0.01, |v| v.powf(2.2));
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| estimate(&stack))
    };
    assert_eq!(on(1), on(3));
}

#[test]
fn unusable_stacks_are_named() {
    let good = capture(12, 0.004, |v| v.powf(2.2));
    assert!(message(&good.mapv(|v| v * 0.05)).contains("too dark"));
    assert!(message(&good.mapv(|v| (v * 30.0).min(1.0))).contains("shorten the exposure"));
    assert!(message(&good.mapv(|v| 0.4 + 0.01 * v)).contains("without fringes"));
    assert!(message(&good.mapv(|v| v * 255.0)).contains("divide 8 bit by 255"));
    assert!(message(&good.slice(s![..4, .., ..]).to_owned()).contains("at least 5"));
    assert!(estimate_response(&[]).unwrap_err().to_string().contains("none"));
    let small = good.slice(s![.., .., ..40]);
    let error = estimate_response(&[good.view(), small]).unwrap_err();
    assert!(error.to_string().contains("stack 1"), "{error}");
    let mut broken = good.clone();
    broken[[3, 2, 1]] = f32::NAN;
    assert!(message(&broken).contains("step 3") && message(&broken).contains("row 2, column 1"));
}

#[test]
fn images_out_of_order_are_noticed() {
    let good = capture(12, 0.004, |v| v.powf(2.2));
    for order in [
        [0, 4, 8, 1, 5, 9, 2, 6, 10, 3, 7, 11],
        [0, 1, 10, 3, 4, 5, 6, 7, 8, 9, 2, 11],
        [0, 1, 2, 3, 5, 4, 6, 7, 8, 9, 10, 11],
        [0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5],
        [7, 2, 9, 0, 11, 4, 1, 10, 3, 8, 5, 6],
    ] {
        let text = message(&good.select(ndarray::Axis(0), &order));
        assert!(text.contains("order of their phase steps"), "{order:?} {text}");
    }
}
