//! Numbers of the decoder, each with its unit and reason.

/// Least number of rows and of columns of an image: the width of the widest cell of the joint method. A smaller image has
/// no neighbourhood to fit; `cargo test -p quadfringe --test bad_input` checks that it is refused.
pub(super) const SIDE_MIN_PX: usize = 16;

/// Least number of rows that a thread takes at once. With more rows there are fewer tasks to share among threads; with
/// fewer rows the time between tasks grows. It changes no result, only the time: `cargo bench -p quadfringe -- shot`.
pub(crate) const ROWS_AT_ONCE: usize = 8;
