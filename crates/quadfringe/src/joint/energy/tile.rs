//! One tile: its light, unknowns and working memory.

use super::plane::{Derivatives, Fields, Plane, Weights};
use super::preconditioner::Preconditioner;
use super::scales::Scales;

/// Results of one tile; 0 outside the lit cells.
#[derive(Debug, Default)]
pub(super) struct Found {
    pub inside: Plane,
    /// Change of the phase, rad.
    pub correction: Plane,
    /// Variance of the phase, rad^2.
    pub variance: Plane,
    /// Light without fringes of R, G, B, IR, linear.
    pub albedo: [Plane; 4],
    /// Mean contrast of the fringes, and that of R, G, B, IR relative to it.
    pub contrast: Plane,
    pub channel_contrast: [f32; 4],
    /// Variance of the second differences of the phase (J26), rad^2.
    pub bend: f32,
}

/// A square of cells and everything that is known about it.
#[derive(Debug, Default)]
pub(super) struct Tile {
    /// Phase at the start.
    pub start: Plane,
    /// Linear light of R, G, B, IR.
    pub light: [Plane; 4],
    /// 1 for cells whose light takes part.
    pub usable: Plane,
    /// 1 for lit cells with a phase.
    pub inside: Plane,
    /// 1 for cells all of whose pixels are lit, but whose phases lie far apart.
    pub torn: Plane,
    /// Fringe numbers divided by the first. Without an infrared channel the last is 0; its light and its logarithm of the albedo are
    /// then 0, and it takes no part.
    pub ratios: [f32; 4],
    /// Whether the infrared phase is that of a calibrated pair; then its value and slope at a phase of 0, by the tangent of its
    /// cubic at the start.
    pub pair: bool,
    pub infrared: [Plane; 2],
    pub scales: Scales,
    /// Variance of the second differences of the phase that the shot suggests, whatever `detail` is, rad^2.
    pub bend: f32,
    pub unknown: Fields,
    /// Memory for the unknowns of the lowest minimum so far, once a tile has had another start.
    pub first: Option<Fields>,
    /// Lit cells while the surface is bridged; then cells through which it continues in a comparison.
    pub lit: Plane,
    /// Whether minima have been compared.
    pub compared: bool,
    /// Half the squared difference of the phases of two minima of which neither has a much lower energy, rad^2 (U19).
    pub spread: Plane,
    pub derivatives: Derivatives,
    pub weights: Weights,
    pub preconditioner: Preconditioner,
    /// Negative gradient of the data term; then, while a step is solved, what of the gradient the step leaves, as L^-1 of it.
    pub residual: Fields,
    pub direction: Fields,
    pub product: Fields,
    pub step: Fields,
}

impl Tile {
    /// Empties a row.
    pub fn clear(&mut self, row: usize) {
        let planes = self.light.iter_mut().chain([
            &mut self.start,
            &mut self.usable,
            &mut self.inside,
            &mut self.torn,
        ]);
        let pair = if self.pair { &mut self.infrared[..] } else { &mut [] };
        let planes = planes.chain(pair);
        planes.for_each(|plane| plane.row_mut(row).fill(0.0));
    }
}
