//! Tuned numbers of the stages, each with its unit, its trade-off and the command that measures it.
//!
//! `python evaluation/accuracy.py` (method `published`) measures the effect of a change on noise, texture and edges.

/// Number of image rows from which the fringe period and the statistics of a shot are estimated. More rows average out
/// objects and shadows; fewer rows take less time (`python evaluation/accuracy.py`).
pub(crate) const SAMPLE_ROWS: usize = 16;

/// Number of lines in each direction of which [`carrier`](super::carrier()) and
/// [`quadrature_carrier`](super::quadrature_carrier) average the spectrum. More lines average out objects; fewer lines
/// take less time. Not measured.
pub(crate) const CARRIER_LINES: usize = 48;

/// Least number of fringes over the image that counts as a carrier. A larger number ignores slow shading better; a
/// smaller number accepts coarser fringes. Fewer than 4 fringes lie in the spectrum of the illumination. Not measured.
pub(crate) const CARRIER_CYCLES_MIN: usize = 4;

/// Least share of the power above [`CARRIER_CYCLES_MIN`] that the carrier must have. A larger share rejects fringes on
/// textured or broken surfaces; a smaller one accepts noise. Coarse texture without fringes can have a larger share and
/// then counts as a carrier. `python evaluation/captures_report.py` and `cargo test -p quadfringe --test sizes` decode
/// shots whose carriers must be found.
pub(crate) const CARRIER_SHARE_MIN: f32 = 0.2;

/// Ratio of the ends of a carrier's band to its middle. A wider band holds more of the fringes on tilted and curved
/// surfaces; a narrower one lets fewer other waves in. `cargo test -p quadfringe --lib quadrature` bounds the error; from
/// 1.2 to 1.5 the periods of its scenes hardly change.
pub(crate) const CARRIER_BAND: f64 = 1.3;

/// Least share of the quadrature spectrum above [`CARRIER_CYCLES_MIN`] that the band of a carrier must have. A larger
/// share misses small objects; a smaller one takes texture and noise along the fringes for fringes. `cargo test -p
/// quadfringe --lib quadrature` bounds the error.
pub(crate) const QUADRATURE_SHARE_MIN: f32 = 0.3;

/// Least sum of the band of a carrier along rows or columns, divided by that along the other. A larger share misses
/// inclined fringes at the rim of the frame; a smaller one takes noise along the fringes for fringes. `cargo test -p
/// quadfringe --lib quadrature` bounds the error; from 0.1 to 0.3 the periods of its scenes hardly change.
pub(crate) const DIRECTION_SHARE_MIN: f64 = 0.3;

/// Step in pixels, in both directions, of the samples that tell which part of a frame is lit. A smaller step finds smaller
/// objects; a larger one takes less time. Follows from the least object: 20 px in a direction have five samples.
pub(crate) const LIT_STEP: usize = 4;

/// Side in pixels of the tiles whose fringes count alike (J39). Larger: a bright object outweighs the dim ground in its tile. Smaller: a
/// tile holds less of a wide fringe. `cargo test -p quadfringe --lib quadrature` bounds the error.
pub(crate) const EVEN_TILE_PX: usize = 32;

/// Step in pixels, in both directions, of the samples of a tile. A smaller step tells dimmer fringes from noise; a larger one takes
/// less time. `cargo test -p quadfringe --lib quadrature` bounds the error.
pub(crate) const EVEN_TILE_STEP: usize = 2;

/// Least correlation of neighbours in a tile that shows fringes. A larger value misses dim fringes; a smaller one takes noise for
/// fringes. Follows from the 256 samples of a tile: four standard deviations of what noise has.
pub(crate) const TILE_CORRELATION_MIN: f32 = 0.25;

/// Share of the mean variance of all tiles that counts as noise, which keeps faint shades of images without noise from counting as
/// fringes. Larger: the dim ground of bright objects counts less. Smaller: fainter shades count. `cargo test -p quadfringe --lib
/// quadrature` bounds the error.
pub(crate) const FAINT_SHARE: f32 = 1e-3;

/// Least number of lit samples of a line that takes part. A larger number leaves out the ends of an object; a smaller one takes
/// in bright pixels of the ground. Follows from the fit: a constant and a wave need a few pixels.
pub(crate) const LIT_SAMPLES_MIN: usize = 2;

/// Shares of the pixels that are not brighter than the dark ground and than the bright end of the light. A greater upper share
/// lets highlights darken the object; a smaller one misses objects that fill less of the frame. Not measured.
pub(crate) const LIT_QUANTILES: [f64; 2] = [0.1, 0.995];

/// Place between the dark ground and the bright end above which a pixel is lit. A larger value leaves out the dark halves of
/// fringes and dark surfaces; a smaller one takes in stray light. `cargo test -p quadfringe --lib quadrature` bounds the
/// error; from 0.1 to 0.25 the periods of its scenes hardly change.
pub(crate) const LIT_SHARE: f32 = 0.15;

/// Largest share of a frame that counts as a small part, whose light is taken by itself. A larger share also treats objects so
/// whose fringes are many; a smaller one leaves objects of two fringes to the spectra of whole lines. `pytest
/// tests/test_real_objects.py` decodes objects that fill 2 to 15 %.
pub(crate) const SMALL_PART: f64 = 0.25;

/// Least energy of a wave on the lit pixels of a line without its mean, divided by its energy with it. A larger value takes
/// weight from waves longer than the line; a smaller one lets noise pass for them. Follows from a wave: an arc of a seventh of
/// a period has less. From 0.02 to 0.1 the periods of `cargo test -p quadfringe --lib quadrature` hardly change.
pub(crate) const WAVE_ENERGY_MIN: f32 = 0.02;

/// Least power of a carrier divided by the power of the mean level. Follows from the rounding of `f32`, which leaves
/// less than 1e-12 of a flat line; fringes with an amplitude of 0.1 % of the level have 9e-8.
pub(crate) const CARRIER_POWER_MIN: f32 = 1e-8;

/// Least number of samples per fringe of G and IR after averaging over columns. The improved band ends at 2.3 times the
/// carrier, where 13 samples per fringe leave more than five: the phase moves by far less than half a turn from sample
/// to sample, and straight lines between samples stay within 4e-3 rad (`cargo test -p quadfringe --lib
/// the_phase_is_known_at_every_pixel`). A larger number averages less and takes longer.
pub(crate) const SAMPLES_PER_FRINGE_MIN: f32 = 13.0;

/// Shortest fringe period in camera pixels that is accepted. Follows from sampling: two-step and Fourier analysis need
/// at least 3 samples per fringe, because the third sample separates background, modulation and phase.
pub(crate) const PERIOD_MIN_PX: f64 = 3.0;

/// Rows of a block for each of its columns. More rows average more noise away and blur the orders at edges across the
/// rows. `python evaluation/accuracy.py` shows the effect on noise and edges.
pub(crate) const ROWS_PER_COLUMN: usize = 2;

/// Columns of the widest block: 1, 2 or 4. Wider blocks save time and blur edges along the rows. `python
/// evaluation/accuracy.py` shows the effect on edges, `cargo bench -p quadfringe -- shot` the time.
pub(crate) const BLOCK_COLUMNS_MAX: usize = 4;

/// Least number of samples per fringe with which the envelope searches for extrema. More samples place an extremum more
/// exactly; fewer average more noise away. The place of an extremum between samples comes from a parabola. `python
/// evaluation/accuracy.py` shows the effect on both.
pub(crate) const ENVELOPE_SAMPLES_PER_FRINGE: f32 = 8.0;

/// Width of the smoothing before the search for extrema, and the shortest half wave, as shares of a fringe period.
/// Larger values remove more false extrema by noise; smaller ones keep steep fringes. `python evaluation/accuracy.py`
/// shows the effect on both.
pub(crate) const ENVELOPE_SMOOTHING: f32 = 0.2;

/// Flanks of the Fourier bands, as multiples of the carrier frequency. A wider band follows steeper slopes (S3); a
/// narrower one passes less noise. Wider flanks ring less at edges. `quadfringe reproduce peaks` compares both bands.
pub(crate) struct BandEdges {
    /// The weight rises from 0 here ...
    pub zero_below: f32,
    /// ... to 1 here,
    pub full_from: f32,
    /// and falls from 1 here ...
    pub full_to: f32,
    /// ... to 0 here.
    pub zero_above: f32,
}

/// Half a carrier to each side of the carrier. `quadfringe reproduce peaks` compares both bands.
pub(crate) const TRADITIONAL_BAND: BandEdges =
    BandEdges { zero_below: 0.4, full_from: 0.6, full_to: 1.4, zero_above: 1.6 };

/// From zero to about twice the carrier. See [`TRADITIONAL_BAND`].
pub(crate) const IMPROVED_BAND: BandEdges =
    BandEdges { zero_below: 0.0, full_from: 0.3, full_to: 1.8, zero_above: 2.3 };

/// The transform joins the end of a row to its beginning by a passage, whose length is the length of the row divided by
/// this number. A longer passage makes the join smoother; a shorter one takes less time. `cargo test -p quadfringe
/// --lib fringes_go_on_in_phase_at_both_ends` checks the passage.
pub(crate) const PASSAGE_PART: usize = 10;

/// Lower bound of the margin below which an order counts as a stray. A larger value counts noise as strays; a smaller
/// one misses strays on noisy shots. `cargo test -p quadfringe --test uncertainty` bounds the probabilities that
/// follow.
pub(crate) const STRAY_MARGIN_MIN: f32 = 0.25;

/// Least standard deviation of a beat in rad. It keeps the probabilities of shots without noise away from 0 and 1. A
/// larger value overestimates the probability on clean shots. Not measured.
pub(crate) const BEAT_SIGMA_MIN_RAD: f32 = 0.02;

/// Step between the pixels of a sampled row that enter the statistics of a shot. Fewer pixels take less time and make
/// the median less exact. Follows from the standard error of a median: 16 rows of 1024 columns give 5,500 pixels, whose
/// median is certain to 2 %.
pub(crate) const SAMPLE_STRIDE: usize = 3;

/// Least number of samples of a row for the Fourier stage, of which the search for an extremum at each end needs an eighth.
/// Follows from the search; `cargo test -p quadfringe --test bad_input` checks that shorter rows are refused.
pub(crate) const ROW_MIN: usize = 8;

/// Distance between the pixels whose mean gives the gain of one image against another. A larger one misses small objects; a smaller
/// one takes longer. Not measured: a seventh of the pixels of an image has the same mean.
pub const MEAN_STRIDE: usize = 7;

/// Share of the squares left by one albedo that the shared brightness may leave, to be taken. A larger share lets a wrong response, of
/// which R and B make a brightness, move the fringes of others: with 1 a sound shot is refused (`pytest tests/test_doctor_board.py -k
/// response`). A smaller one takes texture for offsets. Other shares were not tried.
pub(crate) const SHARED_LEFT_MAX: f64 = 0.5;
/// Least albedo of R over that of B. Not measured: it keeps a quotient finite.
pub(crate) const BRIGHT_RATIO_MIN: f32 = 1e-3;
/// Added to the square of the light of a brightness of 1. Not measured: it keeps a quotient finite.
pub(crate) const BRIGHT_SQUARE_MIN: f32 = 1e-3;
/// Ridge of the normal equations of a tile, linear light squared. Not measured: it keeps a tile without light finite.
pub(crate) const OFFSET_RIDGE: f64 = 1e-6;
