//! Bodies with closed-form intersections (half-space, sphere, cuboid), and the scene of steps composed of them.

use super::{REFERENCE_Z_MM, Surface, Union, march, unit};
use crate::error::{Error, Result};
use crate::optics::{Ray, dot};

/// Half-space behind a plane.
///
/// ```
/// use quadfringe::surface::{Plane, Surface};
/// let tilted = Plane::new([0.0, 0.0, 800.0], [0.1, 0.0, -1.0])?;
/// assert!(tilted.value([0.0, 0.0, 700.0]) > 0.0);
/// # Ok::<(), quadfringe::error::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Plane {
    point_mm: [f64; 3],
    normal: [f64; 3],
}

impl Plane {
    /// Plane through a point (mm) with a normal that points into free space; the normal need not have unit length.
    ///
    /// # Errors
    /// [`Error::Value`] when a number is not finite or the normal is zero.
    pub fn new(point_mm: [f64; 3], normal: [f64; 3]) -> Result<Self> {
        let normal = unit(normal);
        if !point_mm.iter().chain(&normal).all(|c| c.is_finite()) {
            let actual = format!("point {point_mm:?} mm, normal {normal:?}");
            return Err(Error::value("plane", "a finite point and a normal other than zero", actual));
        }
        Ok(Self { point_mm, normal })
    }

    /// Plane at constant depth, facing the camera.
    #[must_use]
    pub const fn at_z(z_mm: f64) -> Self {
        Self { point_mm: [0.0, 0.0, z_mm], normal: [0.0, 0.0, -1.0] }
    }
}

impl Surface for Plane {
    fn value(&self, p_mm: [f64; 3]) -> f64 {
        dot(self.normal, std::array::from_fn(|i| p_mm[i] - self.point_mm[i]))
    }

    fn bounds_mm(&self) -> [[f64; 3]; 2] {
        [[f64::NEG_INFINITY; 3], [f64::INFINITY; 3]]
    }

    fn hit(&self, ray: &Ray, [from, to]: [f64; 2]) -> Option<f64> {
        let approach = dot(self.normal, ray.direction);
        let height = self.value(ray.origin_mm);
        if height + from * approach <= 0.0 {
            return (from <= to).then_some(from);
        }
        let t = -height / approach;
        (approach < 0.0 && (from..=to).contains(&t)).then_some(t)
    }

    fn normal(&self, _p_mm: [f64; 3]) -> [f64; 3] {
        self.normal
    }
}

/// Solid sphere.
///
/// ```
/// use quadfringe::surface::{Sphere, Surface};
/// assert_eq!(Sphere::new([0.0, 0.0, 800.0], 30.0)?.value([0.0, 0.0, 700.0]), 70.0);
/// # Ok::<(), quadfringe::error::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Sphere {
    centre_mm: [f64; 3],
    radius_mm: f64,
}

impl Sphere {
    /// Sphere from centre and radius, mm.
    ///
    /// # Errors
    /// [`Error::Value`] when a number is not finite or the radius is not positive.
    pub fn new(centre_mm: [f64; 3], radius_mm: f64) -> Result<Self> {
        let finite = centre_mm.iter().all(|c| c.is_finite()) && radius_mm.is_finite();
        if !finite || radius_mm <= 0.0 {
            let actual = format!("centre {centre_mm:?} mm, radius {radius_mm} mm");
            return Err(Error::value("sphere", "a finite centre and a positive radius", actual));
        }
        Ok(Self { centre_mm, radius_mm })
    }

    fn offset_from(&self, p_mm: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|i| p_mm[i] - self.centre_mm[i])
    }
}

impl Surface for Sphere {
    fn value(&self, p_mm: [f64; 3]) -> f64 {
        let v = self.offset_from(p_mm);
        dot(v, v).sqrt() - self.radius_mm
    }

    fn bounds_mm(&self) -> [[f64; 3]; 2] {
        [self.centre_mm.map(|c| c - self.radius_mm), self.centre_mm.map(|c| c + self.radius_mm)]
    }

    fn hit(&self, ray: &Ray, [from, to]: [f64; 2]) -> Option<f64> {
        let v = self.offset_from(ray.origin_mm);
        let nearest = -dot(v, ray.direction);
        let passing: [f64; 3] = std::array::from_fn(|i| v[i] + nearest * ray.direction[i]);
        let half = (self.radius_mm * self.radius_mm - dot(passing, passing)).sqrt();
        // The half chord of a ray that misses the sphere is NaN, and comparisons with NaN are false.
        let t = (nearest - half).max(from);
        (half >= 0.0 && t <= to && t <= nearest + half).then_some(t)
    }

    fn normal(&self, p_mm: [f64; 3]) -> [f64; 3] {
        unit(self.offset_from(p_mm))
    }
}

/// Solid block with faces along the axes; its walls are exactly vertical.
///
/// ```
/// use quadfringe::surface::{Cuboid, Surface};
/// let block = Cuboid::new([-10.0, -10.0, 780.0], [10.0, 10.0, 800.0])?;
/// assert_eq!(block.value([20.0, 0.0, 790.0]), 10.0);
/// # Ok::<(), quadfringe::error::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Cuboid {
    low_mm: [f64; 3],
    high_mm: [f64; 3],
}

impl Cuboid {
    /// Block from its least and greatest corner, mm.
    ///
    /// # Errors
    /// [`Error::Value`] when a number is not finite or a side is not positive.
    pub fn new(low_mm: [f64; 3], high_mm: [f64; 3]) -> Result<Self> {
        let finite = low_mm.iter().chain(&high_mm).all(|c| c.is_finite());
        if !finite || (0..3).any(|i| low_mm[i] >= high_mm[i]) {
            let actual = format!("{low_mm:?} to {high_mm:?} mm");
            return Err(Error::value("cuboid", "a low corner below the high one on every axis", actual));
        }
        Ok(Self { low_mm, high_mm })
    }

    /// Signed distance beyond each pair of faces, negative between them.
    fn beyond(&self, p_mm: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|i| (self.low_mm[i] - p_mm[i]).max(p_mm[i] - self.high_mm[i]))
    }
}

impl Surface for Cuboid {
    fn value(&self, p_mm: [f64; 3]) -> f64 {
        let beyond = self.beyond(p_mm);
        let outside = beyond.map(|b| b.max(0.0));
        let inside = beyond[0].max(beyond[1]).max(beyond[2]).min(0.0);
        dot(outside, outside).sqrt() + inside
    }

    fn bounds_mm(&self) -> [[f64; 3]; 2] {
        [self.low_mm, self.high_mm]
    }

    fn hit(&self, ray: &Ray, range_mm: [f64; 2]) -> Option<f64> {
        march::clip(ray, self.bounds_mm(), range_mm).map(|[from, _]| from)
    }

    fn normal(&self, p_mm: [f64; 3]) -> [f64; 3] {
        let beyond = self.beyond(p_mm);
        let axis = (0..3).max_by(|a, b| beyond[*a].total_cmp(&beyond[*b])).unwrap_or(2);
        let mut normal = [0.0; 3];
        let middle = 0.5 * (self.low_mm[axis] + self.high_mm[axis]);
        normal[axis] = if p_mm[axis] < middle { -1.0 } else { 1.0 };
        normal
    }
}

/// Blocks of the steps: edges along x, then height above the reference plane, for the upper and the lower row.
const STEP_EDGES_X_MM: [f64; 7] = [-126.0, -84.0, -42.0, 0.0, 42.0, 84.0, 126.0];
const STEP_ROWS_Y_MM: [[f64; 2]; 2] = [[-88.0, -4.0], [-4.0, 80.0]];
const STEP_HEIGHTS_MM: [[f64; 6]; 2] =
    [[5.0, 15.0, 30.0, 50.0, 20.0, 10.0], [20.0, 10.0, 40.0, 25.0, 45.0, 15.0]];

/// The ready scene of twelve blocks on the reference plane.
pub(super) fn steps() -> Union {
    let mut bodies: Vec<Box<dyn Surface>> = vec![Box::new(Plane::at_z(REFERENCE_Z_MM))];
    for (rows, heights) in STEP_ROWS_Y_MM.iter().zip(STEP_HEIGHTS_MM) {
        for (x, height) in STEP_EDGES_X_MM.windows(2).zip(heights) {
            bodies.push(Box::new(Cuboid {
                low_mm: [x[0], rows[0], REFERENCE_Z_MM - height],
                high_mm: [x[1], rows[1], REFERENCE_Z_MM],
            }));
        }
    }
    Union(bodies)
}
