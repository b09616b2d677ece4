//! Numbers of the ray march: unit, trade-off, and what holds them. `cargo test -p quadfringe --test forward_random` compares
//! hits of random rays with closed forms.

/// Shortest step of the march, mm. Objects thinner than this along the ray may be missed; a shorter step takes longer
/// where a ray passes a surface at a small angle. `cargo test -p quadfringe --test forward_random` compares hits with
/// closed forms.
pub(super) const STEP_MIN_MM: f64 = 0.05;

/// Width at which the bracket around a crossing counts as closed, mm. Follows from the rounding of `f64`, which is
/// 1e-13 mm at 1 m; a smaller width may never be reached.
pub(super) const CLOSED_MM: f64 = 1e-10;

/// Most steps that close a bracket. Follows from bisection, which alone closes 0.05 mm to 1e-10 mm in 29 steps, so this
/// never ends the search early.
pub(super) const REFINEMENTS_MAX: usize = 100;

/// Step of the finite differences of the default normal, mm. A longer step rounds edges; a shorter one loses digits.
/// `cargo test -p quadfringe --test forward_random` compares normals with closed forms.
pub(super) const NORMAL_STEP_MM: f64 = 1e-3;
