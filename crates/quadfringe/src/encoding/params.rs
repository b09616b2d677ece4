//! Tuned numbers of an encoding: unit, trade-off, and the test that holds them.

/// Least distance in phase space (rad) between two columns that counts as different. It leaves 0.15 rad of joint error to
/// each of the two; smaller values accept encodings in which noise decides, larger ones refuse encodings that decode
/// (`cargo test -p quadfringe --lib ambiguity`).
pub(super) const MARGIN_NEEDED_RAD: f64 = 0.3;
