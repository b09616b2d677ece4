//! Normal equations of cells, solved side by side.

use crate::joint::params::photometry::RIDGE;
use crate::parallel::lanes::{LANES, Lanes};
use multiversion::multiversion;

/// Number of entries in a triangle of the normal matrix of a_r, b_r, a_g, b_g, a_b, b_b, a_ir, b_ir.
pub(super) const MATRIX: usize = 36;
/// Number of entries including the right-hand side.
pub(super) const SUMS: usize = MATRIX + 8;

/// Solves the normal equations of a row of cells for the change of the eight unknowns, and adds it.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
pub(super) fn improve(sums: [&[f32]; SUMS], before: [&[f32]; 8], out: &mut [f32]) {
    let columns = before[0].len();
    for first in (0..columns).step_by(LANES) {
        let count = LANES.min(columns - first);
        let part = |row: &[f32]| {
            let rest = &row[first..];
            rest.first_chunk().copied().unwrap_or_else(|| {
                let mut lanes = [0.0; LANES];
                lanes[..count].copy_from_slice(rest);
                lanes
            })
        };
        let mut system = System::new(sums.map(part), before.map(part));
        system.solve();
        for (k, values) in system.unknowns.iter().enumerate() {
            out[k * columns + first..][..count].copy_from_slice(&values[..count]);
        }
    }
}

/// Systems of equations of [`LANES`] cells, side by side. Only the lower triangle of each matrix is stored.
struct System {
    matrix: [[Lanes; 8]; 8],
    right: [Lanes; 8],
    unknowns: [Lanes; 8],
}

impl System {
    #[inline(always)]
    fn new(sums: [Lanes; SUMS], before: [Lanes; 8]) -> Self {
        let mut matrix = [[[0.0; LANES]; 8]; 8];
        let mut at = 0;
        for c in 0..4 {
            for k in c..4 {
                let (u, v) = (2 * c, 2 * k);
                matrix[v][u] = sums[at];
                matrix[v + 1][u] = sums[at + 1];
                if k > c {
                    matrix[v][u + 1] = sums[at + 2];
                    matrix[v + 1][u + 1] = sums[at + 3];
                    at += 4;
                } else {
                    matrix[v + 1][u + 1] = sums[at + 2];
                    at += 3;
                }
            }
        }
        let mut right: [Lanes; 8] = std::array::from_fn(|r| sums[MATRIX + r]);
        let (mut floor, mut trace, mut size) = ([1e-9; LANES], [0.0; LANES], [1e-12; LANES]);
        for r in 0..8 {
            for c in 0..=r {
                for x in 0..LANES {
                    right[r][x] -= matrix[r][c][x] * before[c][x];
                    if c < r {
                        right[c][x] -= matrix[r][c][x] * before[r][x];
                    }
                }
            }
            for x in 0..LANES {
                floor[x] += matrix[r][r][x] * (RIDGE / 8.0);
                trace[x] += matrix[r][r][x] * (1.0 + RIDGE);
                size[x] += before[r][x] * before[r][x];
            }
        }
        // In light of another texture, a model of 0 would have the least residual. Only ratios have a meaning, so the
        // magnitude of the unknowns is held (J13).
        let scale: Lanes = std::array::from_fn(|x| (trace[x] + 8.0 * floor[x]) / size[x]);
        for r in 0..8 {
            for x in 0..LANES {
                matrix[r][r][x] += RIDGE * matrix[r][r][x] + floor[x];
            }
            for c in 0..=r {
                for x in 0..LANES {
                    matrix[r][c][x] += scale[x] * before[r][x] * before[c][x];
                }
            }
        }
        Self { matrix, right, unknowns: before }
    }

    /// Adds the solution to the unknowns (Cholesky).
    #[inline(always)]
    fn solve(&mut self) {
        let Self { matrix, right, unknowns } = self;
        for k in 0..8 {
            let mut inverse = [0.0; LANES];
            for x in 0..LANES {
                let pivot = matrix[k][k][x];
                inverse[x] = 1.0 / (if pivot > 1e-12 { pivot } else { 1e-12 }).sqrt();
            }
            // The diagonal stores the inverse, because only the inverse is used.
            matrix[k][k] = inverse;
            for r in k + 1..8 {
                for x in 0..LANES {
                    matrix[r][k][x] *= inverse[x];
                }
            }
            for r in k + 1..8 {
                for c in k + 1..=r {
                    for x in 0..LANES {
                        matrix[r][c][x] -= matrix[r][k][x] * matrix[c][k][x];
                    }
                }
            }
        }
        for k in 0..8 {
            for x in 0..LANES {
                right[k][x] *= matrix[k][k][x];
            }
            for r in k + 1..8 {
                for x in 0..LANES {
                    right[r][x] -= matrix[r][k][x] * right[k][x];
                }
            }
        }
        for k in (0..8).rev() {
            for x in 0..LANES {
                right[k][x] *= matrix[k][k][x];
                unknowns[k][x] += right[k][x];
            }
            for r in 0..k {
                for x in 0..LANES {
                    right[r][x] -= matrix[k][r][x] * right[k][x];
                }
            }
        }
    }
}
