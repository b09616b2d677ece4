//! The model of the intensities (S1): `I_c = rho (A_c + B_c cos(k_c Phi + delta_c))`.
//!
//! Channel c has the offset `A_c`, the amplitude `B_c` and `k_c = N_c / N_1` fringes for each fringe of R and B. `Phi` is the
//! absolute phase of R and B, `rho` the albedo of the pixel. The shift `delta_c` is pi/2 for B and 0 for the others.
//!
//! Without an infrared projector `k_IR` is 0. This channel is then dark, with `A` and `B` of 0, so that it adds nothing to any sum
//! over the channels. What counts channels or has a term for each of them takes their weights from here. Of three colours with
//! different fringe numbers, B has the place of IR, and that of B is dark.

use crate::parallel::angle::sin_cos;

/// Weights of R, G, B, IR for these fringe numbers over the first, of which that of an absent channel is 0: 1, and 0 for an absent
/// channel.
#[inline(always)]
pub(super) fn weights(ratios: [f32; 4]) -> [f32; 4] {
    ratios.map(|ratio| if ratio > 0.0 { 1.0 } else { 0.0 })
}

/// Whether B is in quadrature with R; otherwise its place is dark.
#[inline(always)]
pub(super) fn has_quadrature(ratios: [f32; 4]) -> bool {
    ratios[2] > 0.0
}

/// Share of R in the mean of R and B.
#[inline(always)]
pub(super) fn red_share(ratios: [f32; 4]) -> f32 {
    if has_quadrature(ratios) { 0.5 } else { 1.0 }
}

/// The place that is dark; none of four channels.
pub(super) fn absent(ratios: [f32; 4]) -> Option<usize> {
    ratios.iter().position(|&ratio| ratio == 0.0)
}

/// Number of channels: 4, or 3 for three colours.
#[inline(always)]
pub(super) fn count(ratios: [f32; 4]) -> f32 {
    weights(ratios).iter().sum()
}

/// Offset and amplitude of R, G, B, IR along one row of pixels, in linear light for an albedo of 1.
#[derive(Clone, Copy)]
pub(super) struct FringeRows<'a> {
    pub offset: [&'a [f32]; 4],
    pub amplitude: [&'a [f32]; 4],
}

impl<'a> FringeRows<'a> {
    /// Takes maps in the order offset and amplitude of R, of G, of B, of IR.
    pub fn from_interleaved(maps: [&'a [f32]; 8]) -> Self {
        Self { offset: [0, 2, 4, 6].map(|k| maps[k]), amplitude: [1, 3, 5, 7].map(|k| maps[k]) }
    }
}

/// Offset and amplitude of R, G, B, IR in one cell.
#[derive(Debug, Clone, Copy)]
pub(super) struct CellFringes {
    pub offset: [f32; 4],
    pub amplitude: [f32; 4],
}

/// Carriers of the four channels at one pixel.
#[derive(Debug, Clone, Copy)]
pub(super) struct Carriers {
    /// `cos(k_c Phi + delta_c)`.
    pub cosine: [f32; 4],
    /// Its derivative with respect to `Phi`.
    pub derivative: [f32; 4],
}

/// The phase of a channel at a pixel, in rad, and its derivative with respect to that of R and B.
#[derive(Debug, Clone, Copy)]
pub(super) struct Wave {
    pub phase: f32,
    pub slope: f32,
}

impl Wave {
    /// The wave of a channel with `ratio` fringes for each fringe of R and B, from the same projector or a coaxial one.
    #[inline(always)]
    pub fn coaxial(phase: f32, ratio: f32) -> Self {
        Self { phase: ratio * phase, slope: ratio }
    }
}

/// Carriers at an absolute phase in rad. `ratios` are the fringe numbers divided by the first.
#[inline(always)]
pub(super) fn carriers(phase: f32, [_, second, ..]: [f32; 4], infrared: Wave) -> Carriers {
    let (s, c) = sin_cos(phase);
    let (s_g, c_g) = sin_cos(second * phase);
    let (s_ir, c_ir) = sin_cos(infrared.phase);
    Carriers { cosine: [c, c_g, -s, c_ir], derivative: [-s, -second * s_g, -c, -infrared.slope * s_ir] }
}
