//! A pair of calibrated projectors, coaxial or not, and the phase of the infrared fringes in space.

use super::Device;
use crate::error::{Error, Limit, Result};

impl Device {
    /// Maps a position (column, row) of this device to `other`: the ray of the position meets the plane z = `z_mm` of the
    /// camera frame in a point, and `other` images this point. `None` if the ray does not meet the plane, or if the point is
    /// outside the field of `other`.
    ///
    /// ```
    /// use quadfringe::optics::{Device, rotation_from_vector};
    /// let first = Device::pinhole(912, 1140, [1570.0; 2], [455.5, 569.5])?;
    /// let second = first.clone().with_pose(rotation_from_vector([0.0, 0.02, 0.0]), [0.5, 0.0, 0.0])?;
    /// let there = second.through_plane([100.0, 200.0], &first, 800.0).expect("in front");
    /// let back = first.through_plane(there, &second, 800.0).expect("in front");
    /// assert!((back[0] - 100.0).abs() < 1e-9 && (back[1] - 200.0).abs() < 1e-9);
    /// # Ok::<(), quadfringe::error::Error>(())
    /// ```
    #[must_use]
    pub fn through_plane(&self, position: [f64; 2], other: &Self, z_mm: f64) -> Option<[f64; 2]> {
        let ray = self.ray(position);
        let distance_mm = (z_mm - ray.origin_mm[2]) / ray.direction[2];
        let reached = distance_mm > 0.0 && distance_mm.is_finite();
        reached.then(|| other.project(ray.at(distance_mm)))?
    }
}

/// A pair of projectors with calibrated poses (S10). The infrared image can be pre-deformed to correct the poses (S11).
///
/// ```
/// use quadfringe::optics::{ProjectorPair, Device};
/// let visible = Device::pinhole(912, 1140, [1570.0; 2], [455.5, 569.5])?;
/// let infrared = visible.clone().with_pose(visible.rotation, [0.5, 0.0, 0.0])?;
/// let (plain, point) = (ProjectorPair::new(visible, infrared), [10.0, 20.0, 800.0]);
/// let corrected = plain.clone().predeformed(800.0)?;
/// let column = plain.visible().project(point).expect("in front")[0];
/// assert!((912.0 * plain.infrared_turns(point).expect("lit") - column - 0.98).abs() < 0.01);
/// assert!((912.0 * corrected.infrared_turns(point).expect("lit") - column).abs() < 1e-9);
/// # Ok::<(), quadfringe::error::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct ProjectorPair {
    visible: Device,
    infrared: Device,
    predeformed_z_mm: Option<f64>,
}

impl ProjectorPair {
    /// Makes a pair that shows plain fringes. The poses of the projectors are relative to the camera.
    #[must_use]
    pub const fn new(visible: Device, infrared: Device) -> Self {
        Self { visible, infrared, predeformed_z_mm: None }
    }

    /// This pair with an infrared image that is pre-deformed for the plane z = `z_mm`.
    ///
    /// # Errors
    /// [`Error::Value`] when the depth is not finite and positive.
    pub fn predeformed(self, z_mm: f64) -> Result<Self> {
        check_plane(z_mm)?;
        Ok(Self { predeformed_z_mm: Some(z_mm), ..self })
    }

    /// The visible projector.
    #[must_use]
    pub const fn visible(&self) -> &Device {
        &self.visible
    }

    /// Position in the field of infrared fringes that lights a point of the camera frame (mm): 0 at the first column, 1 after
    /// the last one. This position times the fringe number is the phase in turns. `None` if the point is not lit.
    #[must_use]
    pub fn infrared_turns(&self, p_mm: [f64; 3]) -> Option<f64> {
        let mirror = self.infrared.project(p_mm)?;
        match self.predeformed_z_mm {
            None => Some(mirror[0] / self.infrared.width as f64),
            Some(z_mm) => {
                let stands_for = self.infrared.through_plane(mirror, &self.visible, z_mm)?;
                Some(stands_for[0] / self.visible.width as f64)
            }
        }
    }
}

/// Check that the plane is in front of the camera.
pub(crate) fn check_plane(z_mm: f64) -> Result<()> {
    if z_mm.is_finite() && z_mm > 0.0 {
        return Ok(());
    }
    Err(Error::value("depth of the reference plane (mm)", Limit::Positive, z_mm))
}
