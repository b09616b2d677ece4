//! Results are bit-identical for any number of threads, and for a decoder that has decoded other shots before.

mod common;

use common::{bench, bytes, cast_scene, code, decode_planes, decoder, noisy, there_and_back};
use ndarray::Array2;
use quadfringe::rig::{Albedo, Bench, Light, RenderOptions};
use quadfringe::{Decoded, Decoder, Device, Method, Options, Shot};
use rayon::ThreadPoolBuilder;

fn bits(decoded: &Decoded) -> Vec<u32> {
    let maps: [&Array2<f32>; 5] = [
        &decoded.phase_rad,
        &decoded.column_px,
        &decoded.modulation,
        &decoded.quality,
        &decoded.wrong_order_probability,
    ];
    let xyz = decoded.xyz_mm.iter().flatten();
    let values =
        maps.into_iter().chain(&decoded.uncertainty_rad).chain(&decoded.uncertainty_mm).flatten().chain(xyz);
    values.map(|v| v.to_bits()).collect()
}

/// Options with squares of random albedo, for which the joint method estimates an albedo for every pixel.
fn printed() -> RenderOptions {
    RenderOptions { albedo: Albedo::Patches { side_mm: 20.0, albedo: [0.9; 4] }, ..noisy(5) }
}

#[test]
fn threads_change_no_bit() {
    let bench = bench(2);
    let cases = [(Method::joint(), noisy(5)), (Method::joint(), printed()), (Method::published(), noisy(5))];
    for (method, options) in cases {
        let run = |threads: usize| {
            let pool = ThreadPoolBuilder::new().num_threads(threads).build();
            pool.expect("threads").install(|| {
                let cast = cast_scene(&bench, "face");
                bits(&there_and_back(&bench, &cast, &code(), &options, &method))
            })
        };
        let one = run(1);
        for threads in [2, 3] {
            assert!(run(threads) == one, "{}, {threads} threads", method.name());
        }
    }
}

#[test]
fn a_shot_leaves_nothing_behind() {
    let bench = bench(2);
    let shots = [("steps", noisy(5)), ("peaks", printed()), ("steps", noisy(5))].map(|(name, options)| {
        let cast = cast_scene(&bench, name);
        let lights = Light::shot(&code()).expect("four channels");
        let planes = bench.render(&cast, &lights, &options);
        planes.expect("a valid scene")
    });
    for method in [Method::joint(), Method::published()] {
        let name = method.name();
        let (rows, columns) = shots[0].shape();
        let builder = Decoder::builder(&code(), [rows, columns]);
        let mut decoder =
            builder.options(Options::default().with_method(method)).build().expect("valid options");
        let [first, _, again] =
            shots.each_ref().map(|planes| bits(&decode_planes(&mut decoder, planes).expect("a valid shot")));
        assert!(first == again, "{name}");
    }
}

/// Decoders use the memory of the given maps as working memory, and rows of planes are longer than rows of images.
#[test]
fn maps_may_hold_anything() {
    for (width, height, options) in [(333, 250, noisy(5)), (500, 375, printed()), (810, 300, noisy(5))] {
        let whole = Bench::reference();
        let focal = whole.camera.focal_px.map(|f| f * width as f64 / whole.camera.width as f64);
        let centre = [width, height].map(|n| 0.5 * (n as f64 - 1.0));
        let camera = Device::pinhole(width, height, focal, centre).expect("valid camera");
        let bench = Bench { camera, ..whole };
        let cast = cast_scene(&bench, "steps");
        let lights = Light::shot(&code()).expect("four channels");
        let images = bytes(bench.render(&cast, &lights, &options).expect("a valid scene"));
        let shot = Shot::try_from(&images).expect("equal images");
        for method in [Method::joint(), Method::published()] {
            let name = method.name();
            let mut decoder = decoder(&bench, Options::default().with_method(method));
            let mut decoded = decoder.decode(&shot).expect("a valid shot");
            let first = bits(&decoded);
            for round in 0..2 {
                poison(&mut decoded);
                decoder.decode_into(&shot, &mut decoded).expect("maps of the right size");
                assert!(first == bits(&decoded), "{name}, {width} x {height}, round {round}");
            }
        }
    }
}

fn poison(decoded: &mut Decoded) {
    let maps = [
        &mut decoded.phase_rad,
        &mut decoded.column_px,
        &mut decoded.modulation,
        &mut decoded.quality,
        &mut decoded.wrong_order_probability,
    ];
    let deviations = decoded.uncertainty_rad.iter_mut().chain(&mut decoded.uncertainty_mm);
    maps.into_iter().chain(deviations).for_each(|map| map.fill(f32::NAN));
    decoded.xyz_mm.iter_mut().for_each(|xyz| xyz.fill(f32::NAN));
}
