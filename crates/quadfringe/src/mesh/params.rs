//! Tuned numbers of the mesh, each with its unit, its trade-off and the command that measures it.

/// Cotangent of the least angle between a piece of surface and the line of sight, 10 degrees. Two neighbouring points whose
/// connection is nearer to the line of sight belong to two surfaces. Larger: connections over small steps in depth stay.
/// Smaller: the flanks of round objects are cut off, on a face 0.08 % of the neighbours at 14 degrees and 0.03 % at 10
/// degrees; no triangle crosses a step at either (`python evaluation/mesh.py --limits`).
pub(super) const COTANGENT: f64 = 5.67;

/// Number of standard deviations by which noise may move two neighbours apart along the line of sight. Fewer: noisy
/// surfaces fall apart, on a face 0.05 % of the neighbours in place of 0.03 % with none. More: connections over steps stay
/// where the noise is large (`python evaluation/mesh.py --limits`).
pub(super) const DEVIATIONS: f64 = 3.0;

/// Greatest number of pixels of a hole that may be filled. A larger hole hides shapes that its rim does not show. The time
/// grows with its square. Not measured.
pub(super) const HOLE_MAX_PX: usize = 1000;

/// Change of a filled value, as a share of it, below which the relaxation ends. Follows from the rounding of `f32`, 6e-8,
/// in which points are given.
pub(super) const FILL_TOLERANCE: f64 = 1e-8;

/// Greatest number of sweeps of the relaxation. Follows from [`HOLE_MAX_PX`]: a round hole of that size is 36 pixels wide,
/// and the slowest part of the error falls by 0.4 % in each sweep.
pub(super) const FILL_SWEEPS: usize = 5000;

/// Median of the size of a normal value, in standard deviations. Follows from the normal distribution.
pub(super) const NORMAL_MEDIAN: f64 = 0.6745;

/// Every such row is asked how much the errors of neighbours have in common. More: faster. Fewer: more samples. Not
/// measured: 1024 x 768 pixels leave some 100 000 samples.
pub(super) const CORRELATION_ROWS: usize = 8;

/// Least number of samples for the same; with fewer the errors count as independent, and the stated uncertainty of normals
/// is too large. The median of so many samples is right within 12 %. Follows from the median of normal values.
pub(super) const CORRELATION_SAMPLES_MIN: usize = 100;
