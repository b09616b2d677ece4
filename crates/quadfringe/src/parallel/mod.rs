//! Helpers of all code that has to be fast: angles in whole vectors, rows of pixels as vectors, aligned memory, and
//! working memory that tasks hand on to each other.

pub(crate) mod aligned;
pub(crate) mod angle;
pub(crate) mod lanes;
pub(crate) mod slots;

pub(crate) use aligned::{Aligned, first_of_line, spare};
