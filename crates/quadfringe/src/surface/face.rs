//! A mask-like face, composed of ellipsoids.

use std::sync::LazyLock;

use multiversion::multiversion;

use super::blend::{Blend, Ellipsoid, Lanes};
use super::cells::Cells;
use super::{REFERENCE_Z_MM, RangedRay, Surface, around, march, normal_of};
use crate::optics::Ray;

/// Mask-like face towards the camera: brow, eyes in their sockets, nose, cheeks, mouth and chin, smoothly joined; about
/// 140 mm wide, 190 mm high and 80 mm deep.
///
/// ```
/// use quadfringe::surface::{Face, Surface};
/// let face = Face::default();
/// assert!(face.value([6.0, 2.0, 790.0]) < 0.0);
/// assert!(face.value([6.0, 2.0, 700.0]) > 0.0);
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Face {
    centre_mm: [f64; 3],
}

impl Face {
    /// Face whose back lies in the plane through `centre_mm`, in the camera frame.
    #[must_use]
    pub const fn new(centre_mm: [f64; 3]) -> Self {
        Self { centre_mm }
    }
}

impl Default for Face {
    /// A face on the reference plane of the ready scenes.
    fn default() -> Self {
        Self::new([6.0, 2.0, REFERENCE_Z_MM])
    }
}

const fn add(centre: [f64; 3], radii: [f64; 3], rounding: f64) -> (Ellipsoid, Blend) {
    (Ellipsoid::new(centre, radii), Blend::Add(rounding))
}

const fn take(centre: [f64; 3], radii: [f64; 3], rounding: f64) -> (Ellipsoid, Blend) {
    (Ellipsoid::new(centre, radii), Blend::Carve(rounding))
}

/// Parts relative to the centre of the back of the head, mm. Parts off the centre line are mirrored.
const PARTS: [(Ellipsoid, Blend); 11] = [
    // Head, to which the others are joined.
    add([0.0; 3], [72.0, 98.0, 62.0], 0.0),
    // Cheeks, brow, chin.
    add([34.0, 20.0, -40.0], [24.0, 26.0, 18.0], 12.0),
    add([20.0, -36.0, -50.0], [28.0, 10.0, 12.0], 12.0),
    add([0.0, 72.0, -40.0], [24.0, 18.0, 16.0], 14.0),
    // Eye sockets and eyes.
    take([27.0, -18.0, -64.0], [17.0, 11.0, 12.0], 8.0),
    add([27.0, -18.0, -43.0], [13.0, 12.0, 12.0], 3.0),
    // Bridge and tip of the nose.
    add([0.0, 0.0, -58.0], [11.0, 32.0, 14.0], 10.0),
    add([4.0, 20.0, -66.0], [11.0, 10.0, 13.0], 8.0),
    // Lips, and the line between them.
    add([0.0, 43.0, -54.0], [21.0, 6.0, 8.0], 5.0),
    add([0.0, 54.0, -52.0], [18.0, 7.0, 8.0], 5.0),
    take([0.0, 48.5, -62.0], [24.0, 2.5, 5.0], 4.0),
];

/// Length over which the crease that mirroring leaves on the centre line is rounded off, mm.
const CREASE_MM: f64 = 4.0;

/// Least and greatest corner relative to the centre of the back of the head, mm.
const BOUNDS_MM: [[f64; 3]; 2] = [[-76.0, -102.0, -85.0], [76.0, 102.0, 0.0]];

static CELLS: LazyLock<Cells> =
    LazyLock::new(|| Cells::new(BOUNDS_MM, &PARTS.map(|(_, blend)| blend), part_value));

/// Value of one part at a point relative to the centre of the back of the head.
fn part_value(part: usize, [x, y, z]: [f64; 3]) -> f64 {
    let side = if part == 0 { x } else { x.hypot(CREASE_MM) };
    PARTS[part].0.value([side, y, z])
}

impl Face {
    fn own(&self, p_mm: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|i| p_mm[i] - self.centre_mm[i])
    }

    fn is_passed_by(&self, RangedRay { ray, range_mm }: &RangedRay) -> bool {
        CELLS.is_passed_by(&Ray { origin_mm: self.own(ray.origin_mm), ..*ray }, *range_mm)
    }
}

impl Surface for Face {
    fn value(&self, p_mm: [f64; 3]) -> f64 {
        let [x, y, z] = self.own(p_mm);
        let side = [x.hypot(CREASE_MM), y, z];
        CELLS.blended([x, y, z], |part| PARTS[part].0.value(if part == 0 { [x, y, z] } else { side }))
    }

    fn bounds_mm(&self) -> [[f64; 3]; 2] {
        BOUNDS_MM.map(|corner| std::array::from_fn(|i| self.centre_mm[i] + corner[i]))
    }

    fn value_floor(&self, p_mm: [f64; 3]) -> f64 {
        CELLS.floor_mm(self.own(p_mm)).unwrap_or(f64::NEG_INFINITY)
    }

    fn hit(&self, ray: &Ray, range_mm: [f64; 2]) -> Option<f64> {
        if self.is_passed_by(&RangedRay { ray: *ray, range_mm }) {
            return None;
        }
        march::first_crossing(self, ray, range_mm)
    }

    fn hit_all(&self, rays: &[RangedRay]) -> Vec<Option<f64>> {
        let mut found = vec![None; rays.len()];
        let wanted = (0..rays.len()).filter(|index| !self.is_passed_by(&rays[*index]));
        march::first_crossings(self, |points| values(self.centre_mm, points), rays, wanted, &mut found);
        found
    }

    fn normal(&self, p_mm: [f64; 3]) -> [f64; 3] {
        normal_of(values(self.centre_mm, &around(p_mm)))
    }
}

/// Values at several points, by coordinate.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn values(centre_mm: [f64; 3], p_mm: &[Lanes; 3]) -> Lanes {
    let mut own = *p_mm;
    for (line, centre) in own.iter_mut().zip(centre_mm) {
        line.iter_mut().for_each(|c| *c -= centre);
    }
    let side = [own[0].map(|x| x.hypot(CREASE_MM)), own[1], own[2]];
    let cells = &*CELLS;
    cells.blended_all(cells.parts_at_all(&own), |part| {
        PARTS[part].0.values(if part == 0 { &own } else { &side })
    })
}
