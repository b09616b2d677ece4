//! Step 5: photometry.

/// Width (sigma) of the window in fringe periods. Changes of the light over a shorter distance are explained by the albedo of
/// the pixels. Larger: smooth shades of albedo look like phase. Smaller: phase errors enter. Widths from 0.22 to 0.4 change all
/// figures by less than a tenth (`python evaluation/accuracy.py`). Varied x0.7: peaks +8 %, face +5 %, near edges of steps +122
/// %; x1.4: near edges of steps -14 %, of dim steps -26 %, textured face +7 %.
pub const WINDOW: f32 = 0.28;

/// Width (sigma) in fringe periods of the neighbourhood to whose photometry a cell is drawn, and that supports an order. Larger:
/// variation of the illumination over the image is smoothed, and edges lose support from what lies beyond them. Smaller: noise. Varied
/// for photometry, x0.7: peaks without noise +8 %, near edges of dim steps -22 %; x1.4: peaks without noise -6 %; for orders: no effect.
pub const NEIGHBOURHOOD: f32 = 1.0;

/// A cell that differs from its neighbourhood by more than this keeps its fit. The difference is relative (root mean square of
/// offsets and amplitudes). Larger: edges of the texture are smoothed. Smaller: noise stays. Varied:
/// 0.01 loses 0.06 points of photographs and changes nothing else (`python evaluation/world.py --half tune`).
pub const OTHER_TEXTURE: f32 = 0.015;

/// Ridge of the normal equations relative to the diagonal: it holds those combinations of the unknowns that a window without a
/// whole fringe does not determine. Many fits with a large ridge end as far from the start as two fits with a small one (`cargo
/// test --test sizes`). Varied: no effect at x0.7; peaks without noise +2 % and near edges of dim steps -22 % at x1.4.
pub const RIDGE: f32 = 1.7e-2;

/// Number of rounds of photometry and phase after the first. More: time. Two, each of which begins with the choice of places, take 8 %
/// less of a white shot (`python benches/two_builds.py`), but lose 0.1 to 0.7 points of photographs (`python evaluation/world.py --half
/// tune`) and 0.04 of the bottle (`python evaluation/captures.py`). With 1, white fringes of 78 px have an RMS 10 % larger, and a mosaic
/// returns 0.3 per mille fewer of the pixels that full sampling returns (`cargo test --test bayer a_mosaic_loses -- --nocapture`).
pub const ROUNDS: usize = 3;

/// Weight of the phase of the wide window relative to the information about the phase in the light. Larger: steps are smoothed.
/// Smaller: errors of the photometry are explained as phase. Varied: no effect, but 4 % near edges of dim steps at x0.7. 0.01:
/// painted face +7 %, 1.1 points less of photographs (`python evaluation/world.py --half tune`).
pub const PHASE_TRUST: f32 = 0.08;

/// This weight if the channels saw the surface at different instants. Larger: the ripple of slow motion vanishes in fewer
/// rounds, but motion that is too fast to be measured appears slower than it is. (`cargo test --test motion -- --nocapture`)
/// Varied on shots of planes that move by 100, 300 and 600 mm/s: phase RMS of the first 0.0059 -> 0.0066 and 0.0054 rad, of
/// the second 0.023 -> 0.027 and 0.020 rad, wrong orders of the third 0.87 -> 0.74 and 0.95 %.
pub const MOVING_PHASE_TRUST: f32 = 0.01;

/// Distance, in fringe periods, of the nearer ones of the places from which a pixel can take offsets and amplitudes; somewhat
/// more than the width (sigma) of the window. Larger: the places lie beyond narrow features. Smaller: their windows still mix
/// two albedos. Varied: no effect, but near edges of dim steps -21 % at x0.7.
pub const PLACE_DISTANCE: f32 = 0.35;

/// Pixels compare places where their squared residual, averaged over a vector in the rows of a task, exceeds its expectation for
/// noise by this factor; the excess is three standard deviations of the average. Larger: weak texture stays in the phase. Smaller:
/// noise makes pixels choose another place. Varied x0.7: dim steps become textured (phase RMS -21 %, near edges +36 %); x1.4: near
/// edges of dim steps -21 %. 1.0: 0.08 points less of the bottle (`python evaluation/captures_report.py`), nothing else.
pub const PLACE_NOISES: f32 = 1.2;

/// Root mean square, in units of the modulation, that the residual must have in addition to noise, and by which another place must
/// reduce it. Without it, residuals of curved or blurred surfaces would make pixels choose another place (rims, `python
/// evaluation/captures_report.py`). Varied x0.7: steps count as textured in part (phase RMS +11 %, near edges +39 %); x1.4: dim
/// steps +6 %, near edges -19 %. 0: steps +7 %, face +21 % (`python evaluation/world.py --half tune`).
pub const PLACE_GAIN_MIN: f32 = 0.02;

/// Another place is taken if its squared residual is less than this share of the squared residual at the place of the pixel. Varied
/// x0.7: dim steps +6 %, near edges -19 %; x1.4 (worse places are taken): face +161 %. 1: steps +2 %, 0.8 points less of
/// photographs, 0.16 of the bottle.
pub const PLACE_BETTER: f32 = 0.9;
