//! Three wrapped phases -> absolute phase.
//!
//! [`Ladder`] is the published way, point by point (optimum three-frequency selection, system (S4)). `Support`
//! chooses the fringe order by likelihood over all three phases, with the neighbours' help. `AlongRay` searches the camera
//! ray of each pixel with both projectors calibrated.

mod along_ray;
mod ladder;
mod support;

pub(crate) use along_ray::AlongRay;
pub use along_ray::RayRow;
pub use ladder::{Ladder, Ordered, unwrap};
pub(crate) use support::{Evidence, Seen, Support};
