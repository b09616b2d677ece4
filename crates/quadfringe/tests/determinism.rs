//! The same bits for any number of threads, and for a decoder that has decoded other shots before.

mod common;

use common::{bench, cast_scene, code, decode_planes, noisy, there_and_back};
use ndarray::Array2;
use quadfringe::rig::Light;
use quadfringe::{Conditioner, Decoded, Decoder, Method, Options};
use rayon::ThreadPoolBuilder;

fn bits(decoded: &Decoded) -> Vec<u32> {
    let maps: [&Array2<f32>; 5] = [
        &decoded.phase_rad,
        &decoded.column_px,
        &decoded.modulation,
        &decoded.quality,
        &decoded.wrong_order_probability,
    ];
    let xyz = decoded.xyz_mm.iter().flatten();
    let values =
        maps.into_iter().chain(&decoded.uncertainty_rad).chain(&decoded.uncertainty_mm).flatten().chain(xyz);
    values.map(|v| v.to_bits()).collect()
}

#[test]
fn threads_change_no_bit() {
    let bench = bench(2);
    for method in [Method::Best, Method::Published] {
        let run = |threads: usize| {
            let pool = ThreadPoolBuilder::new().num_threads(threads).build();
            pool.expect("threads").install(|| {
                let cast = cast_scene(&bench, "face");
                bits(&there_and_back(&bench, &cast, &code(), &noisy(5), method))
            })
        };
        let one = run(1);
        for threads in [2, 3] {
            assert!(run(threads) == one, "{method:?}, {threads} threads");
        }
    }
}

#[test]
fn a_shot_leaves_nothing_behind() {
    let bench = bench(2);
    let shots = ["steps", "peaks", "steps"].map(|name| {
        let cast = cast_scene(&bench, name);
        let planes = bench.render(&cast, &Light::shot(&code()), &noisy(5));
        planes.expect("a valid scene")
    });
    for method in [Method::Best, Method::Published] {
        let options = Options { method, ..Options::default() };
        let (rows, columns) = shots[0].shape();
        let mut decoder =
            Decoder::new(code(), [rows, columns], &Conditioner::default(), options).expect("valid options");
        let [first, _, again] =
            shots.each_ref().map(|planes| bits(&decode_planes(&mut decoder, planes).expect("a valid shot")));
        assert!(first == again, "{method:?}");
    }
}
