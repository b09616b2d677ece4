//! Numbers of the inverse of a lens distortion, in normalised coordinates (1 is the focal length).
//! `cargo test -p quadfringe --test forward_random` holds the inverse for random lenses.

/// Most Newton steps. Follows from the quadratic convergence: each step doubles the number of correct digits, so that most
/// lenses need fewer than ten; halved steps near the fold of a strong distortion take the others. More steps change no
/// result, because the search ends when it converges.
pub(super) const ITERATIONS_MAX: usize = 30;

/// Distance between the distorted estimate and the given point at which the search has converged. Follows from the rounding
/// of `f64` (2e-16), of which it is some tens. A smaller value is below the rounding of the polynomial.
pub(super) const CONVERGED: f64 = 1e-14;

/// Distance up to which the last estimate is a solution when no step improves it; 1e-7 px at a focal length of 1000 px. A
/// larger value accepts points that the lens does not image there; a smaller one refuses rounding. `cargo test -p
/// quadfringe --test forward_random` compares the solutions of random lenses with their points.
pub(super) const SOLVED: f64 = 1e-10;

/// Part of a Newton step below which the search stops, after twenty halvings: so short a step changes the point by less
/// than the error that remains. Follows from the halving: 2^-20 is 1e-6.
pub(super) const STEP_PART_MIN: f64 = 1e-6;

/// Most reductions of the start value by [`START_FACTOR`]. Follows from the factor: sixty of them take a point to 5e-10 of
/// its radius, which lies before the fold of any real lens.
pub(super) const START_REDUCTIONS: usize = 60;

/// Factor that moves a start value beyond the fold towards the axis. Nearer 1 takes more reductions; smaller values start
/// further from the solution. Not measured: only points beyond the fold need it.
pub(super) const START_FACTOR: f64 = 0.7;

/// Least determinant of the Jacobian of the distortion; it is 1 without distortion and 0 on the fold, where no Newton step
/// exists. Not measured: it only has to exceed the rounding of `f64`.
pub(super) const DETERMINANT_MIN: f64 = 1e-12;
