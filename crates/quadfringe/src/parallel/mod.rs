//! Private helpers for vectors and threads: angles without branches, rows of pixels as vectors, memory aligned to cache
//! lines, and working memory that one task after another uses.

pub(crate) mod aligned;
pub(crate) mod angle;
pub(crate) mod exp;
pub(crate) mod lanes;
pub(crate) mod slots;

pub(crate) use aligned::{Aligned, first_of_line, spare};
