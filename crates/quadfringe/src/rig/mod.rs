//! The virtual bench: a camera, two projectors, and any surface in front of them (S8, S9).
//!
//! [`Bench::cast`] traces one ray through each camera pixel and a shadow ray from each projector, and stores the projector
//! position that lights the pixel; this is done once for a scene. [`Bench::render`] then renders a shot for any four
//! patterns, with the effects of a real bench. [`Bench::predeform`] gives the infrared pattern that corrects an infrared
//! projector that is not coaxial (S11).

mod blur;
mod cast;
mod expose;
mod light;
mod mosaic;
mod options;
mod params;
mod predeform;
mod print;
mod quick;
mod render;
mod truth;

pub use cast::{Cast, Hit};
pub use light::Light;
pub use options::{Albedo, BitDepth, Demosaic, RenderOptions};
pub use print::Print;
pub use render::Planes;

use crate::encoding::DmdLayout;
pub use crate::encoding::{Axis, Projector};
use crate::error::{Error, Result};
use crate::optics::{Device, dot, rotation_from_vector};

/// Camera and projectors of a bench; the poses of the projectors are relative to the camera.
///
/// ```
/// use quadfringe::Encoding;
/// use quadfringe::rig::{Bench, Light, RenderOptions};
/// use quadfringe::surface::scene;
/// let mut bench = Bench::reference();
/// bench.camera = quadfringe::Device::pinhole(64, 48, [161.0, 161.0], [31.5, 23.5])?;
/// let cast = bench.cast(scene("steps", 0.0)?.as_ref());
/// let lights = Light::shot(&Encoding::optimum(36, 912)?)?;
/// let shot = bench.render(&cast, &lights, &RenderOptions::default())?;
/// assert_eq!(shot.shape(), (48, 64));
/// # Ok::<(), quadfringe::error::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Bench {
    /// The camera; its frame is the frame of all points.
    pub camera: Device,
    /// The visible light projector, P1.
    pub visible: Device,
    /// The infrared light projector, P2. It is coaxial with P1 if both are equal.
    pub infrared: Device,
    /// Layout of the mirrors of both projectors, which determines where pattern images are sampled.
    pub layout: DmdLayout,
    /// Invertible affine map, row by row, from the visible pixel (x, y, 1) to the position on the infrared chip that
    /// sees the same point. `None` if both chips see the same image.
    pub infrared_from_visible: Option<[[f64; 3]; 2]>,
}

/// Focal length of the camera and of both projectors, mm.
const FOCAL_MM: f64 = 12.0;
const CAMERA_PITCH_UM: f64 = 4.65;
const CAMERA_SIZE: [usize; 2] = [1024, 768];
const PROJECTOR_SIZE: [usize; 2] = [912, 1140];
/// Position of the projectors of the reference bench and the point on their axis, mm.
const PROJECTOR_CENTRE_MM: [f64; 3] = [200.0, -15.0, 200.0];
const PROJECTOR_TARGET_MM: [f64; 3] = [0.0, 0.0, 800.0];
/// Rotation of the projectors about their axis, rad.
const PROJECTOR_ROLL_RAD: f64 = std::f64::consts::PI / 180.0;

impl Bench {
    /// The published geometry with a regular mirror grid: camera 1024 x 768, 4.65 um, 12 mm; coaxial projectors
    /// 912 x 1140, 7.63 um, 12 mm, to the side of the camera and in front of it, at (200, -15, 200) mm, turned by one
    /// degree, towards the middle of the plane z = 800 mm.
    #[must_use]
    pub fn reference() -> Self {
        Self::reference_with(DmdLayout::Regular)
    }

    /// The published geometry with a given layout of the mirrors.
    ///
    /// ```
    /// use quadfringe::{DmdLayout, rig::Bench};
    /// let diamond = Bench::reference_with(DmdLayout::Diamond);
    /// assert!(diamond.visible.focal_px[1] > 1.9 * diamond.visible.focal_px[0]);
    /// ```
    #[must_use]
    pub fn reference_with(layout: DmdLayout) -> Self {
        let reason = "the published geometry is valid";
        let camera = centred(CAMERA_SIZE, [CAMERA_PITCH_UM; 2]).expect(reason);
        let pose = DevicePose::towards(PROJECTOR_CENTRE_MM, PROJECTOR_TARGET_MM, PROJECTOR_ROLL_RAD);
        let projector = centred(PROJECTOR_SIZE, layout.pitch_um())
            .and_then(|device| device.with_pose(pose.rotation, pose.translation_mm))
            .expect(reason);
        Self { camera, visible: projector.clone(), infrared: projector, layout, infrared_from_visible: None }
    }

    /// This bench with an infrared projector that deviates from the visible one by the pose `T_infrared_visible`, given
    /// as a rotation vector (rad) and a translation (mm), as in (S10).
    ///
    /// # Errors
    /// [`crate::Error::Value`] when a number is not finite.
    ///
    /// ```
    /// use quadfringe::rig::Bench;
    /// let bench = Bench::reference().deviated([1f64.to_radians(); 3], [0.5; 3])?;
    /// assert!((bench.infrared.translation_mm[0] + 254.660).abs() < 1e-3);
    /// # Ok::<(), quadfringe::error::Error>(())
    /// ```
    pub fn deviated(self, rotation_rad: [f64; 3], translation_mm: [f64; 3]) -> Result<Self> {
        let turn = rotation_from_vector(rotation_rad);
        let (rotation, translation) = (self.visible.rotation, self.visible.translation_mm);
        let column = |j: usize| rotation.map(|row| row[j]);
        let turned = turn.map(|row| std::array::from_fn(|j| dot(row, column(j))));
        let moved = std::array::from_fn(|i| dot(turn[i], translation) + translation_mm[i]);
        let infrared = self.visible.clone().with_pose(turned, moved)?;
        Ok(Self { infrared, ..self })
    }

    /// This bench with an infrared chip that is not registered: the affine map takes the visible pixel (x, y, 1) to the
    /// position on the infrared chip that sees the same point.
    ///
    /// # Errors
    /// [`crate::Error::Value`] when the map has no inverse.
    ///
    /// ```
    /// use quadfringe::rig::Bench;
    /// let apart = [[1.001, 0.002, 0.7], [-0.002, 0.999, -1.3]];
    /// assert!(Bench::reference().with_infrared_chip(apart).is_ok());
    /// assert!(Bench::reference().with_infrared_chip([[0.0; 3]; 2]).is_err());
    /// ```
    pub fn with_infrared_chip(self, infrared_from_visible: [[f64; 3]; 2]) -> Result<Self> {
        inverse(infrared_from_visible)?;
        Ok(Self { infrared_from_visible: Some(infrared_from_visible), ..self })
    }

    /// Affine map from a pixel of the infrared chip to the visible pixel that sees the same point.
    fn visible_from_infrared(&self) -> Option<[[f64; 3]; 2]> {
        self.infrared_from_visible.and_then(|affine| inverse(affine).ok())
    }

    /// The device of a projector.
    #[must_use]
    pub const fn projector(&self, projector: Projector) -> &Device {
        match projector {
            Projector::Visible => &self.visible,
            Projector::Infrared => &self.infrared,
        }
    }
}

/// Inverse of an affine map of the plane.
fn inverse(affine: [[f64; 3]; 2]) -> Result<[[f64; 3]; 2]> {
    let [[a, b, tx], [c, d, ty]] = affine;
    let determinant = a * d - b * c;
    if !(determinant.is_finite() && determinant.abs() > 1e-6 && tx.is_finite() && ty.is_finite()) {
        let expected = "the two rows of an affine map with an inverse";
        return Err(Error::value("infrared_from_visible", expected, format!("{affine:?}")));
    }
    let [ia, ib, ic, id] = [d, -b, -c, a].map(|v| v / determinant);
    Ok([[ia, ib, -(ia * tx + ib * ty)], [ic, id, -(ic * tx + id * ty)]])
}

fn centred([width, height]: [usize; 2], pitch_um: [f64; 2]) -> Result<Device> {
    let focal_px = pitch_um.map(|pitch| FOCAL_MM / (pitch * 1e-3));
    let centre_px = [width, height].map(|n| 0.5 * (n as f64 - 1.0));
    Device::pinhole(width, height, focal_px, centre_px)
}

/// Pose `T_device_camera` of a device.
struct DevicePose {
    rotation: [[f64; 3]; 3],
    translation_mm: [f64; 3],
}

impl DevicePose {
    /// A device at `centre` whose axis goes through `target`, with level rows and then rotated about the axis.
    fn towards(centre: [f64; 3], target: [f64; 3], roll_rad: f64) -> Self {
        let unit = |v: [f64; 3]| {
            let length = dot(v, v).sqrt();
            v.map(|c| c / length)
        };
        let cross = |a: [f64; 3], b: [f64; 3]| {
            [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
        };
        let forward = unit(std::array::from_fn(|i| target[i] - centre[i]));
        let level = unit(cross([0.0, 1.0, 0.0], forward));
        let down = cross(forward, level);
        let (s, c) = roll_rad.sin_cos();
        let right: [f64; 3] = std::array::from_fn(|i| c * level[i] + s * down[i]);
        let rotation = [right, cross(forward, right), forward];
        Self { rotation, translation_mm: rotation.map(|row| -dot(row, centre)) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_reference_bench_lights_what_the_camera_sees() {
        let bench = Bench::reference();
        let centre = bench.visible.centre_mm();
        assert!((0..3).all(|i| (centre[i] - PROJECTOR_CENTRE_MM[i]).abs() < 1e-9));
        for corner in [[0.0, 0.0], [1023.0, 0.0], [0.0, 767.0], [1023.0, 767.0]] {
            let ray = bench.camera.ray(corner);
            let pixel = bench.visible.project(ray.at(800.0 / ray.direction[2])).expect("in front");
            assert!(bench.visible.contains(pixel), "{corner:?} -> {pixel:?}");
        }
    }
}
