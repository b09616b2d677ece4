//! Absolute phase to millimetres: triangulation (S7), per-pixel polynomial (S6) and analytic geometry (S5).
//!
//! [`Triangulator`] gives X, Y, Z in the camera frame from the projector column of each pixel and needs both devices
//! calibrated. [`PolynomialHeight`] needs only planes at known heights. [`CrossedAxes`] is the closed form for an ideal
//! layout, for teaching and for checking a simulation.

mod crossed_axes;
mod polynomial;
mod triangulator;

pub use crossed_axes::CrossedAxes;
pub use polynomial::PolynomialHeight;
pub use triangulator::Triangulator;
