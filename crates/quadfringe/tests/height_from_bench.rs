//! Compares heights and depths from phase with simulated benches.

use ndarray::{Array2, Axis};
use quadfringe::Encoding;
use quadfringe::height::{CrossedAxes, HeightPlane, PolynomialHeight, Triangulator};
use quadfringe::optics::{Device, rotation_from_vector};
use quadfringe::rig::{Bench, Projector};
use quadfringe::surface::Plane;

/// The camera looks straight down on the plane z = L0. The projector stands `d` to its left at the same height, and its
/// axis meets the camera axis in that plane, so that columns increase away from the projector.
fn crossed_axes_bench(distance_mm: f64, baseline_mm: f64) -> Bench {
    let camera = Device::pinhole(160, 120, [400.0; 2], [79.5, 59.5]).expect("valid camera");
    let angle = baseline_mm.atan2(distance_mm);
    let rotation = rotation_from_vector([0.0, -angle, 0.0]);
    let translation = rotation.map(|row| row[0] * baseline_mm);
    let projector = Device::pinhole(912, 1140, [1570.0; 2], [455.5, 569.5])
        .and_then(|device| device.with_pose(rotation, translation))
        .expect("valid projector");
    Bench { camera, visible: projector.clone(), infrared: projector, ..Bench::reference() }
}

#[test]
fn analytic_geometry_agrees_with_a_ray_cast_of_its_layout() {
    let (distance_mm, baseline_mm, fringes) = (800.0, 230.0, 36.0);
    let bench = crossed_axes_bench(distance_mm, baseline_mm);
    let code = Encoding::optimum(36, 912).expect("a valid encoding");
    // Fringe period on the plane that is normal to the projector axis where the axes cross.
    let period_mm = 912.0 / fringes / 1570.0 * distance_mm.hypot(baseline_mm);
    let layout = CrossedAxes::new(distance_mm, baseline_mm, period_mm).expect("valid layout");
    let reference = bench.cast(&Plane::at_z(distance_mm));
    let mut compared = 0;
    for height_mm in [-30.0, 5.0, 40.0, 120.0] {
        let object = bench.cast(&Plane::at_z(distance_mm - height_mm));
        for (on_plane, on_object) in reference.hits().iter().zip(object.hits()) {
            if !on_plane.is_lit(Projector::Visible) || !on_object.is_lit(Projector::Visible) {
                continue;
            }
            let phase = |column_px: f64| code.absolute_phase_rad(column_px);
            let difference_rad = phase(on_object.lit_from_px[0][0]) - phase(on_plane.lit_from_px[0][0]);
            let found = layout.height_from_phase(difference_rad, on_plane.xyz_mm[0]);
            assert!((found - height_mm).abs() < 1e-9, "{found} for {height_mm}");
            compared += 1;
        }
    }
    assert!(compared > 50_000, "{compared}");
    assert!(CrossedAxes::new(-1.0, 1.0, 1.0).is_err());
    assert!((layout.angle_rad() - baseline_mm.atan2(distance_mm)).abs() < 1e-15);
}

#[test]
fn polynomial_from_planes_measures_a_plane_between_them() {
    let bench = crossed_axes_bench(800.0, 200.0);
    let code = Encoding::optimum(36, 912).expect("a valid encoding");
    let phase = |height_mm: f64| bench.cast(&Plane::at_z(800.0 - height_mm)).phase_rad(&code);
    let heights: Vec<f64> = (0..7).map(|i| 10.0 * f64::from(i)).collect();
    let maps: Vec<Array2<f32>> = heights.iter().map(|h| phase(*h)).collect();
    let planes: Vec<_> = heights
        .iter()
        .zip(&maps)
        .map(|(height_mm, map)| HeightPlane { height_mm: *height_mm, phase_rad: map.view() })
        .collect();
    let fitted = PolynomialHeight::fit(maps[0].view(), &planes, 3).expect("enough planes");
    let measured = fitted.height_from_phase(phase(27.5).view()).expect("same size");
    let worst = measured.iter().filter(|h| h.is_finite()).fold(0f32, |w, h| w.max((h - 27.5).abs()));
    assert!(worst < 2e-3, "{worst} mm");
    assert!(measured.iter().filter(|h| h.is_finite()).count() > 10_000);
}

/// Checks both lenses with strong distortion, from 150 mm in front of the reference plane to 150 mm behind it.
#[test]
fn triangulation_is_exact_over_depth_with_both_distortions() {
    let mut bench = crossed_axes_bench(800.0, 230.0);
    bench.camera = bench.camera.with_distortion([-0.25, 0.1, 1e-3, -2e-3, 0.02]).expect("valid");
    bench.visible = bench.visible.with_distortion([-0.2, 0.1, 2e-3, 1e-3, -0.03]).expect("valid");
    let triangulator = Triangulator::new(&bench.camera, &bench.visible).expect("a valid bench");
    let mut worst = 0f64;
    for z_mm in [650.0, 725.0, 800.0, 875.0, 950.0] {
        let cast = bench.cast(&Plane::at_z(z_mm));
        let xyz = triangulator.xyz_mm(cast.column_px(Projector::Visible).view()).expect("same size");
        for (found, expected) in xyz.index_axis(Axis(2), 2).iter().zip(&cast.depth_mm()) {
            if found.is_finite() {
                worst = worst.max(f64::from((found - expected).abs()));
            }
        }
    }
    assert!(worst > 0.0 && worst < 1e-3, "{worst} mm");
}

/// Depth in mm at which the ray of a camera pixel meets the sheet of light of `column`, by the secant method in double
/// precision.
fn depth_mm(bench: &Bench, pixel: [f64; 2], column: f32) -> f64 {
    let ray = bench.camera.ray(pixel);
    let miss = |z_mm: f64| bench.visible.project(ray.at(z_mm)).expect("in front")[0] - f64::from(column);
    let (mut before, mut now) = (790.0, 810.0);
    for _ in 0..20 {
        let slope = (miss(now) - miss(before)) / (now - before);
        if slope == 0.0 || !slope.is_finite() {
            break;
        }
        (before, now) = (now, now - miss(now) / slope);
    }
    now
}

#[test]
fn single_precision_stays_within_a_micrometre_of_double() {
    let plain = Bench::reference();
    let mut bent = Bench::reference();
    bent.camera = bent.camera.with_distortion([-0.25, 0.1, 1e-3, -2e-3, 0.02]).expect("valid");
    bent.visible = bent.visible.with_distortion([-0.2, 0.1, 2e-3, 1e-3, -0.03]).expect("valid");
    for bench in [plain, bent] {
        let triangulator = Triangulator::new(&bench.camera, &bench.visible).expect("a valid bench");
        let (height, width) = triangulator.shape();
        let mut xyz = vec![0.0; 3 * width];
        let mut worst_mm = 0f64;
        for (row, z_mm) in (0..height).step_by(64).zip((650..=950).step_by(25)) {
            let pixel = |x: usize| [x as f64, row as f64];
            let column = |x: usize| bench.visible.project(bench.camera.ray(pixel(x)).at(f64::from(z_mm)));
            let columns: Vec<f32> = (0..width).map(|x| column(x).expect("in front")[0] as f32).collect();
            triangulator.xyz_row(row, &columns, &mut xyz);
            for (x, found) in xyz.chunks_exact(3).enumerate().step_by(7) {
                let expected = bench.camera.ray(pixel(x)).at(depth_mm(&bench, pixel(x), columns[x]));
                let miss = (0..3).map(|i| (f64::from(found[i]) - expected[i]).abs());
                worst_mm = miss.fold(worst_mm, f64::max);
            }
        }
        assert!(worst_mm > 0.0 && worst_mm < 1e-3, "{worst_mm} mm");
    }
}

#[test]
fn triangulation_refuses_pairs_without_depth() {
    let bench = crossed_axes_bench(800.0, 230.0);
    assert!(Triangulator::new(&bench.camera, &bench.camera).is_err());
    assert!(Triangulator::new(&bench.visible, &bench.visible).is_err());
    let above = bench.camera.clone();
    let identity = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let above = above.with_pose(identity, [0.0, 200.0, 0.0]).expect("valid pose");
    assert!(Triangulator::new(&bench.camera, &above).is_err());
    let triangulator = Triangulator::new(&bench.camera, &bench.visible).expect("a valid bench");
    assert!(triangulator.xyz_mm(Array2::zeros((3, 3)).view()).is_err());
}
