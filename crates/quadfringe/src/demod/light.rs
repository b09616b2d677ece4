//! Where light of the projector falls: shadows are told from fringes by the four channels together.
//!
//! R and B are a quarter period apart, so on a lit surface they are never both at the bottom of their fringes: together
//! they stand at least 0.15 of their range above it. In a shadow all four channels lie at the bottom. Bottom and range
//! are taken from the surroundings of each pixel, so that neither the ambient light nor the albedo has to be known.

use super::scene::{RowMaps, Scene, neighbourhoods};
use rayon::prelude::*;

/// Half width of the surroundings in fringe periods: a whole fringe with something to spare.
const SURROUNDINGS: f32 = 0.75;
/// Least sum of squared heights above the bottom, in units of the range. R and B alone reach 2 x 0.146^2 = 0.043.
const LEAST: f32 = 0.02;
/// One pixel in so many is asked for the noise.
const NOISE_STRIDE: usize = 11;

/// Writes true for every pixel that is lit. `range_min` is the least range of fringes, in linear light.
pub(crate) fn find_light(scene: &Scene<'_>, range_min: f32, lit: &mut [bool]) {
    let surroundings = surroundings(scene);
    let (width, noise) = (scene.width, noise(scene));
    let mut heights = vec![0.0f32; lit.len()];
    heights.par_chunks_mut(width).enumerate().for_each_init(RowMaps::default, |row_maps, (y, out)| {
        for (light, [bottom, top]) in scene.rows(y).into_iter().zip(&surroundings) {
            let [low, high] = row_maps.sample(scene, y, [bottom, top]);
            for x in 0..width {
                let range = (high[x] - low[x]).max(range_min);
                let height = light[x] - low[x];
                out[x] += (height * height - noise * noise) / (range * range);
            }
        }
    });
    let sum = |[a, b, c]: [f32; 3]| a + b + c;
    let least = |[a, b, c]: [f32; 3]| a.min(b).min(c);
    let mut means = vec![0.0f32; lit.len()];
    neighbourhoods(&heights, width, &mut means, sum, sum);
    // The mean reaches one pixel into a shadow: the least of the means does not.
    neighbourhoods(&means, width, &mut heights, least, least);
    lit.iter_mut().zip(&heights).for_each(|(lit, height)| *lit = *height > 9.0 * LEAST);
}

/// Least and greatest light of each channel around every cell.
fn surroundings(scene: &Scene<'_>) -> Vec<[Vec<f32>; 2]> {
    let grid = scene.grid;
    let sums = scene.sums::<5>(|[r, g, b, ir], _| [1.0, r, g, b, ir]);
    let reach = scene.cells(SURROUNDINGS).ceil();
    sums[1..]
        .par_iter()
        .map(|light| {
            let mean: Vec<f32> = light.iter().zip(&sums[0]).map(|(s, n)| s / n).collect();
            [f32::min as fn(f32, f32) -> f32, f32::max].map(|pick| {
                let mut map = grid.extreme(&mean, reach as usize, pick);
                grid.average(&mut map, reach / 2.0);
                map
            })
        })
        .collect()
}

/// Standard deviation of the noise of the red plane, from a mask that is blind to anything that varies along rows
/// alone or along columns alone (Immerkaer, Comput. Vis. Image Underst. 64, 300 (1996)).
fn noise(scene: &Scene<'_>) -> f32 {
    let (red, width) = (scene.light[0], scene.width);
    let mut seen: Vec<f32> = (width + 1..red.len().saturating_sub(width + 1))
        .step_by(NOISE_STRIDE)
        .map(|i| {
            let bend = |at: usize| red[at - 1] - 2.0 * red[at] + red[at + 1];
            (bend(i - width) - 2.0 * bend(i) + bend(i + width)).abs()
        })
        .collect();
    if seen.is_empty() {
        return 0.0;
    }
    let middle = seen.len() / 2;
    let (_, median, _) = seen.select_nth_unstable_by(middle, f32::total_cmp);
    *median / (0.6745 * 6.0)
}

#[cfg(test)]
mod tests {
    use super::super::grid::Grid;
    use super::*;
    use std::f32::consts::{FRAC_PI_2, TAU};

    #[test]
    fn a_shadow_is_told_from_dark_fringes_whatever_the_ambient_light() {
        let (width, height) = (200, 80);
        let in_shadow = |x: usize, y: usize| (60..90).contains(&x) && (20..60).contains(&y);
        for ambient in [0.0, 0.1, 0.3] {
            let plane = |number: f32, shift: f32| -> Vec<f32> {
                (0..width * height)
                    .map(|i| (i % width, i / width))
                    .map(|(x, y)| {
                        let fringe = 0.25 + 0.25 * (TAU * number * x as f32 / 912.0 + shift).cos();
                        ambient + if in_shadow(x, y) { 0.0 } else { fringe }
                    })
                    .collect()
            };
            let planes = [plane(36.0, 0.0), plane(35.0, 0.0), plane(36.0, FRAC_PI_2), plane(30.0, 0.0)];
            let grid = Grid::new(height, width, 3);
            let usable = vec![true; width * height];
            let light = planes.each_ref().map(Vec::as_slice);
            let scene = Scene { light, usable: &usable, width, grid: &grid, period_px: 25.3 };
            let mut lit = vec![false; width * height];
            find_light(&scene, 0.04, &mut lit);
            for (i, lit) in lit.iter().enumerate() {
                let (x, y) = (i % width, i / width);
                if in_shadow(x, y) {
                    assert!(!lit, "shadow at {x} {y}, ambient {ambient}");
                } else if !in_shadow(x + 3, y)
                    && !in_shadow(x.saturating_sub(3), y)
                    && !in_shadow(x, y + 3)
                    && !in_shadow(x, y.saturating_sub(3))
                {
                    assert!(*lit || (57..93).contains(&x), "light at {x} {y}, ambient {ambient}");
                }
            }
        }
    }
}
