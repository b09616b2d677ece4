//! The preconditioner: exact solutions along the columns of cells.

use super::blocks::{Block, bend_diagonal, block, difference_diagonal};
use super::plane::{Column, Derivatives, Fields, Plane, STRIDE, Weights, four, place, total};
use crate::joint::model::count;
use crate::joint::params::energy::{CONTRAST_RIDGE, RIDGE, SIDE};
use crate::parallel::lanes::{LANES, Lanes};
use multiversion::multiversion;

/// The factors of the matrix, column by column. Columns follow the fringes. Without them, streaks of phase and colour along a
/// fringe converge slowly. Within a cell, the albedos answer to phase and contrast, and the contrast to the phase.
#[derive(Debug, Default)]
pub(super) struct Preconditioner {
    /// Change of each logarithm of an albedo that balances a unit change of the phase or the contrast of its cell, negative.
    by_phase: [Plane; 4],
    by_contrast: [Plane; 4],
    /// The same of the contrast for the phase.
    contrast_by_phase: Plane,
    /// Factors of the phase: inverse pivots, and the shares of the first and the second row above.
    phase: Plane,
    phase_first: Plane,
    phase_second: Plane,
    /// Factors of the contrast.
    contrast: Plane,
    contrast_first: Plane,
    /// Inverse pivots of the albedos.
    albedo: [Plane; 4],
    /// Coupling of an albedo with that of the row below, negative.
    coupling: Plane,
}

/// Factors the matrices of the columns of a tile.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2+fma"))]
pub(super) fn prepare(
    lines: &mut Preconditioner,
    derivatives: &Derivatives,
    weights: &Weights,
    ratios: [f32; 4],
) {
    let share = 1.0 / count(ratios);
    for x in (0..SIDE).step_by(LANES) {
        let mut above = Pivots::default();
        for y in 0..SIDE {
            let at = place(x, y);
            let local = block(derivatives, weights, ratios, at);
            lines.follow(derivatives, &local, at);
            lines.albedos(weights, share, &local.albedo, at);
            let coupled = lines.contrast(weights, &local, at);
            lines.bend(weights, &local.phase, coupled, at, &mut above);
        }
    }
}

/// What the factors of a row need of the two rows above.
#[derive(Default)]
struct Pivots {
    /// The pivots themselves are the inverse of these.
    inverse: [Lanes; 2],
    /// Share of the row before the last in the last one.
    first: Lanes,
}

impl Preconditioner {
    /// How albedos follow phase and contrast of their cell.
    #[inline(always)]
    fn follow(&mut self, derivatives: &Derivatives, local: &Block, at: usize) {
        for c in 0..4 {
            let (by_phase, by_albedo) = (derivatives.phase[c].get(at), derivatives.albedo[c].get(at));
            let by_contrast = derivatives.contrast[c].get(at);
            let [mut phase, mut contrast] = [[0.0; LANES]; 2];
            for x in 0..LANES {
                let share = by_albedo[x] * local.albedo[c][x];
                (phase[x], contrast[x]) = (share * by_phase[x], share * by_contrast[x]);
            }
            self.by_phase[c].set(at, phase);
            self.by_contrast[c].set(at, contrast);
        }
    }

    /// Pivots of the albedos.
    #[inline(always)]
    fn albedos(&mut self, weights: &Weights, share: f32, local: &[Lanes; 4], at: usize) {
        let (bright, colour) = (weights.brightness[1].get(at), weights.colour[1].get(at));
        let above = self.coupling.get(at - STRIDE);
        let mut coupling = [0.0; LANES];
        for x in 0..LANES {
            coupling[x] = -((1.0 - share) * colour[x] + share * bright[x]);
        }
        self.coupling.set(at, coupling);
        for c in 0..4 {
            let before = self.albedo[c].get(at - STRIDE);
            let mut inverse = [0.0; LANES];
            for x in 0..LANES {
                inverse[x] = 1.0 / (1.0 / local[c][x] - above[x] * above[x] * before[x]);
            }
            self.albedo[c].set(at, inverse);
        }
    }

    /// Pivots of the contrast; returns the information about the phase that goes to it.
    #[inline(always)]
    fn contrast(&mut self, weights: &Weights, local: &Block, at: usize) -> Lanes {
        let slow = difference_diagonal(&weights.contrast, at);
        let (above, before) = (weights.contrast[1].get(at - STRIDE), self.contrast.get(at - STRIDE));
        let [mut follow, mut coupled, mut inverse, mut first] = [[0.0; LANES]; 4];
        for x in 0..LANES {
            let diagonal = local.contrast[x] + slow[x] + CONTRAST_RIDGE;
            follow[x] = local.mixed[x] / diagonal;
            coupled[x] = follow[x] * local.mixed[x];
            first[x] = -above[x] * before[x];
            inverse[x] = 1.0 / (diagonal + first[x] * above[x]);
        }
        self.contrast_by_phase.set(at, follow);
        self.contrast_first.set(at, first);
        self.contrast.set(at, inverse);
        coupled
    }

    /// Factors of the phase.
    #[inline(always)]
    fn bend(&mut self, weights: &Weights, known: &Lanes, coupled: Lanes, at: usize, above: &mut Pivots) {
        let [_, down, mixed] = &weights.bend;
        let diagonal = bend_diagonal(weights, at);
        let (here, last) = (down.get(at), down.get(at - STRIDE));
        let (corner, corner_left) = (mixed.get(at - STRIDE), mixed.get(at - STRIDE - 1));
        let [mut inverse, mut first, mut second] = [[0.0; LANES]; 3];
        for x in 0..LANES {
            second[x] = last[x] * above.inverse[0][x];
            let next = -2.0 * (here[x] + last[x]) - corner[x] - corner_left[x] - last[x] * above.first[x];
            first[x] = next * above.inverse[1][x];
            let pivot = known[x] - coupled[x] + diagonal[x] + RIDGE - last[x] * second[x] - next * first[x];
            inverse[x] = 1.0 / if pivot > RIDGE { pivot } else { RIDGE };
        }
        self.phase_second.set(at, second);
        self.phase_first.set(at, first);
        self.phase.set(at, inverse);
        *above = Pivots { inverse: [above.inverse[1], inverse], first };
    }
}

/// Solves the columns; returns the scalar product of residual and result.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2+fma"))]
pub(super) fn precondition(lines: &Preconditioner, residual: &Fields, out: &mut Fields) -> f64 {
    let mut product = 0.0;
    for x in (0..SIDE).step_by(LANES) {
        let mut rows = [Column::default(), Column::default()];
        for y in 0..SIDE {
            let at = place(x, y);
            let row = lines.eliminate(at, &Column::of(residual, at), &rows);
            row.write(out, at);
            rows = [rows[1], row];
        }
        let mut rows = [Column::default(), Column::default()];
        for y in (0..SIDE).rev() {
            let at = place(x, y);
            let row = lines.substitute(at, &Column::of(out, at), &rows);
            let solution = lines.answer(at, &row);
            product += total(solution.times(&Column::of(residual, at)));
            solution.write(out, at);
            rows = [rows[1], row];
        }
    }
    product
}

impl Preconditioner {
    /// Forward elimination of one row, from the results of the two rows above, the nearer one last.
    #[inline(always)]
    fn eliminate(&self, at: usize, residual: &Column, [second, first]: &[Column; 2]) -> Column {
        let mut out = *residual;
        let (by_phase, by_contrast) = (four(&self.by_phase, at), four(&self.by_contrast, at));
        let (above, coupling) = (four(&self.albedo, at - STRIDE), self.coupling.get(at - STRIDE));
        for c in 0..4 {
            for x in 0..LANES {
                let log = residual.albedo[c][x];
                out.phase[x] -= by_phase[c][x] * log;
                out.contrast[x] -= by_contrast[c][x] * log;
                out.albedo[c][x] = log - coupling[x] * above[c][x] * first.albedo[c][x];
            }
        }
        let (follow, share) = (self.contrast_by_phase.get(at), self.contrast_first.get(at));
        let (one, two) = (self.phase_first.get(at), self.phase_second.get(at));
        for x in 0..LANES {
            out.phase[x] -= follow[x] * out.contrast[x] + one[x] * first.phase[x] + two[x] * second.phase[x];
            out.contrast[x] -= share[x] * first.contrast[x];
        }
        out
    }

    /// Back substitution of one row, from the results of the two rows below, the nearer one last.
    #[inline(always)]
    fn substitute(&self, at: usize, row: &Column, [second, first]: &[Column; 2]) -> Column {
        let mut out = *row;
        let (pivot, slow) = (self.phase.get(at), self.contrast.get(at));
        let (one, two) = (self.phase_first.get(at + STRIDE), self.phase_second.get(at + 2 * STRIDE));
        let share = self.contrast_first.get(at + STRIDE);
        let (inverse, coupling) = (four(&self.albedo, at), self.coupling.get(at));
        for x in 0..LANES {
            out.phase[x] = pivot[x] * row.phase[x] - one[x] * first.phase[x] - two[x] * second.phase[x];
            out.contrast[x] = slow[x] * row.contrast[x] - share[x] * first.contrast[x];
        }
        for c in 0..4 {
            for x in 0..LANES {
                out.albedo[c][x] = inverse[c][x] * (row.albedo[c][x] - coupling[x] * first.albedo[c][x]);
            }
        }
        out
    }

    /// The unknowns of a row: contrast and albedos follow the phase of their cell.
    #[inline(always)]
    fn answer(&self, at: usize, row: &Column) -> Column {
        let mut out = *row;
        let (by_phase, by_contrast) = (four(&self.by_phase, at), four(&self.by_contrast, at));
        let follow = self.contrast_by_phase.get(at);
        for x in 0..LANES {
            out.contrast[x] -= follow[x] * row.phase[x];
        }
        for c in 0..4 {
            for x in 0..LANES {
                out.albedo[c][x] -= by_phase[c][x] * row.phase[x] + by_contrast[c][x] * out.contrast[x];
            }
        }
        out
    }
}
