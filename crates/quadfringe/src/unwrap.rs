//! Three wrapped phases -> absolute phase.
//!
//! [`Ladder`] is the published way, point by point (optimum three-frequency selection, system (S4)). `Support`
//! chooses the fringe order by likelihood over all three phases, with the neighbours' help.

mod ladder;
mod support;

pub use ladder::{Ladder, Ordered, unwrap};
pub(crate) use support::{Evidence, Seen, Support};
