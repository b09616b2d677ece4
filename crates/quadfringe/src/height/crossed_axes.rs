//! Height from a phase difference in the ideal crossed-axes layout (S5).
//!
//! Layout, in the plane through both optical centres: the camera looks straight down on the reference plane, from the height
//! `L0` above the point `O`. The projector stands at the same height `L0`, at a distance `d` to the side of the camera, and
//! its axis goes through `O`, so that `tan(theta) = d / L0`. `x` is measured on the reference plane from `O`, positive away
//! from the projector.
//!
//! 1. On the plane through `O` normal to the projector axis, fringes are even and have the period `P0`. The projector
//!    ray that meets the reference plane at `x` meets this normal plane at `L0 x cos(theta) / (L0 + x sin(theta)
//!    cos(theta))`: the distance along the axis is `L0 / cos(theta) + x sin(theta)`, the distance from the axis `x
//!    cos(theta)`. Hence `phi(x) = (2 pi / P0) L0 x cos(theta) / G(x)` with `G(x) = L0 + x sin(theta) cos(theta)`.
//! 2. The camera ray that ends at `x` on the reference plane meets the object at height `h`, at `x (L0 - h) / L0` from
//!    the camera axis. The projector ray through this object point continues to `x + e` on the reference plane, with `e
//!    = d h / (L0 - h)` by similar triangles.
//! 3. `dphi = phi(x + e) - phi(x) = (2 pi L0^2 cos(theta) / P0) e / (G (G + e sin(theta) cos(theta)))`. Solved for `e`:
//!    `d / e = 2 pi L0^2 d cos(theta) / (P0 dphi G^2) - d sin(theta) cos(theta) / G`.
//! 4. From step 2, `h = L0 / (1 + d / e)`, which is (S5).
//!
//! So (S5) is exact under these conditions: both centres are at the same height; `theta` is `atan(d / L0)`; `P0` is measured
//! on the normal plane through `O`; and `x` is the end of the camera ray on the reference plane, not the coordinate of the
//! object point. The phase must increase away from the projector; if it increases towards the projector, change the sign of
//! `dphi`.

use std::f64::consts::TAU;

use crate::error::{Error, Result};

/// The ideal crossed-axes layout: the camera axis is normal to the reference plane, and the projector stands to the
/// side of the camera at the same height.
///
/// ```
/// use quadfringe::height::CrossedAxes;
/// let layout = CrossedAxes::new(800.0, 200.0, 8.0)?;
/// let shift = layout.phase_from_height(10.0, 25.0);
/// assert!((layout.height_from_phase(shift, 25.0) - 10.0).abs() < 1e-9);
/// # Ok::<(), quadfringe::error::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct CrossedAxes {
    distance_mm: f64,
    baseline_mm: f64,
    period_mm: f64,
    cos: f64,
    sin: f64,
}

impl CrossedAxes {
    /// Makes a layout with the camera `distance_mm` (L0) above the reference plane and the projector `baseline_mm` (d)
    /// to its side. Fringes have the period `period_mm` (P0) on the plane that is normal to the projector axis where the
    /// two axes cross.
    ///
    /// # Errors
    /// [`Error::Value`] when a length is not finite and positive.
    pub fn new(distance_mm: f64, baseline_mm: f64, period_mm: f64) -> Result<Self> {
        let lengths = [("distance_mm", distance_mm), ("baseline_mm", baseline_mm), ("period_mm", period_mm)];
        for (name, length) in lengths {
            if !(length.is_finite() && length > 0.0) {
                return Err(Error::value(name, "a positive length in mm", length));
            }
        }
        let (sin, cos) = baseline_mm.atan2(distance_mm).sin_cos();
        Ok(Self { distance_mm, baseline_mm, period_mm, cos, sin })
    }

    /// Angle between the two axes in rad: `atan(d / L0)`.
    #[must_use]
    pub fn angle_rad(&self) -> f64 {
        self.baseline_mm.atan2(self.distance_mm)
    }

    /// Height in mm (S5) from object phase minus reference phase in rad, for the camera ray that ends at `x_mm` on the
    /// reference plane; 0 if there is no phase difference, NaN for NaN.
    #[must_use]
    pub fn height_from_phase(&self, difference_rad: f64, x_mm: f64) -> f64 {
        let (l0, d) = (self.distance_mm, self.baseline_mm);
        if difference_rad == 0.0 {
            return 0.0;
        }
        let g = l0 + x_mm * self.cos * self.sin;
        let first = TAU * l0 * l0 * d * self.cos / (self.period_mm * difference_rad * g * g);
        l0 / (first - d * self.cos * self.sin / g + 1.0)
    }

    /// Object phase minus reference phase in rad for a height in mm, which must be less than `L0`: the inverse of
    /// [`CrossedAxes::height_from_phase`] (steps 1 to 3 of the derivation).
    #[must_use]
    pub fn phase_from_height(&self, height_mm: f64, x_mm: f64) -> f64 {
        let reached = x_mm + self.baseline_mm * height_mm / (self.distance_mm - height_mm);
        self.reference_phase(reached) - self.reference_phase(x_mm)
    }

    /// Phase in rad on the reference plane at `x_mm`, 0 where the axes cross.
    #[must_use]
    pub fn reference_phase(&self, x_mm: f64) -> f64 {
        let g = self.distance_mm + x_mm * self.cos * self.sin;
        TAU / self.period_mm * self.distance_mm * x_mm * self.cos / g
    }
}
