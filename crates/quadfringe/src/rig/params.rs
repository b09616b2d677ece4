//! Numbers of the virtual bench that trade exactness against time. `cargo test -p quadfringe --test forward` and
//! `--test forward_random` hold the bench to its closed forms with them.

/// Half width of the kernel of the lens blur in standard deviations; a larger width takes longer. Follows from the
/// normal distribution: the part beyond 4 is 6e-5 of the light.
pub(super) const BLUR_REACH_SIGMAS: f64 = 4.0;

/// Length of a shadow ray that is left out in front of its surface point, mm. A shorter gap lets rounding put the point
/// in the shadow of the surface that it lies on; a longer gap misses objects that are nearer to the surface than the gap.
/// Not measured: hits are exact to 1e-10 mm.
pub(super) const SHADOW_GAP_MM: f64 = 1e-3;

/// Depth difference of neighbouring pixels above which a step lies between them, in footprints of a pixel. 4 is a wall
/// steeper than 76 degrees. A smaller number takes steep smooth surfaces for steps. Not measured.
pub(super) const STEP_FOOTPRINTS: f64 = 4.0;

/// Most samples of a print along one side of a camera pixel. More samples place edges of fine prints more exactly;
/// eight resolve an eighth of a pixel. Not measured.
pub(super) const PRINT_SAMPLES_MAX: f64 = 8.0;
