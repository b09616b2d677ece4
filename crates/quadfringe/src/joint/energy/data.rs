//! The data term: residuals of the intensities and their derivatives with respect to the unknowns.

use super::plane::{Plane, total, vectors};
use super::scales::DataSums;
use super::tile::Tile;
use crate::joint::model::weights;
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
    for at in vectors() {
        let (phase, contrast, usable) = (unknown.phase.get(at), unknown.contrast.get(at), usable.get(at));
        let mut modulation = [0.0; LANES];
        for x in 0..LANES {
            modulation[x] = exp(contrast[x]);
        }
        let mut shared = Shared::default();
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
            let Gradient { whole, by_albedo, cross, power } = shared.add(&model, cut);
            derivatives.phase[c].set(at, model.slope);
            derivatives.albedo[c].set(at, whole);
            derivatives.contrast[c].set(at, model.fringe);
            residual.albedo[c].set(at, by_albedo);
            sums.cross[c] += total(cross);
            sums.power[c] += total(power);
        }
        residual.phase.set(at, shared.by_phase);
        residual.contrast.set(at, shared.by_contrast);
        sums.squares += total(shared.squares);
        sums.brightness += total(shared.brightness);
        sums.cells += total(usable);
    }
    sums
}

/// Sums over the channels of a vector of cells: gradients, squared residuals and squared offsets.
#[derive(Default)]
struct Shared {
    by_phase: Lanes,
    by_contrast: Lanes,
    squares: Lanes,
    brightness: Lanes,
}

/// What one channel contributes by itself: its intensity, its gradient, and the terms of its contrast.
struct Gradient {
    whole: Lanes,
    by_albedo: Lanes,
    cross: Lanes,
    power: Lanes,
}

impl Shared {
    /// Adds one channel.
    #[inline(always)]
    fn add(&mut self, model: &Model, cut: f32) -> Gradient {
        let Model { offset, fringe, slope, rest } = model;
        let [mut whole, mut by_albedo, mut cross, mut power] = [[0.0; LANES]; 4];
        for x in 0..LANES {
            whole[x] = offset[x] + fringe[x];
            by_albedo[x] = whole[x] * rest[x];
            cross[x] = fringe[x] * rest[x];
            power[x] = fringe[x] * fringe[x];
            self.by_phase[x] += slope[x] * rest[x];
            self.by_contrast[x] += cross[x];
            self.squares[x] += rest[x] * rest[x] / (1.0 + rest[x] * rest[x] * cut);
            self.brightness[x] += offset[x] * offset[x];
        }
        Gradient { whole, by_albedo, cross, power }
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
