//! The phase of the infrared fringes as a function of that of R and B. Coaxial projectors have `k_ir Phi`. For a calibrated pair
//! it is a cubic of `Phi` at every pixel (J32), because each depth on a camera ray is a column of both projectors.

use super::cells::Grid;
use super::model::{Carriers, Wave, carriers};
use crate::height::PairTable;
use crate::parallel::lanes::{LANES, Lanes, lanes, take};
use rayon::prelude::*;

/// Coefficients of the cubic.
pub(super) const TERMS: usize = 4;

/// The infrared phase of a calibrated pair at the pixels of one level.
#[derive(Debug, Default)]
pub(super) struct PairPhase {
    /// Coefficients from the constant term up, in padded rows.
    planes: [Vec<f32>; TERMS],
}

/// How the phases of the channels along a row of pixels follow from that of R and B.
pub(super) trait Waves: Copy {
    /// What belongs to the pixels of one vector.
    type Vector: Copy;

    /// Fringe numbers divided by the first.
    fn ratios(self) -> [f32; 4];

    /// Vector `i` of the row.
    fn vector(self, i: usize) -> Self::Vector;

    /// The infrared wave at pixel `x` of a vector.
    fn infrared(self, vector: &Self::Vector, x: usize, phase: f32) -> Wave;

    /// The order from which infrared cosines are counted, as a phase in rad: the middle one of a pair, whose cubic is not good far
    /// outside the field.
    fn origin_rad(self, middle_rad: f32) -> f32;

    /// The carriers of all channels at pixel `x` of a vector.
    #[inline(always)]
    fn carriers(self, vector: &Self::Vector, x: usize, phase: f32) -> Carriers {
        carriers(phase, self.ratios(), self.infrared(vector, x, phase))
    }
}

/// The waves of coaxial projectors.
#[derive(Debug, Clone, Copy)]
pub(super) struct Coaxial {
    pub ratios: [f32; 4],
}

/// The waves of a calibrated pair.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pair<'a> {
    pub ratios: [f32; 4],
    pub terms: [&'a [Lanes]; TERMS],
}

/// Evaluates an expression with the waves of row `y` of a scene. It is compiled once for coaxial projectors and once for a pair.
macro_rules! with_waves {
    ($scene:expr, $y:expr, $ratios:expr, |$waves:ident| $body:expr) => {
        match $scene.pair {
            None => {
                let $waves = $crate::joint::infrared::Coaxial { ratios: $ratios };
                $body
            }
            Some(pair) => {
                let $waves = pair.row($scene.grid, $y, $ratios);
                $body
            }
        }
    };
}
pub(super) use with_waves;

impl Waves for Coaxial {
    type Vector = ();

    #[inline(always)]
    fn ratios(self) -> [f32; 4] {
        self.ratios
    }

    #[inline(always)]
    fn vector(self, _: usize) {}

    #[inline(always)]
    fn infrared(self, (): &(), _: usize, phase: f32) -> Wave {
        Wave::coaxial(phase, self.ratios[3])
    }

    #[inline(always)]
    fn origin_rad(self, _: f32) -> f32 {
        0.0
    }
}

impl Waves for Pair<'_> {
    type Vector = [Lanes; TERMS];

    #[inline(always)]
    fn ratios(self) -> [f32; 4] {
        self.ratios
    }

    #[inline(always)]
    fn vector(self, i: usize) -> Self::Vector {
        take(&self.terms, i)
    }

    #[inline(always)]
    fn infrared(self, [e0, e1, e2, e3]: &Self::Vector, x: usize, phase: f32) -> Wave {
        wave([e0[x], e1[x], e2[x], e3[x]], phase)
    }

    #[inline(always)]
    fn origin_rad(self, middle_rad: f32) -> f32 {
        middle_rad
    }
}

/// The cubic and its derivative.
#[inline(always)]
pub(super) fn wave([e0, e1, e2, e3]: [f32; TERMS], phase: f32) -> Wave {
    Wave {
        phase: e0 + phase * (e1 + phase * (e2 + phase * e3)),
        slope: e1 + phase * (2.0 * e2 + phase * (3.0 * e3)),
    }
}

impl PairPhase {
    /// The cubics of a table, in rows of `stride` pixels. A ray that the visible projector does not light within the range of
    /// depths takes the cubic of the nearest lit ray of its row, or of the row before: what lies there is out of range.
    pub fn new(table: &PairTable, stride: usize) -> Self {
        let (rows, columns) = table.shape();
        let mut planes = [(); TERMS].map(|()| vec![0.0; rows * stride]);
        let order = (0..rows).find(|y| table.row(*y).infrared[0].iter().any(|term| term.is_finite()));
        let first = order.unwrap_or(0);
        for y in (first..rows).chain((0..first).rev()) {
            let terms = table.row(y).infrared;
            let known: Vec<usize> =
                (0..columns).filter(|x| terms.iter().all(|line| line[*x].is_finite())).collect();
            for (plane, line) in planes.iter_mut().zip(terms) {
                if known.is_empty() {
                    let from = if y > first { y - 1 } else { (y + 1).min(rows - 1) };
                    plane.copy_within(from * stride..(from + 1) * stride, y * stride);
                    continue;
                }
                let out = &mut plane[y * stride..][..stride];
                let mut next = 0;
                for (x, out) in out.iter_mut().enumerate() {
                    while next + 1 < known.len() && known[next + 1].abs_diff(x) <= known[next].abs_diff(x) {
                        next += 1;
                    }
                    *out = line[known[next]];
                }
            }
        }
        Self { planes }
    }

    /// The waves of row `y`.
    pub fn row(&self, grid: &Grid, y: usize, ratios: [f32; 4]) -> Pair<'_> {
        Pair {
            ratios,
            terms: self.planes.each_ref().map(|plane| lanes(&plane[y * grid.stride..][..grid.stride])),
        }
    }

    /// Row `y` of the coefficients.
    pub fn terms(&self, grid: &Grid, y: usize) -> [&[f32]; TERMS] {
        self.planes.each_ref().map(|plane| &plane[y * grid.stride..][..grid.stride])
    }

    /// Coefficients of the pixel at `at`.
    pub fn at(&self, at: usize) -> [f32; TERMS] {
        self.planes.each_ref().map(|plane| plane[at])
    }

    /// Fills this level with the means of `factor` x `factor` pixels of `fine`, unless it has them already.
    pub fn shrink(&mut self, fine: &Self, grid: &Grid, fine_grid: &Grid) {
        let factor = fine_grid.stride / grid.stride;
        for (out, plane) in self.planes.iter_mut().zip(&fine.planes) {
            if out.len() == grid.pixels() {
                continue;
            }
            out.resize(grid.pixels(), 0.0);
            out.par_chunks_mut(grid.stride).enumerate().for_each(|(row, out)| {
                out.fill(0.0);
                let share = 1.0 / (factor * factor) as f32;
                for y in (0..factor).map(|i| (row * factor + i).min(fine_grid.height - 1)) {
                    let fine = &plane[y * fine_grid.stride..][..fine_grid.stride];
                    for (out, pixels) in out.iter_mut().zip(fine.chunks_exact(factor)) {
                        *out += share * pixels.iter().sum::<f32>();
                    }
                }
            });
        }
    }
}

/// Coefficients of some pixels that do not lie in a row, as one vector.
#[derive(Debug, Default)]
pub(super) struct Gathered([Lanes; TERMS]);

impl Gathered {
    /// Sets pixel `x` of the vector to the one at `at`.
    pub fn set(&mut self, x: usize, pair: &PairPhase, at: usize) {
        debug_assert!(x < LANES);
        self.0.iter_mut().zip(pair.at(at)).for_each(|(line, term)| line[x] = term);
    }

    /// The waves of the vector.
    pub fn waves(&self, ratios: [f32; 4]) -> Pair<'_> {
        Pair { ratios, terms: self.0.each_ref().map(std::slice::from_ref) }
    }
}
