//! Compares the stated uncertainty of a shape with its errors, on shots of the virtual bench at full size with fixed
//! seeds.

mod common;

use common::{bench, cast_scene, code, decode_planes, decoder};
use quadfringe::rig::{Albedo, Bench, Cast, Light, RenderOptions};
use quadfringe::{Decoded, Method, Options};
use std::f32::consts::PI;

/// Width of a fringe of the reference bench in pixels. Smooth parts are further than this from edges and from the
/// border.
const FRINGE_PX: usize = 28;

/// Noise, albedo and room light, as shares of full scale.
const LIGHTS: [(f64, f32, f64); 4] =
    [(0.01, 0.9, 0.055), (0.03, 0.9, 0.055), (0.03, 0.45, 0.2), (0.05, 0.6, 0.2)];

fn decode(
    bench: &Bench,
    cast: &Cast,
    (noise, albedo, ambient): (f64, f32, f64),
    options: Options,
) -> Decoded {
    let render = RenderOptions {
        noise,
        albedo: Albedo::Uniform([albedo; 4]),
        ambient: [ambient; 4],
        seed: 11,
        ..RenderOptions::default()
    };
    let lights = Light::shot(&code()).expect("four channels");
    let planes = bench.render(cast, &lights, &render).expect("a valid scene");
    decode_planes(&mut decoder(bench, options), &planes).expect("a valid shot")
}

/// Shares of the depth errors in smooth parts that lie inside one, two and three standard deviations.
fn inside(decoded: &Decoded, cast: &Cast) -> [f64; 3] {
    let (truth, depth, edge) = (cast.phase_rad(&code()), cast.depth_mm(), cast.edge_distance_px());
    let xyz = decoded.xyz_mm.as_ref().expect("calibrated");
    let sigma = decoded.uncertainty_mm.as_ref().expect("calibrated");
    let (rows, columns) = truth.dim();
    let (mut count, mut shares) = (0.0, [0.0; 3]);
    for ((y, x), phase) in decoded.phase_rad.indexed_iter() {
        let border = y.min(x).min(rows - 1 - y).min(columns - 1 - x);
        let right = (phase - truth[[y, x]]).abs() < PI;
        if right && border > FRINGE_PX && edge[[y, x]] > FRINGE_PX as f32 {
            let error = (xyz[[y, x, 2]] - depth[[y, x]]).abs() / sigma[[y, x]];
            count += 1.0;
            (0..3).for_each(|k| shares[k] += f64::from(u8::from(error < (k + 1) as f32)));
        }
    }
    shares.map(|share| share / count)
}

/// These shares for normally distributed errors.
const NORMAL: [f64; 3] = [0.683, 0.954, 0.997];

/// Asserts that every share is within tolerances, `below` and `above`, of the share of normal errors.
fn hold_shares(method: &Method, surfaces: &[&str], below: [f64; 3], above: [f64; 3]) {
    let bench = bench(1);
    let mut off = Vec::new();
    for name in surfaces {
        let cast = cast_scene(&bench, name);
        for light in LIGHTS {
            let decoded = decode(&bench, &cast, light, Options::default().with_method(method.clone()));
            let shares = inside(&decoded, &cast);
            let line = format!("{method:?} {name} {light:?}: {shares:.4?}");
            println!("{line}");
            let held = |k: usize| (-below[k]..=above[k]).contains(&(shares[k] - NORMAL[k]));
            off.extend((!(0..3).all(held)).then_some(line));
        }
    }
    assert!(off.is_empty(), "{}", off.join("\n"));
}

#[test]
fn errors_of_the_joint_method_are_as_large_as_it_says() {
    // With little noise the error of the method dominates. It is smaller than the uncertainty on a plane, and larger near the
    // shadows of steps.
    let surfaces = ["plane", "peaks", "steps", "sphere"];
    hold_shares(&Method::joint(), &surfaces, [0.07, 0.04, 0.01], [0.07, 0.02, 0.003]);
}

/// Features that are smaller than the window are smoothed in all four channels alike. The correction that the energy makes shows it.
#[test]
fn errors_on_small_features_are_as_large_as_it_says() {
    hold_shares(&Method::joint(), &["face"], [0.04, 0.03, 0.01], [0.04, 0.02, 0.003]);
}

#[test]
fn errors_of_the_published_method_are_as_large_as_it_says() {
    hold_shares(&Method::published(), &["plane", "peaks"], [0.04, 0.025, 0.01], [0.04, 0.025, 0.003]);
}

/// Observed and promised numbers of wrong orders of a shot, without a limit on quality.
#[derive(Default)]
struct Promise {
    returned: f64,
    wrong: f64,
    promised: f64,
    /// Number of pixels with a wrong-order probability below 1 %, and (`surely_wrong`) how many of them are wrong.
    sure: f64,
    surely_wrong: f64,
}

impl Promise {
    fn of(decoded: &Decoded, cast: &Cast) -> Self {
        let truth = cast.phase_rad(&code());
        let mut found = Self::default();
        let returned = decoded.phase_rad.indexed_iter().filter(|(_, phase)| phase.is_finite());
        for (at, phase) in returned {
            let probability = f64::from(decoded.wrong_order_probability[at]);
            // In shadow the truth is NaN, so a pixel there does not count as wrong.
            let wrong = f64::from(u8::from((phase - truth[at]).abs() >= PI));
            found.returned += 1.0;
            found.wrong += wrong;
            found.promised += probability;
            if probability < 0.01 {
                found.sure += 1.0;
                found.surely_wrong += wrong;
            }
        }
        found
    }
}

fn promise(method: &Method, name: &str, light: (f64, f32, f64)) -> Promise {
    let bench = bench(1);
    let cast = cast_scene(&bench, name);
    let decoded =
        decode(&bench, &cast, light, Options::default().with_method(method.clone()).with_quality_min(0.0));
    let found = Promise::of(&decoded, &cast);
    let Promise { returned, wrong, promised, sure, surely_wrong } = found;
    println!(
        "{method:?} {name} {light:?}: {wrong} of {returned} wrong, {promised:.0} promised; sure {sure}, of them {surely_wrong} wrong"
    );
    found
}

#[test]
fn wrong_orders_of_the_joint_method_are_not_more_than_promised() {
    for name in ["plane", "steps", "sphere", "face"] {
        for light in [LIGHTS[0], LIGHTS[1], LIGHTS[2]] {
            let found = promise(&Method::joint(), name, light);
            assert!(found.wrong <= found.promised, "{name} {light:?}");
            // The bound must also be useful: few pixels are doubtful, and the others are right.
            assert!(found.promised < 0.006 * found.returned, "{name} {light:?}");
            assert!(found.sure > 0.94 * found.returned, "{name} {light:?}");
            assert!(found.surely_wrong <= 1e-5 * found.sure, "{name} {light:?}");
        }
    }
}

#[test]
fn wrong_orders_of_the_published_method_are_not_more_than_promised() {
    for name in ["plane", "steps"] {
        let found = promise(&Method::published(), name, LIGHTS[0]);
        assert!(found.wrong <= found.promised, "{name}");
    }
}
