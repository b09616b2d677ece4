//! Smooth bodies and their blends. The value of each body and of each blend changes by at most 1 per mm.

use crate::optics::dot;

/// Points that are evaluated at the same time.
pub(super) const LANES: usize = 8;
/// A value at each of these points.
pub(super) type Lanes = [f64; LANES];

/// How a part is joined to the previous parts; the seam is rounded off over a length in mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Blend {
    Add(f64),
    Carve(f64),
}

impl Blend {
    /// Value of the body with the part.
    pub(super) fn apply(self, body: f64, part: f64) -> f64 {
        match self {
            Self::Add(rounding) => join(body, part, rounding),
            Self::Carve(rounding) => -join(-body, part, rounding),
        }
    }

    /// [`Blend::apply`] at several points.
    #[inline(always)]
    pub(super) fn apply_all(self, body: Lanes, part: Lanes) -> Lanes {
        match self {
            Self::Add(rounding) => join_all(body, part, rounding),
            Self::Carve(rounding) => join_all(body.map(|v| -v), part, rounding).map(|v| -v),
        }
    }

    /// Whether [`Blend::apply`] gives exactly `body` wherever both values change by at most `reach_mm`.
    pub(super) fn is_idle(self, body: f64, part: f64, reach_mm: f64) -> bool {
        match self {
            Self::Add(rounding) => part - body >= rounding + 2.0 * reach_mm,
            Self::Carve(rounding) => part + body >= rounding + 2.0 * reach_mm,
        }
    }

    /// Whether [`Blend::apply`] gives exactly `part` wherever both values change by at most `reach_mm`.
    pub(super) fn replaces(self, body: f64, part: f64, reach_mm: f64) -> bool {
        matches!(self, Self::Add(rounding) if body - part >= rounding + 2.0 * reach_mm)
    }
}

/// Smooth union: the smaller of two values, rounded off where they differ by less than `k` mm.
fn join(a: f64, b: f64, k: f64) -> f64 {
    if (a - b).abs() >= k { a.min(b) } else { join_everywhere(a, b, k) }
}

/// [`join`] at several points; the division is left out where none of them lies in the seam.
#[inline(always)]
fn join_all(a: Lanes, b: Lanes, k: f64) -> Lanes {
    let (mut found, mut seam) = ([0.0; LANES], false);
    for i in 0..LANES {
        found[i] = a[i].min(b[i]);
        seam |= (a[i] - b[i]).abs() < k;
    }
    if seam {
        for i in 0..LANES {
            found[i] = join_everywhere(a[i], b[i], k);
        }
    }
    found
}

/// [`join`] without branches.
#[inline(always)]
fn join_everywhere(a: f64, b: f64, k: f64) -> f64 {
    let overlap = (k - (a - b).abs()).max(0.0);
    a.min(b) - overlap * overlap / (4.0 * k)
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

    /// Values at several points, by coordinate.
    #[inline(always)]
    pub(super) fn values(&self, p: &[Lanes; 3]) -> Lanes {
        let (centre, scale) = (self.centre, self.one_over_radii);
        let mut found = [0.0; LANES];
        for i in 0..LANES {
            let q = [
                (p[0][i] - centre[0]) * scale[0],
                (p[1][i] - centre[1]) * scale[1],
                (p[2][i] - centre[2]) * scale[2],
            ];
            found[i] = (dot(q, q).sqrt() - 1.0) * self.least_radius;
        }
        found
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

    /// Signed distances of several points, by coordinate.
    #[inline(always)]
    pub(super) fn values(&self, p: &[Lanes; 3]) -> Lanes {
        let (start, along) = (self.start, self.along);
        let mut found = [0.0; LANES];
        for i in 0..LANES {
            let v = [p[0][i] - start[0], p[1][i] - start[1], p[2][i] - start[2]];
            let t = (dot(v, along) * self.scale).clamp(0.0, 1.0);
            let away = [v[0] - t * along[0], v[1] - t * along[1], v[2] - t * along[2]];
            found[i] = dot(away, away).sqrt() - self.radius;
        }
        found
    }

    /// Least and greatest coordinate of the body along an axis.
    pub(super) fn extent(&self, axis: usize) -> [f64; 2] {
        let (a, b) = (self.start[axis], self.start[axis] + self.along[axis]);
        [a.min(b) - self.radius, a.max(b) + self.radius]
    }
}
