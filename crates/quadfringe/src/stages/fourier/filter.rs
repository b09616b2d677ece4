//! Fourier filter for pairs of rows.

use super::extend::{self, extend};
use super::{Band, raised_cosine};
use crate::parallel::Aligned;
use crate::stages::params::PASSAGE_PART;
use rustfft::num_complex::Complex32;
use rustfft::{Fft, FftPlanner};
use std::sync::Arc;

/// A value for each of the two rows that share a complex transform.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct RowPair<T> {
    pub real: T,
    pub imaginary: T,
}

impl<T> RowPair<T> {
    #[inline(always)]
    pub fn map<U>(self, f: impl Fn(T) -> U) -> RowPair<U> {
        RowPair { real: f(self.real), imaginary: f(self.imaginary) }
    }
}

/// Transforms for rows of one length, planned once. Two rows share one complex transform: one is its real part, the
/// other its imaginary part.
#[derive(Clone)]
pub(crate) struct RowFilter {
    forward: Arc<dyn Fft<f32>>,
    inverse: Arc<dyn Fft<f32>>,
    columns: usize,
    /// Weights of the passage from the end of a row to its beginning. With the length of the passage added, the row has
    /// a length that is fast to transform.
    fade: Vec<f32>,
}

/// One of the two rows of a transform.
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
    /// Weighted positive frequencies. All entries from `bins` on are zero.
    positive: Aligned<Complex32>,
    bins: usize,
    output: Aligned<Complex32>,
    work: Aligned<Complex32>,
}

impl RowFilter {
    pub fn new(columns: usize) -> Self {
        let length = quick_length(columns + (columns / PASSAGE_PART).max(2));
        let mut planner = FftPlanner::new();
        let passage = (length - columns) as f32;
        let fade = |k: usize| raised_cosine((k as f32 + 0.5) / passage);
        Self {
            forward: planner.plan_fft_forward(length),
            inverse: planner.plan_fft_inverse(length),
            columns,
            fade: (0..length - columns).map(fade).collect(),
        }
    }

    /// Weights of the frequencies from zero up to the end of the band. They restore the amplitude that the fringes had
    /// before averaging over `pixels` pixels.
    pub fn weights(&self, band: Band, period: f32, pixels: usize) -> Vec<f32> {
        let length = self.forward.len();
        let carrier = length as f32 / period;
        // Separating the two rows doubles the spectrum; this compensates for the omitted negative frequencies.
        let scale = 1.0 / length as f32;
        let averaging = |bin: usize| {
            let half_turn = std::f32::consts::PI * bin as f32 / length as f32;
            if bin == 0 { 1.0 } else { half_turn.sin() / (pixels as f32 * (half_turn / pixels as f32).sin()) }
        };
        let weight = |bin: usize| scale * band.weight(bin as f32 / carrier) / averaging(bin);
        let mut weights: Vec<f32> = (0..length.div_ceil(2)).map(weight).collect();
        weights.truncate(weights.iter().rposition(|w| *w > 0.0).map_or(1, |last| last + 1));
        weights
    }

    /// Standard deviation in rad of the phase of an analytic signal of modulation 1 with these weights, for unit noise of the samples.
    pub fn phase_noise(&self, weights: &[f32]) -> f32 {
        let squares: f32 = weights.iter().map(|weight| weight * weight).sum();
        (2.0 * self.forward.len() as f32 * squares).sqrt()
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

    /// Adapts working memory that may have been used for rows of another length.
    #[inline(always)]
    pub fn ready(&self, scratch: &mut RowScratch) {
        if scratch.spectrum.len() != self.forward.len() || scratch.tails[0].len() != self.fade.len() {
            *scratch = self.scratch();
        }
    }

    /// Spectrum of two rows of fringes without background. The fringe periods are in samples.
    #[inline(always)]
    pub fn transform(&self, rows: RowPair<&[f32]>, periods: RowPair<f32>, scratch: &mut RowScratch) {
        let RowScratch { tails, extend: edges, spectrum, work, .. } = scratch;
        let [real_tail, imaginary_tail] = tails;
        extend(rows.real, periods.real, &self.fade, edges, real_tail);
        extend(rows.imaginary, periods.imaginary, &self.fade, edges, imaginary_tail);
        let (inside, beyond) = spectrum.split_at_mut(self.columns);
        for ((z, re), im) in inside.iter_mut().zip(rows.real).zip(rows.imaginary) {
            *z = Complex32::new(*re, *im);
        }
        for ((z, re), im) in beyond.iter_mut().zip(&**real_tail).zip(&**imaginary_tail) {
            *z = Complex32::new(*re, *im);
        }
        self.forward.process_with_scratch(spectrum, work);
    }

    /// Analytic signal of one of the transformed rows: its weighted positive frequencies. The signal is periodic: after
    /// the row comes the passage from its end to its beginning.
    #[inline(always)]
    pub fn analytic<'a>(&self, half: Half, weights: &[f32], scratch: &'a mut RowScratch) -> &'a [Complex32] {
        let RowScratch { spectrum, positive, bins, output, work, .. } = scratch;
        let mirrored = spectrum.iter().rev();
        // The zero frequency is background and is left out.
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

/// Shortest length that is at least `least`, has only the prime factors 2 and 3 (at most 3^2), and is divisible by 16.
fn quick_length(least: usize) -> usize {
    let threes = [1, 3, 9];
    let lengths = threes.map(|three| three * least.div_ceil(three).next_power_of_two().max(16));
    lengths.into_iter().min().unwrap_or(least)
}
