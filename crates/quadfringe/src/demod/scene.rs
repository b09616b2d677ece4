//! One shot as the steps of the best method see it: four planes of light, the pixels that count, and a grid of cells.

use super::grid::Grid;
use rayon::prelude::*;

/// Four planes of linear light, row-major, with a grid of cells over them.
#[derive(Clone, Copy)]
pub(crate) struct Scene<'a> {
    pub light: [&'a [f32]; 4],
    /// Pixels that may take part in a fit.
    pub usable: &'a [bool],
    pub width: usize,
    pub grid: &'a Grid,
    /// Fringe period across the fringes in pixels.
    pub period_px: f64,
}

impl<'a> Scene<'a> {
    pub fn height(&self) -> usize {
        self.light[0].len() / self.width
    }

    pub fn pixels(&self) -> usize {
        self.light[0].len()
    }

    /// Row `y` of the four planes.
    pub fn rows(&self, y: usize) -> [&'a [f32]; 4] {
        self.light.map(|plane| &plane[y * self.width..][..self.width])
    }

    /// A width given in fringe periods, in cells.
    pub fn cells(&self, periods: f32) -> f32 {
        periods * self.period_px as f32 / self.grid.step as f32
    }

    /// Sums over the pixels of every cell of `N` terms given per pixel (light of the four channels, index of the pixel).
    pub fn sums<const N: usize>(&self, terms: impl Fn([f32; 4], usize) -> [f32; N] + Sync) -> Vec<Vec<f32>> {
        let (step, width, height) = (self.grid.step, self.width, self.height());
        let rows: Vec<Vec<[f32; N]>> = (0..self.grid.rows)
            .into_par_iter()
            .map(|cell_row| {
                let mut sums = vec![[0.0f32; N]; self.grid.columns];
                for y in cell_row * step..((cell_row + 1) * step).min(height) {
                    let rows = self.rows(y);
                    for x in 0..width {
                        let add = terms(rows.map(|row| row[x]), y * width + x);
                        let cell = &mut sums[x / step];
                        cell.iter_mut().zip(add).for_each(|(c, a)| *c += a);
                    }
                }
                sums
            })
            .collect();
        (0..N).map(|k| rows.iter().flatten().map(|cell| cell[k]).collect()).collect()
    }

    /// The same over usable pixels only, smoothed by a Gaussian of `periods` fringe periods (sigma).
    pub fn window_sums<const N: usize>(
        &self,
        periods: f32,
        terms: impl Fn([f32; 4], usize) -> [f32; N] + Sync,
    ) -> Vec<Vec<f32>> {
        let mut sums = self.sums(|light, at| if self.usable[at] { terms(light, at) } else { [0.0; N] });
        self.grid.smooth_all(&mut sums, self.cells(periods));
        sums
    }
}

impl Scene<'_> {
    /// A map given on the cells, at every pixel.
    pub fn spread_out(&self, cells: &Vec<f32>) -> Vec<f32> {
        let mut map = vec![0.0; self.pixels()];
        map.par_chunks_mut(self.width).enumerate().for_each_init(RowMaps::default, |row_maps, (y, out)| {
            out.copy_from_slice(row_maps.sample(self, y, [cells])[0])
        });
        map
    }
}

/// Slow maps interpolated along one row.
#[derive(Debug, Default)]
pub(crate) struct RowMaps {
    mix: Vec<f32>,
    rows: Vec<Vec<f32>>,
}

impl RowMaps {
    /// Maps given on the cells of `scene`, at row `y` of the image.
    pub fn sample<const N: usize>(
        &mut self,
        scene: &Scene<'_>,
        y: usize,
        maps: [&Vec<f32>; N],
    ) -> [&[f32]; N] {
        self.rows.resize_with(self.rows.len().max(N), Vec::new);
        for (row, map) in self.rows.iter_mut().zip(maps) {
            row.resize(scene.width, 0.0);
            scene.grid.sample_row(map, y, &mut self.mix, row);
        }
        std::array::from_fn(|i| self.rows[i].as_slice())
    }
}

/// Every pixel with its eight neighbours, folded column by column and then along; borders repeat.
pub(crate) fn neighbourhoods(
    map: &[f32],
    width: usize,
    out: &mut [f32],
    column: impl Fn([f32; 3]) -> f32 + Sync,
    across: impl Fn([f32; 3]) -> f32 + Sync,
) {
    let height = map.len() / width;
    out.par_chunks_mut(width).enumerate().for_each_init(Vec::new, |folded, (y, out)| {
        let rows = [y.saturating_sub(1), y, (y + 1).min(height - 1)].map(|row| &map[row * width..][..width]);
        folded.clear();
        folded.extend((0..width).map(|x| column(rows.map(|row| row[x]))));
        for (x, value) in out.iter_mut().enumerate() {
            *value = across([x.saturating_sub(1), x, (x + 1).min(width - 1)].map(|i| folded[i]));
        }
    });
}

/// [1 2 1] / 4 in both directions: albedo is not sharper than the lens. `spare` is working memory.
pub(crate) fn smooth_albedo(albedo: &mut Vec<f32>, spare: &mut Vec<f32>, width: usize) {
    let binomial = |[a, b, c]: [f32; 3]| 0.25 * (a + 2.0 * b + c);
    neighbourhoods(albedo, width, spare, binomial, binomial);
    std::mem::swap(albedo, spare);
}
