//! Steps 1 to 3 and 6: cells, levels of the image pyramid, and upsampling.

/// Least number of cells in a fringe period. The width of a cell in pixels is a power of two, so there are up to 6.8 cells.
/// More: time. Fewer: slowly varying quantities are interpolated too coarsely. Varied x1.4 (cells half as wide): phase RMS of
/// peaks without noise +8 %, near edges of steps -13 %, wrong orders of dim steps 190 -> 244 ppm; x0.7 has the same cells.
pub const CELLS_PER_PERIOD: f64 = 3.4;

/// Least fringe period on the coarse level in pixels. Larger: the coarse level has more pixels; at 12 the time grows by a tenth
/// to a sixth, and captures are decoded less correctly. Smaller: fringes are lost (`cargo test --test round_trip`, `python
/// evaluation/captures_report.py`, `quadfringe bench`). Varied x1.4 (means of 2 x 2 pixels instead of 4 x 4): phase RMS of
/// steps +4 %, of the face +5 %, near edges of steps -25 %; x0.7 has the same level.
pub const COARSE_PERIOD_MIN_PX: f64 = 6.0;

/// Greatest factor between the two levels. Follows from the code, which writes out means for 2 and 4. With 4 the coarse
/// level has a sixteenth of the pixels.
pub const FACTOR_MAX: usize = 4;

/// Number of pixels by which interpolated light of a mosaic reaches into a shadow. Follows from the interpolation: a missing sample is
/// a mean of neighbours one pixel away (`cargo test --test bayer`).
pub const MOSAIC_REACH_PX: usize = 1;

/// Least fringe period that is accepted, in pixels. Follows from sampling: a fringe needs four samples for its shape
/// (Nyquist with a margin of two).
pub const PERIOD_MIN_PX: f64 = 4.0;

/// Fringe period if no carrier stands out, as a share of the width of the image: 16 fringes. Not measured: such a shot has
/// no fringes to decode, so any possible period is good enough.
pub const PERIOD_FALLBACK_SHARE: f64 = 1.0 / 16.0;

/// Limit for the squared residual that counts against a surface, in units of the squared modulation, so that one pixel with glare
/// does not decide for its neighbours. Varied: no effect, but 14 ppm fewer wrong orders of dim steps at x0.7. Without it: painted
/// face and bottle +5 % (`python evaluation/world.py --half tune`).
pub const SQUARED_MISFIT_MAX: f32 = 0.5;

/// Greatest correction of the phase of a pixel relative to its surface, in rad. The linearisation holds for about a sixth of a
/// turn. Varied: no effect, but 11 ppm fewer wrong orders of dim steps at x1.4. 3.1: painted face and photographs +8 %, rods -30 %
/// (`python evaluation/world.py --half tune`).
pub const CORRECTION_MAX_RAD: f32 = 1.0;

/// Number of pixel rows that stand for a row of cells in every window of step 3 to 7. Neighbouring rows have nearly the same
/// information. More: time. Fewer: noise. Cells of the coarse level have up to four rows, of which all count. With 2 in place of 4 rows
/// in local fit, slopes, residuals and the first photometry no figure moves: `python evaluation/world.py --half tune`. In motion,
/// 3 rows have +5 % for the first plane, 6 rows -4 % for the hand: `cargo test --test motion -- --nocapture`.
pub const SAMPLED_ROWS: usize = 4;
