//! Step 11: the albedo of every pixel.

/// Rows of the blocks, 16 pixels wide, in which the variance of the texture is estimated. Fewer: the estimate has more noise. More:
/// noise returns farther around an edge. `pytest tests/test_albedo.py`.
pub const ROWS: usize = 8;

/// Cells whose albedo a pixel may have: 3 x 3 around it. Follows from the edge of a print, which one cell mixes.
pub const CANDIDATES: usize = 9;
