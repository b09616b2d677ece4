//! Bad input causes an error that says what was expected, what came and what to do. Bad light causes no data.

mod common;

use common::{bench, bytes, cast_scene, code, decode_planes, noisy};
use ndarray::{Array2, Array3};
use quadfringe::rig::{Light, Planes};
use quadfringe::stages::Phases;
use quadfringe::{
    Conditioner, Decoded, Decoder, Device, Encoding, JointOptions, Method, Options, Response, Shot,
    condition, stages,
};

type Four = [Array2<u8>; 4];

fn message<T>(result: quadfringe::Result<T>) -> String {
    match result {
        Ok(_) => panic!("this must be refused"),
        Err(error) => error.to_string(),
    }
}

fn assert_says<T>(result: quadfringe::Result<T>, parts: &[&str]) {
    let text = message(result);
    for part in parts {
        assert!(text.contains(part), "{part:?} is not in {text:?}");
    }
}

fn decoder(method: Method) -> Decoder {
    let builder = Decoder::builder(&code(), [384, 512]).options(Options::default().with_method(method));
    builder.build().expect("valid plan")
}

fn shot_of_steps() -> Four {
    let bench = bench(2);
    let cast = cast_scene(&bench, "steps");
    let lights = Light::shot(&code()).expect("four channels");
    bytes(bench.render(&cast, &lights, &noisy(2)).expect("valid scene"))
}

fn returned(decoded: &Decoded) -> f64 {
    let count = decoded.phase_rad.iter().filter(|p| p.is_finite()).count();
    count as f64 / decoded.phase_rad.len() as f64
}

fn decode(method: Method, images: Four) -> Decoded {
    decode_planes(&mut decoder(method), &Planes::U8(images)).expect("a valid shot")
}

#[test]
fn sizes_are_named() {
    let image = |rows, columns| Array2::<u8>::zeros((rows, columns));
    let (whole, odd) = (image(384, 512), image(384, 511));
    let mixed = Shot::new([whole.view(), odd.view(), whole.view(), whole.view()]);
    assert_says(mixed, &["G image", "[384, 512]", "[384, 511]"]);
    let small = Shot::new([odd.view(), odd.view(), odd.view(), odd.view()]).expect("one size");
    let result = decoder(Method::joint()).decode(&small);
    assert_says(result, &["shot", "[384, 512]", "[384, 511]"]);
    let empty = image(0, 8);
    let none = Shot::new([empty.view(), empty.view(), empty.view(), empty.view()]);
    assert_says(none, &["[0, 8]"]);
    let tiny = Decoder::builder(&code(), [8, 8]).build();
    assert_says(tiny, &["[16, 16]", "[8, 8]"]);
}

#[test]
fn values_that_are_not_finite_are_counted() {
    let good = Array2::<f32>::zeros((20, 30));
    let mut bad = good.clone();
    (bad[[3, 4]], bad[[7, 1]]) = (f32::NAN, f32::INFINITY);
    let shot = Shot::new([good.view(), good.view(), bad.view(), good.view()]);
    assert_says(shot, &["B image", "2 values", "row 3, column 4"]);
}

#[test]
fn codes_that_cannot_number_the_field_name_two_columns() {
    for numbers in [[16.0, 8.0, 4.0], [30.0, 30.0, 30.0], [36.0, 18.0, 9.0]] {
        let parts = ["cannot number", "912 columns", "look alike", "36, 35, 30"];
        assert_says(Encoding::four_channel(numbers, 912), &parts);
    }
    assert_says(Encoding::four_channel([f64::NAN, 35.0, 30.0], 912), &["fringe number"]);
    assert_says(Encoding::four_channel([-36.0, 35.0, 30.0], 912), &["-36"]);
    assert_says(
        Encoding::four_channel([5e-324, 35.0, 30.0], 912),
        &["fringe number", "a number from 0.001 to below 456"],
    );
    assert_says(Encoding::four_channel([500.0, 35.0, 30.0], 912), &["500"]);
    assert_says(Encoding::optimum(35, 912), &["35"]);
    assert_says(Encoding::optimum(36, usize::MAX), &["projector_width", "from 2 to 65536"]);
}

#[test]
fn light_far_beyond_full_scale_is_refused() {
    let bright = Array2::<f32>::from_elem((384, 512), 1e30);
    let shot = Shot::new([bright.view(), bright.view(), bright.view(), bright.view()]).expect("finite");
    let parts = ["intensity of a shot", "10000 times full scale"];
    for method in [Method::joint(), Method::published()] {
        assert_says(decoder(method).decode(&shot), &parts);
    }
    assert_says(condition::linearise(&shot, &Conditioner::default()), &parts);
    let counts = shot.with_full_scale(1e30).expect("positive");
    assert!(condition::linearise(&counts, &Conditioner::default()).is_ok());
}

/// Green fringes of a period far beyond the width of the image.
#[test]
fn a_period_far_beyond_the_image_is_no_data() {
    let wide = Encoding::four_channel([4.0, 0.001, 3.0], 64).expect("distinct columns");
    let options = Options::default().with_method(Method::published());
    let mut decoder = Decoder::builder(&wide, [16, 20]).options(options).build().expect("valid plan");
    let flat = [(); 4].map(|()| Array2::<u8>::from_elem((16, 20), 90));
    let decoded = decoder.decode(&Shot::try_from(&flat).expect("one size")).expect("a valid shot");
    assert_eq!(returned(&decoded), 0.0);
}

#[test]
fn plans_out_of_range_are_refused() {
    let builder = || Decoder::builder(&code(), [64, 64]);
    let settings = |options| builder().options(options).build();
    let plain = Options::default();
    assert_says(settings(plain.clone().with_modulation_min(f32::NAN)), &["modulation_min", "NaN"]);
    assert_says(settings(plain.clone().with_quality_min(1.0)), &["quality_min"]);
    for period_px in [1.0, 64.5, 1e300, f64::NAN] {
        assert_says(settings(plain.clone().with_period_px(period_px)), &["period_px", "from 3 to 64"]);
        let range = plain.clone().with_period_range_px([3.0, period_px]);
        assert_says(settings(range), &["period_px", "from 3 to 64"]);
    }
    let instants = |instants| {
        settings(plain.clone().with_method(JointOptions::default().with_channel_instants_us(instants)))
    };
    assert_says(instants([0.0, f32::NAN, 1.0, 0.0]), &["channel_instants_us", "finite", "NaN"]);
    assert_says(instants([5.0; 4]), &["channel_instants_us", "differ"]);
    let response = [Response { exponent: -1.0, ..Response::default() }; 4];
    let light = Conditioner::default().with_response(response);
    assert_says(builder().conditioner(light).build(), &["exponent", "-1"]);
}

#[test]
fn stages_refuse_maps_that_do_not_fit() {
    let (a, b) = (Array2::<f32>::zeros((4, 8)), Array2::<f32>::zeros((4, 9)));
    assert!(stages::two_step(a.view(), b.view()).is_err());
    assert!(stages::unwrap(&code(), Phases::from_array([a.view(), a.view(), b.view()])).is_err());
    assert!(stages::n_step(Array3::<f32>::zeros((2, 4, 8)).view()).is_err());
    let black = Array3::<f32>::zeros((12, 32, 32));
    assert!(condition::estimate_response(&[black.view()]).is_err());
    assert!(Device::pinhole(0, 8, [10.0; 2], [4.0; 2]).is_err());
    let narrow = Array2::<f32>::zeros((2, 7));
    let phase = stages::fourier(narrow.view(), stages::Band::Improved, stages::Background::MovingMean, 3.0);
    assert_says(phase, &["samples in a row of fringes", "at least 8", "got 7"]);
    for shape in [(0, 64), (3, 0), (3, 2), (3, 7)] {
        let (image, none) = (Array2::<f32>::zeros(shape), f64::INFINITY);
        assert_eq!(stages::carrier(image.view()).period_px(), none);
        assert_eq!(stages::quadrature_carrier(image.view(), image.view()).period_px(), none);
        assert_eq!(stages::row_period_px(image.view()), f64::max(shape.1 as f64, 3.0));
    }
}

#[test]
fn a_blind_channel_is_no_data() {
    for channel in 0..4 {
        for level in [0, 255] {
            let mut images = shot_of_steps();
            images[channel].fill(level);
            let found = returned(&decode(Method::joint(), images));
            assert!(found < 0.01, "channel {channel} at {level}: {found}");
        }
    }
}

#[test]
fn four_equal_images_are_no_data() {
    let [red, ..] = shot_of_steps();
    let images = [red.clone(), red.clone(), red.clone(), red];
    let found = returned(&decode(Method::joint(), images));
    assert!(found < 0.01, "{found}");
}

#[test]
fn exchanged_channels_leave_little_or_no_trust() {
    let median = |decoded: &Decoded| {
        let quality = decoded.quality.iter().copied();
        let mut known: Vec<f32> = quality.filter(|q| q.is_finite()).collect();
        known.sort_by(f32::total_cmp);
        known.get(known.len() / 2).copied().unwrap_or(0.0)
    };
    let sound = decode(Method::joint(), shot_of_steps());
    assert!(returned(&sound) > 0.8, "{}", returned(&sound));
    for (first, second) in [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)] {
        let mut images = shot_of_steps();
        images.swap(first, second);
        let decoded = decode(Method::joint(), images);
        let (trust, least) = (median(&decoded), median(&sound));
        println!("{first}{second}: median quality {trust}, sound {least}, returned {}", returned(&decoded));
        assert!(trust < 0.6 * least, "{first} for {second}: {trust} {least}");
    }
}

#[test]
fn saturated_parts_are_no_data_and_the_rest_stays() {
    let mut images = shot_of_steps();
    for image in &mut images {
        image.slice_mut(ndarray::s![100..200, 100..300]).fill(255);
    }
    let decoded = decode(Method::joint(), images);
    let inside = decoded.phase_rad.slice(ndarray::s![100..200, 100..300]);
    assert!(inside.iter().all(|p| p.is_nan()));
    assert!(returned(&decoded) > 0.7, "{}", returned(&decoded));
}
