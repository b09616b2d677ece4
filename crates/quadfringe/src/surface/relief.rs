//! Relief from a grid of heights.

use ndarray::Array2;

use super::Surface;
use crate::error::{Error, Result};

/// Upper bound of the rate at which the value of a relief changes along a direction, given the greatest slope of the
/// relief.
pub(super) fn relief_rate(slope: f64, [x, y, z]: [f64; 3]) -> f64 {
    z.abs() + slope * x.hypot(y)
}

/// Interpolation of a height map between its samples.
///
/// ```
/// use quadfringe::surface::Interpolation;
/// assert_eq!(Interpolation::default(), Interpolation::Bicubic);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
#[non_exhaustive]
pub enum Interpolation {
    /// Bilinear, with creases at the grid lines.
    Bilinear,
    /// Bicubic (Catmull-Rom), with a continuous slope.
    #[default]
    Bicubic,
}

/// Solid block with side walls whose face is a relief: a grid of heights over a plane of constant depth, positive
/// towards the camera.
///
/// ```
/// use ndarray::Array2;
/// use quadfringe::surface::{HeightMap, Interpolation, Surface};
/// let ramp = Array2::from_shape_fn((5, 5), |(_, column)| column as f64);
/// let map = HeightMap::new(ramp, [-2.0, -2.0], [1.0, 1.0], 800.0, Interpolation::Bilinear)?;
/// assert!((map.value([0.5, 0.0, 790.0]) - 7.5).abs() < 1e-12);
/// # Ok::<(), quadfringe::error::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct HeightMap {
    heights_mm: Array2<f64>,
    origin_mm: [f64; 2],
    pitch_mm: [f64; 2],
    z_mm: f64,
    interpolation: Interpolation,
    slope: f64,
    bounds_mm: [[f64; 3]; 2],
}

impl HeightMap {
    /// Relief from heights in mm (rows along y, columns along x) over the plane z = `z_mm`; `origin_mm` is the position
    /// (x, y) of the first sample and `pitch_mm` the distance between samples along x and y.
    ///
    /// # Errors
    /// [`Error::Value`] when the map has fewer than 2 x 2 samples, a height or place is not finite, or a pitch is not
    /// positive.
    pub fn new(
        heights_mm: Array2<f64>,
        origin_mm: [f64; 2],
        pitch_mm: [f64; 2],
        z_mm: f64,
        interpolation: Interpolation,
    ) -> Result<Self> {
        check_grid(&heights_mm, origin_mm, pitch_mm, z_mm)?;
        let (rows, columns) = heights_mm.dim();
        let low = heights_mm.iter().fold(f64::INFINITY, |a, b| a.min(*b));
        let high = heights_mm.iter().fold(f64::NEG_INFINITY, |a, b| a.max(*b));
        // Catmull-Rom can overshoot the samples by an eighth of their range on either side, along x and then along y.
        let overshoot = match interpolation {
            Interpolation::Bilinear => 0.0,
            Interpolation::Bicubic => 0.3 * (high - low),
        };
        let end = [(columns - 1) as f64, (rows - 1) as f64];
        let bounds_mm = [
            [origin_mm[0], origin_mm[1], z_mm - high - overshoot],
            [
                origin_mm[0] + end[0] * pitch_mm[0],
                origin_mm[1] + end[1] * pitch_mm[1],
                z_mm - low + overshoot,
            ],
        ];
        let slope = steepest(&heights_mm, pitch_mm, interpolation);
        Ok(Self { heights_mm, origin_mm, pitch_mm, z_mm, interpolation, slope, bounds_mm })
    }

    fn height(&self, x_mm: f64, y_mm: f64) -> f64 {
        let (rows, columns) = self.heights_mm.dim();
        let GridPlace { cell: row, part: v } = place((y_mm - self.origin_mm[1]) / self.pitch_mm[1], rows);
        let GridPlace { cell: column, part: u } =
            place((x_mm - self.origin_mm[0]) / self.pitch_mm[0], columns);
        match self.interpolation {
            Interpolation::Bilinear => {
                let line = |r: usize| {
                    let [a, b] = [self.heights_mm[[r, column]], self.heights_mm[[r, column + 1]]];
                    a + u * (b - a)
                };
                line(row) + v * (line(row + 1) - line(row))
            }
            Interpolation::Bicubic => {
                let at = |base: usize, k: usize, n: usize| (base + k).saturating_sub(1).min(n - 1);
                let lines = std::array::from_fn(|i| {
                    let r = at(row, i, rows);
                    catmull_rom(std::array::from_fn(|j| self.heights_mm[[r, at(column, j, columns)]]), u)
                });
                catmull_rom(lines, v)
            }
        }
    }
}

fn check_grid(heights_mm: &Array2<f64>, origin_mm: [f64; 2], pitch_mm: [f64; 2], z_mm: f64) -> Result<()> {
    let (rows, columns) = heights_mm.dim();
    if rows < 2 || columns < 2 {
        let actual = format!("{rows} x {columns}");
        return Err(Error::value("height map (rows x columns)", "at least 2 x 2 samples", actual));
    }
    if let Some(bad) = heights_mm.iter().find(|h| !h.is_finite()) {
        return Err(Error::value("height map", "finite heights in mm", bad));
    }
    let placed = origin_mm.iter().chain(&pitch_mm).all(|v| v.is_finite()) && z_mm.is_finite();
    if !placed || pitch_mm.iter().any(|p| *p <= 0.0) {
        let actual = format!("origin {origin_mm:?} mm, pitch {pitch_mm:?} mm, z {z_mm} mm");
        return Err(Error::value("height map", "a finite place and a positive pitch", actual));
    }
    Ok(())
}

/// Upper bound of the slope between samples, from the differences of neighbouring samples. Catmull-Rom turns
/// differences of at most 1 into a slope of at most 1.375 along its axis, and amplifies across this axis by at most
/// 1.25.
fn steepest(heights_mm: &Array2<f64>, pitch_mm: [f64; 2], interpolation: Interpolation) -> f64 {
    let (rows, columns) = heights_mm.dim();
    let mut worst = [0f64; 2];
    for ((row, column), height) in heights_mm.indexed_iter() {
        if column + 1 < columns {
            worst[0] = worst[0].max((heights_mm[[row, column + 1]] - height).abs());
        }
        if row + 1 < rows {
            worst[1] = worst[1].max((heights_mm[[row + 1, column]] - height).abs());
        }
    }
    let factor = match interpolation {
        Interpolation::Bilinear => 1.0,
        Interpolation::Bicubic => 1.375 * 1.25,
    };
    factor * (worst[0] / pitch_mm[0]).hypot(worst[1] / pitch_mm[1])
}

/// A position along one axis of the grid.
struct GridPlace {
    /// Index of the sample before the position.
    cell: usize,
    /// Distance from that sample divided by the pitch, in [0, 1].
    part: f64,
}

/// The grid cell that contains a position, which is given in samples. A position beyond the grid is moved to its
/// border.
fn place(position: f64, samples: usize) -> GridPlace {
    let held = position.clamp(0.0, (samples - 1) as f64);
    let index = (held as usize).min(samples - 2);
    GridPlace { cell: index, part: held - index as f64 }
}

/// Cubic through the two middle samples with slopes from their neighbours.
fn catmull_rom([p0, p1, p2, p3]: [f64; 4], t: f64) -> f64 {
    let slope = p2 - p0;
    let bend = 2.0 * p0 - 5.0 * p1 + 4.0 * p2 - p3;
    let twist = 3.0 * (p1 - p2) + p3 - p0;
    p1 + 0.5 * t * (slope + t * (bend + t * twist))
}

impl Surface for HeightMap {
    fn value(&self, [x, y, z]: [f64; 3]) -> f64 {
        self.z_mm - self.height(x, y) - z
    }

    fn bounds_mm(&self) -> [[f64; 3]; 2] {
        self.bounds_mm
    }

    fn rate_limit(&self, direction: [f64; 3]) -> f64 {
        relief_rate(self.slope, direction)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optics::Ray;

    #[test]
    fn both_interpolations_keep_the_samples_and_the_stated_slope() {
        let grid = Array2::from_shape_fn((12, 15), |(r, c)| ((r * 7 + c * 13) % 11) as f64 * 0.8);
        for kind in [Interpolation::Bilinear, Interpolation::Bicubic] {
            let map = HeightMap::new(grid.clone(), [-10.0, 5.0], [1.5, 2.0], 800.0, kind).expect("valid map");
            assert!((map.height(-10.0 + 1.5 * 4.0, 5.0 + 2.0 * 3.0) - grid[[3, 4]]).abs() < 1e-12);
            for i in 0..5000 {
                let (x, y) = (-10.0 + 0.0042 * f64::from(i), 5.0 + 0.0043 * f64::from((i * 37) % 5000));
                let rise = map.height(x + 6e-5, y + 8e-5) - map.height(x, y);
                assert!(rise.abs() / 1e-4 <= map.slope * (1.0 + 1e-6));
                let z = 800.0 - map.height(x, y);
                assert!(map.bounds_mm[0][2] <= z && z <= map.bounds_mm[1][2]);
            }
        }
    }

    #[test]
    fn refuses_bad_grids() {
        let grid = || Array2::<f64>::zeros((3, 3));
        let kind = Interpolation::Bicubic;
        assert!(HeightMap::new(Array2::zeros((1, 3)), [0.0; 2], [1.0; 2], 800.0, kind).is_err());
        assert!(HeightMap::new(grid(), [0.0; 2], [0.0, 1.0], 800.0, kind).is_err());
        assert!(HeightMap::new(grid() + f64::NAN, [0.0; 2], [1.0; 2], 800.0, kind).is_err());
    }

    #[test]
    fn a_ray_past_the_grid_meets_nothing() {
        let map = HeightMap::new(Array2::zeros((3, 3)), [0.0; 2], [1.0; 2], 800.0, Interpolation::Bilinear)
            .expect("valid map");
        let ray = |x: f64| Ray { origin_mm: [x, 1.0, 0.0], direction: [0.0, 0.0, 1.0] };
        assert_eq!(map.hit(&ray(5.0), [0.0, 1e4]), None);
        assert_eq!(map.hit(&ray(1.0), [0.0, 1e4]), Some(800.0));
    }
}
