//! The carrier of fringes on a small object, from its light alone.
//!
//! On an object narrower than a few fringes, the spectrum of its outline is as wide as the frequency of the fringes. So the lit
//! pixels of a line are taken by themselves: the means of R and B over them are subtracted, and the quadrature spectrum is divided
//! by the energy that a wave keeps without its mean over these pixels. With z = R - i B, this is the least-squares fit of a
//! constant and a wave to z on the lit pixels (J37), and it needs no whole number of fringes.

use super::band::{Waves, strongest_band};
use super::carrier::LineTransform;
use super::params::{CARRIER_CYCLES_MIN, CARRIER_LINES, CARRIER_POWER_MIN};
use super::params::{LIT_QUANTILES, LIT_SAMPLES_MIN, LIT_SHARE, LIT_STEP, SMALL_PART, WAVE_ENERGY_MIN};
use ndarray::{ArrayView1, ArrayView2};

/// The lit part of a frame that is dark elsewhere.
pub(super) struct SmallPart {
    /// Sum of R and B above which a pixel is lit.
    least: f32,
    rows: Vec<usize>,
    columns: Vec<usize>,
}

impl SmallPart {
    /// The lit part, if it is small.
    pub fn of(red: ArrayView2<'_, f32>, blue: ArrayView2<'_, f32>) -> Option<Self> {
        let (height, width) = red.dim();
        let [rows, columns] = [height, width].map(|length| (0..length).step_by(LIT_STEP));
        let light = |y: usize, x: usize| red[[y, x]] + blue[[y, x]];
        let places = rows.clone().flat_map(|y| columns.clone().map(move |x| (y, x)));
        let mut sums: Vec<f32> = places.map(|(y, x)| light(y, x)).filter(|sum| sum.is_finite()).collect();
        let [dark, bright] = LIT_QUANTILES.map(|share| quantile(&mut sums, share));
        let least = dark? + LIT_SHARE * (bright? - dark?);
        let lit = sums.iter().filter(|&&sum| sum > least).count();
        if lit as f64 > SMALL_PART * sums.len() as f64 {
            return None;
        }
        let is_lit = |y: usize, x: usize| light(y, x) > least;
        let lit_rows =
            rows.clone().filter(|&y| columns.clone().filter(|&x| is_lit(y, x)).count() >= LIT_SAMPLES_MIN);
        let lit_columns =
            columns.clone().filter(|&x| rows.clone().filter(|&y| is_lit(y, x)).count() >= LIT_SAMPLES_MIN);
        Some(Self { least, rows: spread(lit_rows), columns: spread(lit_columns) })
    }

    /// The strongest waves along rows and along columns.
    pub fn waves(&self, red: ArrayView2<'_, f32>, blue: ArrayView2<'_, f32>) -> [Waves; 2] {
        let along_columns =
            || lit_waves(red.reversed_axes(), blue.reversed_axes(), self.least, &self.columns);
        let (row, column) = rayon::join(|| lit_waves(red, blue, self.least, &self.rows), along_columns);
        [row, column]
    }
}

/// The value that a share of `values` does not exceed.
fn quantile(values: &mut [f32], share: f64) -> Option<f32> {
    let place = (share * values.len().checked_sub(1)? as f64) as usize;
    Some(*values.select_nth_unstable_by(place, f32::total_cmp).1)
}

/// At most [`CARRIER_LINES`] of the lines, evenly spread.
fn spread(lines: impl Iterator<Item = usize>) -> Vec<usize> {
    let all: Vec<usize> = lines.collect();
    all.iter().copied().step_by(all.len().div_ceil(CARRIER_LINES).max(1)).collect()
}

fn lit_waves(red: ArrayView2<'_, f32>, blue: ArrayView2<'_, f32>, least: f32, lines: &[usize]) -> Waves {
    let length = red.ncols();
    if length < 4 * CARRIER_CYCLES_MIN || lines.is_empty() {
        return Waves::default();
    }
    let [mut r, mut b, mut mask] = [(); 3].map(|()| LineTransform::new(length));
    let (mut quadrature, mut level) = (vec![0.0; length / 2 + 1], 0.0);
    let mut lit = Vec::new();
    for &line in lines {
        let (red, blue) = (red.row(line), blue.row(line));
        lit.clear();
        lit.extend(red.iter().zip(blue).map(|(r, b)| f32::from(u8::from(r + b > least))));
        let count: f32 = lit.iter().sum();
        level += run_lit(&mut r, red, &lit, count) * run_lit(&mut b, blue, &lit, count) * count;
        mask.run_plain(lit.iter().copied());
        let spectra = r.spectrum.iter().zip(&b.spectrum).zip(&mask.spectrum);
        for (sum, ((r, b), mask)) in quadrature.iter_mut().zip(spectra) {
            let energy = (count - mask.norm_sqr() / count).max(WAVE_ENERGY_MIN * count);
            *sum += (r * b.conj()).im / energy;
        }
    }
    strongest_band(&quadrature, CARRIER_POWER_MIN * level).map_or_else(Waves::default, |band| {
        let period_px = length as f64 / band.cycles;
        // Waves change the light along a line by their amplitude in a period. Of two directions, the one with the greater change
        // tells the period; long waves along the fringes would outweigh it by their amplitude.
        Waves { period_px, strength: band.sum / ((lines.len() * length) as f64 * period_px) }
    })
}

/// Finds the spectrum of the lit pixels of a line less their mean, and gives the mean.
fn run_lit(transform: &mut LineTransform, line: ArrayView1<'_, f32>, lit: &[f32], count: f32) -> f32 {
    let light = || line.iter().zip(lit).map(|(&value, &lit)| (value, lit > 0.0));
    let mean = light().filter(|&(_, lit)| lit).map(|(value, _)| value).sum::<f32>() / count;
    transform.run_plain(light().map(|(value, lit)| if lit { value - mean } else { 0.0 }));
    mean
}
