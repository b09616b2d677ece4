//! Compares the virtual bench with known results.

use ndarray::{Array2, Array3};
use quadfringe::encoding::{Channel, DmdLayout, Encoding, pattern};
use quadfringe::optics::{BayerPattern, Device};
use quadfringe::rig::{Albedo, Bench, BitDepth, Light, Planes, Projector, RenderOptions};
use quadfringe::surface::{Plane, scene};

fn small(bench: Bench, shrink: usize) -> Bench {
    let camera = &bench.camera;
    let (width, height) = (camera.width / shrink, camera.height / shrink);
    let scale = 1.0 / shrink as f64;
    let centre = [0.5 * (width as f64 - 1.0), 0.5 * (height as f64 - 1.0)];
    let camera =
        Device::pinhole(width, height, camera.focal_px.map(|f| f * scale), centre).expect("valid camera");
    Bench { camera, ..bench }
}

fn clean() -> RenderOptions {
    RenderOptions {
        albedo: Albedo::Uniform([1.0; 4]),
        ambient: [0.0; 4],
        bit_depth: BitDepth::Float,
        ..RenderOptions::default()
    }
}

fn floats(planes: Planes) -> [Array2<f32>; 4] {
    match planes {
        Planes::F32(planes) => planes,
        other => panic!("expected floats, got {other:?}"),
    }
}

fn worst(a: &Array2<f32>, b: &Array2<f32>) -> f32 {
    a.iter().zip(b).fold(0.0, |worst, (a, b)| worst.max((a - b).abs()))
}

/// If camera and projector are identical, the camera captures the projected image.
#[test]
fn identical_camera_and_projector_capture_the_projected_image() {
    let focal = 12.0 / 4.65e-3;
    let device = Device::pinhole(1024, 768, [focal; 2], [511.5, 383.5]).expect("valid device");
    let bench =
        Bench { camera: device.clone(), visible: device.clone(), infrared: device, ..Bench::reference() };
    let code = Encoding::optimum(36, 1024).expect("a valid encoding");
    let cast = bench.cast(&Plane::at_z(800.0));
    let images = Channel::ALL
        .map(|channel| pattern(&code.channels()[channel.index()], [1024, 768], DmdLayout::Regular));
    let continuous =
        bench.render(&cast, &Light::shot(&code).expect("four channels"), &clean()).expect("valid scene");
    let sampled = images.each_ref().map(|image| Light::Image(image.view()));
    let sampled = bench.render(&cast, &sampled, &clean()).expect("valid scene");
    for shot in [floats(continuous), floats(sampled)] {
        for (captured, projected) in shot.iter().zip(&images) {
            let difference = worst(captured, projected);
            assert!(difference < 1e-4, "{difference}");
        }
    }
}

#[test]
fn rows_do_not_depend_on_the_number_of_threads() {
    let bench = small(Bench::reference(), 8);
    let options = RenderOptions {
        noise: 0.03,
        blur_px: 0.8,
        bayer: Some(BayerPattern::Rggb),
        seed: 11,
        ..RenderOptions::default()
    };
    let code = Encoding::optimum(36, 912).expect("a valid encoding");
    let shots = [1, 2, 5].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| {
            let cast = bench.cast(scene("face", 0.0).expect("known scene").as_ref());
            bench.render(&cast, &Light::shot(&code).expect("four channels"), &options).expect("valid scene")
        })
    });
    assert_eq!(shots[0], shots[1]);
    assert_eq!(shots[0], shots[2]);
    let other = RenderOptions { seed: 12, ..options };
    let cast = bench.cast(scene("face", 0.0).expect("known scene").as_ref());
    let again =
        bench.render(&cast, &Light::shot(&code).expect("four channels"), &other).expect("valid scene");
    assert_ne!(shots[0], again);
}

#[test]
fn noise_has_the_stated_spread() {
    let bench = small(Bench::reference(), 4);
    let cast = bench.cast(&Plane::at_z(800.0));
    let options = RenderOptions { noise: 0.03, ..clean() };
    let grey = [(); 4].map(|()| Light::Uniform(0.5));
    let shot = floats(bench.render(&cast, &grey, &options).expect("valid scene"));
    for plane in &shot {
        let n = plane.len() as f32;
        let mean = plane.sum() / n;
        let sigma = (plane.mapv(|v| (v - mean) * (v - mean)).sum() / n).sqrt();
        assert!((mean - 0.5).abs() < 5e-4 && (sigma - 0.03).abs() < 3e-4, "{mean} {sigma}");
    }
    assert!(worst(&shot[0], &shot[1]) > 0.05);
}

#[test]
fn options_do_what_they_say() {
    let bench = small(Bench::reference(), 8);
    let cast = bench.cast(&Plane::at_z(800.0));
    let level = |options: &RenderOptions, lights: [f64; 4]| {
        let shot = bench.render(&cast, &lights.map(Light::Uniform), options);
        floats(shot.expect("valid scene")).map(|plane| plane[[40, 60]])
    };
    let close = |a: [f32; 4], b: [f32; 4]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-5);
    let mut crosstalk = clean().crosstalk;
    crosstalk[1][0] = 0.1;
    let options = RenderOptions { crosstalk, ..clean() };
    assert!(close(level(&options, [1.0, 0.5, 0.0, 0.2]), [1.0, 0.6, 0.0, 0.2]));
    let options = RenderOptions { projector_exponent: [2.0; 4], ..clean() };
    assert!(close(level(&options, [0.5; 4]), [0.25; 4]));
    let options = RenderOptions { camera_exponent: [2.0; 4], camera_offset: [0.1; 4], ..clean() };
    assert!(close(level(&options, [0.25; 4]), [0.6; 4]));
    let options = RenderOptions { gain: [3.0; 4], ..clean() };
    assert!(close(level(&options, [0.5; 4]), [1.0; 4]));
    let options = RenderOptions { shading: true, ..clean() };
    let shaded = level(&options, [1.0; 4]);
    assert!(shaded[0] > 0.9 && shaded[0] < 0.99);
}

/// If the infrared chip is shifted by whole pixels, the infrared image is shifted, and the other images do not change.
#[test]
fn the_infrared_chip_has_rays_of_its_own() {
    let bench = small(Bench::reference(), 16);
    let apart = bench.clone().with_infrared_chip([[1.0, 0.0, 2.0], [0.0, 1.0, -1.0]]).expect("regular");
    let surface = scene("peaks", 0.0).expect("known scene");
    let lights = Light::shot(&Encoding::optimum(36, 912).expect("a valid encoding")).expect("four channels");
    let mut crosstalk = RenderOptions::default().crosstalk;
    crosstalk[3][0] = 0.2;
    let options = RenderOptions { bit_depth: BitDepth::Float, crosstalk, ..clean() };
    let [aligned, shifted] = [&bench, &apart].map(|bench| {
        let cast = bench.cast(surface.as_ref());
        let Planes::F32(planes) = bench.render(&cast, &lights, &options).expect("a shot") else {
            panic!("floats were asked for")
        };
        planes
    });
    assert_eq!(aligned[..3], shifted[..3]);
    let (rows, columns) = aligned[3].dim();
    for row in 0..rows - 1 {
        for column in 2..columns {
            let (seen, expected) = (shifted[3][[row, column]], aligned[3][[row + 1, column - 2]]);
            assert!((seen - expected).abs() < 1e-6, "{row} {column}: {seen} {expected}");
        }
    }
}

#[test]
fn bad_input_is_refused() {
    let bench = small(Bench::reference(), 16);
    let cast = bench.cast(&Plane::at_z(800.0));
    let white = || [(); 4].map(|()| Light::Uniform(1.0));
    let refused = |options: RenderOptions| bench.render(&cast, &white(), &options).is_err();
    assert!(refused(RenderOptions { noise: -0.1, ..clean() }));
    assert!(refused(RenderOptions { blur_px: f64::NAN, ..clean() }));
    assert!(refused(RenderOptions { blur_px: 1e300, ..clean() }));
    assert!(refused(RenderOptions { camera_exponent: [0.0; 4], ..clean() }));
    assert!(refused(RenderOptions { albedo: Albedo::Image(Array3::zeros((2, 2, 4))), ..clean() }));
    assert!(bench.clone().with_infrared_chip([[0.0; 3]; 2]).is_err());
    let image = Array2::zeros((3, 3));
    let lights = [(); 4].map(|()| Light::Image(image.view()));
    assert!(bench.render(&cast, &lights, &clean()).is_err());
    assert!(Bench::reference().render(&cast, &white(), &clean()).is_err());
    assert!(bench.predeform(&Light::Uniform(1.0), -1.0).is_err());
}

#[test]
fn steps_throw_shadows_and_have_edges() {
    let bench = small(Bench::reference(), 4);
    let cast = bench.cast(scene("steps", 0.0).expect("known scene").as_ref());
    let dark = cast.shadow().iter().filter(|dark| **dark).count();
    let distance = cast.edge_distance_px();
    assert!(dark > 100 && dark < 5000, "{dark}");
    let near = distance.iter().filter(|d| **d == 0.0).count();
    assert!(near > 300 && near < 8000, "{near}");
    let column = cast.column_px(Projector::Visible);
    for (column, dark) in column.iter().zip(&cast.shadow()) {
        assert_eq!(column.is_nan(), *dark);
    }
}

#[test]
fn a_moving_hand_is_seen_at_three_instants() {
    let bench = small(Bench::reference(), 8);
    let cast = |time_s: f64| bench.cast(scene("hand", time_s).expect("known scene").as_ref());
    let (a, b, c) = (cast(0.0), cast(0.1), cast(0.2));
    let white = [(); 4].map(|()| Light::Uniform(1.0));
    let options = RenderOptions { shading: true, ..clean() };
    let moving = floats(bench.render_moving([&a, &b, &c], &white, &options).expect("valid scene"));
    let still = [&a, &b, &c].map(|cast| floats(bench.render(cast, &white, &options).expect("valid scene")));
    assert_eq!((&moving[0], &moving[1]), (&still[0][0], &still[1][1]));
    assert_eq!(moving[2], still[2][2]);
    let mean = (&still[0][3] + &still[1][3] + &still[2][3]) / 3.0;
    assert!(worst(&moving[3], &mean) < 1e-6);
}

#[test]
fn predeformed_infrared_matches_the_visible_fringes_on_the_plane() {
    let bench = small(Bench::reference(), 4).deviated([1f64.to_radians(); 3], [0.5; 3]).expect("finite");
    let image = bench.predeform(&Light::fringes(30.0, 0.0), 800.0).expect("valid plane");
    let wave = || Light::fringes(30.0, 0.0);
    let cast = bench.cast(&Plane::at_z(800.0));
    let lights = [wave(), wave(), wave(), Light::Image(image.view())];
    let corrected = floats(bench.render(&cast, &lights, &clean()).expect("valid scene"));
    let plain =
        floats(bench.render(&cast, &[wave(), wave(), wave(), wave()], &clean()).expect("valid scene"));
    assert!(worst(&plain[3], &plain[0]) > 0.5);
    assert!(worst(&corrected[3], &corrected[0]) < 6e-3);
}
