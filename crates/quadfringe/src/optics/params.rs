//! Numbers for the inverse of a lens distortion, in normalised coordinates (1 is the focal length). `cargo test -p
//! quadfringe --test forward_random` checks the inverse for random lenses.

/// Greatest number of Newton steps. Follows from the quadratic convergence: each step doubles the number of correct
/// digits, so that most lenses need fewer than ten steps. The others serve for halved steps near the fold of a strong
/// distortion. A higher limit changes no result, because the search ends when it converges.
pub(super) const ITERATIONS_MAX: usize = 30;

/// The search has converged when the distorted estimate is nearer to the given point than this. Follows from the rounding
/// of `f64` (2e-16): it is fifty times as much. A smaller value is below the rounding of the polynomial.
pub(super) const CONVERGED: f64 = 1e-14;

/// If no step improves the estimate, it is accepted as a solution up to this distance; 1e-7 px at a focal length of 1000
/// px. A larger value accepts points that the lens does not image there; a smaller one refuses solutions because of
/// rounding. `cargo test -p quadfringe --test forward_random` compares the solutions of random lenses with their points.
pub(super) const SOLVED: f64 = 1e-10;

/// The search stops when it would take less than this part of a Newton step, after twenty halvings: such a step changes
/// the point by less than the remaining error. Follows from the halving: 2^-20 is 1e-6.
pub(super) const STEP_PART_MIN: f64 = 1e-6;

/// Greatest number of reductions of the start value by [`START_FACTOR`]. Follows from the factor: sixty reductions leave
/// 5e-10 of the radius of a point, which lies before the fold of any real lens.
pub(super) const START_REDUCTIONS: usize = 60;

/// Factor by which a start value beyond the fold is moved towards the axis. A factor nearer to 1 needs more reductions; a
/// smaller one starts further from the solution. Not measured: only points beyond the fold need it.
pub(super) const START_FACTOR: f64 = 0.7;

/// Least determinant of the Jacobian of the distortion; it is 1 without distortion and 0 on the fold, where no Newton step
/// exists. Not measured: it only has to exceed the rounding of `f64`.
pub(super) const DETERMINANT_MIN: f64 = 1e-12;
