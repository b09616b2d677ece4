//! Step 3: the local fit.

/// Width (sigma) of the first window in fringe periods, which has to average whole fringes. FIRST_VARIED
pub const FIRST_WINDOW: f32 = 0.5;

/// Width (sigma) of the fitting window in fringe periods. Larger: less noise of beats, offsets and amplitudes. Smaller: they follow edges.
/// WINDOW_VARIED
pub const WINDOW: f32 = 0.3;

/// Rows of pixels that stand for a row of cells. Neighbouring rows carry nearly the same information, and the window holds hundreds of
/// pixels. ROWS_VARIED
pub const SAMPLED_ROWS: usize = 2;

/// Ridge of the normal equations relative to the weight in the window. Larger: offsets and amplitudes are drawn to 0. Smaller: windows
/// without a whole fringe become singular. RIDGE_VARIED
pub const RIDGE: f32 = 1e-3;

/// Least contrast (amplitude over offset) of light from the projector. Larger: surfaces under room light are lost. Smaller: room light
/// passes for fringes. CONTRAST_VARIED
pub const CONTRAST_MIN: f32 = 0.1;

/// Least mean square of the phasor of R and B in any direction: 1/2 for whole fringes, 0 when B repeats R. SPREAD_VARIED
pub const SPREAD_MIN: f32 = 0.02;
