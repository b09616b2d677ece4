//! Tuned numbers of the joint method.

/// Greatest second difference of the phase, in rad, of a surface without discontinuities.
pub(super) const BEND_MAX: f32 = 0.3;
/// Greatest misfit of the four channels, root mean square, in units of the modulation.
pub(super) const MISFIT_MAX: f32 = 0.28;
