//! Properties that must hold for any encoding, phase, exposure and rig.

mod common;

use common::{cast_scene, decode_planes, score, there_and_back};
use ndarray::{Array2, s};
use proptest::prelude::*;
use quadfringe::encoding::pattern;
use quadfringe::height::Triangulator;
use quadfringe::optics::rotation_from_vector;
use quadfringe::rig::{Bench, BitDepth, Light, Planes, RenderOptions};
use quadfringe::stages::{Absolute, Phases};
use quadfringe::{Channel, Decoder, Device, DmdLayout, Encoding, Method, Shot, stages};
use std::f64::consts::TAU;

/// Encodings for a projector of 912 columns, with fringe numbers that are integers and others that are not.
fn any_code() -> impl Strategy<Value = Encoding> {
    let triples = vec![
        [36.0, 35.0, 30.0],
        [25.0, 24.0, 20.0],
        [16.0, 15.0, 12.0],
        [28.25, 27.3, 23.1],
        [45.714, 42.667, 40.0],
    ];
    prop::sample::select(triples).prop_map(|numbers| Encoding::four_channel(numbers, 912).expect("valid"))
}

fn wrap(angle: f64) -> f64 {
    angle - TAU * (angle / TAU).round()
}

/// Images of a camera that sees the projector columns one to one: `offset + scale * pattern`.
fn one_to_one(code: &Encoding, rows: usize, offset: f32, scale: f32) -> [Array2<f32>; 4] {
    Channel::ALL.map(|channel| {
        let size_px = [code.projector_width(), rows];
        let image = pattern(&code.channels()[channel.index()], size_px, DmdLayout::Regular);
        image.mapv(|light| offset + scale * light)
    })
}

fn joint(code: &Encoding, images: [Array2<f32>; 4]) -> quadfringe::Decoded {
    let (rows, columns) = images[0].dim();
    let mut decoder = Decoder::builder(code, [rows, columns]).build().expect("valid options");
    decode_planes(&mut decoder, &Planes::F32(images)).expect("valid shot")
}

proptest! {
    #![proptest_config(common::cases(64))]

    /// For any three wrapped phases, wrap(unwrap(phi)) = phi. For three phases of one column, unwrap(phi) is the true
    /// phase, except near the borders of the field, where an error of the beat can wrap it around.
    #[test]
    fn unwrapping_adds_whole_turns_only(
        code in any_code(),
        columns in prop::collection::vec(20.0..892.0f64, 32),
        errors in prop::collection::vec(-0.05..0.05f64, 96),
        strangers in prop::collection::vec(-3.1..3.1f32, 96),
    ) {
        let four = code.four_channel_view().expect("four channels");
        let shape = (1, columns.len());
        let maps: [Array2<f32>; 3] = std::array::from_fn(|i| {
            let channel = [Channel::R, Channel::G, Channel::Ir][i];
            Array2::from_shape_fn(shape, |(_, x)| {
                wrap(four.phase_rad(channel, columns[x]) + errors[32 * i + x]) as f32
            })
        });
        let wrapped = Phases::from_array(maps.each_ref().map(|m| m.view()));
        let Absolute { phase_rad: phase, margin, .. } = stages::unwrap(&code, wrapped).expect("same size");
        for (x, column) in columns.iter().enumerate() {
            let truth = code.absolute_phase_rad(*column) + errors[x];
            prop_assert!((f64::from(phase[[0, x]]) - truth).abs() < 1e-3, "column {column}");
            prop_assert!((0.0..=1.0).contains(&margin[[0, x]]));
        }
        let maps: [Array2<f32>; 3] = std::array::from_fn(|i| {
            Array2::from_shape_fn(shape, |(_, x)| strangers[32 * i + x])
        });
        let wrapped = Phases::from_array(maps.each_ref().map(|m| m.view()));
        let phase = stages::unwrap(&code, wrapped).expect("same size").phase_rad;
        for (given, found) in maps[0].iter().zip(&phase) {
            prop_assert!(wrap(f64::from(found - given)).abs() < 1e-3);
        }
    }

    /// N-step phase shifting returns phase, background and modulation of the fringes. An offset changes only the
    /// background.
    #[test]
    fn an_offset_shifts_the_background_alone(
        steps in 3..17usize,
        phase in -3.1..3.1f64,
        level in 0.1..0.4f64,
        amplitude in 0.02..0.1f64,
        offset in 0.0..0.4f64,
    ) {
        let stack = |offset: f64| ndarray::Array3::from_shape_fn((steps, 2, 3), |(k, _, _)| {
            (offset + level + amplitude * (phase + TAU * k as f64 / steps as f64).cos()) as f32
        });
        let plain = stages::n_step(stack(0.0).view()).expect("enough steps");
        let shifted = stages::n_step(stack(offset).view()).expect("enough steps");
        prop_assert!(wrap(f64::from(plain.phase_rad[[1, 1]]) - phase).abs() < 2e-4);
        prop_assert!(wrap(f64::from(shifted.phase_rad[[1, 1]]) - phase).abs() < 2e-4);
        prop_assert!((f64::from(shifted.background[[1, 1]] - plain.background[[1, 1]]) - offset).abs() < 1e-5);
        prop_assert!((shifted.modulation[[1, 1]] - plain.modulation[[1, 1]]).abs() < 1e-5);
    }
}

proptest! {
    #![proptest_config(common::cases(12))]

    /// More room light or another exposure does not change the phase.
    #[test]
    fn exposure_and_room_light_leave_the_phase(
        offset in 0.0..0.25f32,
        scale in 0.3..0.7f32,
    ) {
        let code = Encoding::optimum(16, 400).expect("a valid encoding");
        let inner = s![12..52, 40..360];
        let plain = joint(&code, one_to_one(&code, 64, 0.05, 0.7));
        let other = joint(&code, one_to_one(&code, 64, 0.05 + offset, scale));
        let (mut sum, mut most) = (0.0, 0.0f64);
        for (a, b) in plain.phase_rad.slice(inner).iter().zip(other.phase_rad.slice(inner)) {
            let apart = f64::from(a - b).abs();
            prop_assert!(apart.is_finite(), "no data appears or goes");
            (sum, most) = (sum + apart * apart, most.max(apart));
        }
        let rms = (sum / plain.phase_rad.slice(inner).len() as f64).sqrt();
        prop_assert!(rms < 2e-3 && most < 0.02, "RMS {rms} rad, greatest {most} rad");
    }
}

prop_compose! {
    /// A bench with a projector 9 to 17 degrees to the side of the camera, which lights the whole field through a lens
    /// with random distortion.
    fn any_bench()(
        angle_deg in 9.0..17.0f64,
        side in prop::bool::ANY,
        distance_mm in 600.0..1300.0f64,
        roll in -0.05..0.05f64,
        k in -0.1..0.1f64,
    ) -> Bench {
        let angle = angle_deg.to_radians() * if side { 1.0 } else { -1.0 };
        let (sine, cosine) = angle.sin_cos();
        let turn = rotation_from_vector([0.0, 0.0, roll]);
        let rotation = [[cosine, 0.0, sine], [0.0, 1.0, 0.0], [-sine, 0.0, cosine]];
        let rotation: [[f64; 3]; 3] = turn.map(|row| {
            std::array::from_fn(|j| (0..3).map(|i| row[i] * rotation[i][j]).sum())
        });
        let translation: [f64; 3] = std::array::from_fn(|i| {
            distance_mm * f64::from(u8::from(i == 2)) - 800.0 * rotation[i][2]
        });
        let focal = 912.0 / 400.0 * distance_mm;
        let projector = Device::pinhole(912, 1140, [focal; 2], [455.5, 569.5])
            .and_then(|d| d.with_distortion([k, 0.0, 1e-3 * k, 0.0, 0.0]))
            .and_then(|d| d.with_pose(rotation, translation))
            .expect("valid projector");
        let camera = Device::pinhole(480, 360, [1280.0; 2], [239.5, 179.5]).expect("valid camera");
        Bench { camera, visible: projector.clone(), infrared: projector, ..Bench::reference() }
    }
}

proptest! {
    #![proptest_config(common::cases(16))]

    #[test]
    fn simulated_shots_decode_to_their_surface(
        bench in any_bench(),
        code in any_code(),
        name in prop::sample::select(vec!["plane", "peaks", "steps", "sphere", "face"]),
        seed in 0..1000u64,
        noise in prop::sample::select(vec![0.0, 0.01]),
    ) {
        let cast = cast_scene(&bench, name);
        let render = RenderOptions { noise, seed, bit_depth: BitDepth::Twelve, ..RenderOptions::default() };
        // Twelve-bit images are stored in 16-bit words.
        let lights = Light::shot(&code).expect("four channels");
        let planes = bench.render(&cast, &lights, &render).expect("valid scene");
        let Planes::U16(images) = &planes else { panic!("12 bit") };
        let (rows, columns) = planes.shape();
        let triangulator = Triangulator::new(&bench.camera, &bench.visible).expect("valid bench");
        let builder = Decoder::builder(&code, [rows, columns]).triangulator(triangulator);
        let mut decoder = builder.build().expect("valid plan");
        let shot = Shot::try_from(images)
            .and_then(|shot| shot.with_full_scale(4095.0))
            .expect("valid shot");
        let decoded = decoder.decode(&shot).expect("valid shot");
        let found = score(&decoded, &cast, &code, 30.0);
        prop_assert!(found.wrong_share() < 2e-3, "{name} {found:?}");
        prop_assert!(found.returned_share() > 0.9, "{name} {found:?}");
        prop_assert!(found.depth_rms_mm < 0.3, "{name} {found:?}");
        prop_assert!(found.in_shadow as f64 <= 1e-3 * found.returned as f64, "{name} {found:?}");
    }
}

/// The published method in one random rig, so that both methods are tested.
#[test]
fn the_published_way_holds_on_a_small_bench() {
    let bench = common::bench(2);
    let cast = cast_scene(&bench, "plane");
    let code = Encoding::optimum(25, 912).expect("a valid encoding");
    let decoded = there_and_back(&bench, &cast, &code, &common::clean(), &Method::published());
    let found = score(&decoded, &cast, &code, 20.0);
    assert!(found.wrong_share() < 0.02, "{found:?}");
}
