//! Blocks of pixels that are triangulated together, as vectors.

/// Number of pixels in a block.
pub(super) const BLOCK: usize = 64;

/// Normalised directions `(x, y, 1)` of the rays of a block.
pub(super) struct Directions {
    pub x: [f32; BLOCK],
    pub y: [f32; BLOCK],
}

/// Intermediate values of a block. If a block has fewer columns than [`BLOCK`], the last entries are not valid.
pub(super) struct Block {
    pub directions: Directions,
    /// Ideal normalised coordinates of the columns.
    pub ideal: [f32; BLOCK],
    /// Derivative of the ideal coordinate with respect to the column, 1 / px.
    pub stretch: [f32; BLOCK],
    /// Depth, mm.
    pub depth: [f32; BLOCK],
    /// Derivative of the depth with respect to the column, mm / px.
    pub growth: [f32; BLOCK],
}

impl Block {
    pub fn new() -> Self {
        let row = [0.0; BLOCK];
        Self { directions: Directions { x: row, y: row }, ideal: row, stretch: row, depth: row, growth: row }
    }

    /// Writes the points `t x, t y, t` pixel by pixel.
    #[inline(always)]
    pub fn write_points(&self, xyz: &mut [f32]) {
        let Directions { x, y } = &self.directions;
        let (points, _) = xyz.as_chunks_mut::<3>();
        for (((point, x), y), t) in points.iter_mut().zip(x).zip(y).zip(&self.depth) {
            *point = [t * x, t * y, *t];
        }
    }

    /// Converts standard deviations of columns in px to standard deviations of depths in mm.
    #[inline(always)]
    pub fn scale_uncertainty(&self, uncertainty: &mut [f32]) {
        for (value, growth) in uncertainty.iter_mut().zip(&self.growth) {
            *value *= growth.abs();
        }
    }
}
