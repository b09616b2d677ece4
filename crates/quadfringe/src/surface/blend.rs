//! Smooth bodies and their blends. The value of each body and of each blend changes by at most 1 per mm.

use crate::optics::dot;

/// Smooth union: the smaller of two values, rounded off where they differ by less than `k` mm.
pub(super) fn join(a: f64, b: f64, k: f64) -> f64 {
    let overlap = (k - (a - b).abs()).max(0.0);
    a.min(b) - overlap * overlap / (4.0 * k)
}

/// Smooth difference: the body `a` without the body `b`, rounded off over `k` mm.
pub(super) fn carve(a: f64, b: f64, k: f64) -> f64 {
    -join(-a, b, k)
}

/// Ellipsoid with axes along x, y, z.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Ellipsoid {
    centre: [f64; 3],
    one_over_radii: [f64; 3],
    least_radius: f64,
}

impl Ellipsoid {
    pub(super) const fn new(centre: [f64; 3], [rx, ry, rz]: [f64; 3]) -> Self {
        let of_two = if rx < ry { rx } else { ry };
        Self {
            centre,
            one_over_radii: [1.0 / rx, 1.0 / ry, 1.0 / rz],
            least_radius: if of_two < rz { of_two } else { rz },
        }
    }

    /// A value that is negative inside and nowhere greater than the distance to the surface.
    pub(super) fn value(&self, p: [f64; 3]) -> f64 {
        let q: [f64; 3] = std::array::from_fn(|i| (p[i] - self.centre[i]) * self.one_over_radii[i]);
        (dot(q, q).sqrt() - 1.0) * self.least_radius
    }
}

/// Ball swept along a segment.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Capsule {
    start: [f64; 3],
    along: [f64; 3],
    /// One over the squared length of the segment.
    scale: f64,
    radius: f64,
}

impl Capsule {
    pub(super) fn new(start: [f64; 3], end: [f64; 3], radius: f64) -> Self {
        let along = std::array::from_fn(|i| end[i] - start[i]);
        Self { start, along, scale: 1.0 / dot(along, along), radius }
    }

    /// Signed distance.
    pub(super) fn value(&self, p: [f64; 3]) -> f64 {
        let v: [f64; 3] = std::array::from_fn(|i| p[i] - self.start[i]);
        let t = (dot(v, self.along) * self.scale).clamp(0.0, 1.0);
        let away: [f64; 3] = std::array::from_fn(|i| v[i] - t * self.along[i]);
        dot(away, away).sqrt() - self.radius
    }

    /// Least and greatest coordinate of the body along an axis.
    pub(super) fn extent(&self, axis: usize) -> [f64; 2] {
        let (a, b) = (self.start[axis], self.start[axis] + self.along[axis]);
        [a.min(b) - self.radius, a.max(b) + self.radius]
    }
}
