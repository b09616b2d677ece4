//! Step 7: motion between the channels. Measured by `cargo test --test motion -- --nocapture` and `quadfringe reproduce hand`.

/// Width (sigma) of the window in fringe periods: motion varies slowly over a surface. Larger: less noise of the velocity.
/// Smaller: less mixing of the motion of an object with that of its background. WINDOW_VARIED
pub const WINDOW: f32 = 0.5;

/// Rows of pixels that stand for a row of cells. ROWS_VARIED
pub const SAMPLED_ROWS: usize = 4;

/// Factor of a Gauss-Newton step. Photometry and phase were fitted as if the surface stood still, and have taken up about half of
/// the motion, so that a plain step goes half of the way; any factor below 4 converges. A factor measured on the shot itself went
/// astray near edges. GAIN_VARIED
pub const GAIN: f32 = 2.0;

/// Rounds of compensation and decoding. More: time, each a whole decode. ROUNDS_VARIED
pub const ROUNDS: usize = 3;

/// Greatest turn of B against R in rad; at a quarter of a fringe (1.57) both show the same. Larger: pixels that move too fast
/// pass for slower ones. Smaller: fewer pixels are returned. TURN_VARIED
pub const TURN_MAX: f32 = 0.75;
