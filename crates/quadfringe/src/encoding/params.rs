//! Tuned numbers of an encoding, each with its unit, its trade-off and the test that checks it.

/// Least fringe number, fringes over the projector width. A smaller one changes the phase by less than 0.007 rad over the
/// whole field, which noise hides, and the period in columns overflows as it nears 0. `cargo test -p quadfringe --test
/// bad_input` checks that less is refused.
pub(super) const FRINGE_NUMBER_MIN: f64 = 1e-3;

/// Greatest number of projector columns. No projector has a quarter of it; with more columns, single precision holds fewer than
/// eight bits of a fraction of a column, and the search for similar columns takes long.
/// `cargo test -p quadfringe --test bad_input` checks that more is refused.
pub(super) const PROJECTOR_WIDTH_MAX: usize = 65_536;

/// Two columns count as different if their distance in phase space is at least this, in rad. It leaves each of the two a
/// joint error of 0.15 rad. A smaller value accepts encodings whose orders noise decides; a larger one refuses encodings
/// that can be decoded (`cargo test -p quadfringe --lib ambiguity`).
pub(super) const MARGIN_NEEDED_RAD: f64 = 0.3;
