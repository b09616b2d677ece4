//! decode(simulate(h)) must return h: the bars of the whole chain, through the public API alone.

mod common;

use common::{bench, cast_scene, clean, code, noisy, score, there_and_back};
use quadfringe::Method;

/// Width of a fringe of the reference bench in camera pixels.
const FRINGE_PX: f32 = 28.0;
/// Share of returned pixels whose order may be wrong without noise. Of 780 thousand pixels these are a few near edges
/// where R and B have the same phase on both sides, and a few where lens blur spreads light into a shadow.
const WRONG_MAX: f64 = 2e-5;

#[test]
fn without_noise_the_surface_comes_back() {
    let bench = bench(1);
    for name in ["plane", "peaks", "steps", "sphere", "face"] {
        let cast = cast_scene(&bench, name);
        let decoded = there_and_back(&bench, &cast, &code(), &clean(), &Method::joint());
        let found = score(&decoded, &cast, &code(), FRINGE_PX);
        println!("{name}: {found:?}");
        assert!(found.phase_rms_rad < 0.005, "{name}: {found:?}");
        assert!(found.wrong_share() <= WRONG_MAX, "{name}: {found:?}");
        assert!(found.in_shadow * 100_000 < found.returned, "{name}: {found:?}");
        assert!(found.returned_share() > 0.95, "{name}: {found:?}");
        assert!(found.smooth * 2 > found.lit, "{name}: {found:?}");
    }
}

#[test]
fn noise_of_three_percent_leaves_a_tenth_of_a_millimetre() {
    let bench = bench(1);
    for (seed, name) in (11..).zip(["plane", "peaks", "steps", "sphere", "face"]) {
        let cast = cast_scene(&bench, name);
        let decoded = there_and_back(&bench, &cast, &code(), &noisy(seed), &Method::joint());
        let found = score(&decoded, &cast, &code(), FRINGE_PX);
        println!("{name}: {found:?}");
        assert!(found.depth_rms_mm <= 0.10, "{name}: {found:?}");
        assert!(found.wrong_share() <= 1e-3, "{name}: {found:?}");
        assert!(found.returned_share() > 0.95, "{name}: {found:?}");
    }
}

#[test]
fn the_published_way_gives_a_smooth_surface_back() {
    let bench = bench(1);
    for name in ["plane", "peaks"] {
        let cast = cast_scene(&bench, name);
        let decoded = there_and_back(&bench, &cast, &code(), &clean(), &Method::published());
        let found = score(&decoded, &cast, &code(), FRINGE_PX);
        println!("{name}: {found:?}");
        assert!(found.phase_rms_rad < 0.05, "{name}: {found:?}");
        assert!(found.wrong_share() < 5e-3, "{name}: {found:?}");
    }
}

#[test]
fn maps_agree_with_one_another() {
    let bench = bench(2);
    let cast = cast_scene(&bench, "steps");
    let decoded = there_and_back(&bench, &cast, &code(), &noisy(3), &Method::joint());
    let xyz = decoded.xyz_mm.as_ref().expect("calibrated");
    let orders = decoded.order();
    for (at, &phase) in decoded.phase_rad.indexed_iter() {
        let column = decoded.column_px[at];
        let order = orders[at];
        let z = xyz[[at.0, at.1, 2]];
        if phase.is_nan() {
            assert!(column.is_nan() && order.is_nan() && z.is_nan(), "{at:?}");
            continue;
        }
        assert!((column - phase * 912.0 / (36.0 * std::f32::consts::TAU)).abs() < 1e-3);
        assert_eq!(order, (phase / std::f32::consts::TAU).floor(), "{at:?}");
        assert!(z.is_finite() && decoded.modulation[at] > 0.0, "{at:?}");
        assert!((0.0..=1.0).contains(&decoded.quality[at]), "{at:?}");
    }
}
