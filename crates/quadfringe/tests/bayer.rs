//! Compares shots of a Bayer chip with shots that have all colours at every pixel, and a registered infrared image with
//! an aligned one.

mod common;

use common::{BAYER, Score, bench, cast_scene, clean, code, noisy, score, there_and_back, there_and_back_by};
use ndarray::Array2;
use quadfringe::rig::{Bench, BitDepth, Cast, Demosaic, RenderOptions};
use quadfringe::{Conditioner, Decoded, Error, Method, Response, Shot};
use std::f32::consts::PI;

/// Width of a fringe of the reference bench in camera pixels.
const FRINGE_PX: f32 = 28.0;
/// Misalignment of the infrared chip: a shift by parts of a pixel, a rotation by a quarter of a degree, and a scale.
const MISALIGNED: [[f64; 3]; 2] = [[1.002, -0.0044, 0.37], [0.0044, 1.002, -1.62]];

fn mosaic(plain: &RenderOptions) -> RenderOptions {
    RenderOptions { bayer: Some(BAYER), ..plain.clone() }
}

/// Width of the rim of the image that an infrared chip with the misalignment [`MISALIGNED`] does not see; it is five
/// and a half pixels at most.
const UNSEEN_PX: usize = 6;

/// Phase RMS (rad) over the pixels with the right order that are at least a fringe away from edges and from the rim of
/// the area that both chips see.
fn inner_phase_rms_rad(decoded: &Decoded, cast: &Cast) -> f64 {
    let (truth, edge) = (cast.phase_rad(&code()), cast.edge_distance_px());
    let (rows, columns) = truth.dim();
    let rim = FRINGE_PX as usize + UNSEEN_PX;
    let inside = |y: usize, x: usize| (rim..rows - rim).contains(&y) && (rim..columns - rim).contains(&x);
    let errors = decoded.phase_rad.indexed_iter().map(|(at, phase)| (at, phase - truth[at]));
    let counted = errors.filter(|&((y, x), e)| e.abs() < PI && edge[[y, x]] > FRINGE_PX && inside(y, x));
    let (sum, count) = counted.fold((0.0, 0), |(sum, n), (_, e)| (sum + f64::from(e * e), n + 1));
    assert!(count > rows * columns / 4, "{count}");
    (sum / count as f64).sqrt()
}

fn found(bench: &Bench, cast: &Cast, render: &RenderOptions, method: &Method) -> Score {
    score(&there_and_back(bench, cast, &code(), render, method), cast, &code(), FRINGE_PX)
}

/// Scores of a scene from all colours at every pixel, from the raw mosaic, and from planes that the camera
/// interpolated.
fn three_ways(bench: &Bench, cast: &Cast, plain: &RenderOptions, method: &Method) -> [Score; 3] {
    let raw = mosaic(plain);
    let bilinear = RenderOptions { demosaic: Some(Demosaic::Bilinear), ..raw.clone() };
    [plain, &raw, &bilinear].map(|render| found(bench, cast, render, method))
}

/// Without noise a mosaic is as good as full sampling, and bilinear interpolation is not. The joint method hardly suffers from
/// bilinear interpolation, because all but its last step work on means of pixels.
#[test]
fn a_mosaic_keeps_the_phase_that_bilinear_planes_lose() {
    let bench = bench(1);
    let cast = cast_scene(&bench, "peaks");
    for (method, times_better) in [(Method::published(), 4.0), (Method::joint(), 1.05)] {
        let [full, raw, bilinear] = three_ways(&bench, &cast, &clean(), &method);
        println!("{method:?}\n{full:?}\n{raw:?}\n{bilinear:?}");
        assert!(raw.phase_rms_rad < 1.2 * full.phase_rms_rad, "{raw:?}");
        assert!(times_better * raw.phase_rms_rad < bilinear.phase_rms_rad, "{raw:?} {bilinear:?}");
        assert_eq!(raw.wrong, 0);
        assert!(raw.returned_share() > full.returned_share() - 1e-3, "{raw:?}");
    }
}

/// At edges, two of three colours are interpolated from both sides. No order may be lost by this, and a shadow may be a
/// pixel too small.
#[test]
fn a_mosaic_loses_no_orders_at_edges() {
    let bench = bench(1);
    let cast = cast_scene(&bench, "steps");
    let [full, raw, _] = three_ways(&bench, &cast, &clean(), &Method::joint());
    println!("{full:?}\n{raw:?}");
    assert!(raw.wrong_orders() <= full.wrong_orders() + 1, "{raw:?}");
    assert!(raw.in_shadow < raw.returned / 1000, "{raw:?}");
    assert!(raw.phase_rms_rad < 1.2 * full.phase_rms_rad, "{raw:?}");
    // Next to every shadow one pixel is left out, because light is interpolated into it: five pixels in a thousand.
    assert!(raw.returned_share() > full.returned_share() - 5e-3, "{raw:?}");
}

#[test]
fn a_noisy_mosaic_leaves_a_tenth_of_a_millimetre() {
    let bench = bench(1);
    for (seed, name) in (21..).zip(["steps", "face"]) {
        let cast = cast_scene(&bench, name);
        let raw = found(&bench, &cast, &mosaic(&noisy(seed)), &Method::joint());
        println!("{name}: {raw:?}");
        assert!(raw.depth_rms_mm < 0.10, "{name}: {raw:?}");
        assert!(raw.wrong_share() <= 1e-3, "{name}: {raw:?}");
        assert!(raw.returned_share() > 0.95, "{name}: {raw:?}");
    }
}

/// Response and dark level are corrected before samples are mixed, crosstalk after. With this order, a mosaic of a
/// camera that has all of these effects is as good as one without them.
#[test]
fn dark_level_response_crosstalk_and_registration_are_undone_in_a_mosaic() {
    let bench = bench(1);
    let apart = bench.clone().with_infrared_chip(MISALIGNED).expect("regular");
    let [cast, cast_apart] = [&bench, &apart].map(|bench| cast_scene(bench, "peaks"));
    let mut crosstalk = Conditioner::default().crosstalk;
    (crosstalk[0][1], crosstalk[1][2], crosstalk[3][0]) = (0.08, 0.05, 0.03);
    let flawed = RenderOptions {
        crosstalk,
        gain: [0.8; 4],
        camera_offset: [0.03; 4],
        camera_exponent: [1.8; 4],
        ..mosaic(&clean())
    };
    let conditioner = Conditioner::default()
        .with_dark([0.03; 4])
        .with_response([Response { exponent: 1.8, ..Response::default() }; 4])
        .with_crosstalk(crosstalk)
        .with_ir_registration(MISALIGNED);
    for method in [Method::published(), Method::joint()] {
        let plain = there_and_back(&bench, &cast, &code(), &mosaic(&clean()), &method);
        let undone = there_and_back_by(&apart, &cast_apart, &code(), &flawed, &method, &conditioner);
        let rms = [&plain, &undone].map(|decoded| inner_phase_rms_rad(decoded, &cast));
        let judged = score(&undone, &cast, &code(), FRINGE_PX);
        println!("{method:?} {rms:?} {judged:?}");
        // Or so little that noise of a thousandth of full scale would hide it.
        assert!(rms[1] < (1.1 * rms[0]).max(2e-3), "{rms:?}");
        assert!(judged.wrong_share() < 5e-5, "{judged:?}");
        assert!(judged.returned_share() > 0.98, "{judged:?}");
    }
}

/// A registered infrared image is as good as an aligned one.
#[test]
fn registration_costs_neither_phase_nor_orders() {
    let bench = bench(1);
    let apart = bench.clone().with_infrared_chip(MISALIGNED).expect("regular");
    let conditioner = Conditioner::default().with_ir_registration(MISALIGNED);
    let cases = [
        ("peaks", clean(), Method::published()),
        ("peaks", clean(), Method::joint()),
        ("steps", clean(), Method::joint()),
        ("steps", noisy(5), Method::joint()),
    ];
    for (name, render, method) in cases {
        let [cast, cast_apart] = [&bench, &apart].map(|bench| cast_scene(bench, name));
        let aligned = there_and_back(&bench, &cast, &code(), &render, &method);
        let registered = there_and_back_by(&apart, &cast_apart, &code(), &render, &method, &conditioner);
        let rms = [&aligned, &registered].map(|decoded| inner_phase_rms_rad(decoded, &cast));
        let [aligned, registered] = [aligned, registered].map(|d| score(&d, &cast, &code(), FRINGE_PX));
        println!("{name} {method:?} {rms:?}\n{aligned:?}\n{registered:?}");
        // Or so little that noise of a thousandth of full scale would hide it.
        assert!(rms[1] < (1.1 * rms[0]).max(2e-3), "{rms:?}");
        // The published filter runs along whole rows, and has errors near pixels that the infrared chip does not see.
        assert!(
            registered.wrong_orders() <= aligned.wrong_orders() + registered.lit / 20_000,
            "{registered:?}"
        );
        assert!(registered.returned_share() > aligned.returned_share() - 0.02, "{registered:?}");
    }
}

#[test]
fn what_is_no_mosaic_is_named() {
    let (image, odd) = (Array2::<f32>::zeros((4, 8)), Array2::<f32>::zeros((4, 7)));
    let mut bad = image.clone();
    bad[[3, 4]] = f32::NAN;
    let refused = |raw: &Array2<f32>, infrared: &Array2<f32>, parts: &[&str]| {
        let text = Shot::bayer(raw.view(), BAYER, infrared.view()).expect_err("no mosaic").to_string();
        assert!(parts.iter().all(|part| text.contains(part)), "{parts:?} {text}");
    };
    refused(&image, &odd, &["IR image", "[4, 8]", "[4, 7]"]);
    refused(&bad, &image, &["raw mosaic", "row 3, column 4"]);
    refused(&image, &bad, &["IR image", "row 3, column 4"]);
    let line = Array2::zeros((1, 8));
    refused(&line, &line, &["raw mosaic", "[2, 2]", "[1, 8]"]);
    let bench = bench(8);
    let render = RenderOptions {
        demosaic: Some(Demosaic::Bilinear),
        bit_depth: BitDepth::Float,
        ..RenderOptions::default()
    };
    let lights = quadfringe::rig::Light::shot(&code()).expect("four channels");
    let error: Error = bench.render(&cast_scene(&bench, "plane"), &lights, &render).expect_err("no pattern");
    assert!(error.to_string().contains("demosaic"), "{error}");
}
