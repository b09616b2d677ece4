//! The preconditioner: exact solutions along the columns of cells.

use super::blocks::{Block, bend_diagonal, block, difference_diagonal};
use super::plane::{Column, Derivatives, Fields, Plane, STRIDE, Weights, place, total};
use crate::joint::model::count;
use crate::joint::params::energy::{CONTRAST_RIDGE, PIVOT_RIDGE, RIDGE, SIDE};
use crate::parallel::lanes::{LANES, Lanes};
use multiversion::multiversion;

/// Factor of the diagonals. Where only the ridges determine cells, as in a column of cells without data, rounding makes pivots 0 or
/// negative, and the tile would have no phase. What this adds is larger than any rounding.
const STABLE: f32 = 1.0 + PIVOT_RIDGE;

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
                inverse[x] = 1.0 / (STABLE / local[c][x] - above[x] * above[x] * before[x]);
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
            inverse[x] = 1.0 / (STABLE * diagonal + first[x] * above[x]);
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
            let own = STABLE * (known[x] + diagonal[x] + RIDGE) - coupled[x];
            inverse[x] = 1.0 / (own - last[x] * second[x] - next * first[x]);
        }
        self.phase_second.set(at, second);
        self.phase_first.set(at, first);
        self.phase.set(at, inverse);
        *above = Pivots { inverse: [above.inverse[1], inverse], first };
    }
}

/// Solves the columns; returns the scalar product of residual and result.
///
/// Each channel has separate passes. In one pass over all of them the compiler gathers the four channels of a cell into
/// short vectors, which takes more than twice as long.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2+fma"))]
pub(super) fn precondition(lines: &Preconditioner, residual: &Fields, out: &mut Fields) -> f64 {
    let mut product = 0.0;
    for x in (0..SIDE).step_by(LANES) {
        for y in 0..SIDE {
            let at = place(x, y);
            out.phase.set(at, residual.phase.get(at));
            out.contrast.set(at, residual.contrast.get(at));
        }
        for c in 0..4 {
            lines.eliminate_albedo(c, x, residual, out);
        }
        lines.eliminate(x, out);
        lines.substitute(x, out);
        for c in 0..4 {
            lines.substitute_albedo(c, x, out);
        }
        for y in (0..SIDE).rev() {
            let at = place(x, y);
            product += total(Column::of(out, at).times(&Column::of(residual, at)));
        }
    }
    product
}

/// `value - factor * by` in every cell.
#[inline(always)]
fn less(value: Lanes, factor: Lanes, by: Lanes) -> Lanes {
    let mut out = [0.0; LANES];
    for x in 0..LANES {
        out[x] = value[x] - factor[x] * by[x];
    }
    out
}

impl Preconditioner {
    /// Forward elimination of the albedos of channel `c`, which changes phase and contrast too.
    #[inline(always)]
    fn eliminate_albedo(&self, c: usize, x: usize, residual: &Fields, out: &mut Fields) {
        let mut first = [0.0; LANES];
        for y in 0..SIDE {
            let at = place(x, y);
            let log = residual.albedo[c].get(at);
            out.phase.set(at, less(out.phase.get(at), self.by_phase[c].get(at), log));
            out.contrast.set(at, less(out.contrast.get(at), self.by_contrast[c].get(at), log));
            let (coupling, above) = (self.coupling.get(at - STRIDE), self.albedo[c].get(at - STRIDE));
            let mut coupled = [0.0; LANES];
            for i in 0..LANES {
                coupled[i] = coupling[i] * above[i];
            }
            first = less(log, coupled, first);
            out.albedo[c].set(at, first);
        }
    }

    /// Forward elimination of contrast and phase.
    #[inline(always)]
    fn eliminate(&self, x: usize, out: &mut Fields) {
        let [mut second, mut first, mut slow] = [[0.0; LANES]; 3];
        for y in 0..SIDE {
            let at = place(x, y);
            let (follow, share) = (self.contrast_by_phase.get(at), self.contrast_first.get(at));
            let (one, two) = (self.phase_first.get(at), self.phase_second.get(at));
            let (mut phase, contrast) = (out.phase.get(at), out.contrast.get(at));
            for i in 0..LANES {
                phase[i] -= follow[i] * contrast[i] + one[i] * first[i] + two[i] * second[i];
            }
            slow = less(contrast, share, slow);
            [second, first] = [first, phase];
            out.phase.set(at, phase);
            out.contrast.set(at, slow);
        }
    }

    /// Back substitution of contrast and phase; then the contrast follows the phase of its cell.
    #[inline(always)]
    fn substitute(&self, x: usize, out: &mut Fields) {
        let [mut second, mut first, mut slow] = [[0.0; LANES]; 3];
        for y in (0..SIDE).rev() {
            let at = place(x, y);
            let (pivot, inverse) = (self.phase.get(at), self.contrast.get(at));
            let (one, two) = (self.phase_first.get(at + STRIDE), self.phase_second.get(at + 2 * STRIDE));
            let share = self.contrast_first.get(at + STRIDE);
            let (mut phase, mut contrast) = (out.phase.get(at), out.contrast.get(at));
            for i in 0..LANES {
                phase[i] = pivot[i] * phase[i] - one[i] * first[i] - two[i] * second[i];
                contrast[i] = inverse[i] * contrast[i] - share[i] * slow[i];
            }
            [second, first, slow] = [first, phase, contrast];
            out.phase.set(at, phase);
            out.contrast.set(at, less(contrast, self.contrast_by_phase.get(at), phase));
        }
    }

    /// Back substitution of the albedos of channel `c`; then they follow phase and contrast of their cell.
    #[inline(always)]
    fn substitute_albedo(&self, c: usize, x: usize, out: &mut Fields) {
        let mut first = [0.0; LANES];
        for y in (0..SIDE).rev() {
            let at = place(x, y);
            let (inverse, coupling) = (self.albedo[c].get(at), self.coupling.get(at));
            let (by_phase, by_contrast) = (self.by_phase[c].get(at), self.by_contrast[c].get(at));
            let (phase, contrast) = (out.phase.get(at), out.contrast.get(at));
            let (row, mut answer) = (out.albedo[c].get(at), [0.0; LANES]);
            for i in 0..LANES {
                first[i] = inverse[i] * (row[i] - coupling[i] * first[i]);
                answer[i] = first[i] - (by_phase[i] * phase[i] + by_contrast[i] * contrast[i]);
            }
            out.albedo[c].set(at, answer);
        }
    }
}
