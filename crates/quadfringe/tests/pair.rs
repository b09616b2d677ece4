//! Decodes shots of two projectors that are calibrated and not coaxial.

mod common;

use common::{bench, clean, code, decode_planes, noisy};
use quadfringe::height::{PairTable, Triangulator};
use quadfringe::optics::ProjectorPair;
use quadfringe::rig::{Bench, Cast, Light, Projector, RenderOptions};
use quadfringe::surface::{Plane, Surface, scene};
use quadfringe::{Channel, Decoded, Decoder, DmdLayout, Method, Options, PublishedOptions, Result};
use std::f32::consts::PI;
use std::sync::Arc;

const DEPTHS_MM: [f64; 5] = [700.0, 750.0, 800.0, 850.0, 900.0];

/// The reference bench with a different lens distortion for each device, and with projectors that deviate by 1 degree
/// and 0.5 mm on every axis.
fn apart(shrink: usize, layout: DmdLayout) -> Bench {
    let reference = Bench { ..Bench::reference_with(layout) };
    let lens = |device: quadfringe::Device, k| device.with_distortion(k).expect("finite");
    let bench = Bench { camera: bench(shrink).camera, ..reference };
    let bench = bench.deviated([1f64.to_radians(); 3], [0.5; 3]).expect("finite");
    Bench {
        camera: lens(bench.camera, [-0.12, 0.08, 2e-4, -3e-4, 0.0]),
        visible: lens(bench.visible, [-0.05, 0.03, 3e-4, -2e-4, 0.0]),
        infrared: lens(bench.infrared, [-0.06, 0.04, -2e-4, 3e-4, 0.0]),
        ..bench
    }
}

fn pair_of(bench: &Bench) -> ProjectorPair {
    ProjectorPair::new(bench.visible.clone(), bench.infrared.clone())
}

fn decode(
    bench: &Bench,
    cast: &Cast,
    ir: Option<Light<'_>>,
    light: &RenderOptions,
    table: Option<PairTable>,
) -> Result<Decoded> {
    let mut published = PublishedOptions::default();
    published.along_rays = table.map(Arc::new);
    decode_by(published.into(), bench, cast, ir, light)
}

fn decode_by(
    method: Method,
    bench: &Bench,
    cast: &Cast,
    ir: Option<Light<'_>>,
    light: &RenderOptions,
) -> Result<Decoded> {
    let code = code();
    let mut lights = Light::shot(&code).expect("four channels");
    if let Some(ir) = ir {
        lights[3] = ir;
    }
    let planes = bench.render(cast, &lights, light)?;
    let (rows, columns) = planes.shape();
    let builder = Decoder::builder(&code, [rows, columns])
        .options(Options::default().with_method(method))
        .triangulator(Triangulator::new(&bench.camera, &bench.visible)?);
    decode_planes(&mut builder.build()?, &planes)
}

/// Width of an infrared fringe in pixels of the largest image here. Nearer to a border of light, the row filter has
/// errors.
const BORDER_PX: usize = 17;

/// Number of lit, returned and wrong pixels, among the pixels that both projectors light, away from borders of light.
fn counts(decoded: &Decoded, cast: &Cast) -> (usize, usize, usize) {
    let (truth, lit) = (cast.phase_rad(&code()), cast.column_px(Projector::Infrared));
    let columns = truth.ncols();
    let whole = |(at, (t, ir)): (usize, (&f32, &f32))| {
        let x = at % columns;
        let inside = x >= BORDER_PX && x + BORDER_PX < columns && t.is_finite() && ir.is_finite();
        // Both projectors must light the row for a fringe to the left and to the right, because the filter runs along
        // the row.
        let row = lit.row(at / columns);
        inside && row[x - BORDER_PX].is_finite() && row[x + BORDER_PX].is_finite()
    };
    let inside: Vec<bool> = truth.iter().zip(&lit).enumerate().map(whole).collect();
    let both = || {
        let pixels = truth.iter().zip(&lit).zip(&decoded.phase_rad).zip(&inside);
        pixels.filter(|(_, inside)| **inside).map(|(pixel, _)| pixel)
    };
    let returned = both().filter(|(_, phase)| phase.is_finite());
    let wrong = returned.clone().filter(|((t, _), phase)| (**phase - **t).abs() > PI);
    (both().count(), returned.count(), wrong.count())
}

/// The table gives the infrared phase at every depth, for plain and pre-deformed patterns and for both layouts.
#[test]
fn the_table_knows_the_infrared_phase() {
    let four = code().four_channel_view().expect("four channels");
    for layout in [DmdLayout::Regular, DmdLayout::Diamond] {
        let bench = apart(16, layout);
        for pair in [pair_of(&bench), pair_of(&bench).predeformed(800.0).expect("a depth")] {
            let limits = [(None, 0.03), (Some([690.0, 910.0]), 2e-3)];
            for (range_mm, limit) in limits {
                let table = PairTable::new(&bench.camera, &pair, &code(), range_mm).expect("valid pair");
                for z_mm in DEPTHS_MM {
                    let cast = bench.cast(&Plane::at_z(z_mm));
                    let known = table.infrared_rad(cast.phase_rad(&code()).view()).expect("same size");
                    for ((pixel, hit), known) in cast.hits().indexed_iter().zip(&known) {
                        let lit = hit.is_lit(Projector::Visible);
                        let turns = pair.infrared_turns(hit.xyz_mm).filter(|_| lit);
                        let Some(turns) = turns else { continue };
                        let error = known - four.phase_rad(Channel::Ir, turns * 912.0) as f32;
                        assert!(error.abs() < limit, "{layout:?} {range_mm:?} {z_mm} {pixel:?}: {error}");
                    }
                }
            }
        }
    }
}

#[test]
fn every_order_is_right_at_every_depth_where_the_ladder_fails() {
    let bench = apart(4, DmdLayout::Regular);
    let table = PairTable::new(&bench.camera, &pair_of(&bench), &code(), None).expect("valid pair");
    let light = RenderOptions { noise: 0.01, seed: 5, blur_px: 0.7, ..clean() };
    for z_mm in DEPTHS_MM {
        let cast = bench.cast(&Plane::at_z(z_mm));
        let searched = decode(&bench, &cast, None, &light, Some(table.clone())).expect("a shot");
        let (lit, returned, wrong) = counts(&searched, &cast);
        assert!(
            wrong * 1000 < returned && returned * 100 > lit * 97,
            "{z_mm}: {wrong} of {returned} of {lit}"
        );
        let ladder = decode(&bench, &cast, None, &light, None).expect("a shot");
        let (_, returned, wrong) = counts(&ladder, &cast);
        assert!(wrong * 3 > returned, "{z_mm}: the ladder has {wrong} of {returned}");
    }
}

#[test]
fn steps_and_noise_are_no_harder_than_for_one_projector() {
    let apart = apart(2, DmdLayout::Regular);
    let alone = Bench { infrared: apart.visible.clone(), ..apart.clone() };
    let surface = scene("steps", 0.0).expect("known scene");
    let table = PairTable::new(&apart.camera, &pair_of(&apart), &code(), Some([600.0, 1000.0]));
    let shares = [(&apart, Some(table.expect("valid pair"))), (&alone, None)].map(|(bench, table)| {
        let cast = bench.cast(surface.as_ref() as &dyn Surface);
        let (lit, returned, wrong) =
            counts(&decode(bench, &cast, None, &noisy(3), table).expect("a shot"), &cast);
        (wrong as f64 / returned as f64, returned as f64 / lit as f64)
    });
    let [(wrong, returned), (wrong_alone, returned_alone)] = shares;
    assert!(wrong <= 1.05 * wrong_alone && returned >= 0.97 * returned_alone, "{shares:?}");
}

/// The joint method has the infrared phase of the ray in its model, for plain and pre-deformed patterns.
#[test]
fn the_joint_method_needs_no_coaxial_pair_at_any_depth() {
    let bench = apart(4, DmdLayout::Regular);
    let image = bench.predeform(&Light::fringes(30.0, 0.0), 800.0).expect("a depth");
    let plain = pair_of(&bench);
    let light = RenderOptions { noise: 0.01, seed: 5, blur_px: 0.7, ..clean() };
    let shots = [(plain.clone(), None), (plain.predeformed(800.0).expect("a depth"), Some(image.view()))];
    for (pair, image) in shots {
        let table = PairTable::new(&bench.camera, &pair, &code(), None).expect("valid pair");
        let method = Method::joint().with_along_rays(table);
        for z_mm in DEPTHS_MM {
            let cast = bench.cast(&Plane::at_z(z_mm));
            let found =
                decode_by(method.clone(), &bench, &cast, image.map(Light::Image), &light).expect("a shot");
            let (lit, returned, wrong) = counts(&found, &cast);
            assert!(wrong == 0 && returned * 100 > lit * 97, "{z_mm}: {wrong} of {returned} of {lit}");
        }
    }
}

/// The published correction and the search can be combined, because the table includes the pre-deformation.
#[test]
fn a_predeformed_image_is_read_both_ways() {
    let bench = apart(4, DmdLayout::Diamond);
    let image = bench.predeform(&Light::fringes(30.0, 0.0), 800.0).expect("a depth");
    let pair = pair_of(&bench).predeformed(800.0).expect("a depth");
    let table = PairTable::new(&bench.camera, &pair, &code(), None).expect("valid pair");
    for z_mm in [750.0, 800.0, 850.0] {
        let cast = bench.cast(&Plane::at_z(z_mm));
        for table in [None, Some(table.clone())] {
            let found =
                decode(&bench, &cast, Some(Light::Image(image.view())), &clean(), table).expect("a shot");
            let (lit, returned, wrong) = counts(&found, &cast);
            assert!(wrong == 0 && returned * 100 > lit * 97, "{z_mm}: {wrong} of {returned} of {lit}");
        }
    }
}

#[test]
fn bad_input_is_refused() {
    let bench = apart(16, DmdLayout::Regular);
    let table = |range_mm| PairTable::new(&bench.camera, &pair_of(&bench), &code(), range_mm);
    for range_mm in [[900.0, 700.0], [-1.0, 700.0], [f64::NAN, 700.0], [700.0, f64::NAN]] {
        assert!(table(Some(range_mm)).is_err(), "{range_mm:?}");
    }
    assert!(pair_of(&bench).predeformed(-800.0).is_err());
    let narrow = quadfringe::Encoding::optimum(16, 400).expect("a valid encoding");
    assert!(PairTable::new(&bench.camera, &pair_of(&bench), &narrow, None).is_err());
    for method in [Method::published(), Method::joint()] {
        let method = method.with_along_rays(table(None).expect("valid pair"));
        let plan = |shape| {
            Decoder::builder(&code(), shape).options(Options::default().with_method(method.clone())).build()
        };
        assert!(plan([48, 64]).is_ok());
        let refused = plan([48, 60]).map(|_| ()).expect_err("another camera").to_string();
        assert!(
            refused.contains("camera of the calibrated pair") && refused.contains("[48, 60]"),
            "{refused}"
        );
    }
}
