//! The grid: its sizes, and which rows of pixels and of cells belong together.

use crate::parallel::lanes::LANES;

/// Cells of `step` x `step` pixels over an image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::joint) struct Grid {
    pub height: usize,
    pub width: usize,
    /// Length of a padded row of pixels.
    pub stride: usize,
    /// Pixels along a side of a cell: 1, 2, 4, 8 or 16.
    pub step: usize,
    pub rows: usize,
    pub columns: usize,
}

/// Rows of cells above and below a row of the image.
pub(super) struct CellRows {
    pub above: usize,
    pub below: usize,
    /// Weight of the row below, in [0, 1).
    pub weight: f32,
}

impl Grid {
    /// Cells of at most `side` pixels.
    #[cfg(test)]
    pub fn new(shape: [usize; 2], side: f64) -> Self {
        Self::with_stride(shape, shape[1].next_multiple_of(LANES), side)
    }

    /// Cells of at most `side` pixels over planes with rows of `stride` pixels, whole vectors.
    pub fn with_stride([height, width]: [usize; 2], stride: usize, side: f64) -> Self {
        let step = 1 << (side.clamp(1.0, LANES as f64).log2() as usize);
        Self { height, width, stride, step, rows: height.div_ceil(step), columns: stride / step }
    }

    /// The same cells over an image with one pixel for every `factor` x `factor`.
    pub fn shrunk(&self, factor: usize) -> Self {
        Self {
            height: self.height.div_ceil(factor),
            width: self.width.div_ceil(factor),
            stride: self.stride / factor,
            step: self.step / factor,
            ..*self
        }
    }

    /// Pixels of a padded plane.
    pub fn pixels(&self) -> usize {
        self.stride * self.height
    }

    /// The rows of cells around row `y` of the image; level at the borders.
    pub(super) fn between(&self, y: usize) -> CellRows {
        let place = (y as f32 + 0.5) / self.step as f32 - 0.5;
        let above = place.floor();
        let clamp = |row: f32| row.clamp(0.0, (self.rows - 1) as f32) as usize;
        CellRows { above: clamp(above), below: clamp(above + 1.0), weight: place - above }
    }

    /// Rows of the image that stand for a row of cells: all of them, or `most` spread symmetrically.
    pub fn samples(&self, cell_row: usize, most: usize) -> impl Iterator<Item = usize> {
        let (step, height) = (self.step, self.height);
        let count = most.min(step);
        (0..count)
            .map(move |i| cell_row * step + (2 * i + 1) * step / (2 * count))
            .map(move |y| y.min(height - 1))
    }
}
