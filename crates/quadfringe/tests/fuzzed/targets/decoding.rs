//! Shots through a decoder, by both methods.

use super::code;
use super::conditioning::conditioner;
use super::devices::{camera_of, pair_table, projector};
use super::input::Input;
use super::invariants::{all_finite, all_within, bits_of, refused_clearly, same_on_threads};
use super::shots::{Form, planes};
use ndarray::{Array2, Array3, Axis};
use quadfringe::condition::Sample;
use quadfringe::height::Triangulator;
use quadfringe::{Conditioner, Decoded, Decoder, DecoderBuilder, Encoding, Method, Options};

pub fn run(input: &mut Input<'_>) {
    let Some(encoding) = code::four_channels(input) else { return };
    let shape = shape(input);
    let conditioner = if input.flag() { conditioner(input) } else { Conditioner::default() };
    let mut builder = Decoder::builder(&encoding, shape).conditioner(conditioner);
    builder = builder.options(options(input, &encoding, shape));
    if input.flag() {
        let triangulator = Triangulator::new(&camera_of(input, shape), &projector(input, &encoding));
        let Some(triangulator) = refused_clearly(triangulator) else { return };
        builder = builder.triangulator(triangulator);
    }
    if refused_clearly(builder.clone().build()).is_none() {
        return;
    }
    let (form, images) = (Form::of(input), planes(input, &encoding, shape));
    match input.below(3) {
        0 => decode(&builder, form, &images.map(|plane| plane.mapv(|light| (light * 255.0) as u8))),
        1 => decode(&builder, form, &images.map(|plane| plane.mapv(|light| (light * 65535.0) as u16))),
        _ => decode(&builder, form, &images),
    }
}

/// A size that the decoder takes, or one time in eight another one.
fn shape(input: &mut Input<'_>) -> [usize; 2] {
    if input.byte() < 32 {
        return [1 + input.below(48), 1 + input.below(48)];
    }
    [16 + input.below(33), 16 + input.below(65)]
}

fn options(input: &mut Input<'_>, encoding: &Encoding, shape: [usize; 2]) -> Options {
    let mut method = if input.flag() { Method::joint() } else { Method::published() };
    if input.byte() < 64 {
        let instants = input.singles_near(-20_000.0, 20_000.0);
        method = refused_clearly(method.clone().with_channel_instants_us(instants)).unwrap_or(method);
    }
    if input.byte() < 64
        && let Some(table) = pair_table(input, encoding, shape)
    {
        method = method.with_along_rays(table);
    }
    let mut options = Options::default().with_method(method);
    if input.flag() {
        options = options.with_modulation_min(input.near(0.0, 0.1) as f32);
        options = options.with_quality_min(input.near(0.0, 0.5) as f32);
    }
    if input.byte() < 64 {
        options = options.with_period_px(input.near(3.0, 60.0));
    }
    options
}

fn decode<T: Sample>(builder: &DecoderBuilder, form: Form, images: &[Array2<T>; 4]) {
    let Some(shot) = refused_clearly(form.shot(images)) else { return };
    let decode = || builder.clone().build().and_then(|mut decoder| decoder.decode(&shot));
    let decoded = same_on_threads(decode, |decoded| decoded.as_ref().map(bits).unwrap_or_default());
    let Some(mut decoded) = refused_clearly(decoded) else { return };
    check(&decoded, builder.encoding(), shot.shape());
    // A decoder and maps that are used again give the same.
    let first = bits(&decoded);
    let mut decoder = builder.clone().build().expect("built before");
    for _ in 0..2 {
        decoder.decode_into(&shot, &mut decoded).expect("decoded before");
        assert!(bits(&decoded) == first, "another result of the second call");
    }
}

fn bits(decoded: &Decoded) -> Vec<u32> {
    let always = [
        &decoded.phase_rad,
        &decoded.column_px,
        &decoded.modulation,
        &decoded.quality,
        &decoded.wrong_order_probability,
    ];
    let if_wanted = [&decoded.uncertainty_rad, &decoded.uncertainty_mm];
    let maps = always.into_iter().chain(if_wanted.into_iter().flatten());
    maps.flat_map(bits_of).chain(decoded.xyz_mm.iter().flat_map(bits_of)).collect()
}

fn check(decoded: &Decoded, encoding: &Encoding, [rows, columns]: [usize; 2]) {
    let Decoded { phase_rad, column_px, modulation, quality, wrong_order_probability, .. } = decoded;
    let sigma = decoded.uncertainty_rad.as_ref().or(decoded.uncertainty_mm.as_ref()).expect("one of the two");
    for map in [phase_rad, column_px, modulation, quality, wrong_order_probability, sigma] {
        assert_eq!(map.dim(), (rows, columns));
    }
    all_finite("phase", phase_rad);
    all_within("column", column_px, -1.5, encoding.projector_width() as f32 + 0.5);
    all_within("modulation", modulation, 0.0, f32::MAX);
    all_within("quality", quality, 0.0, 1.0);
    all_within("probability of a wrong order", wrong_order_probability, 0.0, 1.0);
    all_within("uncertainty", sigma, 0.0, f32::INFINITY);
    for (at, phase) in phase_rad.indexed_iter() {
        assert_eq!(phase.is_nan(), column_px[at].is_nan(), "phase and column at {at:?}");
        let known = !phase.is_nan();
        assert!(known || (sigma[at].is_nan() && wrong_order_probability[at].is_nan()), "no data at {at:?}");
        assert!(!known || !(quality[at].is_nan() || modulation[at].is_nan()), "light at {at:?}");
    }
    if let Some(xyz) = &decoded.xyz_mm {
        check_points(xyz, column_px);
    }
}

fn check_points(xyz_mm: &Array3<f32>, column_px: &Array2<f32>) {
    assert_eq!(xyz_mm.dim(), (column_px.nrows(), column_px.ncols(), 3));
    for (point, column) in xyz_mm.lanes(Axis(2)).into_iter().zip(column_px) {
        let holes = point.iter().filter(|c| c.is_nan()).count();
        assert!(holes == 0 || holes == 3, "part of a point: {point}");
        assert!(holes == 3 || (point[2] > 0.0 && !column.is_nan()), "a point {point} of column {column}");
        all_finite("point", point);
    }
}
