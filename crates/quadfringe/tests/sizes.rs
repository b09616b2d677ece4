//! Images of any size with fringes of any width. The coarse level has one pixel for one, four or sixteen pixels.

mod common;

use common::decode_planes;
use ndarray::{Array2, s};
use quadfringe::encoding::pattern;
use quadfringe::rig::Planes;
use quadfringe::{Channel, Decoder, DmdLayout, Encoding, Method, Options};
use std::f64::consts::TAU;

/// Images of a camera that sees the projector columns one to one, except that from column `step` on it sees `shift`
/// columns further.
fn images(code: &Encoding, shape: [usize; 2], step: usize, shift: usize) -> [Array2<f32>; 4] {
    seen(code, shape, move |_, x| (if x < step { x } else { x + shift }) as f64)
}

/// Images of a camera whose pixel `(y, x)` sees column `source(y, x)`.
fn seen(code: &Encoding, shape: [usize; 2], source: impl Fn(usize, usize) -> f64) -> [Array2<f32>; 4] {
    Channel::ALL.map(|channel| {
        let image = pattern(&code.channels()[channel.index()], [912, 1], DmdLayout::Regular);
        Array2::from_shape_fn(shape, |(y, x)| {
            let column = source(y, x);
            let (left, part) = (column as usize, column.fract() as f32);
            let right = (left + 1).min(image.ncols() - 1);
            0.1 + 0.8 * (image[[0, left]] * (1.0 - part) + image[[0, right]] * part)
        })
    })
}

/// Decodes the images of [`seen`] by both methods. Every pixel that is more than `border` from the left and right sides must have
/// its column. Near the border, less than a fringe determines the background, so larger errors are allowed.
fn columns_come_back(
    numbers: [f64; 3],
    shape: [usize; 2],
    border: usize,
    source: impl Fn(usize, usize) -> f64,
) {
    let code = Encoding::four_channel(numbers, 912).expect("valid");
    let images = Planes::F32(seen(&code, shape, &source));
    for method in [Method::joint(), Method::published()] {
        let name = method.name();
        let options = Options::default().with_method(method);
        let mut decoder = Decoder::builder(&code, shape).options(options).build().expect("valid");
        let phase = decode_planes(&mut decoder, &images).expect("valid shot").phase_rad;
        let (mut returned, mut worst) = (0, [0.0f64; 2]);
        for ((y, x), phase) in phase.indexed_iter().filter(|(_, phase)| phase.is_finite()) {
            let error = f64::from(*phase) - TAU * numbers[0] * source(y, x) / 912.0;
            let inside = usize::from(x.min(shape[1] - 1 - x) > border);
            worst[inside] = worst[inside].max(error.abs());
            returned += 1;
        }
        let share = f64::from(returned) / phase.len() as f64;
        println!("{name} {shape:?}: {share:.4} returned, worst {worst:.4?} rad at the border and inside");
        assert!(share > 0.96, "{name} {shape:?}: {share}");
        assert!(worst[0] < 0.3 && worst[1] < 0.05, "{name} {shape:?}: {worst:?}");
    }
}

#[test]
fn every_size_and_period_gives_every_pixel_its_column() {
    // Fringes of 14, 29 and 59 pixels, and sizes that are not multiples of a factor of the pyramid.
    for numbers in [[64.0, 63.0, 56.0], [31.0, 30.0, 26.0], [15.5, 14.5, 12.0]] {
        let code = Encoding::four_channel(numbers, 912).expect("valid");
        for shape in [[97, 601], [130, 643], [163, 702]] {
            let (step, shift) = (301, 101);
            let images = images(&code, shape, step, shift);
            let mut decoder = Decoder::builder(&code, shape).build().expect("valid");
            let phase = decode_planes(&mut decoder, &Planes::F32(images)).expect("valid shot").phase_rad;
            let (mut returned, mut worst) = (0, [0.0f64; 2]);
            for ((_, x), phase) in phase.indexed_iter().filter(|(_, phase)| phase.is_finite()) {
                let column = if x < step { x } else { x + shift };
                let error = f64::from(*phase) - TAU * numbers[0] * column as f64 / 912.0;
                // Inside means a fringe away from the sides. Next to the step, pixels of both of its sides are
                // averaged.
                let inside = usize::from(x.min(shape[1] - 1 - x) as f64 > 912.0 / numbers[0]);
                let weight = if x.abs_diff(step) > 8 { 1.0 } else { 0.1 };
                worst[inside] = worst[inside].max(weight * error.abs());
                returned += 1;
            }
            let share = f64::from(returned) / phase.len() as f64;
            println!(
                "{numbers:?} {shape:?}: {share:.4} returned, worst {worst:.4?} rad at the sides and inside"
            );
            assert!(share > 0.96, "{numbers:?} {shape:?}: {share}");
            assert!(worst[0] < 0.1 && worst[1] < 0.05, "{numbers:?} {shape:?}: {worst:?}");
        }
    }
}

/// Cameras with many pixels see fringes that are a hundred pixels wide and more.
#[test]
fn wide_fringes_give_every_pixel_its_column() {
    // Fringes of 118, 177, 235 and 353 pixels.
    for (times, shape) in [(2, [401, 1501]), (3, [500, 1999]), (4, [510, 2101]), (6, [643, 3203])] {
        columns_come_back([15.5, 14.5, 12.0], shape, 59 * times, |_, x| 20.0 + x as f64 / times as f64);
    }
}

/// With a camera that is rotated about its axis, or a surface that slopes down the rows, neighbouring rows have different phases.
/// The means of the published method over rows must not lose the order then.
#[test]
fn inclined_fringes_give_every_pixel_its_column() {
    for (slope, first) in [(-1.0, 140.0), (0.5, 10.0), (2.0, 10.0)] {
        println!("slope {slope}");
        let source = |y: usize, x: usize| first + x as f64 + slope * y as f64;
        columns_come_back([31.0, 30.0, 26.0], [121, 643], 30, source);
    }
}

#[test]
fn the_border_is_measured_too() {
    let code = Encoding::four_channel([31.0, 30.0, 26.0], 912).expect("valid");
    let shape = [131, 643];
    let images = images(&code, shape, 643, 0);
    let mut decoder = Decoder::builder(&code, shape).build().expect("valid");
    let phase = decode_planes(&mut decoder, &Planes::F32(images)).expect("valid shot").phase_rad;
    for row in [phase.slice(s![0, ..]), phase.slice(s![130, ..])] {
        assert!(row.iter().filter(|phase| phase.is_finite()).count() > 630);
    }
    for column in [phase.slice(s![.., 0]), phase.slice(s![.., 642])] {
        assert!(column.iter().filter(|phase| phase.is_finite()).count() > 125);
    }
}
