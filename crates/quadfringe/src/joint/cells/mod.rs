//! Maps on a grid of cells: quantities that vary slowly (offset, amplitude, beats) are kept once per cell.
//!
//! Planes of pixels are padded to whole vectors ([`LANES`]), cells are a power of two of pixels wide, so that every
//! vector holds whole cells and no loop has a remainder.

mod grid;
mod maps;
mod rows;
mod sums;

pub(super) use grid::Grid;
pub(super) use maps::{CellMaps, RowMaps};
pub(super) use rows::{blend, spread};
pub(super) use sums::{CellWindow, TaskWork};
