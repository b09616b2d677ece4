//! Lens blur.

use ndarray::{Array2, ArrayView2, Axis};
use rayon::prelude::*;

use super::params::BLUR_REACH_SIGMAS;

/// Gaussian blur with a standard deviation in px. Pixels at the border are repeated beyond it.
pub(super) fn blur(image: &Array2<f32>, sigma_px: f64) -> Array2<f32> {
    let kernel = gaussian(sigma_px);
    let along_rows = blur_rows(image.view(), &kernel);
    blur_columns(along_rows.view(), &kernel)
}

/// Weights from the middle of the kernel to one end. The whole kernel has the sum 1.
fn gaussian(sigma_px: f64) -> Vec<f32> {
    let reach = (BLUR_REACH_SIGMAS * sigma_px).ceil() as i32;
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
}
