//! For tests: an edge between two textures, and the cells that a fit in windows would give.

use crate::joint::cells::{CellMaps, Grid};
use crate::joint::model::{Wave, carriers};
use crate::joint::scene::Scene;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::{Pcg64Mcg, rand_core::SeedableRng};
use std::f32::consts::TAU;

pub const RATIOS: [f32; 4] = [1.0, 35.0 / 36.0, 1.0, 30.0 / 36.0];
pub const PERIOD_PX: f32 = 25.0;
/// First column of the second texture.
pub const EDGE: usize = 128;
/// Albedo of all pixels, on top of their texture.
pub const ALBEDO: f32 = 0.6;

/// Fringes on two textures that meet in column [`EDGE`], under noise; the cells mix both over ten pixels to either side.
pub struct Edge {
    pub grid: Grid,
    /// Offset and amplitude of R, of G, of B, of IR on both sides.
    pub textures: [[f32; 8]; 2],
    pub maps: CellMaps,
    pub phase: Vec<f32>,
    light: [Vec<f32>; 4],
}

impl Edge {
    pub fn new(textures: [[f32; 8]; 2], noise: f32) -> Self {
        let grid = Grid::new([64, 256], 4.0);
        let mut random = Pcg64Mcg::seed_from_u64(3);
        let phase: Vec<f32> = (0..grid.pixels()).map(|i| 40.0 + TAU * (i % 256) as f32 / PERIOD_PX).collect();
        let light = std::array::from_fn(|c| {
            let clean = |i: usize| {
                let [a, b] = [2 * c, 2 * c + 1].map(|k| textures[usize::from(i % 256 >= EDGE)][k]);
                ALBEDO * (a + b * carriers(phase[i], RATIOS, Wave::coaxial(phase[i], RATIOS[3])).cosine[c])
            };
            let mut draw = || -> f32 { StandardNormal.sample(&mut random) };
            (0..grid.pixels()).map(|i| clean(i) + noise * draw()).collect()
        });
        let mut maps = CellMaps::new(8);
        maps.fill::<8>(&grid, |_, lines| {
            for (k, line) in lines.into_iter().enumerate() {
                for (column, value) in line.iter_mut().enumerate() {
                    let across = ((4.0 * column as f32 + 2.0 - 118.0) / 20.0).clamp(0.0, 1.0);
                    *value = textures[0][k] + (textures[1][k] - textures[0][k]) * across;
                }
            }
        });
        Self { grid, textures, maps, phase, light }
    }

    pub fn scene<'a>(&'a self, usable: &'a [f32]) -> Scene<'a> {
        let light = self.light.each_ref().map(Vec::as_slice);
        Scene { light, usable, grid: &self.grid, period_px: f64::from(PERIOD_PX), factor: 1, pair: None }
    }

    /// A plane that has the same value everywhere.
    pub fn plane(&self, value: f32) -> Vec<f32> {
        vec![value; self.grid.pixels()]
    }

    /// The texture of a pixel in column `x`.
    pub fn texture(&self, x: usize) -> [f32; 8] {
        self.textures[usize::from(x >= EDGE)]
    }
}
