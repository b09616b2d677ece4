//! Tuned numbers of the heights: unit, trade-off, and what measures them.

/// Newton steps that remove projector distortion. Each step doubles the number of correct digits; three reach the rounding
/// of `f32` for the projector lenses of `cargo test -p quadfringe --test height_from_bench`. More steps take longer.
pub(super) const NEWTON_STEPS: usize = 3;

/// Highest degree of a height polynomial (S6). Higher degrees oscillate between the planes that they are fitted to. Not
/// measured.
pub(super) const DEGREE_MAX: usize = 6;

/// Projector columns by which a candidate may lie beyond the ends of a camera ray. Zero loses the last fringe to noise;
/// a period or more admits wrong orders. One column is as much as the decoder accepts beyond the projector image.
/// Checked by `cargo test -p quadfringe --test pair`.
pub(super) const RAY_SLACK_PX: f64 = 1.0;

/// Least depth at which a camera ray is searched, mm; it stands for the camera, where a ray has no projector column.
/// Any object is further away. Not measured.
pub(super) const NEAR_MM: f64 = 1.0;

/// Depth that stands for infinity, mm (1000 km). Follows from the geometry: a baseline of 1 m moves the column by less
/// than 1e-6 focal lengths there. A larger depth loses digits of the baseline in `f64`.
pub(super) const FAR_MM: f64 = 1e9;

/// Least part of the baseline that lies across the columns of the projector. With less (0.06 degrees) a sheet of light
/// nearly contains the camera centre, and depths follow from rounding. Not measured.
pub(super) const ACROSS_SHARE_MIN: f64 = 1e-3;

/// Least length of the baseline, mm. It only separates a baseline of zero from rounding; a real one is longer than 1
/// mm. Not measured.
pub(super) const BASELINE_MIN_MM: f64 = 1e-6;
