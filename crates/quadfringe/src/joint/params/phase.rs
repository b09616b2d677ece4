//! Step 6: the window that averages the phase, and the phase fit.

/// Width (sigma) of the window in fringe periods, and of that over which squared residuals are averaged. Larger: less noise. Smaller: finer details. Varied x0.7: phase RMS of peaks +35
/// %, of steps +28 %, near edges of the face -14 %; x1.4: peaks and steps -20 %, face +20 %.
pub const WIDTH: f32 = 0.125;

/// Greatest width in pixels; a wider window takes too long. Not measured: fringes of more than 48 pixels have it.
pub const SIGMA_MAX_PX: f32 = 6.0;

/// Width (sigma) in fringe periods of the wide window. Follows from the window that averages whole fringes: errors of wrong offsets and
/// amplitudes change their sign along a fringe. Larger: curved surfaces are smoothed (varied x1.4: textured face +17 %). Smaller: part of the error
/// stays (x0.7: steps +2 %, textured face -13 %).
pub const WIDE: f32 = super::local_fit::FIRST_WINDOW;

/// Greatest phase difference of a neighbour that has a weight in the window, in standard deviations of the phase of a pixel.
/// Larger: small steps are smoothed. Smaller: noise is averaged less. Varied x0.7: textured face -16 %, face -5 %, near edges of
/// dim steps -28 %, but dim steps +3 %; x1.4: textured face +23 %, face +6 %, near edges of dim steps +150 %.
pub const REACH_SIGMAS: f32 = 7.0;

/// Lower bound of this difference for shots without noise, in rad. Varied: peaks without noise +4 % at x0.7; x1.4 has an effect
/// only on their uncertainty (0.76 instead of 0.78 inside). 0: no effect with noise of 3 % nor on captures.
pub const REACH_RAD: f32 = 0.06;

/// Least albedo by which a step of the phase is divided; it only keeps the division finite. Follows from the range of the images:
/// full scale over the least albedo of a lit pixel is far below its inverse. A larger floor changes dark pixels.
pub const ALBEDO_MIN: f32 = 1e-4;

/// Share of the pixel itself in its albedo, which is a mean of nine pixels with the weights 1 2 1 in both directions. Follows
/// from these weights: 4 / 16. With 1 a step would be up to four times longer and overshoot the solution where the errors of
/// neighbours have different signs. Varied x0.7: peaks without noise +8 %, near edges of steps -7 %; x1.4: -9 % and +24 %.
pub const ALBEDO_SHARE: f32 = 0.25;

/// Weight of an unlit pixel in the albedo of its neighbours: its phase is arbitrary, and so is its albedo. Larger: pixels at the
/// rim of a surface take the albedo of the dark pixels next to them. Follows from the arithmetic: it only
/// has to differ from 0 (with 1e-9 no figure of `python evaluation/world.py --half tune` moves).
pub const UNLIT_WEIGHT: f32 = 1e-3;
