//! Tuned numbers of conditioning and of the estimate of a response: unit, trade-off, and the command that measures them.
//!
//! `python evaluation/auto_response.py` shows the effect of the numbers of an estimate, `cargo test -p quadfringe --lib
//! condition` holds estimates from known curves to 0.035 of the exponent.

// Conditioning.

/// Intensity from which on a pixel counts as saturated, fraction of full scale. Follows from the format of an 8-bit
/// camera: 0.998 lies between its last two values (254 and 255 of 255). A smaller value discards highlights that are
/// still linear; a larger one misses clipped pixels of cameras whose last value is below full scale.
pub(super) const CLIPPED: f32 = 0.998;

/// Exponent of the knee `1 - knee I^20`, which compresses highlights. A smaller exponent would bend middle tones, which
/// belong to the power law. Not measured: at 20 the knee acts above 0.85 of full scale, where 0.85^20 is 0.04.
pub(super) const KNEE_POWER: i32 = 20;

/// Entries of the table of a response from dark to full scale; more entries leave the nearest cache. Straight lines
/// between 4096 entries follow a gamma of 2.2 to 2e-5 of full scale (`cargo test -p quadfringe --lib
/// the_table_follows_the_response`).
pub(super) const CURVE_ENTRIES: usize = 4096;

/// Entries above the offset below which the power itself is computed, because a curve is too steep there for straight
/// lines. Smaller values exceed the error of [`CURVE_ENTRIES`]; larger ones compute more powers (`cargo test -p
/// quadfringe --lib the_table_follows_the_response`).
pub(super) const CURVE_STEEP_ENTRIES: f32 = 16.0;

// The response from N-step stacks.

/// Fewest steps of a stack. Follows from sampling: five steps show the second harmonic, which a gamma adds to the
/// fringes.
pub(super) const STEPS_MIN: usize = 5;

/// Greatest offset of black that is searched, fraction of full scale. Not measured: black above a fifth leaves no room
/// for fringes.
pub(super) const OFFSET_MAX: f64 = 0.2;

/// Exponents of the inverse response that are searched. Not measured: they include gammas from 0.4 to 10, far beyond
/// the 0.45 and 2.2 of common encodings.
pub(super) const EXPONENTS: std::ops::Range<f64> = 0.1..2.5;

/// Greatest knee that is searched. Follows from the formula: at 1 the inverse has a pole at full scale.
pub(super) const KNEE_MAX: f64 = 0.98;

/// Share of the cost that a knee must save to be accepted, so that noise does not make one. A larger share misses weak
/// knees. `cargo test -p quadfringe --lib a_knee_is_found_and_undone` holds that a real one is found.
pub(super) const KNEE_GAIN: f64 = 0.02;

/// Cost in rad^2 that a knee must save in addition: the square of 2 mrad. Not measured: a smaller improvement does not
/// show in a shape.
pub(super) const KNEE_GAIN_RAD2: f64 = 4e-6;

/// Greatest two-step error in rad after correction for which a stack counts as ordered. A smaller value refuses noisy
/// captures; a larger one accepts stacks with exchanged images (`cargo test -p quadfringe --lib
/// images_out_of_order_are_noticed`).
pub(super) const RMS_MAX_RAD: f64 = 0.3;

/// Ratio of the error of one step to that of the median step above which the step counts as out of place. Smaller
/// values refuse captures with flicker; larger ones miss one exchanged image of many (`cargo test -p quadfringe --lib
/// the_step_out_of_place_is_named`).
pub(super) const STEP_EXCESS: f64 = 2.0;
/// Excess of that error over the median in rad, which the step needs as well. See [`STEP_EXCESS`].
pub(super) const STEP_EXCESS_RAD: f64 = 0.12;

/// Greatest level of the look-up table of intensities. Follows from the format: sixteen levels for each value of an
/// 8-bit camera, which it meets exactly. More levels take a larger table without a change of the cost.
pub(super) const LEVEL_MAX: f32 = 255.0 * 16.0;

/// Two-step error in rad above which the cost grows linearly (Huber), so that edges and drift have little weight.
/// Follows from the noise: 3 % of full scale makes errors of 0.06 to 0.07 rad at an amplitude of 0.45 to 0.5, which
/// stay quadratic.
pub(super) const HUBER_RAD: f32 = 0.1;

/// Least amplitude of the fringes of a usable pixel, fraction of full scale. Not measured: fainter fringes are
/// dominated by noise.
pub(super) const STACK_MODULATION_MIN: f32 = 0.05;

/// Intensity of the brightest step from which on a pixel counts as saturated, fraction of full scale: 250 of 255. Not
/// measured: it leaves a few values of an 8-bit camera, because highlights are compressed before they clip.
pub(super) const BRIGHT_MAX: f32 = 250.0 / 255.0;

/// Reach of the light that a saturated pixel spills over its neighbours, px. A larger reach discards more pixels around
/// highlights. Not measured.
pub(super) const SPILL_PX: usize = 2;

/// Share of the variance over the steps outside the first harmonic from which on a pixel does not vary as fringes do.
/// Follows from the harmonics of a power: a gamma of 4 has a share of 0.21, one of 1/4 up to 0.28.
pub(super) const DISORDER: f32 = 0.3;

/// Number of usable pixels for each disordered one below which a stack is refused. A larger number refuses stacks with
/// many edges and moving shadows (`cargo test -p quadfringe --lib unusable_stacks_are_named`).
pub(super) const USABLE_PER_DISORDERED: usize = 10;

/// Fewest pixels of an estimate. Fewer pixels let noise decide; more refuse small objects (`cargo test -p quadfringe
/// --lib unusable_stacks_are_named`).
pub(super) const PIXELS_MIN: usize = 1000;

/// Most pixels of an estimate, evenly spread. More take longer. Not measured: the noise of 20 000 pixels averages to
/// less than a hundredth of that of one.
pub(super) const PIXELS_MAX: usize = 20_000;

// The response from one shot.

/// Phase steps that the pixels of a tile are sorted into. More steps separate higher harmonics and have fewer pixels
/// each (`python evaluation/auto_response.py`).
pub(super) const PHASE_STEPS: usize = 16;

/// Side of a tile in fringes. With fewer than two, a slope of the albedo looks like a harmonic; larger tiles are fewer
/// (`python evaluation/auto_response.py`).
pub(super) const TILE_FRINGES: f32 = 2.5;

/// Least side of a tile in pixels. Follows from [`PHASE_STEPS`]: 24 x 24 pixels give each of 16 phase steps 36 of them.
pub(super) const TILE_SIDE_MIN_PX: usize = 24;

/// Least share of a tile with a known phase. A larger share loses the tiles at edges. Not measured.
pub(super) const KNOWN_MIN: f32 = 0.5;

/// Least number of pixels of a phase step, as a share of the mean number. Uneven tiles have gaps in their period. Not
/// measured.
pub(super) const EVENNESS_MIN: f32 = 0.25;

/// Greatest share of saturated pixels of a tile. A larger share lets clipped crests look like a response. Not measured.
pub(super) const SATURATED_MAX: f32 = 0.02;

/// Least amplitude of the fringes of a tile, fraction of full scale. It is smaller than [`STACK_MODULATION_MIN`],
/// because the mean of a hundred pixels has a tenth of their noise. Not measured.
pub(super) const TILE_MODULATION_MIN: f32 = 0.02;

/// Fewest tiles of an estimate for all channels together. With fewer tiles the texture of a single object decides
/// (`python evaluation/auto_response.py`).
pub(super) const TILES_MIN: usize = 48;
/// Fewest tiles of an estimate for a single channel that differs from the common one. See [`TILES_MIN`].
pub(super) const SINGLE_CHANNEL_TILES_MIN: usize = 60;
/// Fewest tiles of a channel that takes part. See [`TILES_MIN`].
pub(super) const CHANNEL_TILES_MIN: usize = 6;

/// Number of tiles from which on they do not overlap. Fewer tiles overlap by half, which makes up to four times as many
/// of a small image. Not measured: about twice [`TILES_MIN`].
pub(super) const MANY_TILES: usize = 100;

/// Decrease of the two-step error (as the root of the difference of squares, rad) that makes a response worth undoing.
/// A smaller value takes texture for a gamma; 0.02 rad corresponds to a gamma of about 1.1 (`python
/// evaluation/auto_response.py`).
pub(super) const GAIN_RAD: f64 = 0.02;

/// Every so many pixels along rows and columns the slope of the phase is taken. Not measured: its median needs no more.
pub(super) const SLOPE_STRIDE_PX: usize = 4;

/// Size of the simplex, in units of its first steps, at which the search ends. Follows from the step: 0.005 of 0.15
/// changes an exponent by less than 0.001.
pub(super) const SIMPLEX_TOLERANCE: f64 = 0.005;

/// Most rounds of the search. Not measured: it only stops a search that does not converge.
pub(super) const SIMPLEX_ROUNDS_MAX: usize = 200;
