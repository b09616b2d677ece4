//! Shots of a Bayer chip against shots with all colours at every pixel, and registered infrared against aligned.

mod common;

use common::{BAYER, Score, bench, cast_scene, clean, code, noisy, score, there_and_back};
use quadfringe::Method;
use quadfringe::rig::{Bench, Cast, Demosaic, RenderOptions};

/// One fringe of the reference bench in camera pixels.
const FRINGE_PX: f32 = 28.0;

/// The same scene with all colours everywhere, from the raw mosaic, and from planes that the camera interpolated.
fn three_ways(bench: &Bench, cast: &Cast, plain: &RenderOptions, method: Method) -> [Score; 3] {
    let raw = RenderOptions { bayer: Some(BAYER), ..plain.clone() };
    let bilinear = RenderOptions { demosaic: Some(Demosaic::Bilinear), ..raw.clone() };
    [plain, &raw, &bilinear].map(|render| {
        let decoded = there_and_back(bench, cast, &code(), render, method);
        score(&decoded, cast, &code(), FRINGE_PX)
    })
}

#[test]
fn zz_print() {
    let bench = bench(1);
    for name in ["steps", "face", "peaks", "plane"] {
        let cast = cast_scene(&bench, name);
        for (noise, render) in [("0", clean()), ("3%", noisy(4))] {
            for method in [Method::Best, Method::Published] {
                let found = three_ways(&bench, &cast, &render, method);
                for (way, s) in ["full", "mosaic", "bilinear"].iter().zip(found) {
                    println!(
                        "{name:6} {noise:3} {method:?} {way:8} rms {:.5} depth {:.4} wrong {} returned {:.4}",
                        s.phase_rms_rad,
                        s.depth_rms_mm,
                        s.wrong,
                        s.returned_share()
                    );
                }
            }
        }
    }
}
