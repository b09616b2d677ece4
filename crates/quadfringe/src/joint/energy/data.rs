//! The data term: residuals of the intensities and their derivatives with respect to the unknowns.

use super::plane::{Plane, row};
use super::scales::DataSums;
use super::tile::Tile;
use crate::joint::model::weights;
use crate::joint::params::energy::SIDE;
use crate::parallel::angle::sin_cos;
use crate::parallel::exp::exp;
use crate::parallel::lanes::{LANES, Lanes};
use multiversion::multiversion;

/// Linearises the intensities at the unknowns of a tile, as `linear`.
pub(super) fn linearise(tile: &mut Tile) -> DataSums {
    if tile.pair { linear::<true>(tile) } else { linear::<false>(tile) }
}

/// Linearises the intensities at the unknowns of a tile. Writes the derivatives, and the negative gradient of the data term into
/// the residual fields. Returns the sums from which noise and contrasts are estimated.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2+fma"))]
fn linear<const PAIR: bool>(tile: &mut Tile) -> DataSums {
    let Tile { light, usable, unknown, derivatives, residual, scales, ratios, infrared, .. } = tile;
    let cut = 1.0 / (16.0 * scales.misfit);
    let present = weights(*ratios);
    let mut sums = DataSums::default();
    for y in 0..SIDE {
        let mut terms = DataSums::default();
        for at in row(y) {
            let (phase, contrast, usable) = (unknown.phase.get(at), unknown.contrast.get(at), usable.get(at));
            let mut modulation = [0.0; LANES];
            for x in 0..LANES {
                modulation[x] = exp(contrast[x]);
            }
            let mut gradient = Gradient::default();
            for c in 0..4 {
                let ratio = ratios[c];
                let (albedo, light) = (unknown.albedo[c].get(at), light[c].get(at));
                let cells = Cells { phase, modulation, usable, albedo, light };
                let kept = scales.channel_contrast[c];
                let model = if PAIR && c == 3 {
                    predicted::<_, false, false>(&cells, Line::at(infrared, at), kept, 1.0)
                } else {
                    predict(&cells, c, ratio, kept, present[c])
                };
                let Contribution { whole, by_albedo } = gradient.add(&model, cut, &mut terms, c);
                derivatives.phase[c].set(at, model.slope);
                derivatives.albedo[c].set(at, whole);
                derivatives.contrast[c].set(at, model.fringe);
                residual.albedo[c].set(at, by_albedo);
            }
            for x in 0..LANES {
                terms.cells[x] += usable[x];
            }
            residual.phase.set(at, gradient.by_phase);
            residual.contrast.set(at, gradient.by_contrast);
        }
        sums.add(&terms);
    }
    sums
}

/// Negative gradient with respect to phase and contrast of a vector of cells: sums over the channels.
#[derive(Default)]
struct Gradient {
    by_phase: Lanes,
    by_contrast: Lanes,
}

/// What one channel contributes by itself: its intensity, and its negative gradient with respect to the albedo.
struct Contribution {
    whole: Lanes,
    by_albedo: Lanes,
}

impl Gradient {
    /// Adds channel `c`, also to the sums of the row.
    #[inline(always)]
    fn add(&mut self, model: &Model, cut: f32, sums: &mut DataSums<Lanes>, c: usize) -> Contribution {
        let Model { offset, fringe, slope, rest } = model;
        let [mut whole, mut by_albedo] = [[0.0; LANES]; 2];
        for x in 0..LANES {
            whole[x] = offset[x] + fringe[x];
            by_albedo[x] = whole[x] * rest[x];
            let cross = fringe[x] * rest[x];
            sums.cross[c][x] += cross;
            sums.power[c][x] += fringe[x] * fringe[x];
            sums.squares[x] += rest[x] * rest[x] / (1.0 + rest[x] * rest[x] * cut);
            sums.brightness[x] += offset[x] * offset[x];
            self.by_phase[x] += slope[x] * rest[x];
            self.by_contrast[x] += cross;
        }
        Contribution { whole, by_albedo }
    }
}

/// One channel of a vector of cells.
pub(super) struct Cells {
    pub phase: Lanes,
    pub modulation: Lanes,
    pub usable: Lanes,
    pub albedo: Lanes,
    pub light: Lanes,
}

/// Offset and fringe of the light, the derivative of the fringe with respect to the phase, and the residual.
pub(super) struct Model {
    offset: Lanes,
    fringe: Lanes,
    slope: Lanes,
    pub rest: Lanes,
}

impl Model {
    /// The predicted light of cell `x`.
    #[inline(always)]
    pub fn whole(&self, x: usize) -> f32 {
        self.offset[x] + self.fringe[x]
    }

    /// Its derivative with respect to the phase.
    #[inline(always)]
    pub fn slope(&self, x: usize) -> f32 {
        self.slope[x]
    }
}

/// Predicts the light of channel `c`. The fringes of B are a quarter period ahead. A channel that is not `present` has the weight 0,
/// the others 1.
#[inline(always)]
pub(super) fn predict(cells: &Cells, c: usize, ratio: f32, kept: f32, present: f32) -> Model {
    match c {
        2 => predicted::<_, true, true>(cells, ratio, kept, present),
        3 => predicted::<_, false, true>(cells, ratio, kept, present),
        _ => predicted::<_, false, false>(cells, ratio, kept, present),
    }
}

/// The phase of a channel in a vector of cells.
pub(super) trait Turns: Copy {
    fn angle(&self, x: usize, phase: f32) -> f32;
    fn slope(&self, x: usize) -> f32;
}

/// A constant number of fringes for each fringe of R and B.
impl Turns for f32 {
    #[inline(always)]
    fn angle(&self, _: usize, phase: f32) -> f32 {
        self * phase
    }

    #[inline(always)]
    fn slope(&self, _: usize) -> f32 {
        *self
    }
}

/// The infrared phase of a pair: the tangent of its cubic at the start.
#[derive(Clone, Copy)]
pub(super) struct Line {
    offset: Lanes,
    slope: Lanes,
}

impl Line {
    #[inline(always)]
    pub fn at([offset, slope]: &[Plane; 2], at: usize) -> Self {
        Self { offset: offset.get(at), slope: slope.get(at) }
    }
}

impl Turns for Line {
    #[inline(always)]
    fn angle(&self, x: usize, phase: f32) -> f32 {
        self.offset[x] + self.slope[x] * phase
    }

    #[inline(always)]
    fn slope(&self, x: usize) -> f32 {
        self.slope[x]
    }
}

#[inline(always)]
pub(super) fn predicted<T: Turns, const QUADRATURE: bool, const OPTIONAL: bool>(
    cells: &Cells,
    turns: T,
    kept: f32,
    present: f32,
) -> Model {
    let Cells { phase, modulation, usable, albedo, light } = cells;
    let [mut offset, mut fringe, mut slope, mut rest] = [[0.0; LANES]; 4];
    for x in 0..LANES {
        let (sine, cosine) = sin_cos(turns.angle(x, phase[x]));
        let (sine, cosine) = if QUADRATURE { (cosine, -sine) } else { (sine, cosine) };
        let usable = if OPTIONAL { usable[x] * present } else { usable[x] };
        offset[x] = usable * exp(albedo[x]);
        let amplitude = offset[x] * modulation[x] * kept;
        fringe[x] = amplitude * cosine;
        slope[x] = -turns.slope(x) * amplitude * sine;
        rest[x] = usable * light[x] - offset[x] - fringe[x];
    }
    Model { offset, fringe, slope, rest }
}
