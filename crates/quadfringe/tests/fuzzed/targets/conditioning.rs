//! Responses, crosstalk, registration and the estimates of responses.

use super::code;
use super::input::Input;
use super::invariants::refused_clearly;
use super::shots::{Form, planes};
use ndarray::{Array3, Axis};
use quadfringe::condition::{ResponseEstimate, estimate_response, estimate_response_of_shot, linearise};
use quadfringe::{Conditioner, Response};

pub fn response(input: &mut Input<'_>) -> Response {
    let [offset, exponent, knee] =
        [(0.0, 0.5), (0.05, 5.0), (0.0, 0.98)].map(|(from, to)| input.near(from, to) as f32);
    Response { offset, exponent, knee }
}

/// A conditioner with numbers that are in their ranges most of the time.
pub fn conditioner(input: &mut Input<'_>) -> Conditioner {
    let mut conditioner = Conditioner::default();
    if input.flag() {
        conditioner = conditioner.with_dark(input.singles_near(0.0, 0.2));
    }
    if input.flag() {
        conditioner = conditioner.with_response([(); 4].map(|()| response(input)));
    }
    if input.flag() {
        let mut crosstalk = conditioner.crosstalk;
        crosstalk.iter_mut().flatten().for_each(|share| *share += input.near(-0.2, 0.2));
        conditioner = conditioner.with_crosstalk(crosstalk);
    }
    if input.flag() {
        conditioner = conditioner.with_projector_response([(); 4].map(|()| response(input)));
    }
    if input.flag() {
        let [a, b, c, d] = input.all_near(-0.1, 0.1);
        let [x, y] = input.all_near(-60.0, 60.0);
        conditioner = conditioner.with_ir_registration([[1.0 + a, b, x], [c, 1.0 + d, y]]);
    }
    conditioner
}

fn linear_light(input: &mut Input<'_>) {
    let Some(encoding) = code::four_channels(input) else { return };
    let shape = [1 + input.below(48), 1 + input.below(48)];
    let (conditioner, form, images) = (conditioner(input), Form::of(input), planes(input, &encoding, shape));
    let bytes = images.each_ref().map(|plane| plane.mapv(|light| (light * 255.0) as u8));
    if let Some(shot) = refused_clearly(form.shot(&bytes)) {
        check_planes(refused_clearly(linearise(&shot, &conditioner)), shape);
    }
    if let Some(shot) = refused_clearly(form.shot(&images)) {
        check_planes(refused_clearly(linearise(&shot, &conditioner)), shape);
    }
}

fn check_planes(planes: Option<[ndarray::Array2<f32>; 4]>, [rows, columns]: [usize; 2]) {
    for plane in planes.iter().flatten() {
        assert_eq!(plane.dim(), (rows, columns));
    }
}

/// Phase steps of ripples, bent by a power, with enough pixels for an estimate.
fn stack(input: &mut Input<'_>) -> Array3<f32> {
    let (steps, power) = (input.below(10), input.within(0.2, 3.0) as f32);
    let (level, amplitude, shape) = (input.within(0.0, 1.0), input.within(0.0, 0.5), (steps, 36, 36));
    let mut stack = Array3::from_shape_fn(shape, |(s, y, x)| {
        let phase = 0.3 * x as f64 + 0.05 * y as f64 + std::f64::consts::TAU * s as f64 / steps as f64;
        ((level + amplitude * phase.cos()).clamp(0.0, 1.0) as f32).powf(power)
    });
    if steps > 0 && input.flag() {
        let mut step = stack.index_axis(Axis(0), 0).to_owned();
        input.spoil(&mut step);
        stack.index_axis_mut(Axis(0), 0).assign(&step);
    }
    stack
}

fn check_estimate(found: &ResponseEstimate) {
    found.response.check("estimate", "R").expect("an estimate is a response");
    assert!(found.two_step_rms_before_rad.is_finite() && found.two_step_rms_after_rad.is_finite());
}

fn estimates(input: &mut Input<'_>) {
    let stacks: Vec<_> = (0..input.below(3)).map(|_| stack(input)).collect();
    let views: Vec<_> = stacks.iter().map(|stack| stack.view()).collect();
    if let Some(found) = refused_clearly(estimate_response(&views)) {
        check_estimate(&found);
    }
}

fn estimates_of_a_shot(input: &mut Input<'_>) {
    let Some(encoding) = code::four_channels(input) else { return };
    let shape = [1 + input.below(120), 1 + input.below(200)];
    let (light, phase) = (planes(input, &encoding, shape), input.map(shape, 0.0, 200.0));
    let views = light.each_ref().map(|plane| plane.view());
    let found = refused_clearly(estimate_response_of_shot(views, phase.view(), &encoding));
    found.iter().flatten().flatten().for_each(check_estimate);
}

pub fn run(input: &mut Input<'_>) {
    match input.below(4) {
        0 => estimates(input),
        1 => estimates_of_a_shot(input),
        2 => {
            let response = response(input);
            if refused_clearly(response.check("response", "R")).is_some() {
                let light = response.linear(input.within(-0.5, 1.5) as f32);
                assert!(light.is_finite() && light >= -0.5, "{response:?} gives {light}");
            }
        }
        _ => linear_light(input),
    }
}
