//! A grid of cells around a blend of bodies, which saves time and changes no bit of a result.
//!
//! A blend leaves a value exactly as it is, or replaces it, where two bodies are further apart than their seam is wide.
//! Each cell lists the parts that can do anything else in it, so that the other parts need no evaluation.

use super::blend::{Blend, LANES, Lanes};
use super::march::clip;
use super::params::{CELL_MM, CELL_SLACK_MM, CELL_STEP_MIN_MM};
use crate::optics::Ray;

/// The cells of a box. Values of parts and of their blend change by at most 1 per mm.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Cells {
    bounds_mm: [[f64; 3]; 2],
    /// Cells along x, y, z.
    counts: [usize; 3],
    blends: Vec<Blend>,
    /// The parts that count in each cell, one bit for each.
    parts: Vec<u32>,
    /// For each cell, a value that is nowhere in it greater than that of the blend.
    floors_mm: Vec<f32>,
}

impl Cells {
    /// Cells of a box around at most 32 parts that are blended in their order; `value` gives the value of a part at a
    /// point. The first part has no blend to obey.
    pub(super) fn new(
        bounds_mm: [[f64; 3]; 2],
        blends: &[Blend],
        value: impl Fn(usize, [f64; 3]) -> f64,
    ) -> Self {
        assert!((1..=u32::BITS as usize).contains(&blends.len()), "one bit for each part");
        let [low, high] = bounds_mm;
        let counts = std::array::from_fn(|i| ((high[i] - low[i]) / CELL_MM).ceil().max(1.0) as usize);
        let [nx, ny, nz] = counts;
        let mut cells =
            Self { bounds_mm, counts, blends: blends.to_vec(), parts: Vec::new(), floors_mm: Vec::new() };
        for (z, y, x) in (0..nz).flat_map(|z| (0..ny).flat_map(move |y| (0..nx).map(move |x| (z, y, x)))) {
            let place = [x, y, z];
            let centre = std::array::from_fn(|i| low[i] + (place[i] as f64 + 0.5) * CELL_MM);
            cells.add(|part| value(part, centre));
        }
        cells
    }

    /// Add a cell; `value` gives the value of a part at its centre.
    fn add(&mut self, value: impl Fn(usize) -> f64) {
        let reach_mm = 0.5 * 3f64.sqrt() * CELL_MM + CELL_SLACK_MM;
        let (mut parts, mut body) = (0, f64::INFINITY);
        for (part, blend) in self.blends.iter().enumerate() {
            let found = value(part);
            if part == 0 || blend.replaces(body, found, reach_mm) {
                (parts, body) = (1 << part, found);
            } else if !blend.is_idle(body, found, reach_mm) {
                (parts, body) = (parts | 1 << part, blend.apply(body, found));
            }
        }
        self.parts.push(parts);
        self.floors_mm.push((body - reach_mm) as f32);
    }

    /// Least and greatest corner of the box, mm.
    pub(super) const fn bounds_mm(&self) -> [[f64; 3]; 2] {
        self.bounds_mm
    }

    /// Value of the blend at a point; `value` gives that of a part there.
    pub(super) fn blended(&self, p_mm: [f64; 3], value: impl Fn(usize) -> f64) -> f64 {
        let mut parts = Bits(self.parts_at(p_mm));
        let first = parts.next().map_or(f64::INFINITY, &value);
        parts.fold(first, |body, part| self.blends[part].apply(body, value(part)))
    }

    /// Values of the blend of `parts` at several points, where all parts count that [`Cells::parts_at`] gives for the points.
    #[inline(always)]
    pub(super) fn blended_all(&self, parts: u32, value: impl Fn(usize) -> Lanes) -> Lanes {
        let mut parts = Bits(parts);
        let mut body = parts.next().map_or([f64::INFINITY; LANES], &value);
        for part in parts {
            body = self.blends[part].apply_all(body, value(part));
        }
        body
    }

    /// Parts that count at several points, by coordinate.
    pub(super) fn parts_at_all(&self, p_mm: &[Lanes; 3]) -> u32 {
        let [x, y, z] = p_mm;
        (0..LANES).fold(0, |parts, i| parts | self.parts_at([x[i], y[i], z[i]]))
    }

    /// A value that is not greater than that of the blend at a point; `None` outside the box.
    pub(super) fn floor_mm(&self, p_mm: [f64; 3]) -> Option<f64> {
        self.cell(p_mm).map(|cell| f64::from(self.floors_mm[cell]) - CELL_SLACK_MM)
    }

    /// How far a point is outside the box along one axis at least, mm; negative inside.
    pub(super) fn outside_mm(&self, p_mm: [f64; 3]) -> f64 {
        let [low, high] = self.bounds_mm;
        (0..3).fold(f64::NEG_INFINITY, |most, i| most.max(low[i] - p_mm[i]).max(p_mm[i] - high[i]))
    }

    /// Whether the ray certainly stays outside the blend within the range. `false` says nothing.
    pub(super) fn is_passed_by(&self, ray: &Ray, range_mm: [f64; 2]) -> bool {
        let Some([mut t, end]) = clip(ray, self.bounds_mm, range_mm) else {
            return true;
        };
        while t <= end {
            match self.floor_mm(ray.at(t)) {
                Some(floor) if floor > CELL_STEP_MIN_MM => t += floor,
                _ => return false,
            }
        }
        true
    }

    fn parts_at(&self, p_mm: [f64; 3]) -> u32 {
        self.cell(p_mm).map_or(u32::MAX >> (u32::BITS as usize - self.blends.len()), |cell| self.parts[cell])
    }

    /// Number of the cell that holds a point; `None` outside the box, and for NaN.
    #[inline]
    fn cell(&self, p_mm: [f64; 3]) -> Option<usize> {
        let [low, _] = self.bounds_mm;
        let mut place = [0; 3];
        for axis in 0..3 {
            let position = (p_mm[axis] - low[axis]) * (1.0 / CELL_MM);
            if !(position >= 0.0 && position < self.counts[axis] as f64) {
                return None;
            }
            place[axis] = position as usize;
        }
        let [x, y, z] = place;
        Some((z * self.counts[1] + y) * self.counts[0] + x)
    }
}

/// Numbers of the bits that are set, from the lowest.
struct Bits(u32);

impl Iterator for Bits {
    type Item = usize;

    #[inline(always)]
    fn next(&mut self) -> Option<usize> {
        let bits = self.0;
        self.0 = bits & bits.wrapping_sub(1);
        (bits != 0).then(|| bits.trailing_zeros() as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::blend::Capsule;

    const BOUNDS_MM: [[f64; 3]; 2] = [[-40.0; 3], [40.0; 3]];

    fn capsules() -> [Capsule; 5] {
        [[0.0, 9.0, 3.0], [20.0, -14.0, 8.0], [-22.0, 4.0, -6.0], [5.0, 25.0, 11.0], [-3.0, -2.0, 24.0]]
            .map(|[x, y, z]| Capsule::new([x, y, z], [x + 4.0, 0.5 * y - 6.0, -z], 4.0))
    }

    #[test]
    fn cells_change_no_bit_and_their_floors_hold() {
        let bodies = capsules();
        let blends = [Blend::Add(7.0), Blend::Add(7.0), Blend::Carve(3.0), Blend::Add(5.0), Blend::Add(7.0)];
        let cells = Cells::new(BOUNDS_MM, &blends, |part, p| bodies[part].value(p));
        let mut fewer = 0;
        for i in 0..40_000u32 {
            let noise = |k: u32| f64::from((i * 3 + k).wrapping_mul(2_654_435_761)) / 4.3e9 - 0.5;
            let p = [noise(0), noise(1), noise(2)].map(|c| 88.0 * c);
            let value = |part: usize| bodies[part].value(p);
            let whole = (1..5).fold(value(0), |body, part| blends[part].apply(body, value(part)));
            assert_eq!(cells.blended(p, value).to_bits(), whole.to_bits(), "{p:?}");
            assert!(cells.floor_mm(p).is_none_or(|floor| floor <= whole), "{p:?}");
            let all =
                cells.blended_all(cells.parts_at(p), |part| bodies[part].values(&p.map(|c| [c; LANES])));
            assert_eq!(all.map(f64::to_bits), [whole.to_bits(); LANES], "{p:?}");
            fewer += i32::from(cells.parts_at(p).count_ones() < 5);
        }
        assert!(fewer > 20_000, "{fewer}");
    }

    #[test]
    fn rays_that_pass_differ_from_rays_that_may_hit() {
        let body = Capsule::new([0.0; 3], [0.0, 9.0, 0.0], 4.0);
        let cells = Cells::new(BOUNDS_MM, &[Blend::Add(7.0)], |_, p| body.value(p));
        let passed = |x: f64, z: f64| {
            let ray = Ray { origin_mm: [x, 0.0, -100.0], direction: [0.0, 0.0, z] };
            cells.is_passed_by(&ray, [0.0, f64::INFINITY])
        };
        assert!(passed(30.0, 1.0) && passed(50.0, 1.0) && passed(0.0, -1.0));
        assert!(!passed(0.0, 1.0) && !passed(3.9, 1.0) && !passed(0.0, f64::NAN));
    }
}
