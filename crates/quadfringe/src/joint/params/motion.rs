//! Step 7: motion between the channels. Measured by `cargo test --test motion -- --nocapture` and `quadfringe reproduce hand`;
//! "varied" here refers to the figures that the first command prints for planes at 100, 300 and 600 mm/s and for a hand three
//! times as fast as the hand of the bench (phase RMS 0.0059, 0.023, -, 0.011 rad; returned 100, 98, 13, 95 %; wrong orders of
//! the third 0.9 %).

/// Width (sigma) of the window in fringe periods. Follows from the window that averages whole fringes: motion varies slowly over a surface. Larger: less noise of the velocity.
/// Smaller: the motion of an object mixes less with the motion of its background. Varied x0.7: RMS of the planes +8 and +11 %,
/// of the hand -13 %; x1.4: -4, -16 and +22 %.
pub const WINDOW: f32 = super::local_fit::FIRST_WINDOW;

/// Factor of a Gauss-Newton step. Photometry and phase were fitted as if the surface stood still, and these fits explain about
/// half of the motion, so that a step with the factor 1 goes half of the way; any factor below 4 converges. A factor that was
/// estimated from the shot itself was wrong near edges. Varied x0.7: RMS of the planes +64 and +73 %; x1.4: the first +160 %,
/// 12 points of the second not returned.
pub const GAIN: f32 = 2.0;

/// Number of rounds of compensation and decoding. More: time, because each round decodes the whole shot. Varied: 2 rounds,
/// RMS of the planes +64 and +58 %; 4 rounds -16 and -30 %.
pub const ROUNDS: usize = 3;

/// Greatest phase by which motion may shift B against R, in rad; at a quarter of a fringe (1.57) both show the same. Larger:
/// pixels that move too fast are returned with a velocity that is too small. Smaller: fewer pixels are returned. Varied x0.7:
/// 12 % of the second plane are returned; x1.4: 21 % of the third, and 1.4 % of these have a wrong order.
pub const TURN_MAX: f32 = 0.75;
