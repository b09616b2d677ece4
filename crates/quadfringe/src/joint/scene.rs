//! One shot as the steps of the best method see it: four planes of light, the pixels that count, and a grid of cells.

use super::cells::Grid;

/// Four planes of linear light, row-major and padded, with a grid of cells over them.
#[derive(Clone, Copy)]
pub(crate) struct Scene<'a> {
    pub light: [&'a [f32]; 4],
    /// 1 for pixels that may take part in a fit, 0 for the others.
    pub usable: &'a [f32],
    pub grid: &'a Grid,
    /// Fringe period across the fringes in pixels.
    pub period_px: f64,
    /// Pixels of the camera along a side of a pixel, which is their mean.
    pub factor: usize,
}

impl<'a> Scene<'a> {
    /// Row `y` of a padded plane.
    pub fn row<'b, T>(&self, plane: &'b [T], y: usize) -> &'b [T] {
        &plane[y * self.grid.stride..][..self.grid.stride]
    }

    /// Row `y` of the four planes.
    pub fn rows(&self, y: usize) -> [&'a [f32]; 4] {
        self.light.map(|plane| self.row(plane, y))
    }

    /// A width given in fringe periods, in cells.
    pub fn cells(&self, periods: f32) -> f32 {
        periods * self.period_px as f32 / self.grid.step as f32
    }
}

/// Rows above, at and below row `y`; borders repeat.
pub(crate) fn around(y: usize, height: usize) -> [usize; 3] {
    [y.saturating_sub(1), y, (y + 1).min(height - 1)]
}
