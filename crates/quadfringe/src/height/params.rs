//! Tuned numbers of the heights, each with its unit, its trade-off and the command that measures it.

/// Number of Newton steps that remove projector distortion. Each step doubles the number of correct digits; three steps
/// reach the rounding of `f32` for the projector lenses of `cargo test -p quadfringe --test height_from_bench`. More steps
/// take longer.
pub(super) const NEWTON_STEPS: usize = 3;

/// Highest degree of a height polynomial (S6). Higher degrees oscillate between the planes that they are fitted to. Not
/// measured.
pub(super) const DEGREE_MAX: usize = 6;

/// A candidate may lie beyond the ends of a camera ray by this number of projector columns. With zero, noise removes
/// the last fringe; a period or more admits wrong orders. The decoder accepts the same one column beyond the projector
/// image. Checked by `cargo test -p quadfringe --test pair`.
pub(super) const RAY_SLACK_PX: f64 = 1.0;

/// Least depth at which a camera ray is searched, mm. It replaces the depth 0 of the camera itself, which may have no
/// projector column. Any object is further away. Not measured.
pub(super) const NEAR_MM: f64 = 1.0;

/// Depth that stands for infinity, mm (1000 km). Follows from the geometry: a baseline of 1 m moves the column by less
/// than 1e-6 focal lengths there. A larger depth loses digits of the baseline in `f64`.
pub(super) const FAR_MM: f64 = 1e9;

/// Least share of the baseline that lies across the columns of the projector. Below it (0.06 degrees), a sheet of light
/// nearly contains the camera centre, and rounding decides the depths. Not measured.
pub(super) const ACROSS_SHARE_MIN: f64 = 1e-3;

/// Least length of the baseline, mm. It only distinguishes rounding errors of a zero baseline from a real one, which is
/// longer than 1 mm. Not measured.
pub(super) const BASELINE_MIN_MM: f64 = 1e-6;
