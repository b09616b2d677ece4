//! Registration: interpolation of the infrared image at the visible pixels.

use super::Sample;
use super::linear::{Linear, extend, row_of};
use super::saturated::Saturated;
use multiversion::multiversion;
use ndarray::ArrayView2;
use rayon::prelude::*;

/// Channel of the infrared image.
const INFRARED: usize = 3;
/// Number of pixels by which the interpolation reaches beyond the image.
const MARGIN: usize = 2;

/// Linear infrared light with margins, and the affine map from a visible pixel (x, y, 1) to its position in this image.
///
/// Values are interpolated by Lagrange's polynomial through 4 x 4 pixels. This lowers the amplitude of fringes with a
/// period of 20 pixels by 0.03 %; bilinear interpolation lowers it by 1.2 %.
#[derive(Debug, Clone)]
pub(super) struct Registered {
    map: [[f64; 3]; 2],
    light: Vec<f32>,
    size: [usize; 2],
}

impl Registered {
    pub fn new(map: [[f64; 3]; 2]) -> Self {
        Self { map, light: Vec::new(), size: [0; 2] }
    }

    /// Converts the infrared image of a shot to linear light.
    pub fn fill<T: Sample>(&mut self, infrared: &ArrayView2<'_, T>, linear: &Linear) {
        let (rows, columns) = infrared.dim();
        self.size = [rows, columns];
        let stride = self.stride();
        self.light.resize((rows + 2 * MARGIN) * stride, 0.0);
        let inner = &mut self.light[MARGIN * stride..][..rows * stride];
        inner.par_chunks_mut(stride).enumerate().for_each(|(y, line)| {
            linear.row(INFRARED, &row_of(infrared, y), &mut line[MARGIN..]);
            extend(line, MARGIN, columns);
        });
        self.extend_rows();
    }

    fn stride(&self) -> usize {
        self.size[1] + 2 * MARGIN
    }

    /// Extends the columns in the same way as [`extend`] extends rows.
    fn extend_rows(&mut self) {
        let (stride, rows) = (self.stride(), self.size[0]);
        let mut line = vec![0.0; rows + 2 * MARGIN];
        for x in 0..stride {
            for y in MARGIN..MARGIN + rows {
                line[y] = self.light[y * stride + x];
            }
            extend(&mut line, MARGIN, rows);
            for y in (0..MARGIN).chain(MARGIN + rows..rows + 2 * MARGIN) {
                self.light[y * stride + x] = line[y];
            }
        }
    }

    /// Position (x, y) in the infrared image that corresponds to a visible pixel.
    fn place(&self, x: usize, y: usize) -> [f64; 2] {
        self.map.map(|m| m[0] * x as f64 + m[1] * y as f64 + m[2])
    }

    fn sees(&self, [x, y]: [f64; 2]) -> bool {
        let [rows, columns] = self.size;
        x >= 0.0 && y >= 0.0 && x <= (columns - 1) as f64 && y <= (rows - 1) as f64
    }

    /// Range of the visible pixels of row `y` that the infrared chip sees.
    fn seen(&self, y: usize, width: usize) -> std::ops::Range<usize> {
        let seen = |x: &usize| self.sees(self.place(*x, y));
        match (0..width).find(seen) {
            Some(first) => first..(first..width).rfind(seen).map_or(first, |last| last + 1),
            None => 0..0,
        }
    }

    /// Light at the visible pixels of row `y`; NaN where the infrared chip does not see the point.
    pub fn row(&self, y: usize, out: &mut [f32]) {
        let seen = self.seen(y, out.len());
        out.fill(f32::NAN);
        let mut x = seen.start;
        while x < seen.end {
            let end = self.end_of_run(x, seen.end, y);
            self.run(x, y, &mut out[x..end]);
            x = end;
        }
    }

    /// Fills gaps with the nearest pixel of the infrared chip.
    pub fn continue_row(&self, y: usize, out: &mut [f32]) {
        let [rows, columns] = self.size;
        for (x, value) in out.iter_mut().enumerate().filter(|(_, value)| value.is_nan()) {
            let [u, v] = self.place(x, y);
            let (column, row) = ((u.round() as usize).min(columns - 1), (v.round() as usize).min(rows - 1));
            *value = self.light[(row + MARGIN) * self.stride() + column + MARGIN];
        }
    }

    /// End of a run of pixels that starts at `x` and ends at `end` at the latest. In a run, each visible pixel
    /// corresponds to the next pixel of one infrared row, so that samples are read from adjacent addresses.
    fn end_of_run(&self, x: usize, mut end: usize, y: usize) -> usize {
        let moved = |x: usize| {
            let [u, v] = self.place(x, y);
            [u.floor() - x as f64, v.floor()]
        };
        let here = moved(x);
        while moved(end - 1) != here {
            end = x + (end - x) / 2;
        }
        end
    }

    fn run(&self, x: usize, y: usize, out: &mut [f32]) {
        let [u, v] = self.place(x, y);
        let (left, top) = (u.floor() as usize, v.floor() as usize);
        let rows: [&[f32]; 4] = std::array::from_fn(|j| {
            &self.light[(top + MARGIN - 1 + j) * self.stride() + left + MARGIN - 1..][..out.len() + 3]
        });
        let start = [(u - u.floor()) as f32, (v - v.floor()) as f32];
        let step = [(self.map[0][0] - 1.0) as f32, self.map[1][0] as f32];
        interpolate(rows, start, step, out);
    }

    /// Infrared pixels around the position of the first pixel of a run.
    fn between(&self, x: usize, end: usize, y: usize) -> Neighbours {
        let (first, last) = (self.place(x, y), self.place(end - 1, y));
        let [left, top] = first.map(|at| at.floor() as usize);
        let on_pixels = |axis: usize| first[axis].fract() == 0.0 && last[axis].fract() == 0.0;
        Neighbours {
            left,
            right: left + usize::from(!on_pixels(0)),
            top,
            bottom: top + usize::from(!on_pixels(1)),
        }
    }

    /// Marks infrared as saturated at pixels whose position is next to a saturated infrared pixel.
    pub fn saturated_row<T: Sample>(
        &self,
        infrared: &ArrayView2<'_, T>,
        y: usize,
        limit: f32,
        out: &mut [Saturated],
    ) {
        let seen = self.seen(y, out.len());
        let mut x = seen.start;
        while x < seen.end {
            let end = self.end_of_run(x, seen.end, y);
            let Neighbours { left, right, top, bottom } = self.between(x, end, y);
            for row in [top, bottom] {
                let row = row_of(infrared, row);
                for shift in [left, right] {
                    for (out, raw) in out[x..end].iter_mut().zip(&row[shift..]) {
                        *out |= Saturated::new([false, false, false, raw.intensity() >= limit]);
                    }
                }
            }
            x = end;
        }
    }
}

/// Infrared columns and rows around a position. Left and right, or top and bottom, are equal if the position lies on a
/// pixel.
struct Neighbours {
    left: usize,
    right: usize,
    top: usize,
    bottom: usize,
}

/// Weights of Lagrange's polynomial through four samples, at the fraction `t` between the middle two.
#[inline(always)]
fn weights(t: f32) -> [f32; 4] {
    let (before, after, beyond) = (t + 1.0, t - 1.0, t - 2.0);
    [
        t * after * beyond * (-1.0 / 6.0),
        before * after * beyond * 0.5,
        before * t * beyond * -0.5,
        before * t * after * (1.0 / 6.0),
    ]
}

/// Interpolated values at the fractional positions (x, y), which are `start` at the first pixel and increase by `step`
/// from pixel to pixel.
#[multiversion(targets("x86_64+avx2"))]
fn interpolate(rows: [&[f32]; 4], start: [f32; 2], step: [f32; 2], out: &mut [f32]) {
    let n = out.len();
    let taps: [[&[f32]; 4]; 4] = rows.map(|row| std::array::from_fn(|i| &row[i..i + n]));
    for (i, value) in out.iter_mut().enumerate() {
        let across = weights(start[0] + step[0] * i as f32);
        let down = weights(start[1] + step[1] * i as f32);
        let mut sum = 0.0;
        for (taps, down) in taps.iter().zip(down) {
            let [a, b, c, d] = [taps[0][i], taps[1][i], taps[2][i], taps[3][i]];
            sum += down * (across[0] * a + across[1] * b + across[2] * c + across[3] * d);
        }
        *value = sum;
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Conditioner, Saturated, Shot, linearise};
    use ndarray::Array2;
    use std::f64::consts::TAU;

    fn wave(period_px: f64, x: f64, y: f64) -> f32 {
        (0.5 + 0.4 * (TAU / period_px * (x + 0.1 * y)).cos()) as f32
    }

    /// Registration reverses sub-pixel shift, scale and rotation. Bilinear interpolation would have an error of 0.005
    /// at 20 px.
    #[test]
    fn shift_scale_and_turn_are_undone() {
        let maps = [
            [[1.0, 0.0, 0.5], [0.0, 1.0, -0.25]],
            [[1.01, 0.0, -2.6], [0.0, 1.01, -1.4]],
            [[0.9994, -0.035, 6.3], [0.035, 0.9994, -2.1]],
            [[0.0, 1.0, 20.5], [-1.0, 0.0, 130.25]],
        ];
        for (period_px, error_max) in [(28.0, 1e-4), (20.0, 3e-4), (10.0, 4e-3)] {
            for map in maps {
                let infrared =
                    Array2::from_shape_fn((120, 160), |(y, x)| wave(period_px, x as f64, y as f64));
                let conditioner = Conditioner { ir_registration: map, ..Conditioner::default() };
                let shot = Shot::new([(); 4].map(|()| infrared.view())).unwrap();
                let [.., found] = linearise(&shot, &conditioner).unwrap();
                let mut seen = 0;
                for ((y, x), value) in found.indexed_iter() {
                    let [u, v] = map.map(|m| m[0] * x as f64 + m[1] * y as f64 + m[2]);
                    let inside = (0.0..=159.0).contains(&u) && (0.0..=119.0).contains(&v);
                    assert_eq!(value.is_finite(), inside, "{x} {y}");
                    if (2.0..157.0).contains(&u) && (2.0..117.0).contains(&v) {
                        seen += 1;
                        let error = (value - wave(period_px, u, v)).abs();
                        assert!(error < error_max, "{period_px} px {map:?} at {x} {y}: {error}");
                    }
                }
                assert!(seen > 8000, "{seen}");
            }
        }
    }

    #[test]
    fn a_shift_by_whole_pixels_changes_no_value() {
        let infrared = Array2::from_shape_fn((9, 11), |(y, x)| (13 * y + 7 * x) as u8);
        let map = [[1.0, 0.0, 2.0], [0.0, 1.0, -1.0]];
        let conditioner = Conditioner { ir_registration: map, ..Conditioner::default() };
        let shot = Shot::new([(); 4].map(|()| infrared.view())).unwrap();
        let [.., found] = linearise(&shot, &conditioner).unwrap();
        for ((y, x), value) in found.indexed_iter() {
            match (y.checked_sub(1), x + 2 < 11) {
                (Some(row), true) => {
                    assert!((value - f32::from(infrared[[row, x + 2]]) / 255.0).abs() < 1e-6)
                }
                _ => assert!(value.is_nan()),
            }
        }
    }

    #[test]
    fn saturation_is_where_the_infrared_pixel_is_seen() {
        let plain = Array2::from_elem((6, 12), 100u8);
        let mut infrared = plain.clone();
        infrared[[2, 5]] = 255;
        let map = [[1.0, 0.0, 1.5], [0.0, 1.0, 0.0]];
        let conditioner = Conditioner { ir_registration: map, ..Conditioner::default() };
        let shot = Shot::new([plain.view(), plain.view(), plain.view(), infrared.view()]).unwrap();
        let plan = conditioner.plan().map(|mut plan| {
            plan.prepare(&shot);
            plan
        });
        let mut saturated = [Saturated::default(); 12];
        let mut found = Vec::new();
        for y in 0..6 {
            plan.as_ref().unwrap().saturated_row(&shot, y, &mut saturated);
            found.extend((0..12).filter(|&x| saturated[x].has(3)).map(|x| (y, x)));
        }
        assert_eq!(found, [(2, 3), (2, 4)]);
    }
}
