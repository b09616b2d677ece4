//! A print on a flat board, as the camera sees it.

use ndarray::{Array2, Array3, Axis};
use rayon::prelude::*;

use super::Bench;
use super::params::PRINT_SAMPLES_MAX;
use crate::error::{Error, Result};
use crate::optics::{Device, Pose};

/// A print on the plane z = 0 of a posed board: ink on paper.
///
/// ```
/// use ndarray::array;
/// use quadfringe::optics::{Pose, rotation_from_vector};
/// use quadfringe::rig::Print;
/// let pose = Pose::new(rotation_from_vector([0.0; 3]), [0.0, 0.0, 800.0])?;
/// let chessboard = array![[1.0, 0.0], [0.0, 1.0]];
/// let print = Print { coverage: chessboard, pitch_mm: 30.0, origin_mm: [-15.0; 2], paper: [0.9; 4], ink: [0.1; 4], pose };
/// let mut bench = quadfringe::rig::Bench::reference();
/// bench.camera = quadfringe::Device::pinhole(64, 48, [161.0, 161.0], [31.5, 23.5])?;
/// let albedo = bench.printed(&print)?;
/// assert!(albedo[[20, 28, 0]] < 0.3 && albedo[[20, 35, 0]] > 0.8);
/// # Ok::<(), quadfringe::error::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Print {
    /// Inked share of each texel, 0 to 1, rows along y. It is interpolated between texels; outside the image there is
    /// paper.
    pub coverage: Array2<f32>,
    /// Distance of neighbouring texels, mm.
    pub pitch_mm: f64,
    /// Centre of the first texel (x, y) on the board, mm.
    pub origin_mm: [f64; 2],
    /// Albedo of bare paper: R, G, B, IR.
    pub paper: [f32; 4],
    /// Albedo of solid ink: R, G, B, IR. Many inks are nearly clear in the infrared.
    pub ink: [f32; 4],
    /// Pose of the board, `T_camera_board`.
    pub pose: Pose,
}

impl Print {
    fn check(&self) -> Result<()> {
        let share = |v: &f32| (0.0..=1.0).contains(v);
        if self.coverage.is_empty() || !self.coverage.iter().all(share) {
            return Err(Error::value("coverage of a print", "an image of shares from 0 to 1", "another"));
        }
        let albedo_is_valid = self.paper.iter().chain(&self.ink).all(|a| a.is_finite() && *a >= 0.0);
        let place_is_valid = self.pitch_mm > 0.0 && self.pitch_mm.is_finite();
        if albedo_is_valid && place_is_valid && self.origin_mm.iter().all(|c| c.is_finite()) {
            return Ok(());
        }
        let expected = "a positive pitch, a finite origin and albedos of at least 0";
        let actual = format!(
            "pitch {} mm, origin {:?} mm, {:?}",
            self.pitch_mm,
            self.origin_mm,
            [self.paper, self.ink]
        );
        Err(Error::value("print", expected, actual))
    }

    /// Texel coordinates (column, row) of the point where the ray of a camera pixel meets the plane of the board; NaN if it
    /// does not meet it.
    fn texel(&self, camera: &Device, pixel: [f64; 2]) -> [f64; 2] {
        let ray = camera.ray(pixel);
        let origin = self.pose.body_from_camera(ray.origin_mm);
        let direction = self.pose.body_from_direction(ray.direction);
        let t = -origin[2] / direction[2];
        if t.is_nan() || t <= 0.0 {
            return [f64::NAN; 2];
        }
        std::array::from_fn(|i| (origin[i] + t * direction[i] - self.origin_mm[i]) / self.pitch_mm)
    }

    /// Inked share of the cell whose corners have these texel coordinates: upper left, upper right, lower left, lower right.
    fn mean(&self, corners: [[f64; 2]; 4]) -> f64 {
        let [a, b, c, d] = corners;
        let extent = |p: [f64; 2], q: [f64; 2]| (p[0] - q[0]).hypot(p[1] - q[1]);
        let largest = extent(a, d).max(extent(b, c));
        if largest.is_nan() {
            return 0.0;
        }
        let samples = (largest + 1.0).min(PRINT_SAMPLES_MAX) as usize;
        let place = |i: usize| (i as f64 + 0.5) / samples as f64;
        let mut sum = 0.0;
        for v in (0..samples).map(place) {
            for u in (0..samples).map(place) {
                let weights = [(1.0 - u) * (1.0 - v), u * (1.0 - v), (1.0 - u) * v, u * v];
                let at = std::array::from_fn(|k| (0..4).map(|i| weights[i] * corners[i][k]).sum::<f64>());
                sum += self.between_texels(at);
            }
        }
        sum / (samples * samples) as f64
    }

    fn between_texels(&self, [x, y]: [f64; 2]) -> f64 {
        let (rows, columns) = self.coverage.dim();
        if !(x > -1.0 && y > -1.0 && x < columns as f64 && y < rows as f64) {
            return 0.0;
        }
        let (left, top) = (x.floor(), y.floor());
        let (u, v) = (x - left, y - top);
        let texel = |column: f64, row: f64| {
            let inside = column >= 0.0 && row >= 0.0;
            let found = if inside { self.coverage.get([row as usize, column as usize]) } else { None };
            found.map_or(0.0, |share| f64::from(*share))
        };
        let upper = texel(left, top) * (1.0 - u) + texel(left + 1.0, top) * u;
        let lower = texel(left, top + 1.0) * (1.0 - u) + texel(left + 1.0, top + 1.0) * u;
        upper * (1.0 - v) + lower * v
    }
}

impl Bench {
    /// Albedo of a print at each camera pixel, `(rows, columns, 4)` for [`super::Albedo::Image`], or `(rows, columns, 8)` if
    /// the infrared chip is not registered with the visible one. The albedo is the mean over the area of each pixel, so that
    /// edges have their place to a fraction of a pixel.
    ///
    /// # Errors
    /// [`Error::Value`] when a number of the print is out of range.
    pub fn printed(&self, print: &Print) -> Result<Array3<f32>> {
        print.check()?;
        let straight = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let chips: Vec<_> = [Some(straight), self.visible_from_infrared()].into_iter().flatten().collect();
        let (rows, columns) = (self.camera.height, self.camera.width);
        let mut albedo = Array3::zeros((rows, columns, 4 * chips.len()));
        for (first, visible) in (0..).step_by(4).zip(chips) {
            let corner = |row: usize, column: usize| {
                let (x, y) = (column as f64 - 0.5, row as f64 - 0.5);
                print.texel(&self.camera, visible.map(|r| r[0] * x + r[1] * y + r[2]))
            };
            albedo.axis_iter_mut(Axis(0)).into_par_iter().enumerate().for_each(|(row, mut line)| {
                let [upper, lower] = [row, row + 1]
                    .map(|row| (0..=columns).map(|column| corner(row, column)).collect::<Vec<_>>());
                for column in 0..columns {
                    let corners = [upper[column], upper[column + 1], lower[column], lower[column + 1]];
                    let inked = print.mean(corners) as f32;
                    for channel in 0..4 {
                        let (paper, ink) = (print.paper[channel], print.ink[channel]);
                        line[[column, first + channel]] = paper + inked * (ink - paper);
                    }
                }
            });
        }
        Ok(albedo)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optics::rotation_from_vector;

    /// A disc of 6 mm, printed with a finer resolution than the camera has.
    fn disc(pose: Pose) -> Print {
        let pitch_mm = 0.1;
        let inside = |r: usize, c: usize| (r as f64 - 80.0).hypot(c as f64 - 80.0) * pitch_mm;
        let coverage =
            Array2::from_shape_fn((161, 161), |(r, c)| (10.0 * (6.05 - inside(r, c))).clamp(0.0, 1.0) as f32);
        Print { coverage, pitch_mm, origin_mm: [-8.0; 2], paper: [1.0; 4], ink: [0.0; 4], pose }
    }

    #[test]
    fn the_centroid_and_the_area_of_a_disc_are_where_optics_puts_them() {
        let pose = Pose::new(rotation_from_vector([0.0; 3]), [12.345, -6.789, 800.0]).expect("valid pose");
        let bench = Bench::reference();
        let albedo = bench.printed(&disc(pose)).expect("a print");
        let (mut area, mut x, mut y) = (0.0, 0.0, 0.0);
        for ((row, column, channel), level) in albedo.indexed_iter() {
            if channel == 1 {
                let dark = 1.0 - f64::from(*level);
                area += dark;
                x += dark * column as f64;
                y += dark * row as f64;
            }
        }
        let seen = bench.camera.project(pose.camera_from_body([0.0; 3])).expect("in front");
        assert!((x / area - seen[0]).abs() < 1e-3 && (y / area - seen[1]).abs() < 1e-3);
        let radius_px = 6.0 * bench.camera.focal_px[0] / 800.0;
        assert!((area / (std::f64::consts::PI * radius_px * radius_px) - 1.0).abs() < 0.01);
    }

    #[test]
    fn bad_prints_are_named() {
        let pose = Pose::new(rotation_from_vector([0.0; 3]), [0.0, 0.0, 800.0]).expect("valid pose");
        let bench = Bench::reference();
        let refused = |print: Print| bench.printed(&print).expect_err("no print").to_string();
        assert!(refused(Print { coverage: Array2::zeros((0, 4)), ..disc(pose) }).contains("coverage"));
        assert!(refused(Print { pitch_mm: 0.0, ..disc(pose) }).contains("pitch 0"));
        assert!(refused(Print { ink: [-1.0; 4], ..disc(pose) }).contains("albedos"));
    }
}
