//! Small images of one exposure.

use super::input::Input;
use ndarray::{Array2, ArrayView2, s};
use quadfringe::condition::Sample;
use quadfringe::{BayerPattern, Channel, Encoding, Shot};
use std::f64::consts::TAU;

/// Four planes of `shape` in fractions of full scale: fringes of the encoding over a tilted plane with a step, or four
/// maps that have nothing in common.
pub fn planes(input: &mut Input<'_>, encoding: &Encoding, shape: [usize; 2]) -> [Array2<f32>; 4] {
    if input.byte() < 64 {
        return [(); 4].map(|()| input.map(shape, 0.0, 1.0));
    }
    let width = encoding.projector_width() as f64;
    let numbers: Vec<f64> = encoding.channels().iter().map(|channel| channel.fringe_number).collect();
    let period_px = input.within(3.0, 40.0);
    let (start, step) = (input.within(0.0, width), input.within(-0.2, 0.2) * width);
    let (tilt, edge) = (input.within(-1.0, 1.0), input.below(96));
    let (level, amplitude) = (input.within(0.0, 1.0), input.within(0.0, 0.5));
    let noise = input.within(0.0, 0.2) * f64::from(u8::from(input.flag()));
    let mut seed = input.word() | 1;
    let columns_per_px = width / numbers[0] / period_px;
    Channel::ALL.map(|channel| {
        let mut plane = Array2::from_shape_fn(shape, |(y, x)| {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let random = f64::from(seed >> 8) / 16_777_216.0 - 0.5;
            let beyond = if x > edge { step } else { 0.0 };
            let column = start + beyond + columns_per_px * (x as f64 + tilt * y as f64);
            let phase = TAU * numbers[channel.index()] * column / width + channel.shift_rad();
            (level + amplitude * phase.cos() + noise * random) as f32
        });
        if input.byte() < 64 {
            input.spoil(&mut plane);
        }
        plane
    })
}

/// What a shot is made of besides its images.
#[derive(Clone, Copy)]
pub struct Form {
    pattern: Option<BayerPattern>,
    full_scale: Option<f32>,
    reversed: bool,
}

impl Form {
    pub fn of(input: &mut Input<'_>) -> Self {
        let pattern = input.flag().then(|| input.one_of(&BayerPattern::ALL));
        let full_scale = (input.byte() < 64).then(|| input.near(0.0, 70_000.0) as f32);
        Self { pattern, full_scale, reversed: input.flag() }
    }

    /// A shot of planes, or the mosaic of the first of them with the last.
    pub fn shot<T: Sample>(self, planes: &[Array2<T>; 4]) -> quadfringe::Result<Shot<'_, T>> {
        let views = planes.each_ref().map(|plane| self.view(plane));
        let shot = match self.pattern {
            Some(pattern) => Shot::bayer(views[0], pattern, views[3])?,
            None => Shot::new(views)?,
        };
        self.full_scale.map_or(Ok(shot.clone()), |full_scale| shot.with_full_scale(full_scale))
    }

    /// The plane; if reversed, with rows and columns in the opposite order, as a strided view.
    fn view<T>(self, plane: &Array2<T>) -> ArrayView2<'_, T> {
        if self.reversed { plane.slice(s![..;-1, ..;-1]) } else { plane.view() }
    }
}
