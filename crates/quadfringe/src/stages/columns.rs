//! Projector columns from absolute phase.
//!
//! `Phi = 2 pi N u / W` (S1), so `u = Phi W / (2 pi N)`. No light comes from outside the projector image. Columns that
//! lie more than one column outside it are therefore wrong; they and their phases become NaN.

use crate::encoding::Encoding;
use ndarray::{Array2, ArrayView2};
use std::f32::consts::TAU;

/// Phase and projector column of the pixels that the projector image lights, each `(rows, columns)`; NaN is no data.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Columns {
    /// Absolute phase in rad.
    pub phase_rad: Array2<f32>,
    /// Projector column in pixels, 0 at the centre of the first one.
    pub column_px: Array2<f32>,
}

/// Projector columns from the absolute phase of the first fringe number in rad, `(rows, columns)`. NaN in, NaN out.
///
/// ```
/// use ndarray::array;
/// use quadfringe::{Encoding, stages::columns_from_phase};
/// let encoding = Encoding::optimum(36, 912)?;
/// let turns = 2.0 * std::f32::consts::TAU;
/// let found = columns_from_phase(&encoding, array![[turns, -turns]].view());
/// assert!((found.column_px[[0, 0]] - 2.0 * 912.0 / 36.0).abs() < 1e-4);
/// assert!(found.column_px[[0, 1]].is_nan() && found.phase_rad[[0, 1]].is_nan());
/// # Ok::<(), quadfringe::Error>(())
/// ```
#[must_use]
pub fn columns_from_phase(encoding: &Encoding, phase_rad: ArrayView2<'_, f32>) -> Columns {
    let per_rad = encoding.period_px() as f32 / TAU;
    let edges = ProjectorEdges::of(encoding.columns_px());
    let mut found =
        Columns { phase_rad: phase_rad.to_owned(), column_px: phase_rad.mapv(|phase| phase * per_rad) };
    for (phase, column) in found.phase_rad.iter_mut().zip(&mut found.column_px) {
        if !edges.contain(*column) {
            (*phase, *column) = (f32::NAN, f32::NAN);
        }
    }
    found
}

/// First and last of the columns that light the scene, with a tolerance of one column for noise on each side.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ProjectorEdges {
    first_px: f32,
    end_px: f32,
}

impl ProjectorEdges {
    pub fn of([first_px, last_px]: [f64; 2]) -> Self {
        Self { first_px: first_px as f32 - 1.5, end_px: last_px as f32 + 0.5 }
    }

    #[inline(always)]
    pub fn contain(self, column: f32) -> bool {
        (column >= self.first_px) & (column < self.end_px)
    }
}
