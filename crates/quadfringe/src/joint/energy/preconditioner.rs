//! The preconditioner: exact solutions along the columns of cells, and of a smooth phase across them (J46).

use super::blocks::{Block, bend_diagonal, block, difference_diagonal};
use super::plane::{Derivatives, Fields, Plane, STRIDE, VECTORS, Weights, place, row, total};
use super::splines::{self, Products, Splines, Square};
use crate::joint::model::count;
use crate::joint::params::energy::{CONTRAST_RIDGE, PIVOT_RIDGE, RIDGE, SIDE};
use crate::parallel::lanes::{LANES, Lanes, less, plus, times};
use multiversion::multiversion;

/// Factor of the diagonals. Where only the ridges determine cells, as in a column of cells without data, rounding makes pivots 0 or
/// negative, and the tile would have no phase. What this adds is larger than any rounding.
const STABLE: f32 = 1.0 + PIVOT_RIDGE;

/// The factors of the matrix M = L D L^T, column by column, and those of the splines (J46). Columns follow the fringes. Without them,
/// streaks of phase and colour along a fringe converge slowly. Within a cell, the albedos answer to phase and contrast, and the contrast
/// to the phase.
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
    /// Inverse pivots of the albedos, and the coupling of each of them with that of the row below, negative.
    albedo: [Plane; 4],
    coupling: Plane,
    /// The second part.
    pub splines: Splines,
}

/// Factors the matrices of the columns of a tile, and that of its splines.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2+fma"))]
pub(super) fn prepare(
    lines: &mut Preconditioner,
    derivatives: &Derivatives,
    weights: &Weights,
    ratios: [f32; 4],
) {
    let share = 1.0 / count(ratios);
    lines.splines.clear();
    for x in (0..SIDE).step_by(LANES) {
        let (mut above, mut square) = (Pivots::default(), Square::default());
        for y in 0..SIDE {
            let at = place(x, y);
            let local = block(derivatives, weights, ratios, at);
            lines.follow(derivatives, &local, at);
            lines.albedos(weights, share, &local.albedo, at);
            let coupled = lines.contrast(weights, &local, at);
            let known = lines.bend(weights, &local.phase, coupled, at, &mut above);
            square.add(weights, known, at, y);
            if y % LANES == LANES - 1 {
                lines.splines.add(&std::mem::take(&mut square), x / LANES, y);
            }
        }
    }
    lines.splines.factor();
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

    /// Factors of the phase; returns the information that is left once the contrast follows.
    #[inline(always)]
    fn bend(
        &mut self,
        weights: &Weights,
        known: &Lanes,
        coupled: Lanes,
        at: usize,
        above: &mut Pivots,
    ) -> Lanes {
        let [_, down, mixed] = &weights.bend;
        let diagonal = bend_diagonal(weights, at);
        let (here, last) = (down.get(at), down.get(at - STRIDE));
        let (corner, corner_left) = (mixed.get(at - STRIDE), mixed.get(at - STRIDE - 1));
        let [mut inverse, mut first, mut second, mut left] = [[0.0; LANES]; 4];
        for x in 0..LANES {
            left[x] = known[x] + RIDGE - coupled[x];
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
        left
    }
}

/// Goes `length` along a direction whose product with the matrix is given: adds it to the step and takes it from the residual. The
/// residual is kept as L^-1 r, so the product becomes L^-1 of itself. Returns the squared residual, r M^-1 r.
///
/// Whole rows are eliminated one after the other, so that the columns of a row do not wait for each other. Each channel has a
/// separate pass over a row. In one pass over all of them the compiler gathers the four channels of a cell into short vectors, which
/// takes more than twice as long.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2+fma"))]
pub(super) fn move_along(
    lines: &mut Preconditioner,
    length: f32,
    direction: &Fields,
    product: &mut Fields,
    step: &mut Fields,
    residual: &mut Fields,
) -> f64 {
    let (mut size, mut sums, mut smooth) = (0.0, Products::default(), splines::NONE);
    for y in 0..SIDE {
        let phase = lines.eliminate(y, product);
        sums.add(y, &phase, &mut smooth);
        let pivots = lines.pivots().into_iter().zip(product.planes());
        let changed =
            residual.planes_mut().into_iter().zip(direction.planes().into_iter().zip(step.planes_mut()));
        let mut squares = [0.0; LANES];
        for ((pivots, product), (residual, (direction, step))) in pivots.zip(changed) {
            for at in row(y) {
                step.set(at, plus(step.get(at), [length; LANES], direction.get(at)));
                let left = less(residual.get(at), [length; LANES], product.get(at));
                squares = plus(squares, left, times(pivots.get(at), left));
                residual.set(at, left);
            }
        }
        size += total(squares);
    }
    size + lines.splines.take(length, smooth)
}

/// New search direction: M^-1 r plus `share` of the old direction, for a residual that is kept as L^-1 r.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2+fma"))]
pub(super) fn turn(lines: &Preconditioner, residual: &Fields, share: f32, direction: &mut Fields) {
    let (mut below, smooth) = (Below::default(), lines.splines.solved());
    for y in (0..SIDE).rev() {
        lines.substitute(y, residual, &smooth.row(y), share, &mut below, direction);
    }
}

/// What the back substitution of a row needs of the rows below: phases of the next and of the one after it, and albedos and contrast
/// of the next before they follow phase and contrast.
#[derive(Default)]
struct Below {
    phase: [[Lanes; VECTORS]; 2],
    albedo: [[Lanes; VECTORS]; 4],
    contrast: [Lanes; VECTORS],
}

impl Preconditioner {
    /// Inverse pivots, in the order of the planes of fields.
    #[inline(always)]
    fn pivots(&self) -> [&Plane; 6] {
        let [red, green, blue, infrared] = &self.albedo;
        [&self.phase, red, green, blue, infrared, &self.contrast]
    }

    /// Forward elimination of row `y`; returns its phase once albedo and contrast follow, before the rows above are taken from it.
    #[inline(always)]
    fn eliminate(&self, y: usize, out: &mut Fields) -> [Lanes; VECTORS] {
        let Fields { phase, albedo, contrast } = out;
        for c in 0..4 {
            for at in row(y) {
                let log = albedo[c].get(at);
                phase.set(at, less(phase.get(at), self.by_phase[c].get(at), log));
                contrast.set(at, less(contrast.get(at), self.by_contrast[c].get(at), log));
                let first = times(self.coupling.get(at - STRIDE), self.albedo[c].get(at - STRIDE));
                albedo[c].set(at, less(log, first, albedo[c].get(at - STRIDE)));
            }
        }
        let mut phases = [[0.0; LANES]; VECTORS];
        for (i, at) in row(y).enumerate() {
            let slow = contrast.get(at);
            let mut value = less(phase.get(at), self.contrast_by_phase.get(at), slow);
            phases[i] = value;
            value = less(value, self.phase_first.get(at), phase.get(at - STRIDE));
            phase.set(at, less(value, self.phase_second.get(at), phase.get(at - 2 * STRIDE)));
            contrast.set(at, less(slow, self.contrast_first.get(at), contrast.get(at - STRIDE)));
        }
        phases
    }

    /// Back substitution of row `y`; then the phase of the splines is added, and albedos and contrast follow. The result and `share` of
    /// the old direction are the new one.
    #[inline(always)]
    fn substitute(
        &self,
        y: usize,
        residual: &Fields,
        smooth: &[Lanes; VECTORS],
        share: f32,
        below: &mut Below,
        direction: &mut Fields,
    ) {
        let [mut columns, mut phases, mut contrasts] = [[[0.0; LANES]; VECTORS]; 3];
        for (i, at) in row(y).enumerate() {
            let mut phase = times(residual.phase.get(at), self.phase.get(at));
            let mut contrast = times(residual.contrast.get(at), self.contrast.get(at));
            phase = less(phase, self.phase_first.get(at + STRIDE), below.phase[0][i]);
            phase = less(phase, self.phase_second.get(at + 2 * STRIDE), below.phase[1][i]);
            contrast = less(contrast, self.contrast_first.get(at + STRIDE), below.contrast[i]);
            below.contrast[i] = contrast;
            columns[i] = phase;
            phase = plus(phase, [1.0; LANES], smooth[i]);
            contrast = less(contrast, self.contrast_by_phase.get(at), phase);
            (phases[i], contrasts[i]) = (phase, contrast);
            direction.phase.set(at, plus(phase, [share; LANES], direction.phase.get(at)));
            direction.contrast.set(at, plus(contrast, [share; LANES], direction.contrast.get(at)));
        }
        for c in 0..4 {
            for (i, at) in row(y).enumerate() {
                let log = less(residual.albedo[c].get(at), self.coupling.get(at), below.albedo[c][i]);
                let mut log = times(log, self.albedo[c].get(at));
                below.albedo[c][i] = log;
                log = less(log, self.by_phase[c].get(at), phases[i]);
                log = less(log, self.by_contrast[c].get(at), contrasts[i]);
                direction.albedo[c].set(at, plus(log, [share; LANES], direction.albedo[c].get(at)));
            }
        }
        below.phase = [columns, below.phase[0]];
    }
}
