//! The probability that a fringe order is wrong, from the margins of a shot.
//!
//! If the margin is `m`, the beat differs by `d = pi (1 - m)` from the value that its order requires, and by `2 pi - d`
//! from the value that the next order requires. There are two causes of a wrong order. Noise: the differences have a normal
//! distribution, whose standard deviation `sigma` follows from the median of `d`, so the next order is less likely by the
//! factor `exp(-2 pi (pi - d) / sigma^2)`. Strays: near edges a phase is arbitrary, and the order of a stray is random. The
//! share of strays follows from the number of margins beyond four sigma, where noise hardly reaches.

use super::params::{BEAT_SIGMA_MIN_RAD, SAMPLE_ROWS, SAMPLE_STRIDE, STRAY_MARGIN_MIN};
use ndarray::{Array2, ArrayView2};
use std::f32::consts::PI;

/// Entries of the table of probabilities, a power of two. One entry spans 0.003 rad of a beat.
const STEPS: usize = 1024;
/// 2^23, where the last bit of an `f32` has the value 1. Adding it to a number rounds the number and leaves it in the
/// last bits.
const WHOLE: f32 = 8_388_608.0;
/// Median of the absolute value of a normal deviation, in standard deviations.
const MEDIAN_OF_NORMAL: f32 = 0.6745;

/// Probability in [0, 1] that the order of each pixel is wrong, `(rows, columns)`, from the margins of a whole shot. NaN
/// in, NaN out.
///
/// The statistics are taken from 16 rows of the shot.
///
/// ```
/// use ndarray::Array2;
/// use quadfringe::stages::wrong_order_probability;
/// let mut quality = Array2::from_shape_fn((32, 90), |(y, x)| 0.8 + 0.01 * ((7 * x + 3 * y) % 20) as f32);
/// quality[[5, 6]] = 0.0; // a beat half way between two orders
/// let probability = wrong_order_probability(quality.view());
/// assert!(probability[[5, 6]] > 0.9 && probability[[5, 7]] < 0.01);
/// ```
#[must_use]
pub fn wrong_order_probability(quality: ArrayView2<'_, f32>) -> Array2<f32> {
    let mut margins = Vec::new();
    for y in (0..quality.nrows()).filter(|y| is_sampled(*y, quality.nrows())) {
        let row = quality.row(y);
        margins.extend(row.iter().step_by(SAMPLE_STRIDE).filter(|margin| margin.is_finite()));
    }
    let table = WrongOrderTable::new(&margins);
    let mut out = Array2::zeros(quality.raw_dim());
    for (mut out, quality) in out.outer_iter_mut().zip(quality.outer_iter()) {
        table.row(&quality.to_vec(), out.as_slice_mut().expect("rows of a fresh array are contiguous"));
    }
    out
}

/// Whether row `y` enters the statistics of a shot of `height` rows. Such rows have neighbours above and below.
pub(crate) fn is_sampled(y: usize, height: usize) -> bool {
    let every = height.div_ceil(SAMPLE_ROWS).max(1);
    y % every == 1 % every && y > 0 && y + 1 < height
}

/// Table of the probability of a wrong order by margin.
#[derive(Debug, Clone)]
pub(crate) struct WrongOrderTable {
    /// Entries from `STEPS` on are NaN.
    table: Box<[f32; 2 * STEPS]>,
}

impl WrongOrderTable {
    /// A placeholder until the statistics of the shot are known.
    pub fn empty() -> Self {
        Self { table: Box::new([0.0; 2 * STEPS]) }
    }

    /// Makes the table from the margins of many pixels.
    pub fn new(margins: &[f32]) -> Self {
        let mut apart: Vec<f32> = margins.iter().map(|margin| PI * (1.0 - margin)).collect();
        let sigma = deviation(&mut apart).max(BEAT_SIGMA_MIN_RAD);
        let far = (1.0 - 4.0 * sigma / PI).max(STRAY_MARGIN_MIN);
        let beyond = margins.iter().filter(|margin| **margin < far).count() as f32;
        let stray = (beyond / (far * margins.len().max(1) as f32)).min(1.0);
        let probability = |step: usize| {
            let apart = PI * (1.0 - step as f32 / (STEPS - 1) as f32);
            let normal = (2.0 * PI).sqrt() / sigma * (-0.5 * (apart / sigma).powi(2)).exp();
            let random = stray / (stray + (1.0 - stray) * normal).max(f32::MIN_POSITIVE);
            let lead = 2.0 * PI * (PI - apart) / (sigma * sigma);
            let by_noise = 1.0 / (1.0 + lead.min(80.0).exp());
            1.0 - (1.0 - random) * (1.0 - by_noise)
        };
        let entry = |step| if step < STEPS { probability(step) } else { f32::NAN };
        Self { table: Box::new(std::array::from_fn(entry)) }
    }

    /// Probabilities for a row of margins; NaN for NaN. Indices into the table are computed as vectors; only the look-up
    /// is scalar.
    #[inline(always)]
    pub fn row(&self, margins: &[f32], out: &mut [f32]) {
        const BLOCK: usize = 64;
        let mut steps = [0u32; BLOCK];
        for (out, margins) in out.chunks_mut(BLOCK).zip(margins.chunks(BLOCK)) {
            for (step, margin) in steps.iter_mut().zip(margins) {
                let known = (margin.clamp(0.0, 1.0) * (STEPS - 1) as f32 + WHOLE).to_bits() % STEPS as u32;
                *step = if margin.is_nan() { STEPS as u32 } else { known };
            }
            for (out, step) in out.iter_mut().zip(&steps) {
                *out = self.table[*step as usize % (2 * STEPS)];
            }
        }
    }
}

/// Standard deviation of normal values around 0, from the median of their absolute values; 0 if there are none. The
/// values are replaced by their absolute values and reordered.
pub(crate) fn deviation(values: &mut [f32]) -> f32 {
    values.iter_mut().for_each(|value| *value = value.abs());
    let middle = values.len() / 2;
    if values.is_empty() {
        return 0.0;
    }
    let (_, median, _) = values.select_nth_unstable_by(middle, f32::total_cmp);
    *median / MEDIAN_OF_NORMAL
}
