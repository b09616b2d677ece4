//! Cameras and projectors, points from columns, tables of a calibrated pair, heights.

use super::code;
use super::input::Input;
use super::invariants::{all_finite, all_within, bits_of, refused_clearly, same_on_threads};
use ndarray::Array3;
use quadfringe::height::{CrossedAxes, HeightPlane, PairTable, PolynomialHeight, Triangulator};
use quadfringe::optics::{Pose, ProjectorPair, rotation_from_vector};
use quadfringe::stages::Phases;
use quadfringe::{Device, Encoding};

/// A camera at the origin with this size, most often a usual one.
pub fn camera_of(input: &mut Input<'_>, [rows, columns]: [usize; 2]) -> Device {
    let focal_px = input.all_near(20.0, 4000.0);
    let centre_px = [columns, rows].map(|side| input.near(-5.0, side as f64 + 5.0));
    let camera = refused_clearly(Device::pinhole(columns, rows, focal_px, centre_px));
    let camera =
        camera.unwrap_or_else(|| Device::pinhole(columns, rows, [100.0; 2], [0.0; 2]).expect("usual"));
    distorted(input, camera)
}

fn distorted(input: &mut Input<'_>, device: Device) -> Device {
    if input.byte() < 128 {
        return device;
    }
    let distortion = input.all_near(-0.5, 0.5);
    refused_clearly(device.clone().with_distortion(distortion)).unwrap_or(device)
}

/// A projector with as many columns as the encoding, to the side of the camera.
pub fn projector(input: &mut Input<'_>, encoding: &Encoding) -> Device {
    let (width, height) = (encoding.projector_width(), 1 + input.below(40));
    let centre_px = [0.5 * width as f64, 0.5 * height as f64];
    let focal_px = input.all_near(0.5 * width as f64, 3.0 * width as f64);
    let device = refused_clearly(Device::pinhole(width, height, focal_px, centre_px));
    let device =
        device.unwrap_or_else(|| Device::pinhole(width, height, [1000.0; 2], centre_px).expect("usual"));
    let rotation = rotation_from_vector(input.all_near(-0.5, 0.5));
    let translation_mm = [input.near(-300.0, 300.0), input.near(-30.0, 30.0), input.near(-300.0, 300.0)];
    let posed = refused_clearly(device.clone().with_pose(rotation, translation_mm));
    distorted(input, posed.unwrap_or(device))
}

/// Two projectors in front of a camera of this size.
pub fn pair_table(input: &mut Input<'_>, encoding: &Encoding, shape: [usize; 2]) -> Option<PairTable> {
    let camera = camera_of(input, shape);
    let visible = projector(input, encoding);
    let infrared = if input.flag() { visible.clone() } else { projector(input, encoding) };
    let mut pair = ProjectorPair::new(visible, infrared);
    if input.byte() < 64 {
        pair = refused_clearly(pair.clone().predeformed(input.near(1.0, 2000.0))).unwrap_or(pair);
    }
    let range_mm = input.flag().then(|| [input.near(0.0, 500.0), input.near(500.0, 5000.0)]);
    refused_clearly(PairTable::new(&camera, &pair, encoding, range_mm))
}

fn rays_and_pixels(input: &mut Input<'_>) {
    let size = if input.flag() { [input.size(), input.size()] } else { [64, 48] };
    let (focal_px, centre_px) = (input.all_near(1.0, 4000.0), input.all_near(-100.0, 1000.0));
    let pose = [input.all_near(-1.0, 1.0), input.all_near(-500.0, 500.0)];
    let device = Device::new(
        size[0],
        size[1],
        focal_px,
        centre_px,
        input.all_near(-1.0, 1.0),
        rotation_from_vector(pose[0]),
        pose[1],
    );
    let Some(device) = refused_clearly(device) else { return };
    let other = camera_of(input, [10, 10]);
    let (pixel, point_mm) = (input.all_near(-10.0, 70.0), input.all_near(-1000.0, 1000.0));
    let ray = device.ray(pixel);
    let holes = ray.direction.iter().filter(|c| c.is_nan()).count();
    assert!(holes == 0 || holes == 3, "part of a direction: {ray:?}");
    let _ =
        (device.project(point_mm), device.contains(pixel), device.distort(pixel), device.undistort(pixel));
    let _ = device.through_plane(pixel, &other, input.near(1.0, 1000.0));
    if let Some(pair) =
        refused_clearly(ProjectorPair::new(device, other).predeformed(input.near(1.0, 1000.0)))
    {
        let _ = pair.infrared_turns(point_mm);
    }
    if let Some(pose) = refused_clearly(Pose::new(rotation_from_vector(pose[0]), pose[1])) {
        let there = pose.camera_from_body(point_mm);
        let _ = (
            pose.body_from_camera(there),
            pose.body_from_direction(there),
            pose.camera_from_direction(there),
        );
    }
}

fn points(input: &mut Input<'_>) {
    let Some(encoding) = code::four_channels(input) else { return };
    let shape = [1 + input.below(20), 1 + input.below(48)];
    let camera = camera_of(input, shape);
    let projector = projector(input, &encoding);
    let Some(triangulator) = refused_clearly(Triangulator::new(&camera, &projector)) else { return };
    let columns = input.map(shape, 0.0, encoding.projector_width() as f64);
    let xyz =
        same_on_threads(|| triangulator.xyz_mm(columns.view()).expect("the size of the camera"), bits_of);
    for (point, column) in xyz.lanes(ndarray::Axis(2)).into_iter().zip(&columns) {
        all_finite("point", point);
        assert!(point[2].is_nan() || (point[2] > 0.0 && !column.is_nan()), "{point} of column {column}");
    }
    let mut sigma: Vec<f32> = columns.row(0).iter().map(|_| input.within(0.0, 2.0) as f32).collect();
    triangulator.depth_uncertainty_row(0, &columns.row(0).to_vec(), &mut sigma);
    all_within("uncertainty of the depth", &sigma, 0.0, f32::INFINITY);
    refused_clearly(triangulator.xyz_mm(input.map([3, 4], 0.0, 1.0).view()));
}

fn pairs(input: &mut Input<'_>) {
    let Some(encoding) = code::four_channels(input) else { return };
    let shape = [1 + input.below(12), 1 + input.below(80)];
    let Some(table) = pair_table(input, &encoding, shape) else { return };
    let phase = input.map(shape, 0.0, 226.0);
    assert_eq!(table.infrared_rad(phase.view()).expect("the size of the camera").dim(), phase.dim());
    let rows = if input.byte() < 32 { input.size() } else { 1 + input.below(4) };
    let blocks = shape[0].div_ceil(rows.max(1));
    let wrapped = Phases::from_array([(); 3].map(|()| input.map([blocks, shape[1]], -3.2, 3.2)));
    let unwrap = || table.unwrap_blocks(wrapped.as_ref().map(|map| map.view()), rows);
    let bits = |found: &quadfringe::Result<_>| found.as_ref().map_or(Vec::new(), bits_of_absolute);
    if let Some(found) = refused_clearly(same_on_threads(unwrap, bits)) {
        all_finite("phase along the ray", &found.phase_rad);
        all_within("margin along the ray", &found.margin, 0.0, 1.0);
    }
}

pub fn bits_of_absolute(found: &quadfringe::stages::Absolute) -> Vec<u32> {
    [bits_of(&found.phase_rad), bits_of(&found.margin)].concat()
}

fn heights(input: &mut Input<'_>) {
    let lengths: [f64; 3] = input.all_near(1.0, 1000.0);
    if let Some(axes) = refused_clearly(CrossedAxes::new(lengths[0], lengths[1], lengths[2])) {
        let (phase, x_mm) = (input.near(-10.0, 10.0), input.near(-100.0, 100.0));
        let _ = (axes.height_from_phase(phase, x_mm), axes.phase_from_height(phase, x_mm));
        assert!(axes.angle_rad().is_finite() && axes.height_from_phase(0.0, x_mm) == 0.0);
    }
    let shape = [input.below(6), input.below(9)];
    let reference = input.map(shape, 0.0, 100.0);
    let maps: Vec<_> =
        (0..input.below(6)).map(|_| (input.near(0.0, 50.0), input.map(shape, 0.0, 100.0))).collect();
    let planes: Vec<_> = maps
        .iter()
        .map(|(height_mm, map)| HeightPlane { height_mm: *height_mm, phase_rad: map.view() })
        .collect();
    let fitted =
        PolynomialHeight::fit(reference.view(), &planes, if input.flag() { input.size() } else { 2 });
    if let Some(fitted) = refused_clearly(fitted) {
        let height = fitted.height_from_phase(reference.view()).expect("the size of the reference");
        assert_eq!(height.dim(), reference.dim());
    }
    let terms = Array3::from_elem((shape[0], shape[1], input.below(10)), input.any());
    if let Some(restored) = refused_clearly(PolynomialHeight::from_coefficients(reference.clone(), terms)) {
        refused_clearly(restored.height_from_phase(input.map([2, 3], 0.0, 10.0).view()));
    }
}

pub fn run(input: &mut Input<'_>) {
    match input.below(4) {
        0 => rays_and_pixels(input),
        1 => points(input),
        2 => pairs(input),
        _ => heights(input),
    }
}
