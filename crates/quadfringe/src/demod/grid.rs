//! Maps on a coarse grid: what varies slowly (background, modulation, beats) is kept once per cell.

use rayon::prelude::*;

/// Cells of `step` x `step` pixels over an image.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Grid {
    pub step: usize,
    pub rows: usize,
    pub columns: usize,
    /// Per image column: left cell, right cell, weight of the right one.
    taps: Vec<(u32, u32, f32)>,
}

impl Grid {
    pub fn new(height: usize, width: usize, step: usize) -> Self {
        let columns = width.div_ceil(step);
        let taps = (0..width).map(|x| taps(x, step, columns)).collect();
        Self { step, rows: height.div_ceil(step), columns, taps }
    }

    pub fn cells(&self) -> usize {
        self.rows * self.columns
    }

    /// Row `y` of the image interpolated from the cells, bilinear and level at the borders.
    pub fn sample_row(&self, map: &[f32], y: usize, mix: &mut Vec<f32>, out: &mut [f32]) {
        let (top, bottom, weight) = taps(y, self.step, self.rows);
        let line = |row: u32| &map[row as usize * self.columns..][..self.columns];
        mix.clear();
        let pairs = line(top).iter().zip(line(bottom));
        mix.extend(pairs.map(|(t, b)| t + (b - t) * weight));
        for (value, &(left, right, weight)) in out.iter_mut().zip(&self.taps) {
            let (l, r) = (mix[left as usize], mix[right as usize]);
            *value = l + (r - l) * weight;
        }
    }

    /// Gaussian smoothing of one map in place, `sigma` in cells; the window is cut at the borders, so sums stay sums
    /// and only ratios of smoothed maps have a meaning.
    pub fn smooth(&self, map: &mut [f32], sigma: f32, scratch: &mut Vec<f32>) {
        let kernel = kernel(sigma);
        scratch.clear();
        scratch.resize(map.len(), 0.0);
        let (rows, columns) = (self.rows, self.columns);
        let reach = kernel.len() / 2;
        for (source, target) in map.chunks_exact(columns).zip(scratch.chunks_exact_mut(columns)) {
            for (k, weight) in kernel.iter().enumerate() {
                let (from, to) = (reach.saturating_sub(k), (columns + reach - k).min(columns));
                if from < to {
                    let shifted = &source[from + k - reach..to + k - reach];
                    let pairs = target[from..to].iter_mut().zip(shifted);
                    pairs.for_each(|(t, s)| *t += weight * s);
                }
            }
        }
        map.fill(0.0);
        for (row, target) in map.chunks_exact_mut(columns).enumerate() {
            for (k, weight) in kernel.iter().enumerate() {
                if let Some(other) = (row + k).checked_sub(reach).filter(|&r| r < rows) {
                    let source = &scratch[other * columns..][..columns];
                    target.iter_mut().zip(source).for_each(|(t, s)| *t += weight * s);
                }
            }
        }
    }

    /// [`Self::smooth`] for a map of means, level at the borders.
    pub fn average(&self, map: &mut [f32], sigma: f32) {
        let mut weight = vec![1.0; map.len()];
        self.smooth(map, sigma, &mut Vec::new());
        self.smooth(&mut weight, sigma, &mut Vec::new());
        map.iter_mut().zip(weight).for_each(|(m, w)| *m /= w);
    }

    /// Least or greatest value within `reach` cells in both directions.
    pub fn extreme(&self, map: &[f32], reach: usize, pick: fn(f32, f32) -> f32) -> Vec<f32> {
        let (rows, columns) = (self.rows, self.columns);
        let mut along = map.to_vec();
        for (source, target) in map.chunks_exact(columns).zip(along.chunks_exact_mut(columns)) {
            for (x, value) in target.iter_mut().enumerate() {
                let near = &source[x.saturating_sub(reach)..(x + reach + 1).min(columns)];
                *value = near.iter().copied().fold(*value, pick);
            }
        }
        let mut out = along.clone();
        for (row, target) in out.chunks_exact_mut(columns).enumerate() {
            for other in row.saturating_sub(reach)..(row + reach + 1).min(rows) {
                let source = &along[other * columns..][..columns];
                target.iter_mut().zip(source).for_each(|(t, &s)| *t = pick(*t, s));
            }
        }
        out
    }

    /// [`Self::smooth`] for many maps at once.
    pub fn smooth_all(&self, maps: &mut [Vec<f32>], sigma: f32) {
        maps.par_iter_mut().for_each_init(Vec::new, |scratch, map| self.smooth(map, sigma, scratch));
    }
}

fn taps(at: usize, step: usize, cells: usize) -> (u32, u32, f32) {
    let place = (at as f32 + 0.5) / step as f32 - 0.5;
    let left = place.floor();
    let clamp = |cell: f32| cell.clamp(0.0, (cells - 1) as f32) as u32;
    (clamp(left), clamp(left + 1.0), place - left)
}

fn kernel(sigma: f32) -> Vec<f32> {
    let reach = (3.0 * sigma).ceil().max(1.0) as i32;
    let weights = (-reach..=reach).map(|k| (-0.5 * (k as f32 / sigma).powi(2)).exp());
    let weights: Vec<f32> = weights.collect();
    let sum: f32 = weights.iter().sum();
    weights.into_iter().map(|w| w / sum).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slope_on_the_cells_is_a_slope_on_the_pixels() {
        let grid = Grid::new(20, 30, 4);
        let map: Vec<f32> = (0..grid.cells()).map(|i| (i % grid.columns) as f32 * 4.0 + 1.5).collect();
        let mut row = vec![0.0; 30];
        grid.sample_row(&map, 7, &mut Vec::new(), &mut row);
        for (x, value) in row.iter().enumerate().take(28).skip(2) {
            assert!((value - x as f32).abs() < 1e-4, "{x} {value}");
        }
    }

    #[test]
    fn smoothing_keeps_a_constant_ratio_at_the_border() {
        let grid = Grid::new(40, 40, 4);
        let (mut one, mut three) = (vec![1.0; 100], vec![3.0; 100]);
        grid.smooth(&mut one, 2.0, &mut Vec::new());
        grid.smooth(&mut three, 2.0, &mut Vec::new());
        assert!(one.iter().zip(&three).all(|(a, b)| (b / a - 3.0).abs() < 1e-5));
    }
}
