//! A body in a pose.

use super::{Cuboid, Surface};
use crate::error::Result;
use crate::optics::{Pose, Ray};

/// A rotated and translated body.
///
/// ```
/// use quadfringe::optics::{Pose, Ray, rotation_from_vector};
/// use quadfringe::surface::{Posed, Surface};
/// let pose = Pose::new(rotation_from_vector([0.0, 0.5, 0.0]), [0.0, 0.0, 800.0])?;
/// let board = Posed::plate([-120.0, -90.0], [120.0, 90.0], pose)?;
/// let ray = Ray { origin_mm: [0.0; 3], direction: [0.0, 0.0, 1.0] };
/// let t = board.hit(&ray, [0.0, f64::INFINITY]).expect("in the way");
/// assert!((t - 800.0).abs() < 1e-9);
/// # Ok::<(), quadfringe::error::Error>(())
/// ```
#[derive(Debug)]
pub struct Posed {
    body: Box<dyn Surface>,
    pose: Pose,
}

/// Thickness of a plate, mm.
const PLATE_MM: f64 = 4.0;

impl Posed {
    /// Puts a body into a pose. The body is defined in its body frame.
    #[must_use]
    pub fn new(body: Box<dyn Surface>, pose: Pose) -> Self {
        Self { body, pose }
    }

    /// A flat plate such as a calibration board: its face lies in the plane z = 0 of its frame, between two corners (x,
    /// y) in mm, and looks towards negative z, so that the pose of a board that faces the camera has little rotation.
    ///
    /// # Errors
    /// [`crate::Error::Value`] when the corners do not span a rectangle.
    pub fn plate(low_mm: [f64; 2], high_mm: [f64; 2], pose: Pose) -> Result<Self> {
        let body = Cuboid::new([low_mm[0], low_mm[1], 0.0], [high_mm[0], high_mm[1], PLATE_MM])?;
        Ok(Self::new(Box::new(body), pose))
    }
}

impl Surface for Posed {
    fn value(&self, p_mm: [f64; 3]) -> f64 {
        self.body.value(self.pose.body_from_camera(p_mm))
    }

    fn bounds_mm(&self) -> [[f64; 3]; 2] {
        let bounds = self.body.bounds_mm();
        if !bounds.concat().iter().all(|c| c.is_finite()) {
            return [[f64::NEG_INFINITY; 3], [f64::INFINITY; 3]];
        }
        let nothing = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
        (0..8).fold(nothing, |[low, high], corner: usize| {
            let p = self.pose.camera_from_body(std::array::from_fn(|i| bounds[corner >> i & 1][i]));
            [std::array::from_fn(|i| low[i].min(p[i])), std::array::from_fn(|i| high[i].max(p[i]))]
        })
    }

    fn rate_limit(&self, direction: [f64; 3]) -> f64 {
        self.body.rate_limit(self.pose.body_from_direction(direction))
    }

    fn hit(&self, ray: &Ray, range_mm: [f64; 2]) -> Option<f64> {
        let own = Ray {
            origin_mm: self.pose.body_from_camera(ray.origin_mm),
            direction: self.pose.body_from_direction(ray.direction),
        };
        self.body.hit(&own, range_mm)
    }

    fn normal(&self, p_mm: [f64; 3]) -> [f64; 3] {
        self.pose.camera_from_direction(self.body.normal(self.pose.body_from_camera(p_mm)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optics::{dot, rotation_from_vector};
    use crate::surface::Sphere;

    fn pose() -> Pose {
        Pose::new(rotation_from_vector([0.4, -0.3, 0.2]), [10.0, -5.0, 790.0]).expect("valid pose")
    }

    #[test]
    fn a_posed_sphere_is_a_sphere_elsewhere() {
        let own = Sphere::new([8.0, 3.0, -6.0], 20.0).expect("valid sphere");
        let there = Sphere::new(pose().camera_from_body([8.0, 3.0, -6.0]), 20.0).expect("valid sphere");
        let posed = Posed::new(Box::new(own), pose());
        let ray = Ray { origin_mm: [0.0; 3], direction: crate::surface::unit([0.02, -0.005, 1.0]) };
        let range = [0.0, f64::INFINITY];
        let t = there.hit(&ray, range).expect("in the way");
        assert!((posed.hit(&ray, range).expect("in the way") - t).abs() < 1e-9);
        assert!((posed.value([0.0, 0.0, 700.0]) - there.value([0.0, 0.0, 700.0])).abs() < 1e-9);
        assert!(dot(posed.normal(ray.at(t)), there.normal(ray.at(t))) > 1.0 - 1e-9);
        let [low, high] = posed.bounds_mm();
        assert!((0..3).all(|i| low[i] <= there.bounds_mm()[0][i] && high[i] >= there.bounds_mm()[1][i]));
    }

    #[test]
    fn a_plate_ends_at_its_corners_and_faces_the_camera() {
        let plate = Posed::plate([-30.0, -20.0], [30.0, 20.0], pose()).expect("a rectangle");
        let hits = |x: f64, y: f64| {
            let p = pose().camera_from_body([x, y, 0.0]);
            let direction = crate::surface::unit(p);
            plate.hit(&Ray { origin_mm: [0.0; 3], direction }, [0.0, f64::INFINITY]).is_some()
        };
        assert!(hits(29.9, 19.9) && hits(-29.9, -19.9));
        assert!(!hits(35.0, 0.0) && !hits(0.0, -25.0));
        let face = plate.normal(pose().camera_from_body([0.0; 3]));
        assert!(face[2] < -0.5, "{face:?}");
        assert!(Posed::plate([0.0; 2], [0.0; 2], pose()).is_err());
    }
}
