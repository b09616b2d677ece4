//! Fourier transform profilometry along rows (Takeda and Mutoh, Appl. Opt. 22, 3977 (1983); (S3)).
//!
//! A row without its background is `b cos(Phi) = b/2 (exp(j Phi) + exp(-j Phi))`. The spectrum of the first term lies at
//! positive frequencies. If a band of these is kept and doubled, the analytic signal `b exp(j Phi)` remains. Its argument
//! is the wrapped phase and its magnitude the modulation.

mod extend;
mod filter;
mod interpolate;

use super::background::{Background, background, check_period};
use super::params::{BandEdges, IMPROVED_BAND, ROW_MIN, TRADITIONAL_BAND};
use crate::error::Limit;
use crate::parallel::angle::atan2;
use crate::{Error, Result};
pub(crate) use filter::{Half, RowFilter, RowPair, RowScratch};
pub(crate) use interpolate::{Interpolation, lesser};
use ndarray::parallel::prelude::*;
use ndarray::{Array2, ArrayView2, ArrayViewMut1, Axis, Zip};

/// Which part of the spectrum is kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Band {
    /// Half a carrier to each side of the carrier, which excludes the zero frequency. Surfaces may have slopes |dh/dx|
    /// < L0 / (3 d).
    Traditional,
    /// From zero to about twice the carrier, after the background is removed. Surfaces may have slopes |dh/dx| < L0 /
    /// d, three times as much.
    #[default]
    Improved,
}

impl Band {
    /// Weight at `ratio` times the carrier; the flanks are raised cosines, which ring little at edges.
    fn weight(self, ratio: f32) -> f32 {
        let BandEdges { zero_below, full_from, full_to, zero_above } = match self {
            Self::Traditional => TRADITIONAL_BAND,
            Self::Improved => IMPROVED_BAND,
        };
        let rise = ((ratio - zero_below) / (full_from - zero_below)).clamp(0.0, 1.0);
        let drop = ((zero_above - ratio) / (zero_above - full_to)).clamp(0.0, 1.0);
        raised_cosine(rise) * raised_cosine(drop)
    }
}

/// A smooth rise from 0 at `t` = 0 to 1 at `t` = 1.
fn raised_cosine(t: f32) -> f32 {
    0.5 - 0.5 * (std::f32::consts::PI * t).cos()
}

/// Wrapped phase in rad, `(rows, columns)`, of an image with fringes along its rows.
///
/// `period_px` is the mean fringe period along the row in camera pixels. The traditional band subtracts only the mean
/// of each row; the improved band subtracts the background, which is estimated by `removal`. NaN spreads along its row.
///
/// # Errors
/// [`Error::Value`] when a row has fewer than 8 pixels, or the period is below 3 pixels or longer than a row.
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
    check_row(period_px, columns)?;
    let level = match band {
        Band::Improved => background(image, removal, period_px)?,
        Band::Traditional => row_means(image)?,
    };
    let filter = RowFilter::new(columns);
    let weights = filter.weights(band, period_px as f32, 1);
    let mut out = Array2::zeros(image.raw_dim());
    out.axis_iter_mut(Axis(0))
        .into_par_iter()
        .zip(image.axis_iter(Axis(0)))
        .zip(level.axis_iter(Axis(0)))
        .for_each_init(
            || (filter.scratch(), vec![0.0; columns]),
            |(scratch, fringes), ((mut target, row), level)| {
                for ((f, r), l) in fringes.iter_mut().zip(row).zip(level) {
                    *f = r - l;
                }
                let both = RowPair { real: &fringes[..], imaginary: &fringes[..] };
                filter.transform(
                    both,
                    RowPair { real: period_px as f32, imaginary: period_px as f32 },
                    scratch,
                );
                let found = filter.analytic(Half::Real, &weights, scratch);
                let found = target.iter_mut().zip(found);
                found.for_each(|(t, z)| *t = atan2(z.im, z.re));
            },
        );
    Ok(out)
}

fn check_row(period: f64, samples: usize) -> Result<()> {
    if samples < ROW_MIN {
        let expected = Limit::AtLeast(ROW_MIN as f64);
        return Err(Error::value("samples in a row of fringes", expected, samples));
    }
    check_period(period, samples)
}

fn row_means(image: ArrayView2<'_, f32>) -> Result<Array2<f32>> {
    let means = image.mean_axis(Axis(1)).ok_or_else(|| Error::shape("image", &[1, 1], image.shape()))?;
    Ok(means
        .insert_axis(Axis(1))
        .broadcast(image.raw_dim())
        .expect("one column stretches over all")
        .to_owned())
}

/// Fringes without background, the input of [`fourier_pair`].
#[derive(Debug, Clone, Copy)]
pub struct Fringes<'a> {
    /// Means over blocks of pixels, minus their background, `(rows, columns)`.
    pub means: ArrayView2<'a, f32>,
    /// Mean fringe period along the row in samples of `means`.
    pub period: f64,
}

/// Phase and modulation of fringes, each `(rows, columns)`.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Demodulated {
    /// Phase in rad up to whole turns, not necessarily in (-pi, pi].
    pub phase_rad: Array2<f32>,
    /// Modulation in the unit of the images.
    pub modulation: Array2<f32>,
}

/// Phase and modulation at every pixel of two images with fringes along their rows, by the improved band (S3).
///
/// Both images share one complex transform, the first as its real and the second as its imaginary part, which halves
/// the work; the published decoder transforms G and IR in this way. `columns` is the width of the blocks over which the
/// means were taken, and `width` the width of the image in pixels. The phase is interpolated linearly between the
/// centres of blocks, and the arctangent is exact to 1.3e-5 rad. NaN spreads along its row, to both images.
///
/// # Errors
/// [`Error::Shape`] when the two images differ in size or do not have `width / columns` columns; [`Error::Value`] when
/// `columns` is not 1, 2 or 4, a row has fewer than 8 samples, or a period is below 3 samples or longer than a row.
///
/// ```
/// use ndarray::Array2;
/// use quadfringe::stages::{Fringes, fourier_pair};
/// let fringes = |period: f32| {
///     Array2::from_shape_fn((1, 256), |(_, x)| 0.4 * (x as f32 * std::f32::consts::TAU / period).cos())
/// };
/// let (green, infrared) = (fringes(16.0), fringes(18.0));
/// let green = Fringes { means: green.view(), period: 16.0 };
/// let infrared = Fringes { means: infrared.view(), period: 18.0 };
/// let [green, infrared] = fourier_pair(green, infrared, 1, 256)?;
/// assert!((green.modulation[[0, 128]] - 0.4).abs() < 0.01);
/// assert!(infrared.phase_rad[[0, 126]].abs() < 0.01);
/// # Ok::<(), quadfringe::Error>(())
/// ```
pub fn fourier_pair(
    first: Fringes<'_>,
    second: Fringes<'_>,
    columns: usize,
    width: usize,
) -> Result<[Demodulated; 2]> {
    if ![1, 2, 4].contains(&columns) {
        return Err(Error::value("columns of a block", "1, 2 or 4", columns));
    }
    let shape = [first.means.nrows(), width / columns];
    first.check("first fringes", shape)?;
    second.check("second fringes", shape)?;
    let filter = RowFilter::new(shape[1]);
    let periods = RowPair { real: first.period as f32, imaginary: second.period as f32 };
    let weights = periods.map(|period| filter.weights(Band::Improved, period, columns));
    let mut found = [Demodulated::empty(shape[0], width), Demodulated::empty(shape[0], width)];
    let [real, imaginary] = &mut found;
    Zip::from(first.means.rows())
        .and(second.means.rows())
        .and(real.phase_rad.rows_mut())
        .and(real.modulation.rows_mut())
        .and(imaginary.phase_rad.rows_mut())
        .and(imaginary.modulation.rows_mut())
        .into_par_iter()
        .for_each_init(
            || (filter.scratch(), Interpolation::default()),
            |(scratch, interpolation), (first, second, phase, power, other_phase, other_power)| {
                let (first, second) = (first.to_vec(), second.to_vec());
                filter.transform(RowPair { real: &first[..], imaginary: &second[..] }, periods, scratch);
                let signal = filter.analytic(Half::Real, &weights.real, scratch);
                interpolation.run_for(columns, signal, contiguous(phase), contiguous(power));
                let signal = filter.analytic(Half::Imaginary, &weights.imaginary, scratch);
                interpolation.run_for(columns, signal, contiguous(other_phase), contiguous(other_power));
            },
        );
    found.iter_mut().for_each(|found| found.modulation.mapv_inplace(f32::sqrt));
    Ok(found)
}

fn contiguous<'a>(row: ArrayViewMut1<'a, f32>) -> &'a mut [f32] {
    row.into_slice().expect("rows of a fresh array are contiguous")
}

impl Fringes<'_> {
    fn check(&self, name: &str, shape: [usize; 2]) -> Result<()> {
        if self.means.shape() != shape {
            return Err(Error::shape(name.to_owned(), &shape, self.means.shape()));
        }
        check_row(self.period, shape[1])
    }
}

impl Demodulated {
    /// Empty maps. The power starts at infinity, because [`Interpolation::run_for`] keeps the smaller value.
    fn empty(rows: usize, columns: usize) -> Self {
        let modulation = Array2::from_elem((rows, columns), f32::INFINITY);
        Self { phase_rad: Array2::zeros((rows, columns)), modulation }
    }
}

#[cfg(test)]
mod tests;
