//! Poses of bodies.

use super::{check_finite, dot, rotation};
use crate::error::Result;

/// Pose `T_camera_body` of a body: `P_camera = R P_body + T`.
///
/// ```
/// use quadfringe::optics::{Pose, rotation_from_vector};
/// let pose = Pose::new(rotation_from_vector([0.0, 0.3, 0.0]), [5.0, 0.0, 800.0])?;
/// let there = pose.camera_from_body([1.0, 2.0, 3.0]);
/// let back = pose.body_from_camera(there);
/// assert!((back[0] - 1.0).abs() < 1e-9 && (back[2] - 3.0).abs() < 1e-9);
/// # Ok::<(), quadfringe::error::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    rotation: [[f64; 3]; 3],
    translation_mm: [f64; 3],
}

impl Pose {
    /// Makes a pose from a rotation, given row by row, and a translation in mm.
    ///
    /// # Errors
    /// [`crate::Error::Value`] when a number is not finite or the rotation is not a proper rotation within 1e-6.
    pub fn new(rotation: [[f64; 3]; 3], translation_mm: [f64; 3]) -> Result<Self> {
        check_finite("translation_mm", &translation_mm)?;
        rotation::check(&rotation)?;
        Ok(Self { rotation, translation_mm })
    }

    /// Transforms a point (mm) from the body frame to the camera frame.
    #[must_use]
    pub fn camera_from_body(&self, p_mm: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|i| dot(self.rotation[i], p_mm) + self.translation_mm[i])
    }

    /// Transforms a point (mm) from the camera frame to the body frame.
    #[must_use]
    pub fn body_from_camera(&self, p_mm: [f64; 3]) -> [f64; 3] {
        self.body_from_direction(std::array::from_fn(|i| p_mm[i] - self.translation_mm[i]))
    }

    /// Transforms a direction from the body frame to the camera frame.
    #[must_use]
    pub fn camera_from_direction(&self, v: [f64; 3]) -> [f64; 3] {
        self.rotation.map(|row| dot(row, v))
    }

    /// Transforms a direction from the camera frame to the body frame.
    #[must_use]
    pub fn body_from_direction(&self, v: [f64; 3]) -> [f64; 3] {
        let r = &self.rotation;
        std::array::from_fn(|i| r[0][i] * v[0] + r[1][i] * v[1] + r[2][i] * v[2])
    }
}
