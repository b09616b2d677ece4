//! Tuned numbers of the heights: unit, trade-off, and what measures them.

/// Newton steps that remove projector distortion. Each step doubles the number of correct digits; three reach the rounding
/// of `f32` for the projector lenses of `cargo test -p quadfringe --test height_from_bench`. More steps take longer.
pub(super) const NEWTON_STEPS: usize = 3;

/// Highest degree of a height polynomial (S6). Higher degrees oscillate between the planes that they are fitted to.
pub(super) const DEGREE_MAX: usize = 6;

/// Projector columns by which a candidate may lie beyond the ends of a camera ray. Zero loses the last fringe to noise; a
/// period or more admits wrong orders. One column is as much as the decoder accepts beyond the projector image.
pub(super) const RAY_SLACK_PX: f64 = 1.0;
