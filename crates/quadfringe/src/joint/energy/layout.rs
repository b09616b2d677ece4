//! Where the tiles lie, and how much each counts at a cell.

use crate::joint::params::energy::{BLENDED, DISCARDED, SIDE};

/// The tiles along one direction: as few as overlap enough, evenly spread.
#[derive(Debug)]
pub(super) struct Axis {
    cells: usize,
    /// First cell of every tile.
    pub origins: Vec<usize>,
}

/// One tile that contains a cell.
pub(super) struct Place {
    /// Number of the tile along the axis.
    pub tile: usize,
    /// The cell, counted from the first of the tile.
    pub inner: usize,
    /// How much the tile counts: 0 in the discarded cells, rising to 1 over the blended ones.
    pub weight: f32,
}

impl Axis {
    pub fn new(cells: usize) -> Self {
        const OVERLAP: usize = 2 * DISCARDED + BLENDED;
        let more = cells.saturating_sub(SIDE);
        let gaps = more.div_ceil(SIDE - OVERLAP);
        Self { cells, origins: (0..=gaps).map(|n| n * more / gaps.max(1)).collect() }
    }

    /// The tiles that contain a cell. Nothing is missing beyond the border of the image, so no cell is discarded there.
    pub fn around(&self, cell: usize) -> impl Iterator<Item = Place> {
        let inside = self
            .origins
            .iter()
            .enumerate()
            .filter(move |(_, first)| (**first..**first + SIDE).contains(&cell));
        inside.map(move |(tile, &first)| {
            let low = if first == 0 { SIDE } else { cell - first };
            let high = if first + SIDE >= self.cells { SIDE } else { first + SIDE - 1 - cell };
            let depth = low.min(high) as f32 + 0.5 - DISCARDED as f32;
            Place { tile, inner: cell - first, weight: (depth / BLENDED as f32).clamp(0.0, 1.0) }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_cover_every_cell() {
        for cells in [1, SIDE - 1, SIDE, SIDE + 1, 5 * SIDE + 3] {
            let axis = Axis::new(cells);
            assert!(axis.origins.windows(2).all(|pair| pair[1] > pair[0]));
            let last = axis.origins[axis.origins.len() - 1];
            assert!(last + SIDE >= cells && (last == 0 || last + SIDE == cells));
            for cell in 0..cells {
                let weights: f32 = axis.around(cell).map(|place| place.weight).sum();
                assert!(weights > 0.99, "{cells} {cell} {weights}");
                assert!(axis.around(cell).all(|place| axis.origins[place.tile] + place.inner == cell));
            }
        }
    }
}
