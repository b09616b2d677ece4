//! First intersection of a ray with an implicit surface.

use super::blend::{LANES, Lanes};
use super::params::{CLOSED_MM, REFINEMENTS_MAX, STEP_MIN_MM, STEPS_MAX};
use super::{RangedRay, Surface};
use crate::optics::Ray;

/// Distance along the ray at which the value of the surface first is not positive, within the range and the bounds of
/// the surface.
pub(super) fn first_crossing<S: Surface + ?Sized>(surface: &S, ray: &Ray, range_mm: [f64; 2]) -> Option<f64> {
    let range = clip(ray, surface.bounds_mm(), range_mm)?;
    let mut walk = Walk::new(range, surface.rate_limit(ray.direction));
    loop {
        if walk.tell(surface.value(ray.at(walk.at_mm))) {
            return walk.found;
        }
    }
}

/// [`first_crossing`] of many rays with a surface that gives its values at several points at once. `wanted` names the rays;
/// the others keep what `found` says.
pub(super) fn first_crossings<S: Surface>(
    surface: &S,
    values: impl Fn(&[Lanes; 3]) -> Lanes,
    rays: &[RangedRay],
    wanted: impl IntoIterator<Item = usize>,
    found: &mut [Option<f64>],
) {
    let bounds = surface.bounds_mm();
    let mut walks = wanted.into_iter().filter_map(|index| {
        let RangedRay { ray, range_mm } = &rays[index];
        Some((index, Walk::new(clip(ray, bounds, *range_mm)?, surface.rate_limit(ray.direction))))
    });
    // An empty lane keeps its last point; its value is not used.
    let mut points = [[0.0; LANES]; 3];
    let mut lanes: [Option<(usize, Walk)>; LANES] = std::array::from_fn(|_| walks.next());
    while lanes.iter().any(Option::is_some) {
        for (lane, (index, walk)) in
            lanes.iter().enumerate().filter_map(|(i, lane)| Some((i, lane.as_ref()?)))
        {
            let point = rays[*index].ray.at(walk.at_mm);
            (0..3).for_each(|axis| points[axis][lane] = point[axis]);
        }
        let values = values(&points);
        for (lane, value) in lanes.iter_mut().zip(values) {
            if let Some((index, walk)) = lane
                && walk.tell(value)
            {
                found[*index] = walk.found;
                *lane = walks.next();
            }
        }
    }
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

/// The search for a crossing on one ray: a march, and then a bracket that closes. Whoever holds it evaluates the surface at
/// `at_mm` and tells the value, until the search has ended.
struct Walk {
    at_mm: f64,
    end_mm: f64,
    /// Greatest change of the value per mm along the ray.
    rate: f64,
    steps_left: usize,
    /// The bracket, once there is one: the last point outside the surface, the first one inside, and their values.
    ends_mm: [f64; 2],
    values: [f64; 2],
    is_closing: bool,
    same_side: i32,
    iteration: usize,
    found: Option<f64>,
}

impl Walk {
    fn new([start_mm, end_mm]: [f64; 2], rate: f64) -> Self {
        Self {
            at_mm: start_mm,
            end_mm,
            rate,
            steps_left: STEPS_MAX,
            ends_mm: [f64::NAN; 2],
            values: [f64::NAN; 2],
            is_closing: false,
            same_side: 0,
            iteration: 0,
            found: None,
        }
    }

    /// Takes the value at `at_mm`; moves `at_mm`, or returns `true` when the search has ended.
    #[inline]
    fn tell(&mut self, value: f64) -> bool {
        if self.is_closing {
            self.narrow(value);
            return self.close();
        }
        if value <= 0.0 {
            if self.steps_left == STEPS_MAX {
                self.found = Some(self.at_mm);
                return true;
            }
            (self.ends_mm[1], self.values[1], self.is_closing) = (self.at_mm, value, true);
            return self.close();
        }
        if self.steps_left == 0 || self.at_mm >= self.end_mm {
            return true;
        }
        self.steps_left -= 1;
        (self.ends_mm[0], self.values[0]) = (self.at_mm, value);
        self.at_mm = (self.at_mm + (value / self.rate).max(STEP_MIN_MM)).min(self.end_mm);
        false
    }

    /// Root in a bracket by the Illinois method, a secant method that keeps the bracket, with bisection as a safeguard.
    fn close(&mut self) -> bool {
        let ([a, b], [fa, fb]) = (self.ends_mm, self.values);
        if self.iteration == REFINEMENTS_MAX || b - a <= CLOSED_MM || fb == 0.0 {
            self.found = Some(b);
            return true;
        }
        let secant = (a * fb - b * fa) / (fb - fa);
        let inside = secant > a && secant < b && self.iteration % 8 != 7;
        self.at_mm = if inside { secant } else { 0.5 * (a + b) };
        false
    }

    fn narrow(&mut self, value: f64) {
        // The end that moves; the value at the other one is halved if it stays twice.
        let moved = usize::from(value <= 0.0 || value.is_nan());
        let side = [1, -1][moved];
        (self.ends_mm[moved], self.values[moved]) = (self.at_mm, value);
        if self.same_side == side {
            self.values[1 - moved] *= 0.5;
        }
        self.same_side = side;
        self.iteration += 1;
    }
}

#[cfg(test)]
mod tests {
    use crate::surface::Peaks;

    use super::*;

    /// The ray runs along an endless relief and never leaves its bounds.
    #[test]
    fn a_ray_that_never_arrives_meets_nothing() {
        let ray = Ray { origin_mm: [0.0, 400.0, 799.0], direction: [0.0, 1.0, 0.0] };
        assert_eq!(first_crossing(&Peaks::default(), &ray, [0.0, f64::INFINITY]), None);
    }
}
