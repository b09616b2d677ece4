//! Fourier transform profilometry along rows (Takeda and Mutoh, Appl. Opt. 22, 3977 (1983); system, section 3, (S3)).

mod extend;

use super::background::{Background, background, check_period};
use crate::parallel::Aligned;
use crate::parallel::angle::atan2;
use crate::{Error, Result};
use extend::extend;
use ndarray::{Array2, ArrayView2, Axis};
use rayon::prelude::*;
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
        soft(rise) * soft(drop)
    }
}

/// From 0 to 1 as a raised cosine.
fn soft(t: f32) -> f32 {
    0.5 - 0.5 * (std::f32::consts::PI * t).cos()
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
/// use quadfringe::stages::{Band, Background, fourier};
/// let step = std::f32::consts::TAU / 16.0;
/// let image = Array2::from_shape_fn((1, 256), |(_, x)| 0.5 + 0.4 * (step * x as f32).cos());
/// let phase = fourier(image.view(), Band::Improved, Background::MovingMean, 16.0)?;
/// assert!((phase[[0, 132]] - step * 4.0).abs() < 0.01);
/// # Ok::<(), quadfringe::Error>(())
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
    let weights = plan.weights(band, period_px as f32, 1);
    let mut out = Array2::zeros(image.raw_dim());
    out.axis_iter_mut(Axis(0))
        .into_par_iter()
        .zip(image.axis_iter(Axis(0)))
        .zip(level.axis_iter(Axis(0)))
        .for_each_init(
            || (plan.scratch(), vec![0.0; columns]),
            |(scratch, fringes), ((mut target, row), level)| {
                for ((f, r), l) in fringes.iter_mut().zip(row).zip(level) {
                    *f = r - l;
                }
                plan.transform([&*fringes, &*fringes], [period_px as f32; 2], scratch);
                let found = plan.analytic(Half::Real, &weights, scratch);
                let found = target.iter_mut().zip(found);
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

/// Transforms for rows of one length, planned once. Two rows go through one complex transform, as its real and its
/// imaginary part.
#[derive(Clone)]
pub(crate) struct RowFilter {
    forward: Arc<dyn Fft<f32>>,
    inverse: Arc<dyn Fft<f32>>,
    columns: usize,
    /// Weights of the passage from the end of a row to its beginning; with it a row has a length quick to transform.
    fade: Vec<f32>,
}

/// Which of the two rows of a transform.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Half {
    Real,
    Imaginary,
}

/// Working memory of one thread.
#[derive(Debug, Default)]
pub(crate) struct RowScratch {
    tails: [Aligned<f32>; 2],
    extend: extend::Scratch,
    spectrum: Aligned<Complex32>,
    /// Weighted positive frequencies; zero from `bins` on.
    positive: Aligned<Complex32>,
    bins: usize,
    output: Aligned<Complex32>,
    work: Aligned<Complex32>,
}

impl RowFilter {
    pub fn new(columns: usize) -> Self {
        let length = quick_length(columns + (columns / 10).max(2));
        let mut planner = FftPlanner::new();
        let passage = (length - columns) as f32;
        let fade = |k: usize| soft((k as f32 + 0.5) / passage);
        Self {
            forward: planner.plan_fft_forward(length),
            inverse: planner.plan_fft_inverse(length),
            columns,
            fade: (0..length - columns).map(fade).collect(),
        }
    }

    /// Weight of the frequencies from zero on that count, scaled so that the signal has the amplitude of the fringes before
    /// means of so many `pixels` became the samples of a row.
    pub fn weights(&self, band: Band, period: f32, pixels: usize) -> Vec<f32> {
        let length = self.forward.len();
        let carrier = length as f32 / period;
        // Separating the two rows gives twice the spectrum, and the negative frequencies held the other half of it.
        let scale = 1.0 / length as f32;
        let left = |bin: usize| {
            let half_turn = std::f32::consts::PI * bin as f32 / length as f32;
            if bin == 0 { 1.0 } else { half_turn.sin() / (pixels as f32 * (half_turn / pixels as f32).sin()) }
        };
        let weight = |bin: usize| scale * band.weight(bin as f32 / carrier) / left(bin);
        let mut weights: Vec<f32> = (0..length.div_ceil(2)).map(weight).collect();
        weights.truncate(weights.iter().rposition(|w| *w > 0.0).map_or(1, |last| last + 1));
        weights
    }

    pub fn scratch(&self) -> RowScratch {
        let length = self.forward.len();
        let work = (self.forward.get_inplace_scratch_len()).max(self.inverse.get_immutable_scratch_len());
        RowScratch {
            tails: [Aligned::new(self.fade.len()), Aligned::new(self.fade.len())],
            extend: extend::Scratch::default(),
            spectrum: Aligned::new(length),
            positive: Aligned::new(length),
            bins: 0,
            output: Aligned::new(length),
            work: Aligned::new(work),
        }
    }

    /// Make memory that may have served rows of another length fit for these.
    #[inline(always)]
    pub fn ready(&self, scratch: &mut RowScratch) {
        if scratch.spectrum.len() != self.forward.len() || scratch.tails[0].len() != self.fade.len() {
            *scratch = self.scratch();
        }
    }

    /// Spectrum of two rows of fringes without background.
    #[inline(always)]
    pub fn transform(&self, rows: [&[f32]; 2], periods_px: [f32; 2], scratch: &mut RowScratch) {
        let RowScratch { tails, extend: edges, spectrum, work, .. } = scratch;
        for ((row, period), tail) in rows.iter().zip(periods_px).zip(tails.iter_mut()) {
            extend(row, period, &self.fade, edges, tail);
        }
        let (inside, beyond) = spectrum.split_at_mut(self.columns);
        for ((z, re), im) in inside.iter_mut().zip(rows[0]).zip(rows[1]) {
            *z = Complex32::new(*re, *im);
        }
        for ((z, re), im) in beyond.iter_mut().zip(&*tails[0]).zip(&*tails[1]) {
            *z = Complex32::new(*re, *im);
        }
        self.forward.process_with_scratch(spectrum, work);
    }

    /// Analytic signal of one of the rows last transformed: its positive frequencies, weighted. It goes on beyond the end of the
    /// row, up to what leads to its beginning.
    #[inline(always)]
    pub fn analytic<'a>(&self, half: Half, weights: &[f32], scratch: &'a mut RowScratch) -> &'a [Complex32] {
        let RowScratch { spectrum, positive, bins, output, work, .. } = scratch;
        let mirrored = spectrum.iter().rev();
        // The zero frequency is background.
        let weighted = positive.iter_mut().zip(spectrum.iter()).zip(weights).skip(1).zip(mirrored);
        for (((out, &up), &w), down) in weighted {
            *out = match half {
                Half::Real => (up + down.conj()) * w,
                Half::Imaginary => {
                    let twice = up - down.conj();
                    Complex32::new(twice.im * w, -twice.re * w)
                }
            };
        }
        positive[weights.len()..(*bins).max(weights.len())].fill(Complex32::ZERO);
        *bins = weights.len();
        self.inverse.process_immutable_with_scratch(positive, output, work);
        output
    }
}

/// The least length from `least` on that has no prime factors but 2 and 3, 16 at least among them.
fn quick_length(least: usize) -> usize {
    let threes = [1, 3, 9];
    let lengths = threes.map(|three| three * least.div_ceil(three).next_power_of_two().max(16));
    lengths.into_iter().min().unwrap_or(least)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts::TAU;

    /// Fringes whose local frequency swings between (1 - s) and (1 + s) times the carrier.
    fn swinging(s: f32) -> (Array2<f32>, Vec<f32>) {
        let phase: Vec<f32> =
            (0..1024).map(|x| TAU * x as f32 / 32.0 + s * 8.0 * (TAU * x as f32 / 256.0).sin()).collect();
        let image = Array2::from_shape_fn((1, 1024), |(_, x)| 0.5 + 0.4 * phase[x].cos());
        (image, phase)
    }

    fn rms(found: &Array2<f32>, phase: &[f32]) -> f32 {
        let errors = (64..960).map(|x| crate::parallel::angle::wrap(found[[0, x]] - phase[x]));
        (errors.map(|e| e * e).sum::<f32>() / 896.0).sqrt()
    }

    #[test]
    fn the_improved_band_follows_slopes_where_the_traditional_one_fails() {
        for (swing, bound) in [(0.5, 0.02), (0.75, 0.1)] {
            let (image, phase) = swinging(swing);
            // A moving mean over a period would take most of the slow fringes for background.
            let run = |band| fourier(image.view(), band, Background::MeanEnvelope, 32.0).unwrap();
            let old = rms(&run(Band::Traditional), &phase);
            let new = rms(&run(Band::Improved), &phase);
            assert!(old > 0.1, "{old}");
            assert!(new < bound && new < old / 5.0, "{new} against {old}");
        }
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
