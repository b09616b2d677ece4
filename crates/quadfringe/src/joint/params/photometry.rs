//! Step 5: photometry.

/// Width (sigma) of the window in fringe periods; faster changes go into the albedo of the pixels. Larger: smooth shades of
/// albedo look like phase. Smaller: phase errors enter. Widths from 0.22 to 0.4 move all figures by less than a tenth
/// (`python evaluation/accuracy.py`). Varied x0.7: peaks +8 %, face +5 %, near edges of steps +122 %; x1.4: near edges of steps
/// -14 %, of dim steps -26 %, textured face +7 %.
pub const WINDOW: f32 = 0.28;

/// Width (sigma) in fringe periods of the neighbourhood that a cell is drawn to. Larger: illumination that varies over the image
/// is smoothed. Smaller: noise. Varied x0.7: peaks without noise +8 %, near edges of dim steps -22 %; x1.4: peaks without noise
/// -6 %.
pub const NEIGHBOURHOOD: f32 = 1.0;

/// Relative difference (root mean square of offsets and amplitudes) from the neighbourhood above which a cell keeps its fit: in
/// units of the noise over the modulation, and at least [`OTHER_TEXTURE_MIN`]. Larger: edges of the texture are smoothed.
/// Smaller: noise stays. Thresholds half as large again move all figures by less than a tenth (`python evaluation/accuracy.py`).
/// Varied: no effect, but near edges of dim steps -23 % at x1.4.
pub const OTHER_TEXTURE_NOISES: f32 = 0.2;
/// See [`OTHER_TEXTURE_NOISES`]. Varied: as above.
pub const OTHER_TEXTURE_MIN: f32 = 0.01;

/// Side of the cells in fringe periods, rounded down to a power of two of pixels. Larger: less noise, coarser interpolation.
/// Smaller: more time. Varied x1.4 (twice as wide): peaks without noise -8 %, textured face +2 %; x0.7 has the same cells.
pub const CELL: f64 = 0.35;

/// Ridge of the normal equations relative to the diagonal: directions that a window without a whole fringe does not determine
/// stay as they were. More fits with more ridge end as far from the start as two with little (`cargo test --test sizes`). Varied:
/// no effect at x0.7; peaks without noise +2 % and near edges of dim steps -22 % at x1.4.
pub const RIDGE: f32 = 1.7e-2;

/// Greatest misfit of a pixel that takes part. Follows from the limit of a valid pixel.
pub const MISFIT_MAX: f32 = super::validity::MISFIT_MAX;

/// Rows of pixels that stand for a row of cells, in the fit before the last choice of orders and after it. More: time. Not
/// measured by itself: the first fit only has to be good enough to choose orders.
pub const FIRST_SAMPLED_ROWS: usize = 2;
/// See [`FIRST_SAMPLED_ROWS`].
pub const SAMPLED_ROWS: usize = 4;

/// Rounds of photometry and phase after the first. More: time. Varied: 1 round in place of 2 makes the phase RMS of peaks without
/// noise half as large again, 3 rounds improve it by 16 % and make edges of steps 41 % worse.
pub const ROUNDS: usize = 2;
/// The same on textured surfaces. Varied: no effect but 3 % near edges.
pub const TEXTURED_ROUNDS: usize = 3;

/// Share of lit pixels that take offsets and amplitudes from another place, above which a surface is textured. Smaller: white
/// surfaces with many edges get the slower estimate for textured ones (varied x0.7: dim steps become textured, phase RMS -21 %,
/// near edges +36 %). Larger: weak texture stays in the phase (x1.4: dim steps +6 %, near edges -19 %).
pub const TEXTURED_SHARE: f32 = 0.03;

/// Weight of the phase of the wide window against the information of the light about it. Larger: steps are bent. Smaller: errors
/// of the photometry are explained as phase. Varied: no effect, but 4 % near edges of dim steps at x0.7.
pub const PHASE_TRUST: f32 = 0.08;

/// The same when the channels saw the surface at different instants. Larger: the ripple of slow motion goes sooner, but motion
/// that is too fast to be measured appears slower than it is. (`cargo test --test motion -- --nocapture`) Varied on shots of
/// planes that move by 100, 300 and 600 mm/s: phase RMS of the first 0.0059 -> 0.0066 and 0.0054 rad, of the second 0.023 ->
/// 0.027 and 0.020 rad, wrong orders of the third 0.87 -> 0.74 and 0.95 %.
pub const MOVING_PHASE_TRUST: f32 = 0.01;

/// Least lit share of the window of the slopes around a pixel that takes part, on a surface without texture: in a window that an
/// edge cuts, the mean lies to one side. On a textured surface, where discontinuities are everywhere, it would leave too few
/// pixels. Without the limit the border is up to 0.16 rad off. Varied x0.7: phase RMS of steps +11 %, near edges +35 %; x1.4 (no
/// pixel takes part): peaks without noise +93 %.
pub const LIT_SHARE_MIN: f32 = 0.9;

/// Distance of the nearer places to take offsets and amplitudes from, in fringe periods; somewhat more than the width (sigma) of
/// the window. Larger: places beyond narrow features. Smaller: windows that still mix two albedos. Varied: no effect, but near
/// edges of dim steps -21 % at x0.7.
pub const PLACE_DISTANCE: f32 = 0.35;

/// Pixels look around where their squared residual, on average over a vector in the rows of a task, is more than this many times
/// that of noise: three standard deviations of that average. Larger: weak texture stays in the phase. Smaller: noise sends pixels
/// elsewhere. Varied x0.7: dim steps become textured (phase RMS -21 %, near edges +36 %); x1.4: near edges of dim steps -21 %.
pub const PLACE_NOISES: f32 = 1.2;

/// Root mean square, in units of the modulation, that the residual must have on top of that and that another place must gain.
/// Without it residuals of curved or blurred surfaces would send pixels elsewhere (rims, `python evaluation/captures_report.py`).
/// Varied x0.7: steps count as textured in part (phase RMS +11 %, near edges +39 %); x1.4: dim steps +6 %, near edges -19 %.
pub const PLACE_GAIN_MIN: f32 = 0.02;

/// Another place is taken if its squared residual is less than this share of that of the place of the pixel. Varied x0.7: dim
/// steps +6 %, near edges -19 %; x1.4 (worse places are taken): face +161 %.
pub const PLACE_BETTER: f32 = 0.9;

/// Width (sigma) in fringe periods over which the contrast of the light is averaged. Larger: light that varies over the image.
/// Smaller: noise. Varied: no effect.
pub const CONTRAST_WIDTH: f32 = 1.5;

/// Reach of the mean albedo in fringe periods. More: time. Varied: textured face +2 % at x1.4, whose steps are wider.
pub const ALBEDO_REACH: f32 = 0.6;
/// Width (sigma) of the mean albedo in fringe periods. Larger: fine texture is smoothed. Smaller: noise (varied: textured face +6
/// % at x0.7, -4 % at x1.4).
pub const ALBEDO_WIDTH: f32 = 0.3;
/// Steps to the furthest pixel of the mean, at most. More: time. Varied: textured face +6 % with 2 steps, -2 % with 4.
pub const ALBEDO_STEPS: usize = 3;

/// Relative error of an albedo by the errors of phase and contrast. Larger: different albedos are averaged. Smaller: bright
/// pixels find no partners. Varied: no effect.
pub const ALBEDO_ERROR: f32 = 0.015;

/// Sum of the squared albedo differences of four channels, in units of their variance, up to which a pixel has full weight; its
/// expectation is 4. Varied: textured face +2 % at x0.7, -3 % at x1.4.
pub const ALBEDO_EXPECTED: f32 = 4.0;
/// Excess over [`ALBEDO_EXPECTED`] from which a pixel has no weight. Varied: textured face +5 % at x0.7, -5 % at x1.4.
pub const ALBEDO_EXCESS: f32 = 16.0;
