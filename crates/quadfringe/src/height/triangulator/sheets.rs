//! Sheets of light: the surfaces that the columns of a projector light, in the projector frame, with lens distortion.

use super::block::{BLOCK, Block, Directions};
use crate::error::{Error, Result};
use crate::height::params::{ACROSS_SHARE_MIN, BASELINE_MIN_MM, NEWTON_STEPS};
use crate::optics::Device;

/// An ideal coordinate, and the derivative of the distorted coordinate with respect to it.
struct Ideal {
    coordinate: f32,
    slope: f32,
}

/// The sheets of light of a projector's columns.
#[derive(Debug, Clone)]
pub(super) struct ColumnSheets {
    rotation: [[f32; 3]; 3],
    /// Camera centre in projector coordinates, mm.
    centre: [f32; 3],
    focal_px: f32,
    centre_px: f32,
    distortion: Option<[f32; 5]>,
}

impl ColumnSheets {
    pub fn new(projector: &Device) -> Result<Self> {
        let a = projector.translation_mm;
        let middle = (0.5 * (projector.width as f64 - 1.0) - projector.centre_px[0]) / projector.focal_px[0];
        let across = (a[0] - middle * a[2]).abs() / middle.hypot(1.0);
        let length = (a[0] * a[0] + a[1] * a[1] + a[2] * a[2]).sqrt();
        if across <= ACROSS_SHARE_MIN * length || length <= BASELINE_MIN_MM {
            let expected = "a baseline across the columns of the projector";
            let actual = format!("camera at {a:?} mm in the projector's frame");
            return Err(Error::value("pose of the projector", expected, actual));
        }
        Ok(Self {
            rotation: projector.rotation.map(|row| row.map(|v| v as f32)),
            centre: a.map(|v| v as f32),
            focal_px: projector.focal_px[0] as f32,
            centre_px: projector.centre_px[0] as f32,
            distortion: projector.is_distorted().then(|| projector.distortion.map(|v| v as f32)),
        })
    }

    /// Depths at which rays `(x, y, 1)` meet the sheets of `columns`, NaN behind the camera, and the derivatives of the
    /// depths with respect to the columns: `dt / dk` of `t = (k A2 - A0) / (B0 - k B2)`, times `dk / du`.
    #[inline(always)]
    pub fn intersect(&self, columns: &[f32], block: &mut Block) {
        self.ideal(columns, block);
        let Block { directions: Directions { x, y }, ideal: k, stretch, depth, growth } = block;
        let ([r0, _, r2], [a0, _, a2]) = (self.rotation, self.centre);
        for i in 0..BLOCK {
            let b0 = r0[0] * x[i] + r0[1] * y[i] + r0[2];
            let b2 = r2[0] * x[i] + r2[1] * y[i] + r2[2];
            let inverse = 1.0 / (b0 - k[i] * b2);
            let t = (k[i] * a2 - a0) * inverse;
            let seen = (t > 0.0) & (t <= f32::MAX);
            depth[i] = if seen { t } else { f32::NAN };
            growth[i] = if seen { (a2 + t * b2) * inverse * stretch[i] } else { f32::NAN };
        }
    }

    /// Ideal normalised coordinates of `columns`, and their derivatives with respect to the columns.
    #[inline(always)]
    fn ideal(&self, columns: &[f32], block: &mut Block) {
        let Block { directions: Directions { x, y }, ideal: k, stretch, .. } = block;
        let scale = 1.0 / self.focal_px;
        stretch.fill(scale);
        for (k, u) in k.iter_mut().zip(columns) {
            *k = (u - self.centre_px) * scale;
        }
        if let Some(distortion) = &self.distortion {
            for i in 0..BLOCK {
                let ideal = self.ideal_coordinate(distortion, k[i], x[i], y[i]);
                (k[i], stretch[i]) = (ideal.coordinate, scale / ideal.slope);
            }
        }
    }

    /// Ideal normalised coordinate of the point on the ray `(x, y, 1)` that the projector images at the distorted
    /// coordinate `measured`.
    #[inline(always)]
    fn ideal_coordinate(&self, distortion: &[f32; 5], measured: f32, x: f32, y: f32) -> Ideal {
        let [k1, k2, p1, p2, k3] = *distortion;
        let b = self.rotation.map(|r| r[0] * x + r[1] * y + r[2]);
        let a = self.centre;
        // In the projector the ray is the line n . (k, m, 1) = 0 with n = A x B.
        let across = 1.0 / (a[2] * b[0] - a[0] * b[2]);
        let m0 = (a[1] * b[0] - a[0] * b[1]) * across;
        let s = (a[2] * b[1] - a[1] * b[2]) * across;
        let (mut k, mut slope) = (measured, 1.0);
        for _ in 0..NEWTON_STEPS {
            let m = m0 + s * k;
            let r2 = k * k + m * m;
            let along = k + m * s;
            let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
            let growth = 2.0 * (k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3));
            let value = k * radial + 2.0 * p1 * k * m + p2 * (r2 + 2.0 * k * k);
            slope = radial + k * growth * along + 2.0 * p1 * (m + k * s) + p2 * (2.0 * along + 4.0 * k);
            k -= (value - measured) / slope;
        }
        Ideal { coordinate: k, slope }
    }
}
