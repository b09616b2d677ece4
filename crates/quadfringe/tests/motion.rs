//! Colours are projected one after another on a moving surface: shots of the virtual bench with fixed seeds.

mod common;

use common::{bench, code, decode_planes, decoder};
use quadfringe::rig::{Bench, Cast, Light, Planes, RenderOptions};
use quadfringe::surface::{Hand, Plane, Surface};
use quadfringe::{Decoded, JointOptions, Options};
use std::f32::consts::PI;

/// R, G and B share a frame of 60 Hz; infrared is lit throughout.
const INSTANTS_US: [f32; 4] = [-5556.0, 0.0, 5556.0, 0.0];
/// Width of a fringe of the reference bench in pixels.
const FRINGE_PX: usize = 28;

/// Renders a shot with 3 % noise of a surface that has a different position at each of the three instants. Returns the images
/// and the cast of the middle instant.
fn film<S: Surface>(bench: &Bench, at: impl Fn(f64) -> S) -> (Planes, Cast) {
    let instants = [0, 1, 2].map(|c| f64::from(INSTANTS_US[c]) * 1e-6);
    let casts = instants.map(|time_s| bench.cast(&at(time_s)));
    let render = RenderOptions { noise: 0.03, seed: 3, ..RenderOptions::default() };
    let lights = Light::shot(&code()).expect("four channels");
    let planes = bench.render_moving(casts.each_ref(), &lights, &render);
    let [_, middle, _] = casts;
    (planes.expect("a valid scene"), middle)
}

fn decode(bench: &Bench, planes: &Planes, channel_instants_us: Option<[f32; 4]>) -> Decoded {
    let mut joint = JointOptions::default();
    joint.channel_instants_us = channel_instants_us;
    let options = Options::default().with_method(joint);
    decode_planes(&mut decoder(bench, options), planes).expect("a valid shot")
}

/// Returns the RMS of the phase in rad over pixels with the right order at least a fringe away from edges and border; the
/// share of lit pixels that are returned; and the share of these that have a wrong order.
fn errors(decoded: &Decoded, cast: &Cast) -> [f64; 3] {
    let (truth, edge) = (cast.phase_rad(&code()), cast.edge_distance_px());
    let (rows, columns) = truth.dim();
    let (mut count, mut sum, mut returned, mut wrong, mut lit) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for ((y, x), phase) in decoded.phase_rad.indexed_iter() {
        lit += f64::from(u8::from(truth[[y, x]].is_finite()));
        let error = phase - truth[[y, x]];
        let border = y.min(x).min(rows - 1 - y).min(columns - 1 - x);
        returned += f64::from(u8::from(phase.is_finite()));
        if error.abs() >= PI {
            wrong += 1.0;
        } else if error.is_finite() && border > FRINGE_PX && edge[[y, x]] > FRINGE_PX as f32 {
            (count, sum) = (count + 1.0, sum + f64::from(error).powi(2));
        }
    }
    [(sum / f64::max(count, 1.0)).sqrt(), returned / lit, wrong / f64::max(returned, 1.0)]
}

/// Errors without and with the channel instants.
fn before_and_after<S: Surface>(name: &str, at: impl Fn(f64) -> S) -> [[f64; 3]; 2] {
    let bench = bench(1);
    let (planes, truth) = film(&bench, at);
    let found = [None, Some(INSTANTS_US)].map(|instants| errors(&decode(&bench, &planes, instants), &truth));
    println!("{name}: RMS rad, returned, wrong: {:.4?} before, {:.4?} after", found[0], found[1]);
    found
}

#[test]
fn what_stands_still_stays_as_it_is() {
    let [before, after] = before_and_after("plane at rest", |_| Plane::at_z(790.0));
    assert!(after[0] < 1.1 * before[0], "{before:?} {after:?}");
}

#[test]
fn the_ripple_of_a_moving_plane_goes() {
    for speed_mm_per_s in [50.0, 100.0, 200.0, 300.0] {
        let name = format!("plane, {speed_mm_per_s} mm/s");
        let [before, after] = before_and_after(&name, |t| Plane::at_z(790.0 + speed_mm_per_s * t));
        // 3 % noise alone causes an error of 0.005 rad.
        assert!(after[0] < 0.008 + 0.2 * before[0], "{name}: {before:?} {after:?}");
        assert!(after[1] > 0.97 && after[2] == 0.0, "{name}: {after:?}");
    }
}

#[test]
fn a_moving_hand_is_brought_to_one_instant() {
    // The hand of the bench at its speed and at three times its speed.
    for (faster, most_rad) in [(1.0, 0.0085), (3.0, 0.0110)] {
        let name = format!("hand, {faster} times as fast");
        let [before, after] =
            before_and_after(&name, |t| Hand::at(0.37 + faster * t).expect("a finite time"));
        // The energy alone takes away half of the error.
        assert!(after[0] < 0.7 * before[0] && after[0] < most_rad, "{name}: {before:?} {after:?}");
        assert!(after[1] >= before[1] - 0.02, "{name}: {before:?} {after:?}");
    }
}

#[test]
fn what_moves_too_fast_is_no_data() {
    // B has shifted against R by a fifth of a fringe, so that the two hardly differ. Some pixels are therefore not
    // recognised as too fast.
    let [before, after] = before_and_after("plane, 600 mm/s", |t| Plane::at_z(790.0 + 600.0 * t));
    assert!(after[1] < 0.25 && after[2] < 0.03, "{before:?} {after:?}");
}
