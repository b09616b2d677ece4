//! The fringe period in camera pixels, estimated from the shot.
//!
//! Fringes concentrate power at one frequency, the carrier. The mean is subtracted from each of a few lines, and the
//! lines are multiplied by a sine-squared window; then their mean power spectrum has a peak at the carrier. The centre of
//! gravity of the peak is the number of fringes on a line, and the length of the line divided by this number is the
//! period.

use super::params::{
    CARRIER_CYCLES_MIN, CARRIER_LINES, CARRIER_POWER_MIN, CARRIER_SHARE_MIN, PERIOD_MIN_PX, SAMPLE_ROWS,
};
use ndarray::{ArrayView1, ArrayView2};
use realfft::{RealFftPlanner, RealToComplex};
use rustfft::num_complex::Complex32;
use std::sync::Arc;

/// Fringe period in camera pixels along rows and columns; infinite where no carrier stands out.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Carrier {
    /// Period along a row.
    pub row_px: f64,
    /// Period along a column.
    pub column_px: f64,
}

impl Carrier {
    /// Period across the fringes in camera pixels, for fringes in any direction.
    #[must_use]
    pub fn period_px(&self) -> f64 {
        1.0 / (1.0 / self.row_px).hypot(1.0 / self.column_px)
    }
}

/// The carrier of a fringe image: the strongest peak in the mean power spectrum of its rows and of its columns.
///
/// NaN is replaced by the mean of its line.
///
/// ```
/// use ndarray::Array2;
/// use quadfringe::stages::carrier;
/// let image = Array2::from_shape_fn((64, 512), |(_, x)| (x as f32 * std::f32::consts::TAU / 20.0).cos());
/// let found = carrier(image.view());
/// assert!((found.row_px - 20.0).abs() < 0.2);
/// assert!((found.period_px() - 20.0).abs() < 0.2);
/// ```
#[must_use]
pub fn carrier(image: ArrayView2<'_, f32>) -> Carrier {
    let (row_px, column_px) = rayon::join(|| line_period(image), || line_period(image.reversed_axes()));
    Carrier { row_px, column_px }
}

fn line_period(image: ArrayView2<'_, f32>) -> f64 {
    let (lines, length) = image.dim();
    if length < 4 * CARRIER_CYCLES_MIN {
        return f64::INFINITY;
    }
    let mut spectrum = LineSpectrum::new(length);
    for line in (0..lines).step_by(lines.div_ceil(CARRIER_LINES).max(1)) {
        spectrum.add(image.row(line));
    }
    spectrum.take_period_px()
}

/// Fringe period along the rows in camera pixels, as the published decoder estimates it from linear red light. The
/// result lies between 3 pixels and the width of the image; it is the width if no carrier stands out. It is 3 pixels for a
/// narrower image.
///
/// ```
/// use ndarray::Array2;
/// use quadfringe::stages::row_period_px;
/// let image = Array2::from_shape_fn((64, 512), |(_, x)| (x as f32 * std::f32::consts::TAU / 20.0).cos());
/// assert!((row_period_px(image.view()) - 20.0).abs() < 0.2);
/// ```
#[must_use]
pub fn row_period_px(image: ArrayView2<'_, f32>) -> f64 {
    let (height, width) = image.dim();
    let mut spectrum = LineSpectrum::new(width);
    for y in period_rows(height) {
        spectrum.add(image.row(y));
    }
    spectrum.take_row_period_px()
}

/// Rows from which the fringe period is estimated.
pub(crate) fn period_rows(height: usize) -> impl Iterator<Item = usize> {
    (0..height).step_by(height.div_ceil(SAMPLE_ROWS).max(1))
}

/// Spectrum of a line without its mean, under the sine-squared window; the transform is planned once.
pub(super) struct LineTransform {
    forward: Arc<dyn RealToComplex<f32>>,
    window: Vec<f32>,
    input: Vec<f32>,
    pub spectrum: Vec<Complex32>,
    work: Vec<Complex32>,
}

impl LineTransform {
    pub fn new(length: usize) -> Self {
        let forward = RealFftPlanner::new().plan_fft_forward(length);
        let bell = |x: usize| (std::f32::consts::PI * (x as f32 + 0.5) / length as f32).sin();
        Self {
            window: (0..length).map(|x| bell(x).powi(2)).collect(),
            input: forward.make_input_vec(),
            spectrum: forward.make_output_vec(),
            work: forward.make_scratch_vec(),
            forward,
        }
    }

    /// Finds the spectrum of a line, and gives the mean of the line, which replaces NaN.
    pub fn run(&mut self, line: ArrayView1<'_, f32>) -> f32 {
        let seen = line.iter().filter(|v| v.is_finite());
        let mean = seen.clone().sum::<f32>() / seen.count().max(1) as f32;
        for ((value, &sample), weight) in self.input.iter_mut().zip(line).zip(&self.window) {
            let inside = sample.is_finite();
            *value = if inside { (sample - mean) * weight } else { 0.0 };
        }
        self.transform();
        mean
    }

    /// Finds the spectrum of the values of a line as they are.
    pub fn run_plain(&mut self, line: impl Iterator<Item = f32>) {
        self.input.iter_mut().zip(line).for_each(|(value, sample)| *value = sample);
        self.transform();
    }

    fn transform(&mut self) {
        self.forward
            .process_with_scratch(&mut self.input, &mut self.spectrum, &mut self.work)
            .expect("buffers were made by this plan");
    }
}

/// Mean power spectrum of lines of equal length.
pub(crate) struct LineSpectrum {
    transform: LineTransform,
    power: Vec<f32>,
    /// Power of the mean levels of the lines.
    level: f32,
}

impl LineSpectrum {
    pub fn new(length: usize) -> Self {
        Self { transform: LineTransform::new(length), power: vec![0.0; length / 2 + 1], level: 0.0 }
    }

    /// Adds a line. NaN is replaced by the mean of the line.
    pub fn add(&mut self, line: ArrayView1<'_, f32>) {
        self.level += (self.transform.run(line) * line.len() as f32).powi(2);
        for (p, s) in self.power.iter_mut().zip(&self.transform.spectrum) {
            *p += s.norm_sqr();
        }
    }

    /// Period of the strongest peak in samples; infinite if no peak stands out. Resets the spectrum for new lines.
    pub fn take_period_px(&mut self) -> f64 {
        let cycles = strongest(&self.power, CARRIER_POWER_MIN * self.level);
        self.power.fill(0.0);
        self.level = 0.0;
        cycles.map_or(f64::INFINITY, |cycles| self.length() as f64 / cycles)
    }

    /// As [`Self::take_period_px`], within the limits of [`row_period_px`].
    pub fn take_row_period_px(&mut self) -> f64 {
        let width = self.length() as f64;
        self.take_period_px().clamp(PERIOD_MIN_PX, width.max(PERIOD_MIN_PX))
    }

    fn length(&self) -> usize {
        self.transform.window.len()
    }
}

/// Centre of gravity of the strongest peak in cycles per line, if the peak holds enough of the power. Lines that are too
/// short for a carrier, or whose power is beyond `f32`, have none.
fn strongest(power: &[f32], least: f32) -> Option<f64> {
    let total: f32 = power.get(CARRIER_CYCLES_MIN..)?.iter().sum();
    let peak = (CARRIER_CYCLES_MIN..power.len()).max_by(|&a, &b| power[a].total_cmp(&power[b]))?;
    // Three bins to each side cover the main lobe of the window.
    let around = peak.saturating_sub(3).max(CARRIER_CYCLES_MIN)..(peak + 4).min(power.len());
    let near: f32 = power[around.clone()].iter().sum();
    let moment: f32 = around.map(|bin| bin as f32 * power[bin]).sum();
    let stands_out = near > least && near > CARRIER_SHARE_MIN * total && moment.is_finite();
    stands_out.then(|| f64::from(moment / near))
}
