//! The linear system of one Gauss-Newton step, solved by preconditioned conjugate gradients.

use super::plane::{Column, Derivatives, Fields, Plane, STRIDE, Weights, four, row, total, vectors};
use super::preconditioner::{move_along, prepare, turn};
use super::tile::Tile;
use crate::joint::model::{count, weights as channel_weights};
use crate::joint::params::energy::{CONTRAST_RIDGE, INNER_STEPS, NEGLIGIBLE, RESIDUAL_LEFT, RIDGE, SIDE};
use crate::parallel::lanes::{LANES, Lanes};
use multiversion::multiversion;

/// Solves the normal equations for the step, starting from the negative gradient in `residual`.
pub(super) fn solve(tile: &mut Tile) {
    let Tile {
        unknown,
        derivatives,
        weights,
        preconditioner,
        residual,
        direction,
        product,
        step,
        inside,
        scales,
        ratios,
        ..
    } = tile;
    // The gradient of the priors, less the negative gradient of the data.
    multiply::<false>(derivatives, weights, inside, *ratios, unknown, product);
    subtract(residual, product);
    prepare(preconditioner, derivatives, weights, *ratios);
    [&mut *residual, direction, step].into_iter().for_each(Fields::clear);
    let negligible =
        NEGLIGIBLE * f64::from(scales.noise) * vectors().map(|at| total(inside.get(at))).sum::<f64>();
    let mut size = move_along(preconditioner, 1.0, direction, product, step, residual);
    let enough = negligible.max(RESIDUAL_LEFT * size);
    let mut share = 0.0;
    for _ in 0..INNER_STEPS {
        if size <= enough {
            break;
        }
        turn(preconditioner, residual, share, direction);
        let curvature = multiply::<true>(derivatives, weights, inside, *ratios, direction, product);
        if curvature <= 0.0 {
            break;
        }
        let before = size;
        size = move_along(preconditioner, (size / curvature) as f32, direction, product, step, residual);
        share = (size / before) as f32;
    }
}

/// Subtracts fields from others.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2+fma"))]
fn subtract(fields: &Fields, from: &mut Fields) {
    for (fields, from) in fields.planes().into_iter().zip(from.planes_mut()) {
        for at in vectors() {
            let (fields, mut out) = (fields.get(at), from.get(at));
            for x in 0..LANES {
                out[x] -= fields[x];
            }
            from.set(at, out);
        }
    }
}

/// Multiplies fields by the matrix of the priors, and with `DATA` by that of the data too. Returns the scalar product of the fields
/// with the result.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2+fma"))]
pub(super) fn multiply<const DATA: bool>(
    derivatives: &Derivatives,
    weights: &Weights,
    inside: &Plane,
    ratios: [f32; 4],
    from: &Fields,
    to: &mut Fields,
) -> f64 {
    let (share, present) = (1.0 / count(ratios), channel_weights(ratios));
    let mut product = 0.0;
    for y in 0..SIDE {
        let mut squares = [0.0; LANES];
        for at in row(y) {
            let given = Column::of(from, at);
            let mut found = Column {
                phase: bend(weights, &from.phase, at),
                albedo: [[0.0; LANES]; 4],
                contrast: difference(&weights.contrast, &from.contrast, at),
            };
            for (k, edge, there) in
                [(0, at, at + 1), (0, at - 1, at - 1), (1, at, at + STRIDE), (1, at - STRIDE, at - STRIDE)]
            {
                let (bright, colour) = (weights.brightness[k].get(edge), weights.colour[k].get(edge));
                let between = Between { bright, colour, share, present };
                colours(&between, &given.albedo, &four(&from.albedo, there), &mut found.albedo);
            }
            if DATA {
                add_data(derivatives, inside.get(at), at, &given, &mut found);
            }
            let terms = found.times(&given);
            for x in 0..LANES {
                squares[x] += terms[x];
            }
            found.write(to, at);
        }
        product += total(squares);
    }
    product
}

/// Adds the product with the matrix of the data and the ridges.
#[inline(always)]
fn add_data(derivatives: &Derivatives, inside: Lanes, at: usize, given: &Column, out: &mut Column) {
    let (phase, contrast) = (&given.phase, &given.contrast);
    for x in 0..LANES {
        out.phase[x] += RIDGE * inside[x] * phase[x];
        out.contrast[x] += CONTRAST_RIDGE * inside[x] * contrast[x];
    }
    for c in 0..4 {
        let (by_phase, by_albedo) = (derivatives.phase[c].get(at), derivatives.albedo[c].get(at));
        let (by_contrast, albedo) = (derivatives.contrast[c].get(at), &given.albedo[c]);
        for x in 0..LANES {
            let change = by_phase[x] * phase[x] + by_albedo[x] * albedo[x] + by_contrast[x] * contrast[x];
            out.phase[x] += by_phase[x] * change;
            out.contrast[x] += by_contrast[x] * change;
            out.albedo[c][x] += by_albedo[x] * change + RIDGE * inside[x] * albedo[x];
        }
    }
}

/// Gradient of the bending of a phase.
#[inline(always)]
fn bend(weights: &Weights, phase: &Plane, at: usize) -> Lanes {
    const S: usize = STRIDE;
    let [along, down, mixed] = &weights.bend;
    let (w_left, w_right, w_along) = (along.get(at - 1), along.get(at + 1), along.get(at));
    let (w_above, w_below, w_down) = (down.get(at - S), down.get(at + S), down.get(at));
    let (m_here, m_left, m_above, m_corner) =
        (mixed.get(at), mixed.get(at - 1), mixed.get(at - S), mixed.get(at - S - 1));
    let (p, left, right) = (phase.get(at), phase.get(at - 1), phase.get(at + 1));
    let (far_left, far_right) = (phase.get(at - 2), phase.get(at + 2));
    let (above, below) = (phase.get(at - S), phase.get(at + S));
    let (far_above, far_below) = (phase.get(at - 2 * S), phase.get(at + 2 * S));
    let (above_left, above_right) = (phase.get(at - S - 1), phase.get(at - S + 1));
    let (below_left, below_right) = (phase.get(at + S - 1), phase.get(at + S + 1));
    let mut out = [0.0; LANES];
    for x in 0..LANES {
        let straight = w_left[x] * (far_left[x] - 2.0 * left[x] + p[x])
            + w_right[x] * (p[x] - 2.0 * right[x] + far_right[x])
            + w_above[x] * (far_above[x] - 2.0 * above[x] + p[x])
            + w_below[x] * (p[x] - 2.0 * below[x] + far_below[x])
            - 2.0 * w_along[x] * (left[x] - 2.0 * p[x] + right[x])
            - 2.0 * w_down[x] * (above[x] - 2.0 * p[x] + below[x]);
        out[x] = straight + m_here[x] * (p[x] - right[x] - below[x] + below_right[x])
            - m_left[x] * (left[x] - p[x] - below_left[x] + below[x])
            - m_above[x] * (above[x] - above_right[x] - p[x] + right[x])
            + m_corner[x] * (above_left[x] - above[x] - left[x] + p[x]);
    }
    out
}

/// Gradient of the squared first differences of a field.
#[inline(always)]
fn difference(weights: &[Plane; 2], field: &Plane, at: usize) -> Lanes {
    let (along, left, down, above) =
        (weights[0].get(at), weights[0].get(at - 1), weights[1].get(at), weights[1].get(at - STRIDE));
    let (here, f_right, f_left) = (field.get(at), field.get(at + 1), field.get(at - 1));
    let (f_below, f_above) = (field.get(at + STRIDE), field.get(at - STRIDE));
    let mut out = [0.0; LANES];
    for x in 0..LANES {
        out[x] = along[x] * (here[x] - f_right[x])
            + left[x] * (here[x] - f_left[x])
            + down[x] * (here[x] - f_below[x])
            + above[x] * (here[x] - f_above[x]);
    }
    out
}

/// The weights of the differences in brightness and colour over one edge of the cells.
struct Between {
    bright: Lanes,
    colour: Lanes,
    /// Share of one channel in the mean of all.
    share: f32,
    /// Weight of each channel.
    present: [f32; 4],
}

/// Adds the gradients of the differences in brightness and colour over one edge of the cells.
#[inline(always)]
fn colours(between: &Between, here: &[Lanes; 4], there: &[Lanes; 4], out: &mut [Lanes; 4]) {
    let Between { bright, colour, share, present } = between;
    for x in 0..LANES {
        let (a, b) = (here[0][x] - there[0][x], here[1][x] - there[1][x]);
        let (c, d) = (here[2][x] - there[2][x], here[3][x] - there[3][x]);
        let shared = share * (bright[x] - colour[x]) * (a + b + c + d);
        out[0][x] += colour[x] * a + shared;
        out[1][x] += colour[x] * b + shared;
        out[2][x] += colour[x] * c + present[2] * shared;
        out[3][x] += colour[x] * d + present[3] * shared;
    }
}
