//! The preconditioner: the six unknowns of a cell with its neighbours held fixed.

use super::plane::{Derivatives, Fields, Plane, STRIDE, Weights, four, total, vectors};
use super::scales::Information;
use crate::joint::params::energy::{CONTRAST_RIDGE, RIDGE};
use crate::parallel::lanes::{LANES, Lanes};
use multiversion::multiversion;

/// The blocks of the cells: the six unknowns of a cell with its neighbours held fixed.
#[derive(Debug, Default)]
pub(super) struct Preconditioner {
    /// Inverse diagonal of each albedo.
    albedo: [Plane; 4],
    /// Inverse of the block of phase and contrast once the albedos are eliminated.
    phase: Plane,
    mixed: Plane,
    contrast: Plane,
}

/// Diagonal of the matrix of bending.
#[inline(always)]
fn bend_diagonal(weights: &Weights, at: usize) -> Lanes {
    let [along, down, mixed] = &weights.bend;
    let (left, here, right) = (along.get(at - 1), along.get(at), along.get(at + 1));
    let (above, level, below) = (down.get(at - STRIDE), down.get(at), down.get(at + STRIDE));
    let corners = [mixed.get(at), mixed.get(at - 1), mixed.get(at - STRIDE), mixed.get(at - STRIDE - 1)];
    let mut out = [0.0; LANES];
    for x in 0..LANES {
        out[x] = left[x] + right[x] + 4.0 * (here[x] + level[x]) + above[x] + below[x];
        for corner in corners {
            out[x] += corner[x];
        }
    }
    out
}

/// Sum of the four weights of first differences at a cell.
#[inline(always)]
fn difference_diagonal(weights: &[Plane; 2], at: usize) -> Lanes {
    let around =
        [weights[0].get(at), weights[0].get(at - 1), weights[1].get(at), weights[1].get(at - STRIDE)];
    let mut out = [0.0; LANES];
    for weight in around {
        for x in 0..LANES {
            out[x] += weight[x];
        }
    }
    out
}

/// Inverse diagonals of the albedos, and the block of phase and contrast without the bending.
struct Block {
    albedo: [Lanes; 4],
    phase: Lanes,
    mixed: Lanes,
    contrast: Lanes,
}

#[inline(always)]
fn block(derivatives: &Derivatives, weights: &Weights, at: usize) -> Block {
    let bright = difference_diagonal(&weights.brightness, at);
    let colour = difference_diagonal(&weights.colour, at);
    let [mut phase, mut mixed, mut contrast] = [[0.0; LANES]; 3];
    let mut albedo = [[0.0; LANES]; 4];
    for c in 0..4 {
        let (by_phase, by_albedo) = (derivatives.phase[c].get(at), derivatives.albedo[c].get(at));
        let by_contrast = derivatives.contrast[c].get(at);
        for x in 0..LANES {
            let prior = 0.75 * colour[x] + 0.25 * bright[x] + RIDGE;
            albedo[c][x] = 1.0 / (by_albedo[x] * by_albedo[x] + prior);
            // What remains once the albedo follows.
            let kept = prior * albedo[c][x];
            phase[x] += by_phase[x] * by_phase[x] * kept;
            mixed[x] += by_phase[x] * by_contrast[x] * kept;
            contrast[x] += by_contrast[x] * by_contrast[x] * kept;
        }
    }
    Block { albedo, phase, mixed, contrast }
}

/// Mean information of the usable cells.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2+fma"))]
pub(super) fn information(derivatives: &Derivatives, weights: &Weights) -> Information {
    let [mut phase, mut albedo, mut contrast, mut cells] = [0.0f64; 4];
    for at in vectors() {
        let block = block(derivatives, weights, at);
        let (mut squares, mut fringes, mut count) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
        for c in 0..4 {
            let (by_albedo, by_contrast) = (derivatives.albedo[c].get(at), derivatives.contrast[c].get(at));
            for x in 0..LANES {
                squares[x] += 0.25 * by_albedo[x] * by_albedo[x];
                fringes[x] += by_contrast[x] * by_contrast[x];
                count[x] = if squares[x] > 0.0 { 1.0 } else { 0.0 };
            }
        }
        phase += total(block.phase);
        albedo += total(squares);
        contrast += total(fringes);
        cells += total(count);
    }
    let mean = |sum: f64| (sum / cells.max(1.0)) as f32;
    Information { phase: mean(phase), albedo: mean(albedo), contrast: mean(contrast) }
}

/// Information of a cell about its phase once albedo and contrast follow.
#[inline(always)]
pub(super) fn phase_information(derivatives: &Derivatives, weights: &Weights, at: usize) -> Lanes {
    let Block { phase, mixed, contrast, .. } = block(derivatives, weights, at);
    let prior = difference_diagonal(&weights.contrast, at);
    let mut out = [0.0; LANES];
    for x in 0..LANES {
        out[x] = phase[x] - mixed[x] * mixed[x] / (contrast[x] + prior[x] + CONTRAST_RIDGE);
    }
    out
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2+fma"))]
pub(super) fn prepare(blocks: &mut Preconditioner, derivatives: &Derivatives, weights: &Weights) {
    for at in vectors() {
        let Block { albedo, phase, mixed, contrast } = block(derivatives, weights, at);
        let (bend, slow) = (bend_diagonal(weights, at), difference_diagonal(&weights.contrast, at));
        let mut inverse = [[0.0; LANES]; 3];
        for x in 0..LANES {
            let (first, last) = (phase[x] + bend[x] + RIDGE, contrast[x] + slow[x] + CONTRAST_RIDGE);
            let determinant = first * last - mixed[x] * mixed[x];
            let inverted = 1.0 / if determinant > 1e-30 { determinant } else { 1e-30 };
            (inverse[0][x], inverse[1][x], inverse[2][x]) =
                (last * inverted, -mixed[x] * inverted, first * inverted);
        }
        for c in 0..4 {
            blocks.albedo[c].set(at, albedo[c]);
        }
        blocks.phase.set(at, inverse[0]);
        blocks.mixed.set(at, inverse[1]);
        blocks.contrast.set(at, inverse[2]);
    }
}

/// Solves the blocks; returns the scalar product of residual and result.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2+fma"))]
pub(super) fn precondition(
    blocks: &Preconditioner,
    data: &Derivatives,
    residual: &Fields,
    out: &mut Fields,
) -> f64 {
    let mut product = 0.0;
    for at in vectors() {
        let [first, last] = [&residual.phase, &residual.contrast].map(|plane| plane.get(at));
        let (mut phase, mut contrast) = (first, last);
        let (inverse, logs) = (four(&blocks.albedo, at), four(&residual.albedo, at));
        let (by_phase, by_albedo) = (four(&data.phase, at), four(&data.albedo, at));
        let by_contrast = four(&data.contrast, at);
        for c in 0..4 {
            for x in 0..LANES {
                let follow = by_albedo[c][x] * inverse[c][x] * logs[c][x];
                phase[x] -= by_phase[c][x] * follow;
                contrast[x] -= by_contrast[c][x] * follow;
            }
        }
        let [p, m] = blocks.solve(at, [phase, contrast]);
        let mut sum = [0.0; LANES];
        for x in 0..LANES {
            sum[x] = p[x] * first[x] + m[x] * last[x];
        }
        for c in 0..4 {
            let mut log = logs[c];
            for x in 0..LANES {
                let change = by_phase[c][x] * p[x] + by_contrast[c][x] * m[x];
                log[x] = inverse[c][x] * (log[x] - by_albedo[c][x] * change);
                sum[x] += log[x] * logs[c][x];
            }
            out.albedo[c].set(at, log);
        }
        out.phase.set(at, p);
        out.contrast.set(at, m);
        product += total(sum);
    }
    product
}

impl Preconditioner {
    /// Phase and contrast of a vector of cells, by the inverse of their block.
    #[inline(always)]
    fn solve(&self, at: usize, [phase, contrast]: [Lanes; 2]) -> [Lanes; 2] {
        let (first, mixed, last) = (self.phase.get(at), self.mixed.get(at), self.contrast.get(at));
        let [mut p, mut m] = [[0.0; LANES]; 2];
        for x in 0..LANES {
            p[x] = first[x] * phase[x] + mixed[x] * contrast[x];
            m[x] = mixed[x] * phase[x] + last[x] * contrast[x];
        }
        [p, m]
    }
}
