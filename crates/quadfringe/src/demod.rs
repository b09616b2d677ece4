//! Planes -> wrapped phase: background, two-step (TPS), Fourier (FTP), N-step, and the local fit of all channels.

pub(crate) mod agreement;
mod aligned;
mod background;
pub(crate) mod backgrounds;
mod carrier;
pub(crate) mod cells;
mod fourier;
pub(crate) mod joint;
pub(crate) mod lanes;
pub(crate) mod light;
pub(crate) mod local_fit;
pub(crate) mod motion;
mod n_step;
pub(crate) mod residuals;
pub(crate) mod scene;
pub(crate) mod slopes;

mod two_step;
pub(crate) mod window;

pub(crate) use aligned::{Aligned, first_of_line, spare};
pub use background::{Background, background};
pub(crate) use background::{Scratch as BackgroundScratch, coarsen, draw_background};
pub(crate) use carrier::LineSpectrum;
pub use carrier::{Carrier, carrier};
pub use fourier::{Band, fourier};
pub(crate) use fourier::{Half, RowFilter, RowScratch};
pub use n_step::{NStep, n_step};
pub use two_step::two_step;
