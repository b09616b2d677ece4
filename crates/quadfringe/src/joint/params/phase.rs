//! Step 6: the window that averages the phase, and the phase fit.

/// Width (sigma) of the window in fringe periods. Larger: less noise. Smaller: finer details. WIDTH_VARIED
pub const WIDTH: f32 = 0.125;

/// Bounds of that width in pixels: below 0.8 the window would be a single pixel, above 6 it takes too long.
/// Not measured: fringes of 6 to 48 pixels lie between them.
pub const SIGMA_MIN_PX: f32 = 0.8;
/// See [`SIGMA_MIN_PX`].
pub const SIGMA_MAX_PX: f32 = 6.0;

/// Width (sigma) in fringe periods of the wide window, over which errors of wrong offsets and amplitudes average out: they change their
/// sign along a fringe. WIDE_VARIED
pub const WIDE: f32 = 0.5;

/// Greatest difference in phase of a neighbour that counts, in standard deviations of the phase of a pixel. Larger: small steps are
/// smoothed. Smaller: noise is averaged less. SIGMAS_VARIED
pub const REACH_SIGMAS: f32 = 7.0;

/// The same without noise, in rad. REACH_VARIED
pub const REACH_RAD: f32 = 0.06;

/// Width (sigma) in fringe periods over which squared residuals are averaged. RESIDUAL_VARIED
pub const RESIDUAL_WIDTH: f32 = 0.125;
/// Rows of pixels that stand for a row of cells of residuals. Not measured: their window holds dozens of pixels.
pub const RESIDUAL_SAMPLED_ROWS: usize = 2;

/// Share of a pixel in its albedo, which is a mean of nine with the weights 1 2 1. Follows from these weights: 4 / 16. With 1 a step
/// would be up to four times longer and, where neighbours err to different sides, lead beyond the solution. SHARE_VARIED
pub const ALBEDO_SHARE: f32 = 0.25;

/// Weight of an unlit pixel in the albedo of its neighbours: its phase is arbitrary, and so is its albedo. UNLIT_VARIED
pub const UNLIT_WEIGHT: f32 = 1e-3;
