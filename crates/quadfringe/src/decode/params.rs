//! Numbers of the decoder: unit and reason.

/// Least size of an image in either direction, in pixels: one of the widest cells of the joint method. Fewer pixels hold no
/// neighbourhood to fit; `cargo test -p quadfringe --test bad_input` holds that smaller ones are refused.
pub(super) const SIDE_MIN_PX: usize = 16;
