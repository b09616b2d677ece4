//! Fourier transform profilometry along rows (Takeda and Mutoh, Appl. Opt. 22, 3977 (1983); system, section 3, (S3)).

use super::background::{Background, background, check_period};
use crate::angle::atan2;
use crate::{Error, Result};
use ndarray::{Array2, ArrayView2, Axis};
use rayon::prelude::*;
use realfft::{RealFftPlanner, RealToComplex};
use rustfft::num_complex::Complex32;
use rustfft::{Fft, FftPlanner};
use std::sync::Arc;

/// Which part of the spectrum is kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Band {
    /// Half a carrier to each side of the carrier, so that the zero component stays out: |dh/dx| < L0 / (3 d).
    Traditional,
    /// From zero to about twice the carrier, once the background is gone: |dh/dx| < L0 / d, three times the range.
    #[default]
    Improved,
}

impl Band {
    /// Weight at `ratio` times the carrier; the flanks are raised cosines so that edges ring little.
    fn weight(self, ratio: f32) -> f32 {
        let (from, full, fall, to) = match self {
            Self::Traditional => (0.4, 0.6, 1.4, 1.6),
            Self::Improved => (0.0, 0.3, 1.8, 2.3),
        };
        let rise = ((ratio - from) / (full - from)).clamp(0.0, 1.0);
        let drop = ((to - ratio) / (to - fall)).clamp(0.0, 1.0);
        let soft = |t: f32| 0.5 - 0.5 * (std::f32::consts::PI * t).cos();
        soft(rise) * soft(drop)
    }
}

/// Wrapped phase in rad, `(rows, columns)`, of an image with fringes along its rows.
///
/// `period_px` is the mean fringe period along the row in camera pixels. The traditional band subtracts only the mean
/// of each row; the improved band takes the background away first, in the way named.
///
/// # Errors
/// [`Error::Value`] when the period is below 3 pixels or longer than a row.
///
/// ```
/// use ndarray::Array2;
/// use quadfringe::demod::{Band, Background, fourier};
/// let step = std::f32::consts::TAU / 16.0;
/// let image = Array2::from_shape_fn((1, 256), |(_, x)| 0.5 + 0.4 * (step * x as f32).cos());
/// let phase = fourier(image.view(), Band::Improved, Background::MovingMean, 16.0)?;
/// assert!((phase[[0, 132]] - step * 4.0).abs() < 0.01);
/// # Ok::<(), Error>(())
/// # use quadfringe::Error;
/// ```
pub fn fourier(
    image: ArrayView2<'_, f32>,
    band: Band,
    removal: Background,
    period_px: f64,
) -> Result<Array2<f32>> {
    let columns = image.ncols();
    check_period(period_px, columns)?;
    let level = match band {
        Band::Improved => background(image, removal, period_px)?,
        Band::Traditional => row_means(image)?,
    };
    let plan = RowFilter::new(columns);
    let weights = plan.weights(band, period_px as f32);
    let mut out = Array2::zeros(image.raw_dim());
    out.axis_iter_mut(Axis(0))
        .into_par_iter()
        .zip(image.axis_iter(Axis(0)))
        .zip(level.axis_iter(Axis(0)))
        .for_each_init(
            || plan.scratch(),
            |scratch, ((mut target, row), level)| {
                let fringes = scratch.input.iter_mut().zip(row.iter().zip(level));
                fringes.for_each(|(i, (r, l))| *i = r - l);
                plan.analytic(&weights, scratch);
                let found = target.iter_mut().zip(&scratch.output);
                found.for_each(|(t, z)| *t = atan2(z.im, z.re));
            },
        );
    Ok(out)
}

fn row_means(image: ArrayView2<'_, f32>) -> Result<Array2<f32>> {
    let means = image.mean_axis(Axis(1)).ok_or_else(|| Error::shape("image", &[1, 1], image.shape()))?;
    Ok(means
        .insert_axis(Axis(1))
        .broadcast(image.raw_dim())
        .expect("one column stretches over all")
        .to_owned())
}

/// Transforms for rows of one length, planned once.
#[derive(Clone)]
pub(crate) struct RowFilter {
    forward: Arc<dyn RealToComplex<f32>>,
    inverse: Arc<dyn Fft<f32>>,
    columns: usize,
}

/// Working memory of one thread; `input` is filled by the caller, `output` is the analytic signal.
pub(crate) struct RowScratch {
    pub input: Vec<f32>,
    pub output: Vec<Complex32>,
    spectrum: Vec<Complex32>,
    forward: Vec<Complex32>,
    inverse: Vec<Complex32>,
}

impl RowFilter {
    pub fn new(columns: usize) -> Self {
        Self {
            forward: RealFftPlanner::new().plan_fft_forward(columns),
            inverse: FftPlanner::new().plan_fft_inverse(columns),
            columns,
        }
    }

    /// Weight of each non-negative frequency, scaled so that `output` has the amplitude of the fringes.
    pub fn weights(&self, band: Band, period_px: f32) -> Vec<f32> {
        let carrier = self.columns as f32 / period_px;
        let scale = 2.0 / self.columns as f32;
        (0..=self.columns / 2).map(|bin| scale * band.weight(bin as f32 / carrier)).collect()
    }

    pub fn scratch(&self) -> RowScratch {
        let zero = Complex32::new(0.0, 0.0);
        RowScratch {
            input: vec![0.0; self.columns],
            output: vec![zero; self.columns],
            spectrum: self.forward.make_output_vec(),
            forward: self.forward.make_scratch_vec(),
            inverse: vec![zero; self.inverse.get_inplace_scratch_len()],
        }
    }

    /// Positive frequencies of `input`, weighted, into `output`. The input is destroyed.
    pub fn analytic(&self, weights: &[f32], scratch: &mut RowScratch) {
        let RowScratch { input, output, spectrum, forward, inverse } = scratch;
        self.forward.process_with_scratch(input, spectrum, forward).expect("buffers were made by this plan");
        output.fill(Complex32::new(0.0, 0.0));
        for ((o, s), w) in output.iter_mut().zip(&*spectrum).zip(weights) {
            *o = s * w;
        }
        self.inverse.process_with_scratch(output, inverse);
    }

    /// Power of each non-negative frequency of `input`, added to `power`.
    pub fn add_power(&self, scratch: &mut RowScratch, power: &mut [f32]) {
        self.forward
            .process_with_scratch(&mut scratch.input, &mut scratch.spectrum, &mut scratch.forward)
            .expect("buffers were made by this plan");
        for (p, s) in power.iter_mut().zip(&scratch.spectrum) {
            *p += s.norm_sqr();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts::TAU;

    /// Fringes whose local frequency swings between (1 - s) and (1 + s) times the carrier.
    fn swinging(s: f32) -> (Array2<f32>, Vec<f32>) {
        let phase: Vec<f32> =
            (0..1024).map(|x| TAU * x as f32 / 32.0 + s * 4.0 * (TAU * x as f32 / 128.0).sin()).collect();
        let image = Array2::from_shape_fn((1, 1024), |(_, x)| 0.5 + 0.4 * phase[x].cos());
        (image, phase)
    }

    fn rms(found: &Array2<f32>, phase: &[f32]) -> f32 {
        let errors = (64..960).map(|x| crate::angle::wrap(found[[0, x]] - phase[x]));
        (errors.map(|e| e * e).sum::<f32>() / 896.0).sqrt()
    }

    #[test]
    fn the_improved_band_follows_slopes_where_the_traditional_one_fails() {
        let (image, phase) = swinging(0.75);
        let run = |band| fourier(image.view(), band, Background::MovingMean, 32.0).unwrap();
        let (old, new) = (rms(&run(Band::Traditional), &phase), rms(&run(Band::Improved), &phase));
        assert!(old > 0.1, "{old}");
        assert!(new < old / 3.0, "{new} against {old}");
    }

    #[test]
    fn gentle_slopes_are_right_either_way() {
        let (image, phase) = swinging(0.1);
        for band in [Band::Traditional, Band::Improved] {
            let found = fourier(image.view(), band, Background::MeanEnvelope, 32.0).unwrap();
            assert!(rms(&found, &phase) < 0.02, "{band:?} {}", rms(&found, &phase));
        }
    }
}
