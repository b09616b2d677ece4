//! Two projectors that are meant to be one, and what the infrared one really shows.

use super::Device;
use crate::error::{Error, Limit, Result};

impl Device {
    /// Position (column, row) in `other` of what a position of this device sees, or lights, on the plane z = `z_mm` of the
    /// camera frame; `None` when its ray does not meet the plane or `other` does not reach that point.
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

/// The calibrated pair: where both projectors really stand, and whether the infrared image makes up for it (S10, S11).
///
/// ```
/// use quadfringe::optics::{CoaxialPair, Device};
/// let visible = Device::pinhole(912, 1140, [1570.0; 2], [455.5, 569.5])?;
/// let infrared = visible.clone().with_pose(visible.rotation, [0.5, 0.0, 0.0])?;
/// let (plain, point) = (CoaxialPair::new(visible, infrared), [10.0, 20.0, 800.0]);
/// let corrected = plain.clone().predeformed(800.0)?;
/// let column = plain.visible().project(point).expect("in front")[0];
/// assert!((912.0 * plain.infrared_turns(point).expect("lit") - column - 0.98).abs() < 0.01);
/// assert!((912.0 * corrected.infrared_turns(point).expect("lit") - column).abs() < 1e-9);
/// # Ok::<(), quadfringe::error::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct CoaxialPair {
    visible: Device,
    infrared: Device,
    predeformed_z_mm: Option<f64>,
}

impl CoaxialPair {
    /// Two projectors with plain fringes, their poses relative to the camera.
    #[must_use]
    pub const fn new(visible: Device, infrared: Device) -> Self {
        Self { visible, infrared, predeformed_z_mm: None }
    }

    /// The same pair with an infrared image that is pre-deformed for the plane z = `z_mm`.
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

    /// How far through the field of infrared fringes a point of the camera frame (mm) is lit from: 0 at the first column,
    /// 1 after the last. Times the fringe number that is the phase in turns. `None` when the point is not lit.
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

/// Refuses what is no plane before the camera.
pub(crate) fn check_plane(z_mm: f64) -> Result<()> {
    if z_mm.is_finite() && z_mm > 0.0 {
        return Ok(());
    }
    Err(Error::value("depth of the reference plane (mm)", Limit::Positive, z_mm))
}
