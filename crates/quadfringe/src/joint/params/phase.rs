//! Step 6: the window that averages the phase, and the phase fit.

/// Width (sigma) of the window in fringe periods. Larger: less noise. Smaller: finer details. Varied x0.7: phase RMS of peaks +35
/// %, of steps +28 %, near edges of the face -14 %; x1.4: peaks and steps -20 %, face +20 %.
pub const WIDTH: f32 = 0.125;

/// Bounds of that width in pixels: below 0.8 the window would be a single pixel, above 6 it takes too long. Not measured: fringes
/// of 6 to 48 pixels lie between them.
pub const SIGMA_MIN_PX: f32 = 0.8;
/// See [`SIGMA_MIN_PX`].
pub const SIGMA_MAX_PX: f32 = 6.0;

/// Width (sigma) in fringe periods of the wide window, over which errors of wrong offsets and amplitudes average out: they change
/// their sign along a fringe. Larger: curved surfaces are smoothed (varied x1.4: textured face +17 %). Smaller: part of the error
/// stays (x0.7: steps +2 %, textured face -13 %).
pub const WIDE: f32 = 0.5;

/// Greatest difference in phase of a neighbour that counts, in standard deviations of the phase of a pixel. Larger: small steps
/// are smoothed. Smaller: noise is averaged less. Varied x0.7: textured face -16 %, face -5 %, near edges of dim steps -28 %, but
/// dim steps +3 %; x1.4: textured face +23 %, face +6 %, near edges of dim steps +150 %.
pub const REACH_SIGMAS: f32 = 7.0;

/// The same without noise, in rad. Varied: peaks without noise +4 % at x0.7; x1.4 no effect but on their uncertainty (0.76 in
/// place of 0.78 inside).
pub const REACH_RAD: f32 = 0.06;

/// Width (sigma) in fringe periods over which squared residuals are averaged. Larger: the window loosens away from the cause.
/// Smaller: noise. Varied: no effect, but 8 % near edges of dim steps at x1.4.
pub const RESIDUAL_WIDTH: f32 = 0.125;
/// Rows of pixels that stand for a row of cells of residuals. Not measured: their window holds dozens of pixels.
pub const RESIDUAL_SAMPLED_ROWS: usize = 2;

/// Share of a pixel in its albedo, which is a mean of nine with the weights 1 2 1. Follows from these weights: 4 / 16. With 1 a
/// step would be up to four times longer and, where neighbours err to different sides, lead beyond the solution. Varied x0.7:
/// peaks without noise +8 %, near edges of steps -7 %; x1.4: -9 % and +24 %.
pub const ALBEDO_SHARE: f32 = 0.25;

/// Weight of an unlit pixel in the albedo of its neighbours: its phase is arbitrary, and so is its albedo. Larger: rims take the
/// albedo of the dark. It only has to differ from 0. Varied: no effect.
pub const UNLIT_WEIGHT: f32 = 1e-3;
