//! The fringe period that the camera sees, estimated from the shot itself.

use ndarray::{ArrayView1, ArrayView2};
use realfft::{RealFftPlanner, RealToComplex};
use rustfft::num_complex::Complex32;
use std::sync::Arc;

/// Lines that are looked at in each direction: enough to average out objects, few enough to cost nothing.
const LINES: usize = 48;
/// Fewest fringes over the image that count as a carrier.
const FEWEST: usize = 4;
/// Share of the power that a carrier must hold to be believed.
const SHARE: f32 = 0.2;
/// Least power of a carrier, as a share of that of the mean level: rounding of a flat line leaves less than 1e-12.
const FAINTEST: f32 = 1e-8;

/// Fringe period in camera pixels along rows and columns; infinite where no carrier stands out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Carrier {
    /// Period along a row.
    pub row_px: f64,
    /// Period along a column.
    pub column_px: f64,
}

impl Carrier {
    /// Period across the fringes, for fringes in any direction.
    #[must_use]
    pub fn period_px(&self) -> f64 {
        1.0 / (1.0 / self.row_px).hypot(1.0 / self.column_px)
    }
}

/// The carrier of a fringe image: the strongest line of the mean power spectrum of its rows and of its columns.
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
    if length < 4 * FEWEST {
        return f64::INFINITY;
    }
    let mut spectrum = LineSpectrum::new(length);
    for line in (0..lines).step_by(lines.div_ceil(LINES)) {
        spectrum.add(image.row(line));
    }
    spectrum.take_period_px()
}

/// Mean power spectrum of lines of one length, planned once.
pub(crate) struct LineSpectrum {
    forward: Arc<dyn RealToComplex<f32>>,
    window: Vec<f32>,
    input: Vec<f32>,
    spectrum: Vec<Complex32>,
    work: Vec<Complex32>,
    power: Vec<f32>,
    level: f32,
}

impl LineSpectrum {
    pub fn new(length: usize) -> Self {
        let forward = RealFftPlanner::new().plan_fft_forward(length);
        let bell = |x: usize| (std::f32::consts::PI * (x as f32 + 0.5) / length as f32).sin();
        Self {
            window: (0..length).map(|x| bell(x).powi(2)).collect(),
            input: forward.make_input_vec(),
            spectrum: forward.make_output_vec(),
            work: forward.make_scratch_vec(),
            power: vec![0.0; length / 2 + 1],
            level: 0.0,
            forward,
        }
    }

    /// Take one more line into account; NaN counts as the mean.
    pub fn add(&mut self, line: ArrayView1<'_, f32>) {
        let seen = line.iter().filter(|v| v.is_finite());
        let mean = seen.clone().sum::<f32>() / seen.count().max(1) as f32;
        for ((value, &sample), weight) in self.input.iter_mut().zip(line).zip(&self.window) {
            let inside = sample.is_finite();
            *value = if inside { (sample - mean) * weight } else { 0.0 };
        }
        self.level += (mean * line.len() as f32).powi(2);
        self.forward
            .process_with_scratch(&mut self.input, &mut self.spectrum, &mut self.work)
            .expect("buffers were made by this plan");
        for (p, s) in self.power.iter_mut().zip(&self.spectrum) {
            *p += s.norm_sqr();
        }
    }

    /// Period of the strongest line of the spectrum, infinite where none stands out; forgets all lines.
    pub fn take_period_px(&mut self) -> f64 {
        let cycles = strongest(&self.power, FAINTEST * self.level);
        self.power.fill(0.0);
        self.level = 0.0;
        cycles.map_or(f64::INFINITY, |cycles| self.window.len() as f64 / cycles)
    }
}

/// Centre of the strongest line in cycles, when it holds a fair share of all power above the lowest frequencies.
fn strongest(power: &[f32], least: f32) -> Option<f64> {
    let total: f32 = power[FEWEST..].iter().sum();
    let peak = (FEWEST..power.len()).max_by(|&a, &b| power[a].total_cmp(&power[b]))?;
    let around = peak.saturating_sub(3).max(FEWEST)..(peak + 4).min(power.len());
    let near: f32 = power[around.clone()].iter().sum();
    let moment: f32 = around.map(|bin| bin as f32 * power[bin]).sum();
    (near > least && near > SHARE * total).then(|| f64::from(moment / near))
}
