//! Phase of all pixels of a tile, from those that the decoder returned.
//!
//! Which pixels a decoder returns depends on their light: a dark texture at the crest of a fringe contradicts the fringe
//! and becomes no data, the same texture in the trough does not. Means over the returned pixels alone have a second
//! harmonic that is no response. A polynomial gives all pixels a phase. Wrong orders move the phase by whole turns, so
//! that only the phase modulo a turn is fitted.

use crate::condition::params::{COVERED_MIN, FIT_ROUNDS, FIT_STRIDE_PX, KNOWN_MIN, PHASE_MISFIT_MAX_RAD};
use ndarray::{ArrayView1, ArrayView2};
use std::f64::consts::{FRAC_PI_2, TAU};
use std::ops::Range;

/// Number of terms of a polynomial of degree 2 in two coordinates.
const TERMS: usize = 6;

/// Light of a pixel, fraction of full scale, and its phase of the first fringe number. The phase of a tile may be off by
/// a constant.
#[derive(Clone, Copy)]
pub(super) struct Lit {
    pub light: f32,
    pub phase_rad: f32,
}

/// The pixels of a tile on the surface: those between two known ones of their row or of their column. `None` with too few
/// of either, or where no smooth phase describes them, as at depth steps.
pub(super) fn lit_pixels(light: ArrayView2<'_, f32>, phase_rad: ArrayView2<'_, f32>) -> Option<Vec<Lit>> {
    let all = phase_rad.len() as f32;
    let known = phase_rad.iter().filter(|phase| phase.is_finite()).count();
    if (known as f32) < KNOWN_MIN * all {
        return None;
    }
    let smooth = Polynomial::through(phase_rad)?;
    let rows: Vec<_> = phase_rad.rows().into_iter().map(span).collect();
    let columns: Vec<_> = phase_rad.columns().into_iter().map(span).collect();
    let pixels: Vec<Lit> = light
        .indexed_iter()
        .filter(|((y, x), light)| light.is_finite() && (rows[*y].contains(x) || columns[*x].contains(y)))
        .map(|((y, x), &light)| Lit { light, phase_rad: smooth.at(x, y) as f32 })
        .collect();
    (pixels.len() as f32 >= COVERED_MIN * all).then_some(pixels)
}

/// From the first to the last known pixel of a row or column.
fn span(phase_rad: ArrayView1<'_, f32>) -> Range<usize> {
    let is_known = |i: &usize| phase_rad[*i].is_finite();
    let first = (0..phase_rad.len()).find(is_known).unwrap_or(phase_rad.len());
    first..(first..phase_rad.len()).rfind(is_known).map_or(first, |last| last + 1)
}

/// A polynomial of degree 2 over a tile, of coordinates between -1 and 1.
struct Polynomial {
    weights: [f64; TERMS],
    scale: [f64; 2],
}

/// A pixel that takes part in a fit.
struct Known {
    terms: [f64; TERMS],
    phase_rad: f64,
}

impl Polynomial {
    /// Fit of the finite phases modulo a turn; `None` if they do not determine it, or it describes them badly.
    fn through(phase_rad: ArrayView2<'_, f32>) -> Option<Self> {
        let (rows, columns) = phase_rad.dim();
        let scale = [columns, rows].map(|length| 2.0 / (length.max(2) - 1) as f64);
        let known: Vec<Known> = phase_rad
            .indexed_iter()
            .filter(|((y, x), phase)| y % FIT_STRIDE_PX == 0 && x % FIT_STRIDE_PX == 0 && phase.is_finite())
            .map(|((y, x), &phase)| Known { terms: terms(x, y, scale), phase_rad: f64::from(phase) })
            .collect();
        let mut weights = [0.0; TERMS];
        weights[1] = mean_step_rad(phase_rad, 0, 1) / scale[0];
        weights[2] = mean_step_rad(phase_rad, 1, 0) / scale[1];
        weights[0] = mean_angle_rad(known.iter().map(|pixel| pixel.left_rad(&weights)));
        for _ in 0..FIT_ROUNDS {
            let change = correction(&known, &weights)?;
            weights = std::array::from_fn(|i| weights[i] + change[i]);
        }
        let square: f64 = known.iter().map(|pixel| pixel.left_rad(&weights).powi(2)).sum();
        (square <= known.len() as f64 * PHASE_MISFIT_MAX_RAD.powi(2)).then_some(Self { weights, scale })
    }

    fn at(&self, x: usize, y: usize) -> f64 {
        value(&terms(x, y, self.scale), &self.weights)
    }
}

impl Known {
    /// The phase less that of a polynomial, in half a turn to either side.
    fn left_rad(&self, weights: &[f64; TERMS]) -> f64 {
        let left = self.phase_rad - value(&self.terms, weights);
        left - TAU * (left / TAU).round()
    }
}

fn value(terms: &[f64; TERMS], weights: &[f64; TERMS]) -> f64 {
    terms.iter().zip(weights).map(|(term, weight)| term * weight).sum()
}

fn terms(x: usize, y: usize, scale: [f64; 2]) -> [f64; TERMS] {
    let [x, y] = [x as f64 * scale[0] - 1.0, y as f64 * scale[1] - 1.0];
    [1.0, x, y, x * x, x * y, y * y]
}

/// Mean difference of the phase between neighbours so many rows and columns apart, modulo a turn.
fn mean_step_rad(phase_rad: ArrayView2<'_, f32>, down: usize, right: usize) -> f64 {
    let (rows, columns) = phase_rad.dim();
    let places = (0..rows - down)
        .step_by(FIT_STRIDE_PX)
        .flat_map(|y| (0..columns - right).step_by(FIT_STRIDE_PX).map(move |x| [y, x]));
    let steps = places.map(|[y, x]| f64::from(phase_rad[[y + down, x + right]] - phase_rad[[y, x]]));
    mean_angle_rad(steps.filter(|step| step.is_finite()))
}

/// Angle of the sum of unit vectors, which outliers of any direction hardly turn.
fn mean_angle_rad(angles: impl Iterator<Item = f64>) -> f64 {
    let sum = angles.map(f64::sin_cos).fold([0.0; 2], |sum, (sin, cos)| [sum[0] + sin, sum[1] + cos]);
    sum[0].atan2(sum[1])
}

/// Least squares change of the weights from the pixels within a quarter turn; `None` if these do not determine it.
fn correction(known: &[Known], weights: &[f64; TERMS]) -> Option<[f64; TERMS]> {
    // The normal equations, with their right hand side as the last column.
    let mut sums = [[0.0; TERMS + 1]; TERMS];
    for pixel in known {
        let left = pixel.left_rad(weights);
        if left.abs() > FRAC_PI_2 {
            continue;
        }
        for (row, &a) in sums.iter_mut().zip(&pixel.terms) {
            for (sum, &b) in row.iter_mut().zip(&pixel.terms) {
                *sum += a * b;
            }
            row[TERMS] += a * left;
        }
    }
    solved(sums)
}

/// Gauss-Jordan elimination of normal equations, whose diagonal needs no pivot search.
fn solved(mut rows: [[f64; TERMS + 1]; TERMS]) -> Option<[f64; TERMS]> {
    for i in 0..TERMS {
        let pivot = rows[i];
        // The first diagonal element is the number of pixels; the other terms are of the order of 1.
        if pivot[i] <= f64::from(f32::EPSILON) {
            return None;
        }
        for (j, row) in rows.iter_mut().enumerate() {
            let factor = if i == j { 1.0 - 1.0 / pivot[i] } else { row[i] / pivot[i] };
            for (value, pivot) in row.iter_mut().zip(&pivot) {
                *value -= factor * pivot;
            }
        }
    }
    Some(rows.map(|row| row[TERMS]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::Array2;

    fn smooth() -> Array2<f32> {
        Array2::from_shape_fn((40, 50), |(y, x)| {
            let [x, y] = [x as f32, y as f32];
            700.0 + 0.3 * x - 0.1 * y + 0.002 * x * x - 0.001 * x * y
        })
    }

    /// Greatest distance of the phases from those of `whole`, given as light, but for a constant.
    fn spread_rad(whole: &Array2<f32>, known: &Array2<f32>) -> f32 {
        let found = lit_pixels(whole.view(), known.view()).expect("a smooth phase");
        let shift = |pixel: &Lit| pixel.light - pixel.phase_rad;
        found.iter().map(|pixel| (shift(pixel) - shift(&found[0])).abs()).fold(0.0, f32::max)
    }

    #[test]
    fn a_smooth_phase_is_given_to_the_holes_between_known_pixels() {
        let whole = smooth();
        let holes = |(y, x): (usize, usize)| x < 5 || (x / 3 * 7 + y / 3 * 3) % 5 < 3;
        let holed = Array2::from_shape_fn((40, 50), |at| if holes(at) { f32::NAN } else { whole[at] });
        let count = lit_pixels(whole.view(), holed.view()).map_or(0, |pixels| pixels.len());
        assert!(count > 40 * 44 && count <= 40 * 45, "{count}");
        assert!(spread_rad(&whole, &holed) < 2e-3);
    }

    #[test]
    fn wrong_orders_do_not_move_it() {
        let whole = smooth();
        let turned = Array2::from_shape_fn((40, 50), |(y, x)| {
            whole[[y, x]] + std::f32::consts::TAU * ((x * 7 + y * 5) % 3) as f32
        });
        assert!(spread_rad(&whole, &turned) < 2e-3);
    }

    #[test]
    fn a_step_or_too_few_pixels_give_nothing() {
        let step = Array2::from_shape_fn((40, 40), |(_, x)| if x < 20 { 0.0 } else { 3.0 });
        assert!(lit_pixels(step.view(), step.view()).is_none());
        let few = Array2::from_shape_fn((40, 40), |(_, x)| if x < 15 { 0.0 } else { f32::NAN });
        assert!(lit_pixels(few.view(), few.view()).is_none());
        let column = Array2::from_shape_fn((40, 1), |_| 1.0);
        assert!(lit_pixels(column.view(), column.view()).is_none());
    }
}
