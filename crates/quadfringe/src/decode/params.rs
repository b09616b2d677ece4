//! Numbers of the decoder, each with its unit and reason.

use std::ops::RangeInclusive;

/// Least number of rows and of columns of an image: the width of the widest cell of the joint method. A smaller image has
/// no neighbourhood to fit; `cargo test -p quadfringe --test bad_input` checks that it is refused.
pub(super) const SIDE_MIN_PX: usize = 16;

/// Least fringe period that can be set, camera pixels. A fringe of fewer pixels has too few samples for its phase;
/// `cargo test -p quadfringe --test bad_input` checks that it is refused.
pub(super) const PERIOD_MIN_PX: f64 = 3.0;

/// Least number of rows that a thread takes at once. With more rows there are fewer tasks to share among threads; with
/// fewer rows the time between tasks grows. It changes no result, only the time: `cargo bench -p quadfringe -- shot`.
pub(crate) const ROWS_AT_ONCE: usize = 8;

/// Default of the least modulation of R and B of the published method, fraction of full scale. A smaller value returns noise in
/// shadows as data; a larger value loses dark surfaces. `cargo test -p quadfringe --test round_trip` holds the share of lit pixels
/// that come back.
pub(crate) const MODULATION_MIN: f32 = 0.02;

/// Default of the least quality of a returned order. A smaller value returns more wrong orders; a larger value loses correct
/// points with them. `python evaluation/accuracy.py` measures both shares.
pub(super) const QUALITY_MIN: f32 = 0.15;

/// Choices between detail and noise that can be set. Beyond them lies nothing new: cells of 1 px are as small as can be, and a
/// surface four times as stiff is smooth over more than two fringes; `python evaluation/world.py --only resolution --detail 4`.
pub(super) const DETAIL: RangeInclusive<f32> = 0.25..=4.0;
