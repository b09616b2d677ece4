//! Sizes of tasks and blocks. They change no result, only the time (`cargo bench -p quadfringe -- shot`).

/// Number of pixel rows that one task works on. More: fewer rows at the border of blocks are computed twice. Fewer: less
/// working memory, and more tasks to share among threads. Time: `cargo bench -p quadfringe -- shot`.
pub const ROWS: usize = 32;

/// As [`ROWS`] for the choice of places, which holds several rows of every place.
pub const PLACE_ROWS: usize = 16;

/// Number of columns of nodes that one task sweeps vertically. Their costs in one row are adjacent in memory. More: fewer
/// tasks to share among threads. Time: `cargo bench -p quadfringe -- shot`.
pub const SWEEP_COLUMNS: usize = 16;

/// Number of pixels of a row that are scanned at once. Follows from the vectors: four of 16 bytes.
pub const GROUP: usize = 64;
