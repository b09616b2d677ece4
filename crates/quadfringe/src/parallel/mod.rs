//! Helpers of fast code: angles without branches, rows of pixels as vectors, aligned memory, and working memory that tasks
//! share one after another.

pub(crate) mod aligned;
pub(crate) mod angle;
pub(crate) mod lanes;
pub(crate) mod slots;

pub(crate) use aligned::{Aligned, first_of_line, spare};
