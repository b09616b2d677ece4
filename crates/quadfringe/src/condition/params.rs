//! Tuned numbers of conditioning and of the estimate of a response, each with its unit, its trade-off and the command
//! that measures it.
//!
//! `python evaluation/auto_response.py` shows how the numbers change an estimate. `cargo test -p quadfringe --lib
//! condition` checks that estimates from known curves are within 0.035 of the exponent.

// Conditioning.

/// Greatest intensity of a shot, in fractions of full scale. Images of a greater range than the camera's stay far below it;
/// beyond it, products of intensities overflow in `f32`. `cargo test -p quadfringe --test fuzzed` decodes such shots.
pub(crate) const LIGHT_MAX: f32 = 1e4;

/// A pixel with at least this intensity counts as saturated, fraction of full scale. Follows from the format of an
/// 8-bit camera: 0.998 lies between its last two values (254 and 255 of 255). A smaller value discards highlights that
/// are still linear; a larger one misses clipped pixels of cameras whose last value is below full scale.
pub(crate) const CLIPPED: f32 = 0.998;

/// Exponent of the knee `1 - knee I^20`, which compresses highlights. With a smaller exponent the knee would also bend
/// middle tones, which the power law describes. Not measured: at 20 the knee acts above 0.85 of full scale, where
/// 0.85^20 is 0.04.
pub(super) const KNEE_POWER: i32 = 20;

/// Number of entries in the table of a response, from dark to full scale. A larger table does not fit into the nearest
/// cache. Straight lines between 4096 entries follow a gamma of 2.2 to 2e-5 of full scale (`cargo test -p quadfringe
/// --lib the_table_follows_the_response`).
pub(super) const CURVE_ENTRIES: usize = 4096;

/// In this number of entries above the offset, a curve is too steep for straight lines, and the power itself is
/// computed. With a smaller number the error exceeds the value stated at [`CURVE_ENTRIES`]; with a larger one more
/// powers are computed (`cargo test -p quadfringe --lib the_table_follows_the_response`).
pub(super) const CURVE_STEEP_ENTRIES: f32 = 16.0;

// The response from N-step stacks.

/// Least number of steps of a stack. Follows from sampling: five steps resolve the second harmonic, which a gamma adds
/// to the fringes.
pub(super) const STEPS_MIN: usize = 5;

/// Greatest offset that the search tries, fraction of full scale. Not measured: if black lies above a fifth of full
/// scale, little room is left for fringes.
pub(super) const OFFSET_MAX: f64 = 0.2;

/// The bound on the offset is at least this, fraction of full scale, so that the search has an interval even where the darkest
/// pixels are black. Not measured: it is half a level of an 8-bit camera.
pub(super) const OFFSET_MAX_LEAST: f64 = 0.002;

/// Start of the search: offset as a fraction of full scale, exponent and knee of the inverse response. A start far from the
/// response takes more rounds; `cargo test -p quadfringe --lib condition` checks that it does not decide the result.
pub(super) const START_OFFSET: f64 = 0.01;
/// See [`START_OFFSET`]; the exponent of a gamma of 2.
pub(super) const START_EXPONENT: f64 = 0.5;
/// See [`START_OFFSET`].
pub(super) const START_KNEE: f64 = 0.5;

/// First steps of the search from its start, in the same units. See [`START_OFFSET`].
pub(super) const STEP_OFFSET: f64 = 0.03;
/// See [`STEP_OFFSET`].
pub(super) const STEP_EXPONENT: f64 = 0.15;
/// See [`STEP_OFFSET`].
pub(super) const STEP_KNEE: f64 = 0.3;

/// Exponents of the inverse response that the search tries. Not measured: they include gammas from 0.4 to 10, which
/// includes the gammas of common encodings, 0.45 and 2.2.
pub(super) const EXPONENTS: std::ops::Range<f64> = 0.1..2.5;

/// Greatest knee that the search tries. Follows from the formula: at 1 the inverse has a pole at full scale.
pub(super) const KNEE_MAX: f64 = 0.98;

/// A knee is accepted only if it saves this share of the cost, because noise alone also lowers the cost a little. With
/// a larger share weak knees are missed. `cargo test -p quadfringe --lib a_knee_is_found_and_undone` checks that a real
/// knee is found.
pub(super) const KNEE_GAIN: f64 = 0.02;

/// A knee must also save this cost, in rad^2: the square of 2 mrad. Not measured: a smaller improvement is not visible
/// in a shape.
pub(super) const KNEE_GAIN_RAD2: f64 = 4e-6;

/// A stack counts as ordered if its two-step error after correction is at most this, in rad. A smaller value refuses
/// noisy captures; a larger one accepts stacks with swapped images (`cargo test -p quadfringe --lib
/// images_out_of_order_are_noticed`).
pub(super) const RMS_MAX_RAD: f64 = 0.3;

/// A step counts as out of order if its error exceeds the error of the median step by this factor. Smaller values
/// refuse captures with flicker; with larger values a single swapped image among many is missed (`cargo test -p
/// quadfringe --lib the_step_out_of_place_is_named`).
pub(super) const STEP_EXCESS: f64 = 2.0;
/// The error of the step must also exceed the median by this, in rad (root of the difference of squares). See
/// [`STEP_EXCESS`].
pub(super) const STEP_EXCESS_RAD: f64 = 0.12;

/// Greatest level of the look-up table of intensities. Follows from the format: sixteen levels for each value of an
/// 8-bit camera, so that these values are exact. More levels need a larger table and do not change the cost.
pub(super) const LEVEL_MAX: f32 = 255.0 * 16.0;

/// Two-step error in rad above which the cost grows linearly (Huber loss), so that edges and drift have little weight.
/// Follows from the noise: 3 % of full scale causes errors of 0.06 to 0.07 rad at an amplitude of 0.45 to 0.5, and
/// their cost remains quadratic.
pub(super) const HUBER_RAD: f32 = 0.1;

/// Least amplitude of the fringes of a usable pixel, fraction of full scale. Not measured: fainter fringes are
/// dominated by noise.
pub(super) const STACK_MODULATION_MIN: f32 = 0.05;

/// A pixel counts as saturated if its brightest step has at least this intensity, fraction of full scale: 250 of 255.
/// Not measured: the margin of a few values of an 8-bit camera excludes highlights that are compressed before they
/// clip.
pub(super) const BRIGHT_MAX: f32 = 250.0 / 255.0;

/// Reach of the light that a saturated pixel spills over its neighbours, px. A larger reach discards more pixels around
/// highlights. Not measured.
pub(super) const SPILL_PX: usize = 2;

/// A pixel does not vary as fringes do if more than this share of its variance over the steps lies outside the first
/// harmonic. Follows from the harmonics of a power law: a gamma of 4 has a share of 0.21, a gamma of 1/4 up to 0.28.
pub(super) const DISORDER: f32 = 0.3;

/// A stack is refused if it has fewer than this number of usable pixels for each disordered one. A larger number
/// refuses stacks with many edges and moving shadows (`cargo test -p quadfringe --lib unusable_stacks_are_named`).
pub(super) const USABLE_PER_DISORDERED: usize = 10;

/// Least number of pixels of an estimate. With fewer pixels noise decides; a larger number refuses small objects
/// (`cargo test -p quadfringe --lib unusable_stacks_are_named`).
pub(super) const PIXELS_MIN: usize = 1000;

/// Greatest number of pixels of an estimate, evenly spread. More pixels take longer. Not measured: the mean of 20 000
/// pixels has less than a hundredth of the noise of one pixel.
pub(super) const PIXELS_MAX: usize = 20_000;

// The response from one shot.

/// Number of phase steps into which the pixels of a tile are sorted. More steps separate higher harmonics, but each has
/// fewer pixels (`python evaluation/auto_response.py`).
pub(super) const PHASE_STEPS: usize = 16;

/// Side of a tile in fringes. With less than two fringes, a slope of the albedo looks like a harmonic; with larger
/// tiles there are fewer of them (`python evaluation/auto_response.py`).
pub(super) const TILE_FRINGES: f32 = 2.5;

/// Least side of a tile in pixels. Follows from [`PHASE_STEPS`]: 24 x 24 pixels give 36 pixels to each of 16 phase
/// steps.
pub(super) const TILE_SIDE_MIN_PX: usize = 24;

/// Least share of a tile with a known phase. A larger one keeps the tiles whose texture happens to agree with the
/// fringes: of random blocks of 4 px the decoder returns a third. With a smaller one few pixels decide on the phase
/// (`python evaluation/response_sd.py`).
pub(super) const KNOWN_MIN: f32 = 0.25;
/// Least share of a tile on the surface, known or between known pixels. With a larger share the tiles at edges are lost,
/// with a smaller one the rest of a tile spans too few fringes. Not measured.
pub(super) const COVERED_MIN: f32 = 0.5;

/// Greatest RMS distance of the phase of a tile from a polynomial of degree 2, rad of the first fringe number. A larger
/// one sorts pixels at depth steps into wrong phase steps, which weakens the harmonics, a smaller one loses relief and
/// light that is bent much: a gamma of 3 makes 0.3 (`python evaluation/auto_response.py`).
pub(super) const PHASE_MISFIT_MAX_RAD: f64 = 0.5;

/// Rounds of the fit of that polynomial. The first decides which turn a pixel belongs to; later ones hardly change the
/// weights. More take longer. Not measured.
pub(super) const FIT_ROUNDS: usize = 4;

/// Step in pixels, along rows and columns, between the pixels that are fitted. Six weights need no more pixels; a larger
/// one leaves too few in the smallest tiles. Not measured.
pub(super) const FIT_STRIDE_PX: usize = 2;

/// Least number of pixels in a phase step, as a share of the mean number. Below it, the steps of a tile have gaps in
/// their period. Not measured.
pub(super) const EVENNESS_MIN: f32 = 0.25;

/// Greatest share of saturated pixels of a tile. With a larger share, clipped crests look like a response. Not
/// measured.
pub(super) const SATURATED_MAX: f32 = 0.02;

/// Least amplitude of the fringes of a tile, fraction of full scale. It is smaller than [`STACK_MODULATION_MIN`],
/// because the mean of a hundred pixels has a tenth of their noise. Not measured.
pub(super) const TILE_MODULATION_MIN: f32 = 0.02;

/// Least number of tiles of an estimate for all channels together. With fewer tiles the texture of a single object
/// decides (`python evaluation/auto_response.py`).
pub(super) const TILES_MIN: usize = 48;
/// Least number of tiles for a separate estimate of a single channel. See [`TILES_MIN`].
pub(super) const SINGLE_CHANNEL_TILES_MIN: usize = 60;
/// Least number of tiles of a channel that takes part. See [`TILES_MIN`].
pub(super) const CHANNEL_TILES_MIN: usize = 6;

/// If an image has fewer tiles than this, they overlap by half, which gives up to four times as many tiles. Not
/// measured: about twice [`TILES_MIN`].
pub(super) const MANY_TILES: usize = 100;

/// A response is corrected only if this decreases the two-step error by this much (root of the difference of squares,
/// rad). With a smaller value texture is mistaken for a gamma; 0.02 rad corresponds to a gamma of about 1.1 (`python
/// evaluation/auto_response.py`).
pub(super) const GAIN_RAD: f64 = 0.02;

/// Second harmonic over the first, of either sign, that a correction may leave beyond zero. A smaller one follows the
/// noise of the median, a larger one leaves fringes that are bent the other way (`python evaluation/response_sd.py`).
pub(super) const HARMONIC_LEFT: f64 = 0.01;

/// Standard errors by which an exponent must differ from 1. With fewer, photographs as albedo count as a response; with
/// more, weak ones of single objects are missed (`python evaluation/response_sd.py`).
pub(super) const CERTAIN_SDS: f64 = 4.0;

/// Second harmonic over the first that the captured light must have, of either sign: a gamma of 1.11 makes 0.035.
/// Photographs as albedo make up to 0.027 in single channels of linear light (`python evaluation/response_sd.py`). A smaller
/// one corrects these, a larger one leaves weak responses. A channel needs twice as much if all together show no response.
pub(super) const HARMONIC_LEAST: f64 = 0.035;

/// Second harmonic over the first that no texture has in the median of the tiles, so that the light is not linear however uncertain the
/// exponent is: a few tiles with a wrong phase, as at depth steps, make its standard error large. Smaller: texture counts as a response.
/// Larger: strong responses are left uncorrected (`cargo test --package quadfringe --test response`, `python evaluation/response_sd.py`).
pub(super) const HARMONIC_SURE: f64 = 0.15;

/// Standard error that all tiles have in common, as a share of the distance of the exponent from 1. Noise that black
/// clips, room light and blur move all tiles alike: on painted surfaces with 2 % noise exponents come out too small by 0.05
/// to 0.15 of that distance. A smaller one states too little (`python evaluation/response_sd.py`).
pub(super) const EXPONENT_SHARED: f64 = 0.12;

/// Second harmonic over the first that texture may pretend, over the square of the median of its part out of phase, which
/// no response has. The phase of a tile follows its texture, which then counts twice: random blocks have up to 34 times
/// that square, 13 on average. A smaller one corrects linear light on texture, a larger one leaves weak responses on it
/// (`python evaluation/response_sd.py`).
pub(super) const HARMONIC_OF_TEXTURE: f64 = 13.0;

/// Step of the differences from which slopes and curvature of the cost follow, as a share of the exponent. Not measured:
/// small against what a response changes, large against rounding. A larger one averages over the bend of the cost.
pub(super) const DIFFERENCE_EXPONENT: f64 = 0.02;
/// As [`DIFFERENCE_EXPONENT`] for the offset, fraction of full scale. Not measured: one level of 8 bit.
pub(super) const DIFFERENCE_OFFSET: f64 = 0.004;

/// Step in pixels, along rows and columns, between the pixels at which the slope of the phase is computed. Not
/// measured: the median of the slopes needs no more pixels.
pub(super) const SLOPE_STRIDE_PX: usize = 4;

/// The search ends when the size of the simplex, in units of its first steps, is below this. Follows from the step:
/// 0.005 of 0.15 changes an exponent by less than 0.001.
pub(super) const SIMPLEX_TOLERANCE: f64 = 0.005;

/// Greatest number of iterations of the search. Not measured: it only stops a search that does not converge.
pub(super) const SIMPLEX_ROUNDS_MAX: usize = 200;
