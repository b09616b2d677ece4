//! Standard deviation of the intensities, estimated from the shot itself.

use super::cells::Grid;
use super::params::illumination::{NOISE_SAMPLES, NOISE_STRIDE};
use super::scene::{PhaseMap, Scene};
use crate::parallel::angle::wrap;

/// Median of the absolute value of a normal deviation, in standard deviations.
const MEDIAN_OF_NORMAL: f32 = 0.6745;

/// Noise of a plane of light, from a mask that gives 0 for every variation that is only along rows or only along
/// columns (Immerkaer, Comput. Vis. Image Underst. 64, 300 (1996)); in the unit of the light.
pub(super) fn noise_of_image(red: &[f32], grid: &Grid) -> f32 {
    let stride = grid.stride;
    // Rows are padded to whole vectors, so an odd step visits all columns.
    let step = (red.len() / NOISE_SAMPLES) | 1;
    let seen = (stride + 1..red.len().saturating_sub(stride + 1))
        .step_by(step)
        .filter(|i| i % stride + 1 < grid.width)
        .map(|i| {
            let bend = |at: usize| red[at - 1] - 2.0 * red[at] + red[at + 1];
            (bend(i - stride) - 2.0 * bend(i) + bend(i + stride)).abs()
        });
    median(seen.collect()) / (MEDIAN_OF_NORMAL * 6.0)
}

/// Noise of the intensities in linear light, from the second differences of a wrapped phase along rows, in which slopes and most
/// of the curvature cancel.
pub(super) fn noise_of_phase(scene: &Scene<'_>, PhaseMap { phase, modulation }: PhaseMap<'_>) -> f32 {
    let grid = scene.grid;
    let seen = (0..phase.len())
        .step_by(NOISE_STRIDE)
        .filter(|i| (1..grid.width - 1).contains(&(i % grid.stride)))
        .filter(|&i| modulation[i - 1].min(modulation[i]).min(modulation[i + 1]) > 0.0)
        .map(|i| {
            let bend = wrap(wrap(phase[i + 1] - phase[i]) - wrap(phase[i] - phase[i - 1]));
            bend.abs() * modulation[i]
        });
    median(seen.collect()) / (MEDIAN_OF_NORMAL * 6f32.sqrt())
}

/// Upper median; 0 for an empty list.
fn median(mut values: Vec<f32>) -> f32 {
    if values.is_empty() {
        return 0.0;
    }
    let middle = values.len() / 2;
    let (_, median, _) = values.select_nth_unstable_by(middle, f32::total_cmp);
    *median
}
