//! A mask-like face, composed of ellipsoids.

use super::blend::{Ellipsoid, carve, join};
use super::{REFERENCE_Z_MM, Surface};

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

/// How a part is joined to the previous parts; the seam is rounded off over a length in mm.
#[derive(Clone, Copy)]
enum Blend {
    Add(f64),
    Carve(f64),
}

const fn add(centre: [f64; 3], radii: [f64; 3], rounding: f64) -> (Ellipsoid, Blend) {
    (Ellipsoid::new(centre, radii), Blend::Add(rounding))
}

const fn take(centre: [f64; 3], radii: [f64; 3], rounding: f64) -> (Ellipsoid, Blend) {
    (Ellipsoid::new(centre, radii), Blend::Carve(rounding))
}

const HEAD: Ellipsoid = Ellipsoid::new([0.0; 3], [72.0, 98.0, 62.0]);

/// Parts relative to the centre of the back of the head, mm. Parts off the centre line are mirrored.
const PARTS: [(Ellipsoid, Blend); 10] = [
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

impl Surface for Face {
    fn value(&self, p_mm: [f64; 3]) -> f64 {
        let [x, y, z]: [f64; 3] = std::array::from_fn(|i| p_mm[i] - self.centre_mm[i]);
        let side = [x.hypot(CREASE_MM), y, z];
        PARTS.iter().fold(HEAD.value([x, y, z]), |face, (part, blend)| match blend {
            Blend::Add(rounding) => join(face, part.value(side), *rounding),
            Blend::Carve(rounding) => carve(face, part.value(side), *rounding),
        })
    }

    fn bounds_mm(&self) -> [[f64; 3]; 2] {
        let [x, y, z] = self.centre_mm;
        [[x - 76.0, y - 102.0, z - 85.0], [x + 76.0, y + 102.0, z]]
    }
}
