//! Absolute phase to millimetres: triangulation (S7), per-pixel polynomial (S6) and analytic geometry (S5).
//!
//! [`Triangulator`] gives X, Y, Z in the camera frame from the projector column of each pixel and needs both devices
//! calibrated; [`PairTable`] needs both projectors and says what the infrared one shows along each camera ray.
//! [`PolynomialHeight`] needs only planes at known heights. [`CrossedAxes`] is the closed form for an ideal
//! layout, for teaching and for checking a simulation.

mod crossed_axes;
mod pair_table;
mod polynomial;
mod triangulator;

pub use crossed_axes::CrossedAxes;
pub use pair_table::PairTable;
pub use polynomial::PolynomialHeight;
pub use triangulator::Triangulator;
