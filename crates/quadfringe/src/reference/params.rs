//! Tuned numbers of the reference measurement, each with its unit, its trade-off and the command that measures it.

/// Least number of steps of a fringe number. Follows from the model: background, modulation and phase are three unknowns.
pub(super) const STEPS_MIN: usize = 3;

/// Least number of steps whose residual gives the noise by itself. With four steps the only residual is also the second
/// harmonic of the fringes, which a gamma raises far above the noise. Follows from the number of residuals, N - 3.
pub(super) const RESIDUAL_STEPS_MIN: usize = 5;

/// Default of the least modulation of a fringe number, fraction of full scale. A smaller value returns noise in shadows as
/// data; a larger one loses dark surfaces. `pytest tests/test_reference.py` holds the share of lit pixels that come back.
pub(super) const MODULATION_MIN: f32 = 0.02;

/// Greatest variance of a phase without its saturated samples, in units of the variance with all of them. A larger value
/// returns pixels in highlights with a phase that few samples determine. Not measured: at 10 the deviation is three times that
/// of the neighbours, which the uncertainty states.
pub(super) const SATURATED_LOSS_MAX: f64 = 10.0;

/// Least standard deviation of an intensity, fraction of full scale. Follows from the rounding of `f32`; it keeps the weights
/// of images without noise finite.
pub(super) const NOISE_MIN: f32 = 1e-6;

/// Number of image rows from which noise, disagreement and strays are estimated, and of columns between the sampled pixels.
/// More samples take longer; with 5,000 pixels the noise is certain to 1 %. Follows from the count.
pub(super) const SAMPLE_ROWS: usize = 16;
/// See [`SAMPLE_ROWS`].
pub(super) const SAMPLE_STRIDE: usize = 3;

/// Share of the samples, the smallest, of which a noise is the mean. A larger share is more exact where all pixels are sound;
/// a smaller one bears more edges, moving parts and flicker. Not measured.
pub(super) const KEPT_SHARE: f64 = 0.8;

/// Pixels that are more likely of a wrong order than this are no data. A smaller value removes right orders at edges with the
/// wrong ones. `python evaluation/reference.py` shows both shares on the captures.
pub(super) const WRONG_MAX: f32 = 0.5;

/// Share of strays with which the search for it starts, and its bounds. The start does not change the result; the lower bound
/// keeps the probability of a shot without strays above 0. Not measured.
pub(super) const STRAYS_START: f64 = 0.05;
/// See [`STRAYS_START`].
pub(super) const STRAYS_MIN: f64 = 1e-6;
/// See [`STRAYS_START`].
pub(super) const STRAYS_MAX: f64 = 0.9;
/// Number of rounds in which the share of strays and the disagreement settle. Not measured: later rounds change them by less
/// than 1e-6.
pub(super) const ROUNDS: usize = 40;

/// Half the degrees of freedom of the Student law of a cost (R8). With a larger number the law comes near to the normal one, and
/// phases that disturbances have moved count as strays although their order is right; with a smaller one other orders seem
/// likely. `python evaluation/reference.py` shows the promised and the counted wrong orders on the captures.
pub(super) const TAIL: usize = 2;

/// Quantile of the normal law beyond which a cost raises the uncertainty of its pixel. A smaller value makes the map noisier, a
/// larger one hides disturbed pixels. Follows from the share of undisturbed pixels above it, 1 %.
pub(super) const EXCESS_QUANTILE: f64 = 2.326;
