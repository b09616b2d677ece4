//! Phase of all pixels of a tile, from those that the decoder returned.
//!
//! Which pixels a decoder returns depends on their light: a dark texture at the crest of a fringe contradicts the fringe
//! and becomes no data, the same texture in the trough does not. Means over the returned pixels alone have a second
//! harmonic that is no response. A polynomial gives the pixels between them a phase, so that all pixels take part.

use crate::condition::params::{KNOWN_MIN, PHASE_MISFIT_MAX_RAD};
use ndarray::ArrayView2;

/// Number of terms of a polynomial of degree 2 in two coordinates.
const TERMS: usize = 6;

/// Light and phase, rad of the first fringe number, of the pixels of a tile from the first to the last known one of every
/// row; `None` with too few known pixels, or where no smooth phase describes them.
pub(super) fn light_and_phase(
    light: ArrayView2<'_, f32>,
    phase_rad: ArrayView2<'_, f32>,
) -> Option<Vec<(f32, f32)>> {
    let known = phase_rad.iter().filter(|phase| phase.is_finite()).count();
    if (known as f32) < KNOWN_MIN * phase_rad.len() as f32 {
        return None;
    }
    let smooth = Polynomial::through(phase_rad)?;
    let mut pixels = Vec::with_capacity(phase_rad.len());
    let mut misfit = 0.0;
    for (y, (light, phase)) in light.rows().into_iter().zip(phase_rad.rows()).enumerate() {
        let is_known = |x: &usize| phase[*x].is_finite();
        let Some(first) = (0..phase.len()).find(is_known) else { continue };
        let last = (first..phase.len()).rfind(is_known).unwrap_or(first);
        for x in first..=last {
            let fitted = smooth.at(x, y);
            if phase[x].is_finite() {
                misfit += (f64::from(phase[x]) - fitted).powi(2);
            }
            if light[x].is_finite() {
                pixels.push((light[x], fitted as f32));
            }
        }
    }
    (misfit <= known as f64 * PHASE_MISFIT_MAX_RAD.powi(2)).then_some(pixels)
}

/// A polynomial of degree 2 over a tile, of coordinates between -1 and 1.
struct Polynomial {
    weights: [f64; TERMS],
    scale: [f64; 2],
}

impl Polynomial {
    /// The least squares fit of the finite values; `None` if they do not determine it.
    fn through(map: ArrayView2<'_, f32>) -> Option<Self> {
        let (rows, columns) = map.dim();
        let scale = [columns, rows].map(|length| 2.0 / (length.max(2) - 1) as f64);
        // The normal equations, with their right hand side as the last column.
        let mut sums = [[0.0; TERMS + 1]; TERMS];
        for ((y, x), &value) in map.indexed_iter().filter(|(_, value)| value.is_finite()) {
            let terms = terms(x, y, scale);
            for (row, &a) in sums.iter_mut().zip(&terms) {
                for (sum, &b) in row.iter_mut().zip(&terms) {
                    *sum += a * b;
                }
                row[TERMS] += a * f64::from(value);
            }
        }
        Some(Self { weights: solved(sums)?, scale })
    }

    fn at(&self, x: usize, y: usize) -> f64 {
        terms(x, y, self.scale).iter().zip(&self.weights).map(|(term, weight)| term * weight).sum()
    }
}

fn terms(x: usize, y: usize, scale: [f64; 2]) -> [f64; TERMS] {
    let [x, y] = [x as f64 * scale[0] - 1.0, y as f64 * scale[1] - 1.0];
    [1.0, x, y, x * x, x * y, y * y]
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

    #[test]
    fn a_smooth_phase_is_given_to_the_holes_between_known_pixels() {
        let whole = Array2::from_shape_fn((40, 50), |(y, x)| {
            let [x, y] = [x as f32, y as f32];
            700.0 + 0.3 * x - 0.1 * y + 0.002 * x * x - 0.001 * x * y
        });
        let holed =
            Array2::from_shape_fn(
                (40, 50),
                |(y, x)| {
                    if (x * y) % 3 == 1 || x < 5 { f32::NAN } else { whole[[y, x]] }
                },
            );
        let found = light_and_phase(whole.view(), holed.view()).expect("a smooth phase");
        assert!(found.len() > 40 * 43 && found.len() <= 40 * 45, "{}", found.len());
        assert!(found.iter().all(|(light, phase)| (light - phase).abs() < 1e-3));
    }

    #[test]
    fn a_step_or_too_few_pixels_give_nothing() {
        let step = Array2::from_shape_fn((40, 40), |(_, x)| if x < 20 { 0.0 } else { 6.0 });
        assert!(light_and_phase(step.view(), step.view()).is_none());
        let few = Array2::from_shape_fn((40, 40), |(_, x)| if x < 10 { 0.0 } else { f32::NAN });
        assert!(light_and_phase(few.view(), few.view()).is_none());
        let column = Array2::from_shape_fn((40, 1), |_| 1.0);
        assert!(light_and_phase(column.view(), column.view()).is_none());
    }
}
