//! The normal equations of a fit by an offset, cosine and sine.

use crate::joint::params::local_fit::RIDGE;

/// Sums of one cell, of the weight `w` times products of `c` and `s`, cosine and sine of the wave that is fitted.
pub(super) mod wave_sum {
    pub const W: usize = 0;
    pub const C: usize = 1;
    pub const S: usize = 2;
    pub const CC: usize = 3;
    pub const CS: usize = 4;
    /// The sums of what is fitted follow.
    pub const COUNT: usize = 5;
}

/// Inverse of the matrix of the normal equations of a fit by an offset, cosine and sine, by its adjugate.
pub(super) struct Normal {
    /// The upper triangle, row by row.
    adjugate: [f32; 6],
    /// One over the determinant.
    scale: f32,
}

impl Normal {
    /// From the sums of [`wave_sum`].
    #[inline(always)]
    pub fn new([w, wc, ws, wcc, wcs]: [f32; wave_sum::COUNT]) -> Self {
        let ridge = RIDGE * w + 1e-12;
        let (a, b, c, d, e, f) = (w + ridge, wc, ws, wcc + ridge, wcs, w - wcc + ridge);
        let (xx, xy, xz) = (d * f - e * e, c * e - b * f, b * e - c * d);
        let (yy, yz, zz) = (a * f - c * c, b * c - a * e, a * d - b * b);
        let scale = 1.0 / (a * xx + b * xy + c * xz).max(f32::MIN_POSITIVE);
        Self { adjugate: [xx, xy, xz, yy, yz, zz], scale }
    }

    /// Offset and coefficients of cosine and sine, for the sums of the weight times the signal, and times `c` and `s`.
    #[inline(always)]
    pub fn solve(&self, sums: [f32; 3]) -> [f32; 3] {
        let [xx, xy, xz, yy, yz, zz] = self.adjugate;
        let [u, v, t] = sums.map(|sum| sum * self.scale);
        [xx * u + xy * v + xz * t, xy * u + yy * v + yz * t, xz * u + yz * v + zz * t]
    }
}
