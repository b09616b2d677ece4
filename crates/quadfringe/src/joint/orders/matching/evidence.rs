//! The evidence of one node, without the costs of its neighbours.

use super::sweep::Node;
use crate::joint::infrared::TERMS;

/// Evidence of one node. The unit of angles is 1/65536 turn.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(in crate::joint) struct NodeEvidence {
    /// Wrapped phase of the first fringe number.
    pub phase: u16,
    /// Beats of G and IR with the first phase, from the window of the local fit. They have little noise but are blurred
    /// at discontinuities.
    pub beats: [u16; 2],
    /// Weights of these beats, in [0, 1].
    pub weights: [f32; 2],
    /// Cosines of G and IR that the pixels of the node observe. They are noisy but sharp.
    pub cosines: [CosineSums; 2],
    /// Number of pixels in these sums.
    pub pixels: f32,
    /// Whether the node is lit.
    pub lit: bool,
    /// Coefficients of the infrared phase of a calibrated pair; `None` for coaxial projectors.
    pub infrared: Option<[f32; TERMS]>,
}

/// Sums over the pixels of a node: `s` is the cosine observed in one channel, `f` the phase that order 0 predicts for it;
/// for IR of a calibrated pair, the phase of the middle order. All sums have the weight of their channel.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(in crate::joint) struct CosineSums {
    /// Number of pixels.
    pub pixels: f32,
    /// Sum of s^2.
    pub square: f32,
    /// Sums of s cos f and s sin f.
    pub first: [f32; 2],
    /// Sums of cos 2f and sin 2f.
    pub second: [f32; 2],
}

impl NodeEvidence {
    /// Converts an angle from rad to units of 1/65536 turn.
    pub fn turns(angle_rad: f32) -> u16 {
        (angle_rad * (65536.0 / std::f32::consts::TAU)).round() as i32 as u16
    }

    /// The part of the evidence that the sweeps use.
    pub(super) fn node(&self) -> Node {
        Node { phase: self.phase, lit: self.lit }
    }
}
