//! Numbers of the decoder: unit and reason.

/// Least size of an image in either direction, in pixels: one of the widest cells of the joint method. Fewer pixels hold no
/// neighbourhood to fit; `cargo test -p quadfringe --test bad_input` holds that smaller ones are refused.
pub(super) const SIDE_MIN_PX: usize = 16;

/// Fewest rows that a thread takes at once. More rows leave fewer tasks to share among threads; fewer rows cost more time
/// between tasks. It changes no result, only the time: `cargo bench -p quadfringe -- shot`.
pub(crate) const ROWS_AT_ONCE: usize = 8;
