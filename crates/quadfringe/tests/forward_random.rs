//! Checks the virtual bench and triangulation for random rigs and surfaces.

mod common;

use ndarray::Array2;
use proptest::prelude::*;
use quadfringe::height::Triangulator;
use quadfringe::optics::{Device, rotation_from_vector};
use quadfringe::rig::{Bench, Projector};
use quadfringe::surface::{HeightMap, Interpolation, Plane, Sphere, Surface, Union, scene};

prop_compose! {
    fn any_device(width: usize, height: usize)(
        focal in 1200.0..3000.0f64,
        ratio in 0.98..1.02f64,
        shift in prop::array::uniform2(-20.0..20.0f64),
        k in prop::array::uniform5(-1.0..1.0f64),
        turn in prop::array::uniform3(-0.1..0.1f64),
    ) -> Device {
        let centre = [0.5 * width as f64 + shift[0], 0.5 * height as f64 + shift[1]];
        let distortion = [0.15 * k[0], 0.1 * k[1], 2e-3 * k[2], 2e-3 * k[3], 0.05 * k[4]];
        Device::pinhole(width, height, [focal, focal * ratio], centre)
            .and_then(|d| d.with_distortion(distortion))
            .and_then(|d| d.with_pose(rotation_from_vector(turn), [20.0 * turn[1], -5.0, 8.0]))
            .expect("valid device")
    }
}

prop_compose! {
    fn any_bench()(
        camera in any_device(128, 96),
        projector in any_device(912, 1140),
        place in (120.0..260.0f64, -40.0..40.0f64, -50.0..220.0f64),
        side in prop::bool::ANY,
        roll in -0.2..0.2f64,
    ) -> Bench {
        let x = if side { place.0 } else { -place.0 };
        let yaw = (x / (800.0 - place.2)).atan();
        let rotation = rotation_from_vector([0.0, yaw, roll]);
        let centre = [x, place.1, place.2];
        let translation =
            std::array::from_fn(|i| -(0..3).map(|j| rotation[i][j] * centre[j]).sum::<f64>());
        let camera = Device::pinhole(128, 96, camera.focal_px.map(|f| f / 8.0), [63.5, 47.5])
            .and_then(|d| d.with_distortion(camera.distortion))
            .expect("valid camera");
        let projector = projector.with_pose(rotation, translation).expect("valid pose");
        Bench { camera, visible: projector.clone(), infrared: projector, ..Bench::reference() }
    }
}

fn any_surface() -> impl Strategy<Value = Box<dyn Surface>> {
    let tilt = prop::array::uniform2(-0.4..0.4f64);
    let plane = (tilt, 700.0..950.0f64).prop_map(|([x, y], z)| -> Box<dyn Surface> {
        Box::new(Plane::new([0.0, 0.0, z], [x, y, -1.0]).expect("valid plane"))
    });
    let ball =
        (prop::array::uniform2(-60.0..60.0f64), 10.0..60.0f64).prop_map(|([x, y], r)| -> Box<dyn Surface> {
            let ball = Sphere::new([x, y, 750.0], r).expect("valid sphere");
            Box::new(Union(vec![Box::new(Plane::at_z(850.0)), Box::new(ball)]))
        });
    let map = prop::collection::vec(-20.0..20.0f64, 36).prop_map(|heights| -> Box<dyn Surface> {
        let grid = Array2::from_shape_vec((6, 6), heights).expect("36 heights");
        let map = HeightMap::new(grid, [-250.0; 2], [100.0; 2], 800.0, Interpolation::Bicubic);
        Box::new(map.expect("valid map"))
    });
    let named = prop::sample::select(vec!["peaks", "steps", "face", "hand"])
        .prop_map(|name| scene(name, 0.7).expect("known scene"));
    prop_oneof![plane, ball, map, named]
}

proptest! {
    #![proptest_config(common::cases(64))]

    #[test]
    fn project_undoes_ray(device in any_device(1024, 768), x in 0.0..1023.0f64, y in 0.0..767.0f64, t in 100.0..2000.0f64) {
        let ray = device.ray([x, y]);
        prop_assert!((ray.direction.iter().map(|d| d * d).sum::<f64>() - 1.0).abs() < 1e-12);
        let [u, v] = device.project(ray.at(t)).expect("in front of the device");
        prop_assert!((u - x).abs() < 1e-6 && (v - y).abs() < 1e-6, "{u} {v}");
        let ideal = device.undistort([x, y]);
        let back = device.distort(ideal);
        prop_assert!((back[0] * device.focal_px[0] + device.centre_px[0] - x).abs() < 1e-7);
    }

    #[test]
    fn triangulation_gives_the_surface_back(bench in any_bench(), surface in any_surface()) {
        let cast = bench.cast(surface.as_ref());
        let columns = cast.column_px(Projector::Visible);
        let triangulator = Triangulator::new(&bench.camera, &bench.visible).expect("a valid bench");
        let xyz = triangulator.xyz_mm(columns.view()).expect("same size");
        let mut lit = 0;
        for ((at, hit), column) in cast.hits().indexed_iter().zip(&columns) {
            let point: [f64; 3] = std::array::from_fn(|axis| f64::from(xyz[[at.0, at.1, axis]]));
            if column.is_nan() {
                prop_assert!(point.iter().all(|c| c.is_nan()));
                continue;
            }
            lit += 1;
            // Columns are float32. Half a unit in the last place is 3e-5 columns, or some 1e-4 mm.
            let error = (0..3).fold(0f64, |e, axis| e.max((point[axis] - hit.xyz_mm[axis]).abs()));
            prop_assert!(error < 1e-3, "{at:?} {error} {point:?} {:?}", hit.xyz_mm);
        }
        prop_assert!(lit > 100, "{lit} lit pixels");
    }
}
