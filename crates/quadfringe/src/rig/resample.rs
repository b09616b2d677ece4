//! Lens blur, and the offset between the two chips.

use ndarray::{Array2, ArrayView2, Axis};
use rayon::prelude::*;

use crate::error::{Error, Result};

/// Reach of the Gaussian in standard deviations.
const REACH: f64 = 4.0;

/// Gaussian blur with a standard deviation in px; the border is continued.
pub(super) fn blur(image: &Array2<f32>, sigma_px: f64) -> Array2<f32> {
    let kernel = gaussian(sigma_px);
    let along_rows = blur_rows(image.view(), &kernel);
    blur_columns(along_rows.view(), &kernel)
}

/// Weights of one side of the kernel, the middle first; all together they sum to 1.
fn gaussian(sigma_px: f64) -> Vec<f32> {
    let reach = (REACH * sigma_px).ceil() as i32;
    let weight = |i: i32| (-0.5 * (f64::from(i) / sigma_px).powi(2)).exp();
    let total: f64 = (-reach..=reach).map(weight).sum();
    (0..=reach).map(|i| (weight(i) / total) as f32).collect()
}

fn blur_rows(image: ArrayView2<'_, f32>, kernel: &[f32]) -> Array2<f32> {
    let reach = kernel.len() - 1;
    let mut blurred = Array2::zeros(image.dim());
    blurred.axis_iter_mut(Axis(0)).into_par_iter().zip(image.axis_iter(Axis(0))).for_each(
        |(mut out, line)| {
            let width = line.len();
            let padded: Vec<f32> =
                (0..width + 2 * reach).map(|i| line[i.saturating_sub(reach).min(width - 1)]).collect();
            for (column, out) in out.iter_mut().enumerate() {
                let at = column + reach;
                *out = (1..=reach).fold(kernel[0] * padded[at], |sum, i| {
                    sum + kernel[i] * (padded[at - i] + padded[at + i])
                });
            }
        },
    );
    blurred
}

fn blur_columns(image: ArrayView2<'_, f32>, kernel: &[f32]) -> Array2<f32> {
    let height = image.nrows();
    let mut blurred = Array2::zeros(image.dim());
    blurred.axis_iter_mut(Axis(0)).into_par_iter().enumerate().for_each(|(row, mut out)| {
        out.scaled_add(kernel[0], &image.row(row));
        for (i, weight) in kernel.iter().enumerate().skip(1) {
            out.scaled_add(*weight, &image.row(row.saturating_sub(i)));
            out.scaled_add(*weight, &image.row((row + i).min(height - 1)));
        }
    });
    blurred
}

/// Inverse of an affine map of the plane.
pub(super) fn inverse(affine: [[f64; 3]; 2]) -> Result<[[f64; 3]; 2]> {
    let [[a, b, tx], [c, d, ty]] = affine;
    let determinant = a * d - b * c;
    if !(determinant.is_finite() && determinant.abs() > 1e-6 && tx.is_finite() && ty.is_finite()) {
        let expected = "the two rows of an affine map with an inverse";
        return Err(Error::value("infrared_from_visible", expected, format!("{affine:?}")));
    }
    let [ia, ib, ic, id] = [d, -b, -c, a].map(|v| v / determinant);
    Ok([[ia, ib, -(ia * tx + ib * ty)], [ic, id, -(ic * tx + id * ty)]])
}

/// Image as seen through an affine map of its pixels: `out(x, y) = image(from_output (x, y, 1))`, by cubic interpolation;
/// the border is continued.
pub(super) fn warp(image: &Array2<f32>, from_output: [[f64; 3]; 2]) -> Array2<f32> {
    let mut warped = Array2::zeros(image.dim());
    warped.axis_iter_mut(Axis(0)).into_par_iter().enumerate().for_each(|(row, mut out)| {
        for (column, out) in out.iter_mut().enumerate() {
            let [x, y] = from_output.map(|r| r[0] * column as f64 + r[1] * row as f64 + r[2]);
            *out = cubic(image, x, y);
        }
    });
    warped
}

fn cubic(image: &Array2<f32>, x: f64, y: f64) -> f32 {
    let (rows, columns) = image.dim();
    let (x, y) = (x.clamp(-1.0, columns as f64), y.clamp(-1.0, rows as f64));
    let (left, top) = (x.floor(), y.floor());
    let weights_x = catmull_rom((x - left) as f32);
    let weights_y = catmull_rom((y - top) as f32);
    let place =
        |first: f64, k: usize, n: usize| (first as i64 + k as i64 - 1).clamp(0, n as i64 - 1) as usize;
    let mut sum = 0.0;
    for (j, wy) in weights_y.iter().enumerate() {
        let row = place(top, j, rows);
        for (i, wx) in weights_x.iter().enumerate() {
            sum += wy * wx * image[[row, place(left, i, columns)]];
        }
    }
    sum
}

/// Weights of four neighbours at the fraction `t` between the middle two.
fn catmull_rom(t: f32) -> [f32; 4] {
    let (t2, t3) = (t * t, t * t * t);
    [
        0.5 * (2.0 * t2 - t - t3),
        0.5 * (2.0 - 5.0 * t2 + 3.0 * t3),
        0.5 * (t + 4.0 * t2 - 3.0 * t3),
        0.5 * (t3 - t2),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blur_lowers_a_sinusoid_as_the_theory_says() {
        let frequency = std::f64::consts::TAU / 25.0;
        let image = Array2::from_shape_fn((20, 200), |(_, x)| (frequency * x as f64).cos() as f32);
        let blurred = blur(&image, 2.0);
        let expected = (-0.5 * (frequency * 2.0).powi(2)).exp() as f32;
        assert!((blurred[[10, 100]] - expected * image[[10, 100]]).abs() < 1e-4);
    }

    #[test]
    fn warp_moves_the_image_and_its_inverse_moves_it_back() {
        let wave = |x: f64, y: f64| (0.25 * x + 0.1 * y).sin() as f32;
        let image = Array2::from_shape_fn((60, 80), |(y, x)| wave(x as f64, y as f64));
        let affine = [[1.001, 0.002, 0.6], [-0.002, 0.999, -1.3]];
        let warped = warp(&image, inverse(affine).expect("regular"));
        let [[a, b, tx], [c, d, ty]] = affine;
        let (x, y) = (40.0, 30.0);
        let [xi, yi] = [a * x + b * y + tx, c * x + d * y + ty];
        assert!((cubic(&warped, xi, yi) - wave(x, y)).abs() < 1e-3);
        assert!(inverse([[1.0, 1.0, 0.0], [1.0, 1.0, 0.0]]).is_err());
    }
}
