//! Step 7: motion between the channels. Measured by `cargo test --test motion -- --nocapture` and `quadfringe reproduce hand`;
//! "varied" here refers to the figures that the first prints for planes of 100, 300 and 600 mm/s and for a hand three times as
//! fast as that of the bench (phase RMS 0.0059, 0.023, -, 0.011 rad; returned 100, 98, 13, 95 %; wrong orders of the third
//! 0.9 %).

/// Width (sigma) of the window in fringe periods: motion varies slowly over a surface. Larger: less noise of the velocity.
/// Smaller: less mixing of the motion of an object with that of its background. Varied x0.7: RMS of the planes +8 and +11 %, of
/// the hand -13 %; x1.4: -4, -16 and +22 %.
pub const WINDOW: f32 = 0.5;

/// Rows of pixels that stand for a row of cells. More: time. Varied: 3 rows +5 % for the first plane, 6 rows -4 % for the hand.
pub const SAMPLED_ROWS: usize = 4;

/// Factor of a Gauss-Newton step. Photometry and phase were fitted as if the surface stood still, and have taken up about half
/// of the motion, so that a plain step goes half of the way; any factor below 4 converges. A factor measured on the shot itself
/// went astray near edges. Varied x0.7: RMS of the planes +64 and +73 %; x1.4: the first +160 %, 12 points of the second not
/// returned.
pub const GAIN: f32 = 2.0;

/// Rounds of compensation and decoding. More: time, each a whole decode. Varied: 2 rounds, RMS of the planes +64 and +58 %; 4
/// rounds -16 and -30 %.
pub const ROUNDS: usize = 3;

/// Greatest turn of B against R in rad; at a quarter of a fringe (1.57) both show the same. Larger: the velocity of pixels that
/// move too fast is too small. Smaller: fewer pixels are returned. Varied x0.7: 12 % of the second plane are returned; x1.4:
/// 21 % of the third, of which 1.4 % have a wrong order.
pub const TURN_MAX: f32 = 0.75;
