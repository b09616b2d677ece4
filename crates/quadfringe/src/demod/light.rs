//! Where light of the projector falls: shadows are told from fringes by the four channels together.
//!
//! R and B are a quarter period apart, so on a lit surface they are never both at the bottom of their fringes: together
//! they stand at least 0.15 of their range above it. In a shadow all four channels lie at the bottom. Bottom and range
//! are taken from the surroundings of each pixel, so that neither the ambient light nor the albedo has to be known.

use super::grid::Grid;
use super::local_fit::{Planes, RowMaps, cell_sums_at};
use rayon::prelude::*;

/// Half width of the surroundings in fringe periods: a whole fringe with something to spare.
const SURROUNDINGS: f64 = 0.75;
/// Least sum of squared heights above the bottom, in units of the range. R and B alone reach 2 x 0.146^2 = 0.043.
const LEAST: f32 = 0.02;
/// One pixel in so many is asked for the noise.
const NOISE_STRIDE: usize = 11;

/// Writes true for every pixel that is lit. `range_min` is the least range of fringes, in linear light.
pub(crate) fn find_light(
    grid: &Grid,
    planes: &Planes<'_>,
    period_px: f64,
    range_min: f32,
    lit: &mut [bool],
) {
    let width = planes.width;
    let noise = noise(planes);
    let sums = cell_sums_at::<5>(grid, planes, |rows, _, _, x| {
        [1.0, rows[0][x], rows[1][x], rows[2][x], rows[3][x]]
    });
    let reach = (SURROUNDINGS * period_px / grid.step as f64).ceil() as usize;
    let surroundings: Vec<[Vec<f32>; 2]> = (1..5)
        .into_par_iter()
        .map(|c| {
            let mean: Vec<f32> = sums[c].iter().zip(&sums[0]).map(|(s, n)| s / n).collect();
            [f32::min as fn(f32, f32) -> f32, f32::max].map(|pick| {
                let mut map = grid.extreme(&mean, reach, pick);
                grid.average(&mut map, reach as f32 / 2.0);
                map
            })
        })
        .collect();
    let mut heights = vec![0.0f32; lit.len()];
    heights.par_chunks_mut(width).enumerate().for_each_init(
        RowMaps::default,
        |row_maps, (y, out)| {
            out.fill(0.0);
            for (light, [bottom, top]) in planes.rows(y).into_iter().zip(&surroundings) {
                let [low, high, ..] = row_maps.sample(grid, y, [bottom, top, top, top], width);
                for x in 0..width {
                    let range = (high[x] - low[x]).max(range_min);
                    let height = light[x] - low[x];
                    out[x] += (height * height - noise * noise) / (range * range);
                }
            }
        },
    );
    let mut sums = vec![0.0f32; lit.len()];
    neighbourhoods(&heights, width, &mut sums, |sum, near| sum + near);
    heights.copy_from_slice(&sums);
    // The mean reaches one pixel into a shadow: the least of the means does not.
    neighbourhoods(&heights, width, &mut sums, f32::min);
    lit.iter_mut()
        .zip(&sums)
        .for_each(|(lit, sum)| *lit = *sum > 9.0 * LEAST);
}

/// Every pixel and its eight neighbours, folded; borders repeat.
fn neighbourhoods(
    map: &[f32],
    width: usize,
    out: &mut [f32],
    fold: impl Fn(f32, f32) -> f32 + Sync,
) {
    let height = map.len() / width;
    out.par_chunks_mut(width).enumerate().for_each(|(y, out)| {
        let rows = [y.saturating_sub(1), y, (y + 1).min(height - 1)]
            .map(|row| &map[row * width..][..width]);
        let column = |x: usize| fold(fold(rows[0][x], rows[1][x]), rows[2][x]);
        for (x, value) in out.iter_mut().enumerate() {
            *value = fold(
                fold(column(x.saturating_sub(1)), column(x)),
                column((x + 1).min(width - 1)),
            );
        }
    });
}

/// Standard deviation of the noise of the red plane, from a mask that is blind to anything that varies along rows
/// alone or along columns alone (Immerkaer, Comput. Vis. Image Underst. 64, 300 (1996)).
pub(crate) fn noise(planes: &Planes<'_>) -> f32 {
    let (red, width) = (planes.light[0], planes.width);
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
