//! The stages of the published method, each alone.

use super::code;
use super::devices::bits_of_absolute;
use super::input::Input;
use super::invariants::{all_finite, all_within, bits_of, refused_clearly, same_on_threads};
use ndarray::{Array2, Array3};
use quadfringe::stages::*;

/// A wrapped phase and the error of the coarsest arctangent.
const ANGLE_MAX: f32 = std::f32::consts::PI + 2e-5;

fn sides(input: &mut Input<'_>) -> [usize; 2] {
    [input.below(20), input.below(100)]
}

fn carriers(input: &mut Input<'_>) {
    let shape = sides(input);
    let (red, blue) = (input.map(shape, 0.0, 1.0), input.map(shape, 0.0, 1.0));
    for found in [carrier(red.view()), quadrature_carrier(red.view(), blue.view())] {
        assert!(found.row_px > 0.0 && found.column_px > 0.0 && found.period_px() > 0.0, "{found:?}");
    }
    let period_px = row_period_px(red.view());
    let widest = (shape[1] as f64).max(3.0);
    assert!((3.0..=widest).contains(&period_px), "{period_px} of {shape:?}");
    let other = if input.byte() < 32 { [2, 2] } else { shape };
    let blue = input.map(other, 0.0, 1.0);
    refused_clearly(modulation_ratio(red.view(), blue.view()));
    if let Some(phase) = refused_clearly(two_step(red.view(), blue.view())) {
        all_within("two-step phase", &phase, -ANGLE_MAX, ANGLE_MAX);
    }
    if let Some(phase) = refused_clearly(two_step_coarse(red.view(), blue.view())) {
        all_within("coarse two-step phase", &phase, -ANGLE_MAX, ANGLE_MAX);
    }
    if let Some(found) = refused_clearly(modulation(red.view(), blue.view())) {
        all_within("modulation", &found, 0.0, f32::INFINITY);
    }
}

fn filters(input: &mut Input<'_>) {
    let (shape, period_px) = (sides(input), input.near(2.0, 100.0));
    let image = input.map(shape, 0.0, 1.0);
    let removal = input.one_of(&[Background::MeanEnvelope, Background::MovingMean]);
    let band = input.one_of(&[Band::Improved, Band::Traditional]);
    if let Some(level) = refused_clearly(background(image.view(), removal, period_px)) {
        assert_eq!(level.dim(), image.dim());
    }
    if let Some(phase) = refused_clearly(fourier(image.view(), band, removal, period_px)) {
        all_within("Fourier phase", &phase, -ANGLE_MAX, ANGLE_MAX);
    }
    let columns = if input.byte() < 32 { input.size() } else { input.one_of(&[1, 2, 4]) };
    let width = if input.byte() < 32 { input.below(500) } else { shape[1].saturating_mul(columns).min(400) };
    let means = input.map(shape, -0.5, 0.5);
    let [first, second] =
        [&image, &means].map(|map| Fringes { means: map.view(), period: input.near(3.0, 40.0) });
    let pair = || fourier_pair(first, second, columns, width);
    let bits = |found: &quadfringe::Result<[Demodulated; 2]>| {
        found
            .iter()
            .flatten()
            .flat_map(|half| [bits_of(&half.phase_rad), bits_of(&half.modulation)].concat())
            .collect()
    };
    for half in refused_clearly(same_on_threads(pair, bits)).iter().flatten() {
        assert_eq!(half.phase_rad.dim(), (shape[0], width));
        all_within("modulation of a filtered row", &half.modulation, 0.0, f32::INFINITY);
    }
}

fn blocks(input: &mut Input<'_>) {
    let shape = sides(input);
    let image = input.map(shape, 0.0, 1.0);
    let (rows, columns) = (input.size(), input.size());
    let chosen = Blocks::for_periods(input.any() as f32, input.any() as f32, input.size());
    assert!([1, 2, 4].contains(&chosen.columns));
    for (rows, columns) in [(rows, columns), (chosen.rows, chosen.columns)] {
        if let Some(means) = refused_clearly(block_means(image.view(), rows, columns)) {
            assert_eq!(means.dim(), (shape[0].div_ceil(rows), shape[1] / columns));
            let repeated = repeat_rows(means.view(), rows, shape[0]).expect("one row for each block");
            assert_eq!(repeated.dim(), (shape[0], means.ncols()));
        }
    }
    refused_clearly(repeat_rows(image.view(), rows, if input.flag() { input.size() } else { shape[0] }));
    all_finite("filled gaps", &fill_gaps(image.view()));
    assert!(fill_gaps(image.view()).iter().all(|value| value.is_finite()));
    all_within("probability", &wrong_order_probability(image.view()), 0.0, 1.0);
}

fn orders(input: &mut Input<'_>) {
    let Some(encoding) = code::four_channels(input) else { return };
    let shape = sides(input);
    let mut maps = [(); 3].map(|()| input.map(shape, -3.2, 3.2));
    if input.byte() < 32 {
        maps[1] = Array2::zeros((1, 2));
    }
    let wrapped = Phases::from_array(maps);
    let find = || unwrap(&encoding, wrapped.as_ref().map(|map| map.view()));
    let bits = |found: &quadfringe::Result<Absolute>| found.as_ref().map_or(Vec::new(), bits_of_absolute);
    let Some(found) = refused_clearly(same_on_threads(find, bits)) else { return };
    assert_eq!(found.phase_rad.dim(), (shape[0], shape[1]));
    let limits = Limits { modulation_min: input.any() as f32, quality_min: input.any() as f32 };
    let valid = discard_invalid(&found, input.map(shape, 0.0, 1.0).view(), limits).expect("maps of one size");
    assert_eq!(valid.phase_rad.dim(), (shape[0], shape[1]));
    let columns = columns_from_phase(&encoding, found.phase_rad.view());
    all_within("column", &columns.column_px, -1.5, encoding.projector_width() as f32 + 0.5);
    if let Some(phase) = refused_clearly(nearest_turn(wrapped.quadrature.view(), found.phase_rad.view())) {
        assert_eq!(phase.dim(), found.phase_rad.dim());
    }
    let pixel = [(); 3].map(|()| input.any() as f32);
    if let Some(four) = refused_clearly(encoding.four_channel_view()) {
        let _ = Ladder::new(&four).order(Phases::from_array(pixel));
    }
}

fn steps(input: &mut Input<'_>) {
    let (shape, count) = (sides(input), input.below(8));
    let images: Vec<_> = (0..count).map(|_| input.map(shape, 0.0, 1.0)).collect();
    let mut stack = Array3::zeros((count, shape[0], shape[1]));
    stack.outer_iter_mut().zip(&images).for_each(|(mut step, image)| step.assign(image));
    if let Some(found) = refused_clearly(n_step(stack.view())) {
        all_within("N-step phase", &found.phase_rad, -ANGLE_MAX, ANGLE_MAX);
        all_within("N-step modulation", &found.modulation, 0.0, f32::INFINITY);
    }
}

pub fn run(input: &mut Input<'_>) {
    match input.below(5) {
        0 => carriers(input),
        1 => filters(input),
        2 => blocks(input),
        3 => orders(input),
        _ => steps(input),
    }
}
