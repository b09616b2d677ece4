//! The measured object: implicit surfaces in the camera frame, composed without a mesh.
//!
//! A [`Surface`] is a function that is positive in free space and negative inside the body (S9). Rays meet boxes,
//! spheres and planes in closed form. For all others they march in steps that cannot pass the surface, and then close a
//! bracket around the crossing to far below 1e-6 mm. [`scene`] returns ready scenes near z = 800 mm by name.

mod blend;
mod cells;
mod face;
mod hand;
mod march;
mod params;
mod peaks;
mod posed;
mod relief;
mod solids;

pub use face::Face;
pub use hand::Hand;
pub use peaks::Peaks;
pub use posed::Posed;
pub use relief::{HeightMap, Interpolation};
pub use solids::{Cuboid, Plane, Sphere};

use crate::error::{Error, Result};
use crate::optics::Ray;
use blend::{LANES, Lanes};
use params::NORMAL_STEP_MM;

/// Distance of the reference plane of the ready scenes from the camera, mm.
pub const REFERENCE_Z_MM: f64 = 800.0;

/// Names that [`scene`] accepts.
pub const SCENES: [&str; 6] = ["plane", "peaks", "steps", "sphere", "face", "hand"];

/// A ray, and the part of it that counts.
///
/// ```
/// use quadfringe::{optics::Ray, surface::{Plane, RangedRay, Surface}};
/// let ray = Ray { origin_mm: [0.0; 3], direction: [0.0, 0.0, 1.0] };
/// let rays = [[0.0, 900.0], [0.0, 700.0]].map(|range_mm| RangedRay { ray, range_mm });
/// assert_eq!(Plane::at_z(800.0).hit_all(&rays), [Some(800.0), None]);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RangedRay {
    /// The ray.
    pub ray: Ray,
    /// Least and greatest distance from its origin, mm.
    pub range_mm: [f64; 2],
}

/// A body bounded by an implicit surface.
///
/// ```
/// use quadfringe::{optics::Ray, surface::Surface};
/// /// An endless rod along y.
/// #[derive(Debug)]
/// struct Rod;
/// impl Surface for Rod {
///     fn value(&self, [x, _, z]: [f64; 3]) -> f64 {
///         x.hypot(z - 800.0) - 10.0
///     }
///     fn bounds_mm(&self) -> [[f64; 3]; 2] {
///         [[-10.0, f64::NEG_INFINITY, 790.0], [10.0, f64::INFINITY, 810.0]]
///     }
/// }
/// let ray = Ray { origin_mm: [0.0; 3], direction: [0.0, 0.0, 1.0] };
/// let t = Rod.hit(&ray, [0.0, f64::INFINITY]).expect("straight ahead");
/// assert!((t - 790.0).abs() < 1e-9);
/// ```
pub trait Surface: Send + Sync + std::fmt::Debug {
    /// Value at a point of the camera frame in mm: positive in free space, zero on the surface, negative inside.
    fn value(&self, p_mm: [f64; 3]) -> f64;

    /// Least and greatest corner of a box that contains the surface, mm; infinite where the surface has no end.
    fn bounds_mm(&self) -> [[f64; 3]; 2];

    /// A value that costs less than [`Surface::value`] at a point and is not greater; without one, minus infinity.
    fn value_floor(&self, _p_mm: [f64; 3]) -> f64 {
        f64::NEG_INFINITY
    }

    /// Upper bound of the change of [`Surface::value`] per mm along a unit direction; 1 for distance functions.
    fn rate_limit(&self, _direction: [f64; 3]) -> f64 {
        1.0
    }

    /// Distance in mm along the ray, within `[from, to]`, at which it enters the body; `None` when it stays outside.
    fn hit(&self, ray: &Ray, range_mm: [f64; 2]) -> Option<f64> {
        march::first_crossing(self, ray, range_mm)
    }

    /// [`Surface::hit`] of many rays, with the same results.
    fn hit_all(&self, rays: &[RangedRay]) -> Vec<Option<f64>> {
        rays.iter().map(|RangedRay { ray, range_mm }| self.hit(ray, *range_mm)).collect()
    }

    /// Unit normal at a point of the surface, into free space.
    fn normal(&self, p_mm: [f64; 3]) -> [f64; 3] {
        let slope = std::array::from_fn(|axis| {
            let at = |step: f64| {
                let mut p = p_mm;
                p[axis] += step;
                self.value(p)
            };
            at(NORMAL_STEP_MM) - at(-NORMAL_STEP_MM)
        });
        unit(slope)
    }
}

/// Several bodies as one. A ray hits the nearest of them.
///
/// ```
/// use quadfringe::surface::{Plane, Sphere, Surface, Union};
/// let scene = Union(vec![Box::new(Plane::at_z(800.0)), Box::new(Sphere::new([0.0, 0.0, 750.0], 30.0)?)]);
/// assert_eq!(scene.value([0.0, 0.0, 700.0]), 20.0);
/// # Ok::<(), quadfringe::error::Error>(())
/// ```
#[derive(Debug)]
pub struct Union(pub Vec<Box<dyn Surface>>);

impl Surface for Union {
    fn value(&self, p_mm: [f64; 3]) -> f64 {
        self.0.iter().fold(f64::INFINITY, |least, body| least.min(body.value(p_mm)))
    }

    fn bounds_mm(&self) -> [[f64; 3]; 2] {
        let nothing = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
        self.0.iter().fold(nothing, |[low, high], body| {
            let [l, h] = body.bounds_mm();
            [std::array::from_fn(|i| low[i].min(l[i])), std::array::from_fn(|i| high[i].max(h[i]))]
        })
    }

    fn rate_limit(&self, direction: [f64; 3]) -> f64 {
        self.0.iter().fold(0.0, |most, body| most.max(body.rate_limit(direction)))
    }

    fn hit(&self, ray: &Ray, [from, to]: [f64; 2]) -> Option<f64> {
        let mut nearest = None;
        for body in &self.0 {
            nearest = body.hit(ray, [from, nearest.unwrap_or(to)]).or(nearest);
        }
        nearest
    }

    fn hit_all(&self, rays: &[RangedRay]) -> Vec<Option<f64>> {
        let mut nearest = vec![None; rays.len()];
        let mut rays = rays.to_vec();
        for body in &self.0 {
            let hits = body.hit_all(&rays);
            for ((nearest, ray), found) in nearest.iter_mut().zip(&mut rays).zip(hits) {
                if let Some(t) = found {
                    (*nearest, ray.range_mm[1]) = (found, t);
                }
            }
        }
        nearest
    }

    fn normal(&self, p_mm: [f64; 3]) -> [f64; 3] {
        let mut nearest: Option<(f64, &dyn Surface)> = None;
        for body in &self.0 {
            if nearest.is_some_and(|(least, _)| body.value_floor(p_mm) > least) {
                continue;
            }
            let value = body.value(p_mm);
            if nearest.is_none_or(|(least, _)| value.total_cmp(&least).is_lt()) {
                nearest = Some((value, body.as_ref()));
            }
        }
        nearest.map_or([f64::NAN; 3], |(_, body)| body.normal(p_mm))
    }
}

/// A ready scene near z = 800 mm, seen whole by the reference bench.
///
/// `plane`: z = 800. `peaks`: the peaks function, 40 mm from peak to valley. `steps`: twelve blocks of 5 to 50 mm with
/// vertical walls on the plane. `sphere`: radius 34 mm, in front of the plane. `face`: a mask 140 x 190 mm on the plane.
/// `hand`: a hand in front of the plane that waves and closes with `time_s`; the other scenes are static.
///
/// # Errors
/// [`Error::Value`] when there is no scene of that name or the time is not finite.
///
/// ```
/// use quadfringe::{optics::Ray, surface::{Surface, scene}};
/// let steps = scene("steps", 0.0)?;
/// let ray = Ray { origin_mm: [20.0, -40.0, 0.0], direction: [0.0, 0.0, 1.0] };
/// assert_eq!(steps.hit(&ray, [0.0, f64::INFINITY]), Some(750.0));
/// # Ok::<(), quadfringe::error::Error>(())
/// ```
pub fn scene(name: &str, time_s: f64) -> Result<Box<dyn Surface>> {
    let on_plane = |body: Box<dyn Surface>| -> Box<dyn Surface> {
        Box::new(Union(vec![Box::new(Plane::at_z(REFERENCE_Z_MM)), body]))
    };
    Ok(match name {
        "plane" => Box::new(Plane::at_z(REFERENCE_Z_MM)),
        "peaks" => Box::new(Peaks::default()),
        "steps" => Box::new(solids::steps()),
        "sphere" => on_plane(Box::new(Sphere::new([-62.0, -22.0, 738.0], 34.0)?)),
        "face" => on_plane(Box::<Face>::default()),
        "hand" => on_plane(Box::new(Hand::at(time_s)?)),
        _ => {
            let expected = format!("one of {}", SCENES.join(", "));
            return Err(Error::value("scene", expected, name));
        }
    })
}

/// Points next to `p_mm` whose values give the slope along x, y and z: before and after it along each axis, by coordinate.
fn around(p_mm: [f64; 3]) -> [Lanes; 3] {
    let mut points = p_mm.map(|c| [c; LANES]);
    for axis in 0..3 {
        points[axis][2 * axis] += -NORMAL_STEP_MM;
        points[axis][2 * axis + 1] += NORMAL_STEP_MM;
    }
    points
}

/// The normal from the values at [`around`].
fn normal_of(values: Lanes) -> [f64; 3] {
    unit(std::array::from_fn(|axis| values[2 * axis + 1] - values[2 * axis]))
}

/// The vector, scaled to unit length.
fn unit(v: [f64; 3]) -> [f64; 3] {
    let scale = 1.0 / crate::optics::dot(v, v).sqrt();
    v.map(|c| c * scale)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_scene_is_met_where_its_value_is_zero() {
        for name in SCENES {
            let body = scene(name, 0.4).expect("known scene");
            for i in 0..400 {
                let (x, y) = (f64::from(i % 20) - 9.5, f64::from(i / 20) - 9.5);
                let ray = Ray { origin_mm: [0.0; 3], direction: unit([0.019 * x, 0.014 * y, 1.0]) };
                let t = body.hit(&ray, [0.0, f64::INFINITY]).expect("a full-field scene");
                assert!(body.value(ray.at(t)).abs() < 1e-7, "{name} {i}");
                assert!(body.value(ray.at(t - 1e-3)) > 0.0, "{name} {i}");
                let normal = body.normal(ray.at(t));
                assert!(crate::optics::dot(normal, ray.direction) < 1e-6, "{name} {i}");
            }
        }
        assert!(scene("teapot", 0.0).is_err());
        assert!(scene("hand", f64::NAN).is_err());
    }

    #[test]
    fn values_change_no_faster_than_stated() {
        for name in SCENES {
            let body = scene(name, 1.3).expect("known scene");
            for i in 0..20_000u32 {
                let noise = |k: u32| f64::from((i * 4 + k).wrapping_mul(2_654_435_761)) / 4.3e9 - 0.5;
                let p = [250.0 * noise(0), 220.0 * noise(1), 770.0 + 120.0 * noise(2)];
                let direction = unit([noise(3), noise(1) * noise(2), 0.05 + noise(0)]);
                let q: [f64; 3] = std::array::from_fn(|c| p[c] + 0.01 * direction[c]);
                let rate = (body.value(q) - body.value(p)).abs() / 0.01;
                assert!(rate <= body.rate_limit(direction) * (1.0 + 1e-6), "{name} {p:?} {rate}");
            }
        }
    }
}
