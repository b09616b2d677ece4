//! Three colours without infrared: decode(simulate(h)) returns h, and shots must have the channels of the encoding.

mod common;

use common::{BAYER, bench, bytes, cast_scene, clean, code, noisy, score, there_and_back};
use ndarray::{Array2, s};
use quadfringe::condition::linearise;
use quadfringe::height::Triangulator;
use quadfringe::rig::{Bench, Light, Planes, RenderOptions};
use quadfringe::{Conditioner, Decoder, Encoding, Method, Options, Shot};

/// Width of a fringe of the reference bench in camera pixels.
const FRINGE_PX: f32 = 63.0;

fn rgb() -> Encoding {
    Encoding::rgb([16.0, 15.0], 912).expect("valid")
}

fn decoder(bench: &Bench, method: Method) -> Decoder {
    let triangulator = Triangulator::new(&bench.camera, &bench.visible).expect("a valid bench");
    let shape = [bench.camera.height, bench.camera.width];
    let builder = Decoder::builder(&rgb(), shape).options(Options::default().with_method(method));
    builder.triangulator(triangulator).build().expect("valid")
}

#[test]
fn surfaces_come_back() {
    let bench = bench(1);
    for (name, render, phase_max) in
        [("steps", clean(), 0.006), ("face", noisy(2), 0.006), ("peaks", noisy(4), 0.004)]
    {
        let cast = cast_scene(&bench, name);
        let decoded = there_and_back(&bench, &cast, &rgb(), &render, &Method::joint());
        let found = score(&decoded, &cast, &rgb(), FRINGE_PX);
        println!("{name}: {found:?}");
        assert!(found.phase_rms_rad < phase_max, "{name}: {found:?}");
        assert!(found.wrong_share() < 1e-4 && found.returned_share() > 0.95, "{name}: {found:?}");
        let albedo = decoded.albedo.as_ref().expect("the joint method gives it");
        assert!(albedo.slice(s![.., .., 3]).iter().all(|ir| ir.is_nan()));
        let phases = decoded.phase_rad.iter();
        let seen = phases.zip(albedo.slice(s![.., .., 1])).filter(|(phase, _)| phase.is_finite());
        let green: Vec<f32> = seen.map(|(_, green)| *green).filter(|green| green.is_finite()).collect();
        assert!(green.iter().all(|green| *green > 0.0), "{name}: an albedo of nothing");
        assert!(green.len() * 100 > 99 * found.returned, "{name}: {} of {found:?}", green.len());
    }
}

#[test]
fn mosaics_and_the_published_method_come_back() {
    let bench = bench(1);
    let cast = cast_scene(&bench, "peaks");
    let mosaic = RenderOptions { bayer: Some(BAYER), ..noisy(2) };
    let found =
        score(&there_and_back(&bench, &cast, &rgb(), &mosaic, &Method::joint()), &cast, &rgb(), FRINGE_PX);
    assert!(found.phase_rms_rad < 0.01 && found.wrong_share() == 0.0, "{found:?}");
    let found = score(
        &there_and_back(&bench, &cast, &rgb(), &clean(), &Method::published()),
        &cast,
        &rgb(),
        FRINGE_PX,
    );
    assert!(found.phase_rms_rad < 0.05 && found.wrong_share() < 5e-3, "{found:?}");
    assert!(found.returned_share() > 0.95, "{found:?}");
}

#[test]
fn a_range_of_columns_decodes_fringes_that_repeat_beyond_it() {
    let bench = bench(2);
    let cast = cast_scene(&bench, "plane");
    // 36 and 33 fringes repeat after twelve fringes of 25.3 columns.
    let encoding =
        Encoding::rgb_within([36.0, 33.0], 912, [330.0, 620.0]).expect("fewer than twelve fringes");
    assert!(Encoding::rgb([36.0, 33.0], 912).is_err());
    let planes = bench.render(&cast, &Light::shot(&encoding).expect("lights"), &clean()).expect("a scene");
    let Planes::U16(planes) = planes else { panic!("16 bit") };
    let [red, green, blue, _] = planes.each_ref().map(|plane| plane.view());
    let column = cast.column_px(quadfringe::rig::Projector::Visible);
    for method in [Method::joint(), Method::published()] {
        let options = Options::default().with_method(method);
        let builder = Decoder::builder(&encoding, [bench.camera.height, bench.camera.width]).options(options);
        let mut decoder = builder.build().expect("valid");
        let decoded =
            decoder.decode(&Shot::rgb([red, green, blue]).expect("one size")).expect("three channels");
        let (mut inside, mut right) = (0, 0);
        for (found, truth) in
            decoded.column_px.iter().zip(&column).filter(|(_, u)| (345.0..605.0).contains(*u))
        {
            inside += 1;
            right += usize::from((found - truth).abs() < 1.0);
        }
        assert!(inside > 10_000 && right * 100 > 97 * inside, "{right} of {inside}");
        let outside = decoded.column_px.iter().filter(|u| u.is_finite() && !(328.0..621.0).contains(*u));
        assert_eq!(outside.count(), 0);
    }
}

#[test]
fn a_shot_must_have_the_channels_of_the_encoding() {
    let bench = bench(4);
    let cast = cast_scene(&bench, "plane");
    let planes =
        bytes(bench.render(&cast, &Light::shot(&rgb()).expect("lights"), &noisy(1)).expect("a scene"));
    let [red, green, blue, _] = planes.each_ref().map(|plane| plane.view());
    let text = decoder(&bench, Method::joint())
        .decode(&Shot::try_from(&planes).expect("four"))
        .unwrap_err()
        .to_string();
    assert_eq!(
        text,
        "images of a shot: expected R, G and B, the channels of the encoding, got R, G, B and IR"
    );
    let three = Shot::rgb([red, green, blue]).expect("three");
    let text = common::decoder(&bench, Options::default()).decode(&three).unwrap_err().to_string();
    assert_eq!(
        text,
        "images of a shot: expected R, G, B and IR, the channels of the encoding, got R, G and B"
    );
    assert!(code().four_channel_view().expect("four").has_infrared());
}

#[test]
fn crosstalk_of_infrared_plays_no_part() {
    let image = Array2::from_elem((2, 4), 0.5f32);
    let mut crosstalk = Conditioner::default().crosstalk;
    (crosstalk[0][1], crosstalk[0][3], crosstalk[3][0]) = (0.1, 0.4, 0.3);
    let conditioner = Conditioner::default().with_crosstalk(crosstalk).with_dark([0.0, 0.0, 0.0, 0.2]);
    let shot = Shot::rgb([image.view(), image.view(), image.view()]).expect("one size");
    let [red, green, _, infrared] = linearise(&shot, &conditioner).expect("valid");
    assert!((red[[1, 2]] - 0.45).abs() < 1e-6 && (green[[0, 0]] - 0.5).abs() < 1e-6);
    assert!(infrared.iter().all(|light| *light == 0.0));
}
