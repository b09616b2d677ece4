//! What the mask of a shot is decided from.

use crate::joint::energy::Energy;
use crate::joint::orders::Orders;
use crate::joint::regions::RegionOrders;
use crate::joint::scene::PhaseMap;

/// Results of the fit of step 6 for every pixel by itself, row by row without padding.
#[derive(Clone, Copy)]
pub(in crate::joint) struct PixelFit<'a> {
    /// Mean squared residual of the four channels, in linear light squared.
    pub squared_residual: &'a [f32],
    /// Modulation in linear light by the albedo of the pixel.
    pub modulation: &'a [f32],
}

/// What decides the mask of a shot.
#[derive(Clone, Copy)]
pub(in crate::joint) struct Evidence<'a> {
    pub map: PhaseMap<'a>,
    pub pixel: PixelFit<'a>,
    pub orders: &'a Orders,
    pub regions: &'a RegionOrders,
    pub energy: &'a Energy,
    /// Fringe numbers divided by the first.
    pub ratios: [f32; 4],
    pub limits: Limits,
}

/// Limits of a shot.
#[derive(Debug, Clone, Copy)]
pub(in crate::joint) struct Limits {
    /// Standard deviation of the intensities in linear light.
    pub noise: f32,
    /// Least quality of a valid order.
    pub quality_min: f32,
}
