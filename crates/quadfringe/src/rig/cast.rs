//! Ray casting: one ray through each camera pixel, and the projector position that lights the surface point it meets
//! (S9).

use ndarray::Array2;
use rayon::prelude::*;

use super::params::{PIXELS_AT_ONCE, SHADOW_GAP_MM, STEP_FOOTPRINTS};
use super::{Bench, Projector};
use crate::optics::{Device, Ray, dot};
use crate::surface::{RangedRay, Surface};

/// What one camera pixel sees.
///
/// ```
/// use quadfringe::{Device, rig::{Projector, Bench}, surface::Plane};
/// let mut bench = Bench::reference();
/// bench.camera = Device::pinhole(8, 6, [20.0, 20.0], [3.5, 2.5])?;
/// let cast = bench.cast(&Plane::at_z(800.0));
/// assert!(cast.hits()[[3, 4]].is_lit(Projector::Visible));
/// # Ok::<(), quadfringe::error::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Point of the surface in the camera frame, mm; NaN where the ray meets nothing.
    pub xyz_mm: [f64; 3],
    /// Projector column and row that light the point, for each [`Projector`]; NaN in shadow and outside the projected image.
    pub lit_from_px: [[f64; 2]; 2],
    /// Cosine between the surface normal and the direction to each projector.
    pub facing: [f64; 2],
}

impl Hit {
    const NOTHING: Self =
        Self { xyz_mm: [f64::NAN; 3], lit_from_px: [[f64::NAN; 2]; 2], facing: [f64::NAN; 2] };

    /// Whether the pixel sees a surface.
    #[must_use]
    pub fn is_surface(&self) -> bool {
        !self.xyz_mm[2].is_nan()
    }

    /// Whether a projector lights the point.
    #[must_use]
    pub fn is_lit(&self, projector: Projector) -> bool {
        !self.lit_from_px[projector.index()][0].is_nan()
    }
}

/// A scene as the bench sees it. [`Bench::cast`] makes it once; it can be rendered any number of times and holds the
/// truth for comparisons.
///
/// ```
/// use quadfringe::{Device, rig::{Projector, Bench}, surface::Plane};
/// let mut bench = Bench::reference();
/// bench.camera = Device::pinhole(8, 6, [20.0, 20.0], [3.5, 2.5])?;
/// let cast = bench.cast(&Plane::at_z(800.0));
/// assert_eq!(cast.depth_mm()[[3, 4]], 800.0);
/// assert!(cast.column_px(Projector::Visible)[[3, 4]] > 400.0);
/// # Ok::<(), quadfringe::error::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Cast {
    pub(super) hits: Array2<Hit>,
    /// Hits of the infrared pixels, if the infrared chip is not registered with the visible one.
    pub(super) infrared_hits: Option<Array2<Hit>>,
    /// Neighbouring pixels whose depths differ by more than this, in mm per mm of depth, have a step between them.
    pub(super) step_per_depth: f64,
}

impl Bench {
    /// Casts a ray from each pixel of both chips to the surface, and a shadow ray from each projector to the hit; rows
    /// in parallel.
    ///
    /// A projector lights a point that faces it, lies within the projected image, and is not in the shadow of another point.
    #[must_use]
    pub fn cast(&self, surface: &dyn Surface) -> Cast {
        let infrared = self.visible_from_infrared();
        let step_per_depth = STEP_FOOTPRINTS / self.camera.focal_px[0].min(self.camera.focal_px[1]);
        Cast {
            hits: self.hits(surface, [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]),
            infrared_hits: infrared.map(|from_infrared| self.hits(surface, from_infrared)),
            step_per_depth,
        }
    }

    /// Hits of the pixels (x, y) of a chip; `visible` maps (x, y, 1) to the visible pixel that sees the same point.
    fn hits(&self, surface: &dyn Surface, visible: [[f64; 3]; 2]) -> Array2<Hit> {
        let size = (self.camera.height, self.camera.width);
        let mut hits = vec![Hit::NOTHING; size.0 * size.1];
        hits.par_chunks_mut(PIXELS_AT_ONCE).enumerate().for_each(|(chunk, line)| {
            let ray = |index: usize| {
                let index = chunk * PIXELS_AT_ONCE + index;
                let (x, y) = ((index % size.1) as f64, (index / size.1) as f64);
                self.camera.ray(visible.map(|r| r[0] * x + r[1] * y + r[2]))
            };
            let ranged = |index| RangedRay { ray: ray(index), range_mm: [0.0, f64::INFINITY] };
            let rays: Vec<RangedRay> = (0..line.len()).map(ranged).collect();
            let mut seen: Vec<Seen> = Vec::with_capacity(line.len());
            for (index, found) in surface.hit_all(&rays).into_iter().enumerate() {
                if let Some(t) = found {
                    let point = rays[index].ray.at(t);
                    line[index].xyz_mm = point;
                    seen.push(Seen { index, point, normal: surface.normal(point) });
                }
            }
            self.light(surface, &seen, line);
        });
        Array2::from_shape_vec(size, hits).expect("one hit for each pixel")
    }

    /// Sets the light of both projectors at the pixels of `line` that see the surface.
    fn light(&self, surface: &dyn Surface, seen: &[Seen], line: &mut [Hit]) {
        for projector in Projector::ALL {
            let side = projector.index();
            if side == 1 && self.visible == self.infrared {
                for hit in line {
                    hit.lit_from_px[1] = hit.lit_from_px[0];
                    hit.facing[1] = hit.facing[0];
                }
                break;
            }
            for (Seen { index, .. }, lit) in seen.iter().zip(lit_by(self.projector(projector), surface, seen))
            {
                line[*index].facing[side] = lit.facing;
                line[*index].lit_from_px[side] = lit.from_px.unwrap_or([f64::NAN; 2]);
            }
        }
    }
}

/// A point of the surface that a pixel of several sees.
struct Seen {
    index: usize,
    point: [f64; 3],
    normal: [f64; 3],
}

/// Light of a projector at a point of the surface.
struct Lit {
    /// Cosine between the surface normal and the direction to the projector.
    facing: f64,
    /// Projector column and row that light the point; `None` in shadow and outside the image.
    from_px: Option<[f64; 2]>,
}

/// Light of a projector at points of the surface.
fn lit_by(projector: &Device, surface: &dyn Surface, seen: &[Seen]) -> Vec<Lit> {
    let centre = projector.centre_mm();
    // Rays to the points that are lit unless something stands in the way.
    let (mut rays, mut indices) = (Vec::with_capacity(seen.len()), Vec::with_capacity(seen.len()));
    let mut lights = Vec::with_capacity(seen.len());
    for Seen { point, normal, .. } in seen {
        let away: [f64; 3] = std::array::from_fn(|i| point[i] - centre[i]);
        let distance = dot(away, away).sqrt();
        let ray = Ray { origin_mm: centre, direction: away.map(|c| c / distance) };
        let facing = -dot(*normal, ray.direction);
        let from_px = projector.project(*point).filter(|pixel| facing > 0.0 && projector.contains(*pixel));
        if from_px.is_some() {
            rays.push(RangedRay { ray, range_mm: [0.0, distance - SHADOW_GAP_MM] });
            indices.push(lights.len());
        }
        lights.push(Lit { facing, from_px });
    }
    for (index, in_the_way) in indices.into_iter().zip(surface.hit_all(&rays)) {
        if in_the_way.is_some() {
            lights[index].from_px = None;
        }
    }
    lights
}
