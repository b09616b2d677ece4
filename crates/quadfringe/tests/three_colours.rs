//! Three colours of three different fringe numbers: decode(simulate(h)) returns h, with fringes in any direction.

mod common;

use common::{BAYER, bench, cast_scene, clean, noisy, score, there_and_back};
use ndarray::{Array2, s};
use quadfringe::rig::RenderOptions;
use quadfringe::{Decoder, Encoding, Method, Shot};
use std::f64::consts::TAU;

/// Width of a fringe of the reference bench in camera pixels.
const FRINGE_PX: f32 = 28.0;

fn encoding() -> Encoding {
    Encoding::three_colours([36.0, 35.0, 30.0], 912).expect("valid")
}

#[test]
fn surfaces_come_back() {
    let bench = bench(1);
    for (name, render, phase_max) in
        [("steps", clean(), 0.002), ("face", noisy(2), 0.012), ("peaks", noisy(4), 0.006)]
    {
        let cast = cast_scene(&bench, name);
        let decoded = there_and_back(&bench, &cast, &encoding(), &render, &Method::joint());
        let found = score(&decoded, &cast, &encoding(), FRINGE_PX);
        println!("{name}: {found:?}");
        assert!(found.phase_rms_rad < phase_max, "{name}: {found:?}");
        assert!(found.wrong_share() < 1e-4 && found.returned_share() > 0.95, "{name}: {found:?}");
        let albedo = decoded.albedo.as_ref().expect("the joint method gives it");
        assert!(albedo.slice(s![.., .., 3]).iter().all(|ir| ir.is_nan()), "{name}: an infrared albedo");
        let blue = albedo.slice(s![.., .., 2]);
        let known = blue.iter().filter(|blue| **blue > 0.0).count();
        assert!(known * 100 > 99 * found.returned, "{name}: {known} of {found:?}");
    }
}

#[test]
fn mosaics_and_the_published_method_come_back() {
    let bench = bench(1);
    let cast = cast_scene(&bench, "peaks");
    let mosaic = RenderOptions { bayer: Some(BAYER), ..noisy(2) };
    let found = score(
        &there_and_back(&bench, &cast, &encoding(), &mosaic, &Method::joint()),
        &cast,
        &encoding(),
        FRINGE_PX,
    );
    println!("mosaic: {found:?}");
    assert!(found.phase_rms_rad < 0.01 && found.wrong_share() == 0.0, "{found:?}");
    let found = score(
        &there_and_back(&bench, &cast, &encoding(), &clean(), &Method::published()),
        &cast,
        &encoding(),
        FRINGE_PX,
    );
    println!("published: {found:?}");
    assert!(found.phase_rms_rad < 0.05 && found.wrong_share() < 5e-3, "{found:?}");
    assert!(found.returned_share() > 0.95, "{found:?}");
}

#[test]
fn fringes_in_any_direction_come_back() {
    let shape = (320, 420);
    for degrees in [0.0f64, 20.0, 45.0, 70.0, 90.0, -30.0] {
        let (sine, cosine) = degrees.to_radians().sin_cos();
        let column = |(y, x): (usize, usize)| 0.9 * (x as f64 * cosine + y as f64 * sine) + 300.0;
        let image = |number: f64| {
            Array2::from_shape_fn(shape, |at| {
                (65535.0 * (0.5 + 0.4 * (TAU * number * column(at) / 912.0).cos())) as u16
            })
        };
        let images = [36.0, 35.0, 30.0].map(image);
        let shot = Shot::rgb(images.each_ref().map(|image| image.view())).expect("one size");
        let decoded = Decoder::builder(&encoding(), shape.into())
            .build()
            .expect("valid")
            .decode(&shot)
            .expect("three channels");
        let off = decoded.column_px.indexed_iter().filter(|(_, found)| found.is_finite());
        let off: Vec<f64> = off.map(|(at, found)| (f64::from(*found) - column(at)).abs()).collect();
        let right = off.iter().filter(|off| **off < 0.2).count();
        assert!(
            right == off.len() && right * 100 > 95 * shape.0 * shape.1,
            "{right} of {} at {degrees}",
            off.len()
        );
    }
}
