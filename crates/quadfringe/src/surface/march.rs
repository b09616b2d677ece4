//! First intersection of a ray with an implicit surface.

use super::Surface;
use super::params::{CLOSED_MM, REFINEMENTS_MAX, STEP_MIN_MM, STEPS_MAX};
use crate::optics::Ray;

/// Distance along the ray at which the value of the surface first is not positive, within the range and the bounds of
/// the surface.
pub(super) fn first_crossing<S: Surface + ?Sized>(surface: &S, ray: &Ray, range_mm: [f64; 2]) -> Option<f64> {
    let [mut t, end] = clip(ray, surface.bounds_mm(), range_mm)?;
    let rate = surface.rate_limit(ray.direction);
    let mut value = surface.value(ray.at(t));
    if value <= 0.0 {
        return Some(t);
    }
    for _ in 0..STEPS_MAX {
        if t >= end {
            break;
        }
        let next = (t + (value / rate).max(STEP_MIN_MM)).min(end);
        let next_value = surface.value(ray.at(next));
        if next_value <= 0.0 {
            return Some(close(surface, ray, [t, next], [value, next_value]));
        }
        (t, value) = (next, next_value);
    }
    None
}

/// The part of the range that lies in the box; `None` if the ray misses the box.
pub(super) fn clip(ray: &Ray, [low, high]: [[f64; 3]; 2], range_mm: [f64; 2]) -> Option<[f64; 2]> {
    let [mut from, mut to] = range_mm;
    for axis in 0..3 {
        let (origin, direction) = (ray.origin_mm[axis], ray.direction[axis]);
        if direction == 0.0 {
            if !(low[axis]..=high[axis]).contains(&origin) {
                return None;
            }
            continue;
        }
        let a = (low[axis] - origin) / direction;
        let b = (high[axis] - origin) / direction;
        from = from.max(a.min(b));
        to = to.min(a.max(b));
    }
    (from <= to && from.is_finite()).then_some([from, to])
}

/// Root in a bracket by the Illinois method, a secant method that keeps the bracket, with bisection as a safeguard.
fn close<S: Surface + ?Sized>(surface: &S, ray: &Ray, bracket: [f64; 2], values: [f64; 2]) -> f64 {
    let ([mut a, mut b], [mut fa, mut fb]) = (bracket, values);
    let mut same_side = 0i32;
    for iteration in 0..REFINEMENTS_MAX {
        if b - a <= CLOSED_MM || fb == 0.0 {
            break;
        }
        let secant = (a * fb - b * fa) / (fb - fa);
        let inside = secant > a && secant < b && iteration % 8 != 7;
        let middle = if inside { secant } else { 0.5 * (a + b) };
        let value = surface.value(ray.at(middle));
        if value > 0.0 {
            (a, fa) = (middle, value);
            if same_side > 0 {
                fb *= 0.5;
            }
            same_side = 1;
        } else {
            (b, fb) = (middle, value);
            if same_side < 0 {
                fa *= 0.5;
            }
            same_side = -1;
        }
    }
    b
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::Peaks;

    /// The ray runs along an endless relief and never leaves its bounds.
    #[test]
    fn a_ray_that_never_arrives_meets_nothing() {
        let ray = Ray { origin_mm: [0.0, 400.0, 799.0], direction: [0.0, 1.0, 0.0] };
        assert_eq!(first_crossing(&Peaks::default(), &ray, [0.0, f64::INFINITY]), None);
    }
}
