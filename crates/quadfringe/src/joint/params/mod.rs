//! Every tuned number of the joint method, by the step that uses it.
//!
//! The comment of each number states its unit, what a larger or a smaller value trades, and the command that measured it. What half and
//! twice of each number change is in docs/method/sensitivity.md, by `python evaluation/sensitivity.py`.
//! Lengths in fringe periods scale with the fringes of the shot.
//!
//! "Varied" means that the number was multiplied by 0.7 and by 1.4 (integers were changed by at least 1), everything else was
//! unchanged, and the figures of `cargo run --release --example joint_figures` were compared. "Larger" and "smaller" name the
//! effect of a larger or smaller value. The shots are peaks without noise; peaks, steps and a face with noise of 3 %; the face
//! with squares of random albedo (textured); steps at a third of the light (dim). A change is reported if it moves a phase RMS
//! by 2 %, an RMS near edges by 3 %, the returned share by 0.05 points, wrong orders by 10 ppm, the promised wrong orders by 15
//! %, or the share of errors inside one standard deviation by 0.01. "No effect" means that no figure moved that much; such a
//! number is not critical on these shots. The rims of the dim steps are close to the limits of textured surfaces, so many
//! numbers change their RMS near edges by a fifth.

pub mod albedo;
pub mod energy;
pub mod illumination;
pub mod local_fit;
pub mod motion;
pub mod orders;
pub mod phase;
pub mod photometry;
pub mod pyramid;
pub mod regions;
pub mod saturation;
pub mod shadows;
pub mod slopes;
pub mod tasks;
pub mod uncertainty;
pub mod validity;
