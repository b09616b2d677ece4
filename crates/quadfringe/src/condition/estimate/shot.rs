//! The response from one shot whose phase is known: sorted by their phase, the pixels of a tile are a stack of steps.
//!
//! What an albedo or a shadow does to one tile is no wave of its fringes, so that over many tiles only what the response
//! does remains. The phase itself is the worse for a response that was not undone; decoding and estimating again, a few
//! times, ends where both agree.

use super::samples::{Samples, Trace};
use super::select::{self, Mark};
use super::{Response, ResponseEstimate, fit, offset_bound, root_mean_square};
use crate::encoding::{Channel, Encoding};
use crate::{Error, Result};
use ndarray::{Array2, ArrayView1, ArrayView2, s};
use rayon::prelude::*;
use std::f32::consts::TAU;

/// Steps that a period is sorted into.
const STEPS: usize = 16;
/// Side of a tile in fringes: two or more, so that a slope of the albedo is not taken for a harmonic.
const TILE_FRINGES: f32 = 2.5;
const SIDE_MIN: usize = 24;
/// Share of a tile whose phase is known.
const KNOWN: f32 = 0.5;
/// Every step has this share of the pixels that it would have if all had as many.
const EVEN: f32 = 0.25;
/// Share of a tile that may be saturated.
const SATURATED: f32 = 0.02;
/// Least amplitude of a tile, fraction of full scale; the mean of a hundred pixels has little noise.
const MODULATION_MIN: f32 = 0.02;
/// Tiles that an estimate for all channels needs, for one that leaves the others alone, and of a channel that takes part; fewer
/// let the print of a single object decide.
const TILES_MIN: usize = 48;
const OWN_TILES_MIN: usize = 60;
const CHANNEL_TILES_MIN: usize = 6;
/// Tiles that fit into an image from which on they need not overlap.
const MANY_TILES: usize = 100;
/// What undoing the response has to take from the square of the two-step error.
const GAIN_RAD: f64 = 0.02;
/// Neighbours whose difference is taken for the slope of the phase: every fourth along rows and columns.
const STRIDE: usize = 4;

/// Inverse responses of R, G, B and IR from one shot, `light` as captured, in fractions of full scale, and the phase it
/// was decoded to, rad, of the first fringe number, NaN where there is none; all `(rows, columns)`.
///
/// `None` for a channel that is linear as far as the shot can tell (to a gamma of about 1.1), and where fringes fill too
/// little of the image; ten fringes by ten are enough. The shot has to be decoded again with what was found, and the
/// estimate repeated, until it stays: a phase from light that is bent is bent itself. The `pixels` of an estimate are tiles.
///
/// # Errors
/// [`Error::Shape`] when the maps differ in size; [`Error::NotFourChannel`] for another encoding.
///
/// ```
/// use ndarray::Array2;
/// use quadfringe::{Encoding, condition::estimate_response_of_shot};
/// let encoding = Encoding::optimum(36, 912)?;
/// let phase = Array2::from_shape_fn((300, 400), |(y, x)| 0.3 * x as f32 + 0.05 * y as f32);
/// let light = [36.0, 35.0, 30.0].map(|n: f32| {
///     phase.mapv(|first| (0.5 + 0.4 * (first * (n / 36.0)).cos()).powf(2.2))
/// });
/// let [first, second, third] = light.each_ref().map(|plane| plane.view());
/// let found = estimate_response_of_shot([first, second, first, third], phase.view(), &encoding)?;
/// let red = found[0].expect("bent light");
/// assert!((red.response.exponent - 1.0 / 2.2).abs() < 0.02);
/// # Ok::<(), quadfringe::Error>(())
/// ```
pub fn estimate_response_of_shot(
    light: [ArrayView2<'_, f32>; 4],
    phase_rad: ArrayView2<'_, f32>,
    encoding: &Encoding,
) -> Result<[Option<ResponseEstimate>; 4]> {
    for (channel, plane) in Channel::ALL.iter().zip(&light) {
        if plane.dim() != phase_rad.dim() {
            return Err(Error::shape(channel.name(), phase_rad.shape(), plane.shape()));
        }
    }
    let four = encoding.four_channel_view()?;
    let Some(slope) = median_slope(phase_rad) else { return Ok([None; 4]) };
    let mut means = [(); 4].map(|()| Array2::zeros([0, STEPS]));
    means.par_iter_mut().zip(Channel::ALL).for_each(|(means, channel)| {
        let scale = (four.fringe_number(channel) / four.quadrature) as f32;
        let side = ((TILE_FRINGES * TAU / (slope * scale)).ceil() as usize).max(SIDE_MIN);
        *means = tiles(light[channel.index()], phase_rad, scale, side);
    });
    let traces = means.each_ref().map(traces_of);
    let together: Vec<Trace<'_>> = traces.iter().flatten().copied().collect();
    if together.len() < TILES_MIN {
        return Ok([None; 4]);
    }
    let all = Samples::new(&together);
    let before = rms_rad(&all, &Response::default());
    if !pays(0.0, before) {
        return Ok([None; 4]);
    }
    let shared = fit(&all, offset_bound(&together));
    let shared = if pays(rms_rad(&all, &shared), before) { shared } else { Response::default() };
    Ok(traces.each_ref().map(|traces| of_channel(traces, shared)))
}

/// The response that the channel shares with the others, or its own where that is so much better.
///
/// One projector and one camera bend all channels alike as a rule, and four times the tiles make a steadier estimate.
fn of_channel(traces: &[Trace<'_>], shared: Response) -> Option<ResponseEstimate> {
    if traces.len() < CHANNEL_TILES_MIN {
        return None;
    }
    let samples = Samples::new(traces);
    let before = rms_rad(&samples, &Response::default());
    let mut best = (shared, rms_rad(&samples, &shared));
    if traces.len() >= OWN_TILES_MIN && pays(0.0, best.1) {
        let own = fit(&samples, offset_bound(traces));
        let after = rms_rad(&samples, &own);
        best = if pays(after, best.1) { (own, after) } else { best };
    }
    pays(best.1, before).then_some(ResponseEstimate {
        response: best.0,
        two_step_rms_before_rad: before,
        two_step_rms_after_rad: best.1,
        pixels: traces.len(),
    })
}

fn rms_rad(samples: &Samples, response: &Response) -> f64 {
    root_mean_square(&samples.rms_rad(response))
}

fn pays(after_rad: f64, before_rad: f64) -> bool {
    before_rad * before_rad - after_rad * after_rad > GAIN_RAD * GAIN_RAD
}

fn traces_of(means: &Array2<f32>) -> Vec<Trace<'_>> {
    let waves = select::waves(STEPS);
    let harmonic_of = |steps: ArrayView1<'_, f32>| {
        let peak = steps.fold(0.0f32, |a, &b| a.max(b));
        match select::mark_of(steps, &waves, peak, MODULATION_MIN) {
            Mark::Usable(harmonic) => Some(harmonic),
            _ => None,
        }
    };
    means.outer_iter().filter_map(|steps| Some(Trace { steps, harmonic: harmonic_of(steps)? })).collect()
}

/// Mean light by step of phase, `(tiles, steps)`, of the tiles that show every step and are not saturated.
fn tiles(light: ArrayView2<'_, f32>, phase: ArrayView2<'_, f32>, scale: f32, side: usize) -> Array2<f32> {
    // A small image is made the most of: its tiles overlap by half.
    let [rows, columns] = [light.nrows() / side, light.ncols() / side];
    let step = if rows * columns < MANY_TILES { side / 2 } else { side };
    let starts = |length: usize| (0..(length + 1).saturating_sub(side)).step_by(step);
    let mut means = Vec::new();
    for (y, x) in starts(light.nrows()).flat_map(|y| starts(light.ncols()).map(move |x| (y, x))) {
        let tile = s![y..y + side, x..x + side];
        means.extend(steps_of(light.slice(tile), phase.slice(tile), scale).into_iter().flatten());
    }
    Array2::from_shape_vec((means.len() / STEPS, STEPS), means).expect("whole tiles")
}

fn steps_of(light: ArrayView2<'_, f32>, phase: ArrayView2<'_, f32>, scale: f32) -> Option<[f32; STEPS]> {
    let (mut sums, mut counts) = ([0.0f32; STEPS], [0.0f32; STEPS]);
    let (mut known, mut saturated) = (0.0, 0.0);
    for (&light, &phase) in light.iter().zip(phase) {
        if !(phase.is_finite() && light.is_finite()) {
            continue;
        }
        let turns = phase * scale / TAU;
        let step = ((turns - turns.floor()) * STEPS as f32) as usize % STEPS;
        sums[step] += light;
        counts[step] += 1.0;
        known += 1.0;
        saturated += if light >= select::BRIGHT_MAX { 1.0 } else { 0.0 };
    }
    let all = light.len() as f32;
    let even = counts.iter().all(|&count| count >= EVEN * known / STEPS as f32);
    let told = known >= KNOWN * all && saturated <= SATURATED * known && even;
    // Light below zero is what a dark level left of noise.
    told.then(|| std::array::from_fn(|i| (sums[i] / counts[i]).clamp(0.0, 1.0)))
}

/// Median length of the phase's gradient, rad per pixel; `None` without a phase.
fn median_slope(phase: ArrayView2<'_, f32>) -> Option<f32> {
    let (rows, columns) = phase.dim();
    let mut slopes = Vec::new();
    for y in (0..rows.saturating_sub(1)).step_by(STRIDE) {
        for x in (0..columns.saturating_sub(1)).step_by(STRIDE) {
            let here = phase[[y, x]];
            let slope = (phase[[y, x + 1]] - here).hypot(phase[[y + 1, x]] - here);
            if slope > 0.0 && slope < TAU {
                slopes.push(slope);
            }
        }
    }
    let middle = slopes.len() / 2;
    (!slopes.is_empty()).then(|| *slopes.select_nth_unstable_by(middle, f32::total_cmp).1)
}
