//! Absolute phase to millimetres: triangulation (S7), per-pixel polynomial (S6) and analytic geometry (S5).
//!
//! [`Triangulator`] gives X, Y, Z in the camera frame from the projector column of each pixel; it needs camera and projector
//! calibrated. [`PairTable`] needs both projectors calibrated; it stores the infrared phase along each camera ray.
//! [`PolynomialHeight`] needs only planes at known heights. [`CrossedAxes`] is the closed form for an ideal layout, for
//! teaching and for checking a simulation.

mod crossed_axes;
mod pair_table;
mod params;
mod polynomial;
mod triangulator;

pub use crossed_axes::CrossedAxes;
pub use pair_table::PairTable;
pub use polynomial::{HeightPlane, PolynomialHeight};
pub use triangulator::Triangulator;
