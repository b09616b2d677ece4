//! The second part of the preconditioner: slow changes of the phase across many columns.
//!
//! The phase of a tile is written as a tensor product of quadratic B-splines with a knot at every vector of cells. The matrix of the
//! step, restricted to them, is banded, small, and factored exactly (J46).

use super::plane::{VECTORS, Weights, total};
use crate::joint::params::energy::PIVOT_RIDGE;
use crate::parallel::lanes::{LANES, Lanes, plus, times};

/// Splines along each direction: three overlap in every interval between knots.
const SPLINES: usize = VECTORS + 2;
const COUNT: usize = SPLINES * SPLINES;
/// Distance in the list of splines of the farthest two that overlap: two rows and two columns.
const REACH: usize = 2 * SPLINES + 2;

/// One number for each spline, row by row, and then as many zeros as their reach.
type Coefficients = [f64; COUNT + REACH];

/// The three splines of an interval at the middle of each of its cells.
const VALUES: [Lanes; 3] = sampled(0.5, Sample::Value);
/// Their differences from each cell to the next one.
const SLOPES: [Lanes; 3] = sampled(1.0, Sample::Slope);
/// Their second differences, the same at all cells.
const BENDS: [Lanes; 3] = sampled(0.5, Sample::Bend);

#[derive(Clone, Copy)]
enum Sample {
    Value,
    Slope,
    Bend,
}

const fn sampled(offset: f32, what: Sample) -> [Lanes; 3] {
    let mut out = [[0.0; LANES]; 3];
    let cell = 1.0 / LANES as f32;
    let mut x = 0;
    while x < LANES {
        let t = cell * (x as f32 + offset);
        let three = match what {
            Sample::Value => [0.5 * (1.0 - t) * (1.0 - t), 0.5 + t - t * t, 0.5 * t * t],
            Sample::Slope => [cell * (t - 1.0), cell * (1.0 - 2.0 * t), cell * t],
            Sample::Bend => [cell * cell, -2.0 * cell * cell, cell * cell],
        };
        (out[0][x], out[1][x], out[2][x]) = (three[0], three[1], three[2]);
        x += 1;
    }
    out
}

/// The pairs of the three splines of an interval, and the number of the pair of any two.
const PAIRS: [[usize; 2]; 6] = [[0, 0], [0, 1], [0, 2], [1, 1], [1, 2], [2, 2]];
const PAIR: [[usize; 3]; 3] = [[0, 1, 2], [1, 3, 4], [2, 4, 5]];

/// What the matrix needs of a square between knots, for each column of cells: sums along the column of information and weights of
/// bending, with the products of each pair of splines.
#[derive(Default)]
pub(super) struct Square {
    known: [Lanes; 6],
    along: [Lanes; 6],
    down: Lanes,
    mixed: [Lanes; 6],
}

impl Square {
    /// Adds the cells of row `y`. `known` is what they know of their phase once contrast and albedo follow.
    #[inline(always)]
    pub fn add(&mut self, weights: &Weights, known: Lanes, at: usize, y: usize) {
        let [along, down, mixed] = [0, 1, 2].map(|n| weights.bend[n].get(at));
        let n = y % LANES;
        for (p, [a, b]) in PAIRS.into_iter().enumerate() {
            let value = [VALUES[a][n] * VALUES[b][n]; LANES];
            let slope = [SLOPES[a][n] * SLOPES[b][n]; LANES];
            self.known[p] = plus(self.known[p], value, known);
            self.along[p] = plus(self.along[p], value, along);
            self.mixed[p] = plus(self.mixed[p], slope, mixed);
        }
        self.down = plus(self.down, [1.0; LANES], down);
    }

    /// The entry of the matrix for a pair of splines along y and one along x.
    #[inline(always)]
    fn entry(&self, down: usize, across: usize) -> f64 {
        let ([k, l], [m, n]) = (PAIRS[down], PAIRS[across]);
        let value = times(VALUES[m], VALUES[n]);
        let bend = [BENDS[k][0] * BENDS[l][0]; LANES];
        let mut sum = times(value, plus(self.known[down], bend, self.down));
        sum = plus(sum, times(SLOPES[m], SLOPES[n]), self.mixed[down]);
        total(plus(sum, times(BENDS[m], BENDS[n]), self.along[down]))
    }
}

/// The factored matrix A = U^T U, and what of the residual r the steps so far have left.
#[derive(Debug)]
pub(super) struct Splines {
    /// Each row of the upper triangle from its diagonal on. The diagonal is inverse once factored.
    upper: [[f64; REACH + 1]; COUNT + REACH],
    /// U^-T r.
    residual: Coefficients,
}

impl Default for Splines {
    fn default() -> Self {
        Self { upper: [[0.0; REACH + 1]; COUNT + REACH], residual: [0.0; COUNT + REACH] }
    }
}

impl Splines {
    /// Makes matrix and residual 0; the solution is then 0.
    pub fn clear(&mut self) {
        *self = Self::default();
    }

    /// Adds the square in column `i` of squares that ends with row `y` of cells.
    #[inline(always)]
    pub fn add(&mut self, square: &Square, i: usize, y: usize) {
        let band = y / LANES;
        let mut entries = [[0.0; 6]; 6];
        for (down, row) in entries.iter_mut().enumerate() {
            for (across, entry) in row.iter_mut().enumerate() {
                *entry = square.entry(down, across);
            }
        }
        let nine = |n: usize| (n / 3, n % 3, (band + n / 3) * SPLINES + i + n % 3);
        for (k, m, row) in (0..9).map(nine) {
            for (l, n, column) in (0..9).map(nine) {
                if column >= row {
                    self.upper[row][column - row] += entries[PAIR[k][l]][PAIR[m][n]];
                }
            }
        }
    }

    /// Factors the matrix. Its diagonal is raised by more than rounding can take from a pivot.
    #[inline(always)]
    pub fn factor(&mut self) {
        self.upper[..COUNT].iter_mut().for_each(|row| row[0] *= f64::from(1.0 + PIVOT_RIDGE));
        for k in 0..COUNT {
            let (head, below) = self.upper[k..].split_first_mut().expect("the row exists");
            let inverse = 1.0 / head[0].sqrt();
            head.iter_mut().for_each(|entry| *entry *= inverse);
            for (i, row) in (1..).zip(&mut below[..REACH]) {
                for (entry, along) in row.iter_mut().zip(&head[i..]) {
                    *entry -= head[i] * along;
                }
            }
            head[0] = inverse;
        }
    }

    /// Takes `length` times the product of the matrix of the step and a direction from the residual. Returns the square of what is left.
    #[inline(always)]
    pub fn take(&mut self, length: f32, mut product: Coefficients) -> f64 {
        let mut size = 0.0;
        for (k, row) in self.upper[..COUNT].iter().enumerate() {
            let value = product[k] * row[0];
            for (below, entry) in product[k + 1..][..REACH].iter_mut().zip(&row[1..]) {
                *below -= value * entry;
            }
            self.residual[k] -= f64::from(length) * value;
            size += self.residual[k] * self.residual[k];
        }
        size
    }

    /// The solution for the residual.
    #[inline(always)]
    pub fn solved(&self) -> Surface {
        let mut values = self.residual;
        for (k, row) in self.upper[..COUNT].iter().enumerate().rev() {
            let terms: [f64; REACH] = std::array::from_fn(|i| row[i + 1] * values[k + 1 + i]);
            let four: [f64; 4] = std::array::from_fn(|i| terms.iter().skip(i).step_by(4).sum());
            values[k] = (values[k] - four.iter().sum::<f64>()) * row[0];
        }
        Surface { values }
    }
}

/// Scalar products of a phase with the splines.
#[derive(Default)]
pub(super) struct Products {
    /// Sums over the rows since the last knot, for each of three splines along y.
    rows: [[Lanes; VECTORS]; 3],
}

impl Products {
    /// Adds row `y`, and writes the products after the last one before a knot.
    #[inline(always)]
    pub fn add(&mut self, y: usize, phase: &[Lanes; VECTORS], out: &mut Coefficients) {
        for (sums, values) in self.rows.iter_mut().zip(&VALUES) {
            for i in 0..VECTORS {
                sums[i] = plus(sums[i], [values[y % LANES]; LANES], phase[i]);
            }
        }
        if y % LANES < LANES - 1 {
            return;
        }
        for (k, sums) in self.rows.iter().enumerate() {
            for (i, sums) in sums.iter().enumerate() {
                for (m, values) in VALUES.iter().enumerate() {
                    out[(y / LANES + k) * SPLINES + i + m] += total(times(*values, *sums));
                }
            }
        }
        *self = Self::default();
    }
}

/// No products yet.
pub(super) const NONE: Coefficients = [0.0; COUNT + REACH];

/// A phase as a sum of splines.
pub(super) struct Surface {
    values: Coefficients,
}

impl Surface {
    /// The phase along row `y`.
    #[inline(always)]
    pub fn row(&self, y: usize) -> [Lanes; VECTORS] {
        let (band, n) = (y / LANES, y % LANES);
        let along: [f32; SPLINES] = std::array::from_fn(|i| {
            (0..3).map(|k| VALUES[k][n] * self.values[(band + k) * SPLINES + i] as f32).sum()
        });
        std::array::from_fn(|i| {
            let mut phase = times(VALUES[0], [along[i]; LANES]);
            phase = plus(phase, VALUES[1], [along[i + 1]; LANES]);
            plus(phase, VALUES[2], [along[i + 2]; LANES])
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::joint::energy::plane::{Fields, Plane, place, vectors};
    use crate::joint::energy::tests::{RATIOS, random, tile};
    use crate::joint::energy::{preconditioner::prepare, solve::multiply, tile::Tile};
    use crate::joint::params::energy::SIDE;

    #[test]
    fn splines_reproduce_planes() {
        // The coefficient of a line is its value in the middle of the spline.
        let mut values = NONE;
        for k in 0..SPLINES {
            for i in 0..SPLINES {
                values[k * SPLINES + i] = (3 * i) as f64 - k as f64;
            }
        }
        let surface = Surface { values };
        for y in 0..SIDE {
            for (x, phase) in surface.row(y).as_flattened().iter().enumerate() {
                let middle = |n: usize| (n as f32 + 0.5) / LANES as f32 + 0.5;
                assert!((phase - 3.0 * middle(x) + middle(y)).abs() < 1e-5, "{x} {y} {phase}");
            }
        }
    }

    /// A phase that is a sum of splines, and no other unknown, is found at once if the phase alone is unknown.
    #[test]
    fn splines_are_found_exactly() {
        let (mut tile, _) = tile(0.03);
        tile.minimise(1e-6, 1.0);
        let Tile { derivatives, weights, preconditioner, inside, .. } = &mut tile;
        derivatives.albedo.iter_mut().chain(&mut derivatives.contrast).for_each(Plane::clear);
        weights.bend.iter_mut().for_each(Plane::clear);
        prepare(preconditioner, derivatives, weights, RATIOS);
        let values = std::array::from_fn(|k| if k < COUNT { f64::from(random(3, k)) } else { 0.0 });
        let (surface, mut fields, mut product) = (Surface { values }, Fields::default(), Fields::default());
        for y in 0..SIDE {
            fields.phase.row_mut(y).copy_from_slice(surface.row(y).as_flattened());
        }
        multiply::<true>(derivatives, weights, inside, RATIOS, &fields, &mut product);
        let (mut sums, mut products) = (Products::default(), NONE);
        for y in 0..SIDE {
            sums.add(y, &std::array::from_fn(|i| product.phase.get(place(i * LANES, y))), &mut products);
        }
        let size = preconditioner.splines.take(-1.0, products);
        let found = preconditioner.splines.solved();
        for k in 0..COUNT {
            assert!((found.values[k] - values[k]).abs() < 1e-3, "{k} {} {}", found.values[k], values[k]);
        }
        let own: f64 = vectors().map(|at| total(times(fields.phase.get(at), product.phase.get(at)))).sum();
        assert!((size / own - 1.0).abs() < 1e-3, "{size} {own}");
    }
}
