//! Meshes are bit-identical for any number of threads, hold each triangle once, and end at steps in depth.

mod common;

use common::{bench, cast_scene, code, noisy, there_and_back};
use ndarray::{Array2, Array3};
use quadfringe::Method;
use quadfringe::mesh::{Mesh, MeshOptions, Points, mesh_from_points, normals_from_points};
use rayon::ThreadPoolBuilder;
use std::collections::BTreeSet;

/// Points of a scene as decoded, and the standard deviation of their depth.
fn decoded(surface: &str) -> (Array3<f32>, Array2<f32>) {
    let bench = bench(2);
    let found = there_and_back(&bench, &cast_scene(&bench, surface), &code(), &noisy(5), &Method::joint());
    (found.xyz_mm.expect("calibrated"), found.uncertainty_mm.expect("calibrated"))
}

fn bits(mesh: &Mesh) -> Vec<u32> {
    let vectors = mesh.points_mm.iter().chain(&mesh.normals).flatten().chain(&mesh.normal_uncertainty_rad);
    let numbers = mesh.pixels.iter().flatten().chain(mesh.faces.iter().flatten()).copied();
    vectors.map(|c| c.to_bits()).chain(numbers).chain(mesh.filled.iter().map(|f| u32::from(*f))).collect()
}

#[test]
fn threads_change_no_bit() {
    let (xyz_mm, uncertainty_mm) = decoded("face");
    let points = Points { xyz_mm: xyz_mm.view(), uncertainty_mm: Some(uncertainty_mm.view()) };
    for options in [MeshOptions::default(), MeshOptions { step: 3, holes_px: 50 }] {
        let run = |threads: usize| {
            let pool = ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            pool.install(|| {
                let normals = normals_from_points(&points).expect("valid points");
                let normals = normals.normals.iter().map(|c| c.to_bits()).collect::<Vec<_>>();
                (bits(&mesh_from_points(&points, &options).expect("valid points")), normals)
            })
        };
        let one = run(1);
        assert!(one.0.len() > 100_000 / options.step);
        for threads in [2, 3, 5] {
            assert!(run(threads) == one, "{options:?}, {threads} threads");
        }
    }
}

#[test]
fn each_side_belongs_to_one_or_two_triangles_that_look_the_same_way() {
    let (xyz_mm, uncertainty_mm) = decoded("steps");
    let points = Points { xyz_mm: xyz_mm.view(), uncertainty_mm: Some(uncertainty_mm.view()) };
    let mesh = mesh_from_points(&points, &MeshOptions::default()).expect("valid points");
    let mut sides = BTreeSet::new();
    for [a, b, c] in &mesh.faces {
        for side in [[a, b], [b, c], [c, a]] {
            assert!(sides.insert(side), "a side is run through twice in one direction");
        }
    }
    let used: BTreeSet<u32> = mesh.faces.iter().flatten().copied().collect();
    assert_eq!(used.len(), mesh.points_mm.len(), "each vertex is in a triangle");
}
