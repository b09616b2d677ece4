//! The stages of the published method, each standing by itself: background, carrier, two-step (TPS), Fourier (FTP), N-step,
//! and fringe orders by a ladder of beats or along the camera ray.

mod along_ray;
mod background;
mod carrier;
mod fourier;
mod ladder;
mod n_step;
mod two_step;

pub(crate) use along_ray::AlongRay;
pub use along_ray::RayRow;
pub use background::{Background, background};
pub(crate) use background::{Scratch as BackgroundScratch, coarsen, draw_background};
pub(crate) use carrier::LineSpectrum;
pub use carrier::{Carrier, carrier};
pub use fourier::{Band, fourier};
pub(crate) use fourier::{Half, RowFilter, RowScratch};
pub use ladder::{Ladder, Ordered, unwrap};
pub use n_step::{NStep, n_step};
pub use two_step::two_step;
