//! Steps 1 to 3 and 6: cells, levels of the image pyramid, and upsampling.

/// Cells in a fringe period, at least; a cell is a power of two of pixels wide, so up to 6.8. More: time. Fewer: what varies
/// slowly is interpolated too coarsely. Varied x1.4 (cells half as wide): phase RMS of peaks without noise +8 %, near edges of
/// steps -13 %, wrong orders of dim steps 190 -> 244 ppm; x0.7 has the same cells.
pub const CELLS_PER_PERIOD: f64 = 3.4;

/// Least fringe period on the coarse level in pixels. Larger: more pixels, a tenth to a sixth more time at 12, and less right on
/// captures; smaller: fringes are lost (`cargo test --test round_trip`, `python evaluation/captures_report.py`,
/// `quadfringe bench`). Varied x1.4 (means of 2 x 2 pixels in place of 4 x 4): phase RMS of steps +4 %, of the face +5 %, near
/// edges of steps -25 %; x0.7 has the same level.
pub const COARSE_PERIOD_MIN_PX: f64 = 6.0;

/// Greatest factor between the two levels. Follows from the code, which writes out means for 2 and 4. With 4 the coarse
/// level has a sixteenth of the pixels.
pub const FACTOR_MAX: usize = 4;

/// Pixels that interpolated light of a mosaic reaches into a shadow: a missing sample is a mean of neighbours one pixel away
/// (`cargo test --test bayer`).
pub const MOSAIC_REACH_PX: usize = 1;

/// Least fringe period that is looked for, in pixels. Follows from sampling: a fringe needs four samples for its shape
/// (Nyquist with a margin of two).
pub const PERIOD_MIN_PX: f64 = 4.0;

/// Fringe period as a share of the width of the image when no carrier stands out: 16 fringes. Not measured: such a shot has
/// no fringes to decode, and the number only has to be a possible period.
pub const PERIOD_FALLBACK_SHARE: f64 = 1.0 / 16.0;

/// Surfaces whose phases differ by less than this, in rad, count as one in upsampling. Larger: small steps are smoothed. Smaller:
/// more candidates for each pixel, more time. Varied: no effect.
pub const SAME_SURFACE_RAD: f32 = 0.3;

/// Greatest squared residual that counts against a surface, in units of the squared modulation: one pixel of glare must not
/// decide for its neighbours. Varied: no effect, but 14 ppm fewer wrong orders of dim steps at x0.7.
pub const SQUARED_MISFIT_MAX: f32 = 0.5;

/// Greatest correction of the phase of a pixel against its surface, in rad. The linearisation holds for about a sixth of a turn.
/// Varied: no effect, but 11 ppm fewer wrong orders of dim steps at x1.4.
pub const CORRECTION_MAX_RAD: f32 = 1.0;
