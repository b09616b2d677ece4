//! How sure a pixel of the published method is: the standard deviation of its phase, and the probability that its order is
//! another one.

use crate::decode::output::OutputRow;
use std::f32::consts::PI;

/// Least margin up to which margins are counted as strays.
const FAR_MARGIN_MIN: f32 = 0.25;

/// Steps of the table of probabilities, a power of two.
const STEPS: usize = 1024;
/// A number of this size has its last bit at 1: what is added to it is rounded and stands in the last bits.
const WHOLE: f32 = 8_388_608.0;

/// Standard deviation of a two-step phase from red and from blue times `equal`, when both have the noise given: a change of
/// either turns the phase by its part across the phasor.
#[inline(always)]
pub(super) fn two_step_deviation([red, blue]: [f32; 2], equal: f32, noise: f32) -> f32 {
    let square = red * red + blue * blue;
    let across = blue * blue + red * red * equal * equal;
    noise * across.sqrt() / if square > 1e-12 { square } else { 1e-12 }
}

/// Orders that were chosen point by point: probability of another one by the margin, 1 for beats in the middle between two orders
/// and 0 for a toss-up.
#[derive(Debug, Clone)]
pub(super) struct MarginOdds {
    /// NaN from `STEPS` on.
    table: Box<[f32; 2 * STEPS]>,
}

impl MarginOdds {
    /// From margins of many pixels. Most beats are off by a normal deviation, of which the median tells the size; one that is `d`
    /// off would be `2 pi - d` off from the order beyond. The others, beside edges, are off by anything: as many margins as lie
    /// where a normal deviation hardly gets (four of them) tell how many there are, and their orders are as good as random.
    pub fn new(margins: &mut [f32]) -> Self {
        let mut apart: Vec<f32> = margins.iter().map(|margin| PI * (1.0 - margin)).collect();
        let sigma = deviation(&mut apart).max(0.02);
        let far = (1.0 - 4.0 * sigma / PI).max(FAR_MARGIN_MIN);
        let beyond = margins.iter().filter(|margin| **margin < far).count() as f32;
        let stray = (beyond / (far * margins.len().max(1) as f32)).min(1.0);
        let probability = |step: usize| {
            let apart = PI * (1.0 - step as f32 / (STEPS - 1) as f32);
            let normal = (2.0 * PI).sqrt() / sigma * (-0.5 * (apart / sigma).powi(2)).exp();
            let random = stray / (stray + (1.0 - stray) * normal).max(f32::MIN_POSITIVE);
            let lead = 2.0 * PI * (PI - apart) / (sigma * sigma);
            let toss = 1.0 / (1.0 + lead.min(80.0).exp());
            1.0 - (1.0 - random) * (1.0 - toss)
        };
        let known_or_not = |step| if step < STEPS { probability(step) } else { f32::NAN };
        Self { table: Box::new(std::array::from_fn(known_or_not)) }
    }

    /// Probabilities of another order of a row; NaN for NaN. Vectors find the places in the table, so that what is left
    /// for single numbers is to fetch them.
    #[inline(always)]
    pub fn another(&self, margins: &[f32], out: &mut [f32]) {
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

/// What the rows of a shot that are decoded one by one have in common, found from a few of them.
#[derive(Debug, Clone)]
pub(super) struct Sureness {
    /// Standard deviation of the intensities.
    pub noise: f32,
    pub odds: MarginOdds,
}

impl Sureness {
    /// Before anything is known: uncertainties come in units of the noise.
    pub fn none() -> Self {
        Self { noise: 1.0, odds: MarginOdds { table: Box::new([0.0; 2 * STEPS]) } }
    }

    /// From second differences of intensities down columns, which see little of the fringes, and from margins of orders.
    pub fn new(bends: &mut [f32], margins: &mut [f32]) -> Self {
        Self { noise: deviation(bends) / 6f32.sqrt(), odds: MarginOdds::new(margins) }
    }

    /// Uncertainty and odds of a row that was decoded before they were known.
    pub fn tell(&self, row: &mut OutputRow<'_>) {
        row.sigma.iter_mut().for_each(|sigma| *sigma *= self.noise);
        self.odds.another(row.quality, row.wrong);
    }
}

/// Standard deviation of normal values around 0 from the median of their size; 0 of nothing.
fn deviation(values: &mut [f32]) -> f32 {
    values.iter_mut().for_each(|value| *value = value.abs());
    let middle = values.len() / 2;
    if values.is_empty() {
        return 0.0;
    }
    let (_, median, _) = values.select_nth_unstable_by(middle, f32::total_cmp);
    *median / 0.6745
}
