//! Rotation matrices.

use super::dot;
use crate::error::{Error, Result};

pub(super) const IDENTITY: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// Rotation matrix of a rotation vector (axis times angle in rad), by Rodrigues' formula.
///
/// ```
/// let r = quadfringe::optics::rotation_from_vector([0.0, 0.0, std::f64::consts::FRAC_PI_2]);
/// assert!((r[0][1] + 1.0).abs() < 1e-12 && (r[1][0] - 1.0).abs() < 1e-12);
/// ```
#[must_use]
pub fn rotation_from_vector(vector_rad: [f64; 3]) -> [[f64; 3]; 3] {
    let angle = dot(vector_rad, vector_rad).sqrt();
    if angle == 0.0 {
        return IDENTITY;
    }
    let [x, y, z] = vector_rad.map(|v| v / angle);
    let (s, c) = angle.sin_cos();
    let d = 1.0 - c;
    [
        [c + x * x * d, x * y * d - z * s, x * z * d + y * s],
        [y * x * d + z * s, c + y * y * d, y * z * d - x * s],
        [z * x * d - y * s, z * y * d + x * s, c + z * z * d],
    ]
}

/// Check that a matrix is a proper rotation.
pub(super) fn check(r: &[[f64; 3]; 3]) -> Result<()> {
    let orthonormal =
        (0..3).all(|i| (0..3).all(|j| (dot(r[i], r[j]) - f64::from(u8::from(i == j))).abs() <= 1e-6));
    let determinant = r[0][0] * (r[1][1] * r[2][2] - r[1][2] * r[2][1])
        - r[0][1] * (r[1][0] * r[2][2] - r[1][2] * r[2][0])
        + r[0][2] * (r[1][0] * r[2][1] - r[1][1] * r[2][0]);
    if orthonormal && determinant > 0.0 {
        return Ok(());
    }
    let expected = "a proper rotation (orthonormal rows, determinant +1, within 1e-6)";
    Err(Error::value("rotation", expected, format!("{r:?}")))
}
