//! The unknowns of one cell with its neighbours held fixed.

use super::plane::{Derivatives, Plane, STRIDE, Weights, row, total};
use super::scales::Information;
use crate::joint::model::{count, weights as channel_weights};
use crate::joint::params::energy::{CONTRAST_RIDGE, RIDGE, SIDE};
use crate::parallel::lanes::{LANES, Lanes, add, times};
use multiversion::multiversion;

/// Diagonal of the matrix of bending.
#[inline(always)]
pub(super) fn bend_diagonal(weights: &Weights, at: usize) -> Lanes {
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

/// Weight of the bending that holds a cell: that of its differences in the middle of a uniform surface, where their diagonal is 20 times it,
/// and less at a border, where fewer differences reach the cell.
#[inline(always)]
pub(super) fn bend_stiffness(weights: &Weights, at: usize) -> Lanes {
    times([1.0 / 20.0; LANES], bend_diagonal(weights, at))
}

/// Sum of the four weights of first differences at a cell.
#[inline(always)]
pub(super) fn difference_diagonal(weights: &[Plane; 2], at: usize) -> Lanes {
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
pub(super) struct Block {
    pub albedo: [Lanes; 4],
    pub phase: Lanes,
    pub mixed: Lanes,
    pub contrast: Lanes,
}

/// The block of a vector of cells.
#[inline(always)]
pub(super) fn block(derivatives: &Derivatives, weights: &Weights, ratios: [f32; 4], at: usize) -> Block {
    let (share, present) = (1.0 / count(ratios), channel_weights(ratios));
    let bright = difference_diagonal(&weights.brightness, at);
    let colour = difference_diagonal(&weights.colour, at);
    let [mut phase, mut mixed, mut contrast] = [[0.0; LANES]; 3];
    let mut albedo = [[0.0; LANES]; 4];
    for c in 0..4 {
        let (by_phase, by_albedo) = (derivatives.phase[c].get(at), derivatives.albedo[c].get(at));
        let by_contrast = derivatives.contrast[c].get(at);
        for x in 0..LANES {
            let prior = (1.0 - share) * colour[x] + share * bright[x] + RIDGE;
            // Without data the priors alone do not determine an albedo.
            albedo[c][x] = present[c] / (by_albedo[x] * by_albedo[x] + prior);
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
pub(super) fn information(derivatives: &Derivatives, weights: &Weights, ratios: [f32; 4]) -> Information {
    let share = 1.0 / count(ratios);
    let [mut phase, mut albedo, mut contrast, mut cells] = [0.0f64; 4];
    for y in 0..SIDE {
        let mut sums = [[0.0; LANES]; 4];
        for at in row(y) {
            let block = block(derivatives, weights, ratios, at);
            let (mut squares, mut fringes, mut count) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
            for c in 0..4 {
                let (by_albedo, by_contrast) =
                    (derivatives.albedo[c].get(at), derivatives.contrast[c].get(at));
                for x in 0..LANES {
                    squares[x] += share * by_albedo[x] * by_albedo[x];
                    fringes[x] += by_contrast[x] * by_contrast[x];
                    count[x] = if squares[x] > 0.0 { 1.0 } else { 0.0 };
                }
            }
            add(&mut sums, &[block.phase, squares, fringes, count]);
        }
        phase += total(sums[0]);
        albedo += total(sums[1]);
        contrast += total(sums[2]);
        cells += total(sums[3]);
    }
    let mean = |sum: f64| (sum / cells.max(1.0)) as f32;
    Information { phase: mean(phase), albedo: mean(albedo), contrast: mean(contrast) }
}

/// Information of a cell about its phase once albedo and contrast follow.
#[inline(always)]
pub(super) fn phase_information(
    derivatives: &Derivatives,
    weights: &Weights,
    ratios: [f32; 4],
    at: usize,
) -> Lanes {
    let Block { phase, mixed, contrast, .. } = block(derivatives, weights, ratios, at);
    let prior = difference_diagonal(&weights.contrast, at);
    let mut out = [0.0; LANES];
    for x in 0..LANES {
        out[x] = phase[x] - mixed[x] * mixed[x] / (contrast[x] + prior[x] + CONTRAST_RIDGE);
    }
    out
}
