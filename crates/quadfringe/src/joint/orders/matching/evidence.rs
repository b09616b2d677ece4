//! The evidence of one node, before the costs of its neighbours are added.

use super::sweep::Node;

/// Evidence of one node; angles in turns, 65536 to a turn.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(in crate::joint) struct NodeEvidence {
    /// Wrapped phase of the first fringe number.
    pub phase: u16,
    /// Beats of G and IR against it, from the window of the local fit: little noise, blurred at discontinuities.
    pub beats: [u16; 2],
    /// Cosines of G and IR that the pixels of the node observe: noisy, sharp.
    pub cosines: [CosineSums; 2],
    /// Number of pixels in these sums.
    pub pixels: f32,
    /// Whether there is light to judge by.
    pub lit: bool,
}

/// Sums over the pixels of a node: `s` is the cosine observed in one channel, `f` the phase that order 0 predicts for it.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(in crate::joint) struct CosineSums {
    /// Sum of s^2.
    pub square: f32,
    /// Sums of s cos f and s sin f.
    pub first: [f32; 2],
    /// Sums of cos 2f and sin 2f.
    pub second: [f32; 2],
}

impl NodeEvidence {
    /// An angle in turns, 65536 to a turn.
    pub fn turns(angle_rad: f32) -> u16 {
        (angle_rad * (65536.0 / std::f32::consts::TAU)).round() as i32 as u16
    }

    /// The part of it that the sweeps use.
    pub(super) fn node(&self) -> Node {
        Node { phase: self.phase, lit: self.lit }
    }
}
