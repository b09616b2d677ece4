//! Numbers of the ray march, each with its unit, its trade-off and the test that checks it. `cargo test -p quadfringe --test
//! forward_random` compares hits of random rays with closed forms.

/// Shortest step of the march, mm. The march can miss objects that are thinner than this along the ray; a shorter step
/// takes longer where a ray passes a surface at a small angle. `cargo test -p quadfringe --test forward_random`
/// compares hits with closed forms.
pub(super) const STEP_MIN_MM: f64 = 0.05;

/// Greatest number of steps of the march along a ray. A ray that needs more of them meets nothing; without this limit, a ray
/// inside an endless relief would never end. It is 5 m in steps of [`STEP_MIN_MM`], more than the scenes of any test need.
/// `cargo test -p quadfringe --lib march` checks that such a ray ends.
pub(super) const STEPS_MAX: usize = 100_000;

/// The search ends when the bracket around a crossing is narrower than this, mm. Follows from the rounding of `f64`,
/// which is 1e-13 mm at 1 m; the search may never reach a smaller width.
pub(super) const CLOSED_MM: f64 = 1e-10;

/// Greatest number of steps that narrow a bracket. Follows from bisection, which narrows 0.05 mm to 1e-10 mm in 29
/// steps, so this limit never ends the search early.
pub(super) const REFINEMENTS_MAX: usize = 100;

/// Step of the finite differences of the default normal, mm. A longer step rounds edges; a shorter one loses digits.
/// `cargo test -p quadfringe --test forward_random` compares normals with closed forms.
pub(super) const NORMAL_STEP_MM: f64 = 1e-3;

/// Side of the cells that list which parts of a blend count in them, mm. With smaller cells each lists fewer parts, but to
/// make them takes longer. Not measured finely: a cast of the hand takes about the same time from 3 mm to 6 mm.
pub(super) const CELL_MM: f64 = 4.0;

/// What cells leave for rounding, mm. Follows from the rounding of `f64`, which is 1e-13 mm at 1 m; the tests of
/// `surface::cells` compare values bit by bit.
pub(super) const CELL_SLACK_MM: f64 = 1e-6;

/// Shortest step from cell to cell of a ray that passes a blend, mm; a ray that needs a shorter one is marched. Steps
/// shorter than a cell seldom end well, and cost more than they save. Not measured finely.
pub(super) const CELL_STEP_MIN_MM: f64 = 0.5;
