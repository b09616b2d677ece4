//! Numbers of the virtual bench that trade exactness against time. `cargo test -p quadfringe --test forward` and
//! `--test forward_random` compare the bench with closed forms.

/// Half width of the kernel of the lens blur in standard deviations; a larger width takes longer. Follows from the
/// normal distribution: the part beyond 4 is 6e-5 of the light.
pub(super) const BLUR_REACH_SIGMAS: f64 = 4.0;

/// Greatest standard deviation of the lens blur, px, the same as in the settings of Python. The time of the blur grows with
/// it without end. `cargo test -p quadfringe --test forward` checks that more is refused.
pub(super) const BLUR_MAX_PX: f64 = 100.0;

/// A shadow ray ends this far in front of its surface point, mm. With a shorter gap, rounding can put the point into the
/// shadow of its surface; a longer gap misses objects that are nearer to the surface than the gap. Not measured: hits are
/// exact to 1e-10 mm.
pub(super) const SHADOW_GAP_MM: f64 = 1e-3;

/// Two neighbouring pixels have a step between them if their depths differ by more than this many footprints of a
/// pixel. A difference of 4 footprints is a slope of 76 degrees. A smaller number takes steep smooth surfaces for
/// steps. Not measured.
pub(super) const STEP_FOOTPRINTS: f64 = 4.0;

/// Greatest number of samples of a print along one side of a camera pixel. More samples place edges of fine prints more
/// exactly; eight samples resolve an eighth of a pixel. Not measured.
pub(super) const PRINT_SAMPLES_MAX: f64 = 8.0;

/// Share of the brightest light by which the quick light of fringes may be wrong before a pixel is computed exactly. A larger
/// share computes more pixels twice, at 1e-13 some twenty of a shot. Follows from the rounding of `f64`, some 1e-15 in all;
/// `cargo test -p quadfringe --lib quick` checks it.
pub(super) const QUICK_ERROR: f64 = 1e-13;

/// Greatest phase of fringes whose light is computed quickly, rad. Beyond it whole turns are no longer exact. Follows from
/// the 30 bits of the first part of 2 pi.
pub(super) const QUICK_PHASE_MAX_RAD: f64 = 1e6;

/// Pixels whose rays are cast together. With many more, their memory goes back to the system and comes again for each row of
/// pixels, which takes a fifth of the time of a cast; with few, vectors of rays stay half empty. `cargo test -p quadfringe
/// --test determinism` checks that results do not depend on it.
pub(super) const PIXELS_AT_ONCE: usize = 256;
