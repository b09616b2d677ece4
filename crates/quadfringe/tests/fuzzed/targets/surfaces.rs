//! Surfaces and the rays that meet them.

use super::input::Input;
use super::invariants::refused_clearly;
use ndarray::Array2;
use quadfringe::optics::{Pose, Ray, rotation_from_vector};
use quadfringe::surface::*;

/// A surface of numbers that are usual most of the time.
pub fn surface(input: &mut Input<'_>) -> Option<Box<dyn Surface>> {
    let body: Box<dyn Surface> = match input.below(9) {
        0 => refused_clearly(scene(input.one_of(&SCENES), input.near(-10.0, 10.0)))?,
        1 => Box::new(refused_clearly(Plane::new(input.all_near(-50.0, 900.0), input.all_near(-1.0, 1.0)))?),
        2 => Box::new(refused_clearly(Sphere::new(input.all_near(-50.0, 900.0), input.near(0.0, 100.0)))?),
        3 => {
            Box::new(refused_clearly(Cuboid::new(input.all_near(-50.0, 700.0), input.all_near(0.0, 900.0)))?)
        }
        4 => Box::new(refused_clearly(Peaks::new(input.near(300.0, 900.0), input.near(0.0, 10.0)))?),
        5 => Box::new(Face::new(input.all_near(-50.0, 900.0))),
        6 => Box::new(refused_clearly(Hand::at(input.any()))?),
        7 => Box::new(Plane::at_z(input.near(100.0, 900.0))),
        _ => Box::new(relief(input)?),
    };
    match input.below(6) {
        0 => Some(Box::new(Posed::new(body, pose(input)?))),
        1 => Some(Box::new(refused_clearly(plate(input))?)),
        2 => Some(Box::new(Union(vec![Box::new(Plane::at_z(800.0)), body]))),
        _ => Some(body),
    }
}

pub fn pose(input: &mut Input<'_>) -> Option<Pose> {
    let rotation = rotation_from_vector(input.all_near(-0.5, 0.5));
    let [x, y] = input.all_near(-50.0, 50.0);
    refused_clearly(Pose::new(rotation, [x, y, input.near(500.0, 900.0)]))
}

fn plate(input: &mut Input<'_>) -> quadfringe::Result<Posed> {
    let pose = pose(input).unwrap_or(Pose::new(rotation_from_vector([0.0; 3]), [0.0; 3])?);
    Posed::plate(input.all_near(-50.0, 10.0), input.all_near(0.0, 50.0), pose)
}

fn relief(input: &mut Input<'_>) -> Option<HeightMap> {
    let shape = [input.below(12), input.below(12)];
    let heights: Array2<f64> = input.map(shape, 0.0, 40.0).mapv(f64::from);
    let (origin_mm, pitch_mm) = (input.all_near(-100.0, 0.0), input.all_near(0.0, 30.0));
    let kind = input.one_of(&[Interpolation::Bilinear, Interpolation::Bicubic]);
    refused_clearly(HeightMap::new(heights, origin_mm, pitch_mm, input.near(300.0, 900.0), kind))
}

pub fn run(input: &mut Input<'_>) {
    let Some(surface) = surface(input) else { return };
    for _ in 0..4 {
        let direction: [f64; 3] = input.all_near(-1.0, 1.0);
        let length = direction.iter().map(|c| c * c).sum::<f64>().sqrt();
        let ray = Ray { origin_mm: input.all_near(-50.0, 50.0), direction: direction.map(|c| c / length) };
        let range_mm = if input.flag() {
            [0.0, f64::INFINITY]
        } else {
            [input.near(-10.0, 10.0), input.near(0.0, 2000.0)]
        };
        let found = surface.hit(&ray, range_mm);
        assert_eq!(found, surface.hit(&ray, range_mm));
        if let Some(t) = found.filter(|_| range_mm.iter().all(|end| !end.is_nan())) {
            assert!(t >= range_mm[0] && t <= range_mm[1], "{t} is not in {range_mm:?}");
            let _ = surface.normal(ray.at(t));
        }
        let _ = (surface.value(ray.at(input.near(0.0, 1000.0))), surface.rate_limit(ray.direction));
    }
}
