//! The response estimated from a shot: it is found for any object, and no response is found in linear light.

mod common;

use common::{Score, bench, cast_scene, code, decode_planes, noisy, score};
use ndarray::Array2;
use quadfringe::condition::{estimate_response_of_shot, linearise};
use quadfringe::height::Triangulator;
use quadfringe::rig::{Albedo, Bench, Cast, Light, Planes, RenderOptions};
use quadfringe::{Conditioner, Decoded, Decoder, Error, Response, Shot};

const FRINGE_PX: f32 = 14.0;

fn decode(bench: &Bench, planes: &Planes, response: [Response; 4]) -> Decoded {
    let work = || -> Result<Decoded, Error> {
        let (rows, columns) = planes.shape();
        let conditioner = Conditioner::default().with_response(response);
        let triangulator = Triangulator::new(&bench.camera, &bench.visible)?;
        let builder = Decoder::builder(&code(), [rows, columns]).conditioner(conditioner);
        let mut decoder = builder.triangulator(triangulator).build()?;
        decode_planes(&mut decoder, planes)
    };
    work().expect("a valid scene")
}

fn captured(planes: &Planes) -> [Array2<f32>; 4] {
    let Planes::U8(images) = planes else { panic!("8 bit") };
    let shot = Shot::try_from(images).expect("one size");
    linearise(&shot, &Conditioner::default()).expect("a valid shot")
}

/// Decodes and estimates alternately, `rounds` times. Returns the decoded shot of the last round and the response with
/// which it was decoded.
fn straightened(bench: &Bench, planes: &Planes, rounds: usize) -> (Decoded, [Response; 4]) {
    let light = captured(planes);
    let mut response = [Response::default(); 4];
    let mut decoded = decode(bench, planes, response);
    for _ in 0..rounds {
        let found = estimate_response_of_shot(
            light.each_ref().map(|plane| plane.view()),
            decoded.phase_rad.view(),
            &code(),
        );
        response =
            found.expect("one size").map(|estimate| estimate.map_or_else(Response::default, |e| e.response));
        decoded = decode(bench, planes, response);
    }
    (decoded, response)
}

fn render(bench: &Bench, cast: &Cast, options: &RenderOptions) -> Planes {
    bench.render(cast, &Light::shot(&code()).expect("four channels"), options).expect("a valid scene")
}

/// The estimate removes nearly all of the phase error and loses no pixels, with steps, curves and 3 % noise.
#[test]
fn a_gamma_is_found_and_undone() {
    let bench = bench(2);
    for (name, gamma, seed) in [("face", 2.2, 1), ("steps", 2.2, 2), ("sphere", 1.5, 3), ("peaks", 0.6, 4)] {
        let cast = cast_scene(&bench, name);
        let planes = render(&bench, &cast, &RenderOptions { projector_exponent: [gamma; 4], ..noisy(seed) });
        let bent = score(&decode(&bench, &planes, [Response::default(); 4]), &cast, &code(), FRINGE_PX);
        let (decoded, response) = straightened(&bench, &planes, 7);
        let straight = score(&decoded, &cast, &code(), FRINGE_PX);
        // Room light, times the albedo of the bench, does not pass the projector, so it is an offset.
        let offset = 0.9 * RenderOptions::default().ambient[0] as f32;
        let truth = Response { offset, exponent: 1.0 / gamma as f32, ..Response::default() };
        let known = score(&decode(&bench, &planes, [truth; 4]), &cast, &code(), FRINGE_PX);
        println!("{name} {gamma}: {response:?}\n{bent:?}\n{straight:?}\n{known:?}");
        // The result must be as good as with the true response, and only a small part of the additional error may remain.
        assert!(straight.phase_rms_rad < 1.05 * known.phase_rms_rad, "{name}: {straight:?} {known:?}");
        let excess =
            |score: Score| (score.phase_rms_rad.powi(2) - known.phase_rms_rad.powi(2)).max(0.0).sqrt();
        assert!(excess(straight) < 0.25 * excess(bent), "{name}: {bent:?} {straight:?} {known:?}");
        assert!(straight.returned_share() > bent.returned_share() - 1e-3, "{name}: {bent:?} {straight:?}");
        for exponent in response.map(|channel| f64::from(channel.exponent)) {
            // A lower offset compensates a lower exponent.
            assert!((exponent * gamma - 1.0).abs() < 0.2, "{name}: {exponent}");
        }
    }
}

/// The gamma of a camera acts on ambient light too, so there is only an exponent to find, and no offset.
#[test]
fn the_gamma_of_a_camera_is_found_exactly() {
    let bench = bench(2);
    let cast = cast_scene(&bench, "face");
    let options = RenderOptions { camera_exponent: [2.0; 4], noise: 0.01, ..noisy(5) };
    let (_, response) = straightened(&bench, &render(&bench, &cast, &options), 4);
    for channel in response {
        assert!(
            (channel.exponent - 2.0).abs() < 0.04 && channel.offset < 0.01 && channel.knee == 0.0,
            "{channel:?}"
        );
    }
}

/// A channel with a different response is distinguished from the channels that share one.
#[test]
fn channels_may_differ() {
    let bench = bench(2);
    let cast = cast_scene(&bench, "face");
    let gammas = [2.2, 1.8, 2.2, 1.0];
    let options = RenderOptions { projector_exponent: gammas, noise: 0.01, ..noisy(6) };
    let (_, response) = straightened(&bench, &render(&bench, &cast, &options), 7);
    println!("{response:?}");
    assert_eq!(response[3], Response::default());
    for (channel, gamma) in response.iter().zip(gammas) {
        assert!((f64::from(channel.exponent) * gamma - 1.0).abs() < 0.12, "{response:?}");
    }
}

/// Linear light is left unchanged for any surface, print, shadows, noise, and light from other channels.
#[test]
fn nothing_is_found_in_linear_light() {
    let bench = bench(2);
    let mut crosstalk = Conditioner::default().crosstalk;
    (crosstalk[0][1], crosstalk[1][2], crosstalk[3][0]) = (0.08, 0.05, 0.03);
    let printed = |side_mm, seed| RenderOptions {
        albedo: Albedo::Patches { side_mm, albedo: [0.8, 0.8, 0.8, 0.8] },
        ..noisy(seed)
    };
    let cases = [
        ("face", noisy(7)),
        ("face", printed(20.0, 8)),
        ("plane", printed(10.0, 9)),
        ("steps", RenderOptions { crosstalk, ..noisy(10) }),
        ("sphere", RenderOptions { albedo: Albedo::Uniform([0.25; 4]), ..noisy(11) }),
    ];
    for (name, options) in cases {
        let cast = cast_scene(&bench, name);
        let (_, response) = straightened(&bench, &render(&bench, &cast, &options), 1);
        assert_eq!(response, [Response::default(); 4], "{name}");
    }
}

#[test]
fn too_little_tells_nothing_and_other_sizes_are_refused() {
    let bent = Array2::from_shape_fn((100, 200), |(_, x)| (0.5 + 0.4 * (0.3 * x as f32).cos()).powf(2.2));
    let phase = Array2::from_shape_fn((100, 200), |(_, x)| 0.3 * x as f32);
    let of = |bent: &Array2<f32>| estimate_response_of_shot([bent.view(); 4], phase.view(), &code());
    assert_eq!(of(&bent).unwrap(), [None; 4]);
    let nowhere = Array2::from_elem((100, 200), f32::NAN);
    assert_eq!(estimate_response_of_shot([bent.view(); 4], nowhere.view(), &code()).unwrap(), [None; 4]);
    let message = of(&Array2::zeros((100, 199))).unwrap_err().to_string();
    assert!(message.contains("199") && message.contains("200"), "{message}");
}
