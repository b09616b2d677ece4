//! The pinhole model with lens distortion (S8). A projector is an inverse camera and has the same type.
//!
//! `s [u v 1]^T = A [R T] P`: a point `P` of the camera frame (mm) becomes `R P + T` in the device frame, is divided by
//! its depth, distorted, scaled by the focal length and moved to the principal point. Pixel centres are integers.

use crate::error::{Error, Limit, Result};

mod bayer;
mod distortion;
mod pair;
mod params;
mod pose;
mod rotation;

pub use bayer::BayerPattern;
pub use pair::ProjectorPair;
pub(crate) use pair::check_plane;
pub use pose::Pose;
pub use rotation::rotation_from_vector;

/// Half-line in the camera frame.
///
/// ```
/// use quadfringe::optics::Ray;
/// let ray = Ray { origin_mm: [0.0; 3], direction: [0.0, 0.0, 1.0] };
/// assert_eq!(ray.at(800.0), [0.0, 0.0, 800.0]);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    /// Start of the ray, mm.
    pub origin_mm: [f64; 3],
    /// Direction of unit length.
    pub direction: [f64; 3],
}

impl Ray {
    /// Point at distance `t_mm` from the origin, mm.
    #[must_use]
    pub fn at(&self, t_mm: f64) -> [f64; 3] {
        std::array::from_fn(|i| self.origin_mm[i] + t_mm * self.direction[i])
    }
}

/// A camera or a projector: pinhole, lens distortion and pose in the camera frame.
///
/// ```
/// use quadfringe::optics::Device;
/// let camera = Device::pinhole(1024, 768, [2580.6, 2580.6], [511.5, 383.5])?
///     .with_distortion([-0.1, 0.02, 1e-4, -1e-4, 0.0])?;
/// let ray = camera.ray([100.0, 700.0]);
/// let seen = camera.project(ray.at(800.0)).expect("in front of the camera");
/// assert!((seen[0] - 100.0).abs() < 1e-9 && (seen[1] - 700.0).abs() < 1e-9);
/// # Ok::<(), quadfringe::error::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Device {
    /// Number of columns.
    pub width: usize,
    /// Number of rows.
    pub height: usize,
    /// Focal length along the columns and along the rows, in pixels.
    pub focal_px: [f64; 2],
    /// Principal point (column, row).
    pub centre_px: [f64; 2],
    /// Lens distortion k1, k2, p1, p2, k3 in OpenCV's order and meaning.
    pub distortion: [f64; 5],
    /// Rotation of `T_device_camera`, row by row.
    pub rotation: [[f64; 3]; 3],
    /// Translation of `T_device_camera`, mm.
    pub translation_mm: [f64; 3],
}

impl Device {
    /// Makes a device from all parameters; `rotation` and `translation_mm` map points from the camera frame to the
    /// device frame.
    ///
    /// # Errors
    /// [`Error::Value`] when the size is zero, a focal length is not positive, a number is not finite, or the rotation is
    /// not a proper rotation within 1e-6.
    pub fn new(
        width: usize,
        height: usize,
        focal_px: [f64; 2],
        centre_px: [f64; 2],
        distortion: [f64; 5],
        rotation: [[f64; 3]; 3],
        translation_mm: [f64; 3],
    ) -> Result<Self> {
        Self::pinhole(width, height, focal_px, centre_px)?
            .with_distortion(distortion)?
            .with_pose(rotation, translation_mm)
    }

    /// Makes a device without distortion whose frame is the camera frame.
    ///
    /// # Errors
    /// [`Error::Value`] when the size is zero, a focal length is not positive, or a number is not finite.
    pub fn pinhole(width: usize, height: usize, focal_px: [f64; 2], centre_px: [f64; 2]) -> Result<Self> {
        if width == 0 || height == 0 {
            let actual = format!("{width} x {height}");
            return Err(Error::value("device size (columns x rows)", "at least 1 x 1", actual));
        }
        if !focal_px.iter().all(|f| f.is_finite() && *f > 0.0) {
            let expected = "two positive focal lengths in pixels";
            return Err(Error::value("focal_px", expected, format!("{focal_px:?}")));
        }
        check_finite("centre_px", &centre_px)?;
        Ok(Self {
            width,
            height,
            focal_px,
            centre_px,
            distortion: [0.0; 5],
            rotation: rotation::IDENTITY,
            translation_mm: [0.0; 3],
        })
    }

    /// This device with the lens distortion k1, k2, p1, p2, k3 (OpenCV).
    ///
    /// # Errors
    /// [`Error::Value`] when a coefficient is not finite.
    pub fn with_distortion(self, distortion: [f64; 5]) -> Result<Self> {
        check_finite("distortion (k1, k2, p1, p2, k3)", &distortion)?;
        Ok(Self { distortion, ..self })
    }

    /// This device with the pose `T_device_camera`.
    ///
    /// # Errors
    /// [`Error::Value`] when a number is not finite or the rotation is not a proper rotation within 1e-6.
    pub fn with_pose(self, rotation: [[f64; 3]; 3], translation_mm: [f64; 3]) -> Result<Self> {
        check_finite("translation_mm", &translation_mm)?;
        rotation::check(&rotation)?;
        Ok(Self { rotation, translation_mm, ..self })
    }

    /// Projects a point of the camera frame (mm) to a pixel (column, row), which may lie outside the image. `None` if the
    /// point is not in front of the device, or so far off axis that the distortion model folds back.
    #[must_use]
    pub fn project(&self, p_mm: [f64; 3]) -> Option<[f64; 2]> {
        let [x, y, z] = self.device_from_camera(p_mm);
        if z <= 1e-9 {
            return None;
        }
        let ideal = [x / z, y / z];
        if !distortion::is_before_fold(&self.distortion, ideal) {
            return None;
        }
        let [xd, yd] = self.distort(ideal);
        let pixel = [self.focal_px[0] * xd + self.centre_px[0], self.focal_px[1] * yd + self.centre_px[1]];
        Some(pixel)
    }

    /// Ray through a pixel (column, row), in the camera frame; its direction is NaN if no ray meets this pixel.
    #[must_use]
    pub fn ray(&self, pixel: [f64; 2]) -> Ray {
        let [x, y] = self.undistort(pixel);
        let scale = 1.0 / (x * x + y * y + 1.0).sqrt();
        Ray {
            origin_mm: self.centre_mm(),
            direction: self.camera_from_direction([x * scale, y * scale, scale]),
        }
    }

    /// Optical centre in the camera frame, mm.
    #[must_use]
    pub fn centre_mm(&self) -> [f64; 3] {
        self.camera_from_direction(self.translation_mm.map(|t| -t))
    }

    /// Normalised coordinates without distortion of a pixel (column, row); NaN when no point is imaged there.
    #[must_use]
    pub fn undistort(&self, pixel: [f64; 2]) -> [f64; 2] {
        let distorted = [
            (pixel[0] - self.centre_px[0]) / self.focal_px[0],
            (pixel[1] - self.centre_px[1]) / self.focal_px[1],
        ];
        if !self.is_distorted() {
            return distorted;
        }
        distortion::remove(&self.distortion, distorted).unwrap_or([f64::NAN; 2])
    }

    /// Adds the distortion to normalised coordinates.
    #[must_use]
    pub fn distort(&self, ideal: [f64; 2]) -> [f64; 2] {
        distortion::apply(&self.distortion, ideal)
    }

    /// Whether any distortion coefficient differs from zero.
    #[must_use]
    pub fn is_distorted(&self) -> bool {
        self.distortion.iter().any(|k| *k != 0.0)
    }

    /// Whether a position (column, row) lies in the image; pixels extend half a pixel around their centres.
    #[must_use]
    pub fn contains(&self, pixel: [f64; 2]) -> bool {
        let inside = |p: f64, n: usize| (-0.5..n as f64 - 0.5).contains(&p);
        inside(pixel[0], self.width) && inside(pixel[1], self.height)
    }

    /// Transforms a point (mm) from the camera frame to the device frame.
    #[must_use]
    pub fn device_from_camera(&self, p_mm: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|i| dot(self.rotation[i], p_mm) + self.translation_mm[i])
    }

    /// Transforms a direction from the device frame to the camera frame.
    pub(crate) fn camera_from_direction(&self, v: [f64; 3]) -> [f64; 3] {
        let r = &self.rotation;
        std::array::from_fn(|i| r[0][i] * v[0] + r[1][i] * v[1] + r[2][i] * v[2])
    }
}

pub(crate) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn check_finite(name: &str, numbers: &[f64]) -> Result<()> {
    if numbers.iter().all(|n| n.is_finite()) {
        return Ok(());
    }
    Err(Error::value(name.to_owned(), Limit::Finite, format!("{numbers:?}")))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn device() -> Device {
        Device::pinhole(912, 1140, [1570.0, 1580.0], [455.5, 569.5]).expect("valid device")
    }

    #[test]
    fn refuses_bad_parameters() {
        assert!(Device::pinhole(0, 10, [1.0, 1.0], [0.0, 0.0]).is_err());
        assert!(Device::pinhole(10, 10, [-1.0, 1.0], [0.0, 0.0]).is_err());
        assert!(Device::pinhole(10, 10, [1.0, 1.0], [f64::NAN, 0.0]).is_err());
        let mirrored = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]];
        assert!(device().with_pose(mirrored, [0.0; 3]).is_err());
        assert!(device().with_pose([[2.0, 0.0, 0.0]; 3], [0.0; 3]).is_err());
        assert!(device().with_distortion([f64::INFINITY, 0.0, 0.0, 0.0, 0.0]).is_err());
    }

    #[test]
    fn behind_or_folded_is_none() {
        assert_eq!(device().project([0.0, 0.0, -5.0]), None);
        let barrel = device().with_distortion([-0.4, 0.0, 0.0, 0.0, 0.0]).expect("valid device");
        assert!(barrel.project([0.5, 0.0, 1.0]).is_some());
        assert_eq!(barrel.project([2.0, 0.0, 1.0]), None);
        assert!(barrel.undistort([1e5, 0.0])[0].is_nan());
    }

    #[test]
    fn the_centre_is_where_rays_start() {
        let posed = device()
            .with_pose(rotation_from_vector([0.1, -0.2, 0.05]), [-250.0, 20.0, -120.0])
            .expect("valid device");
        let centre = posed.device_from_camera(posed.centre_mm());
        assert!(centre.iter().all(|c| c.abs() < 1e-9));
    }
}
