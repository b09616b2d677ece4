//! Estimate of the response from one shot whose phase is known: the pixels of a tile, sorted by phase, act as a stack
//! of phase steps.
//!
//! Albedo and shadows change single tiles at random, but the response changes the fringes of all tiles alike. A wrong
//! response also makes the phase wrong, so decoding and estimating alternate until both agree.

use super::samples::{Samples, Trace};
use super::select::{self, Mark};
use super::tile_phase::lit_pixels;
use super::uncertainty::{exponent_sd, harmonic_of_texture, second_harmonic, without_excess};
use super::{Response, ResponseEstimate, fit, offset_bound, root_mean_square};
use crate::condition::params::{
    BRIGHT_MAX, CERTAIN_SDS, CHANNEL_TILES_MIN, EVENNESS_MIN, EXPONENT_SHARED, GAIN_RAD, HARMONIC_LEAST,
    HARMONIC_LEFT, HARMONIC_SURE, MANY_TILES, PHASE_STEPS, SATURATED_MAX, SINGLE_CHANNEL_TILES_MIN,
    SLOPE_STRIDE_PX, TILE_FRINGES, TILE_MODULATION_MIN, TILE_SIDE_MIN_PX, TILES_MIN,
};
use crate::encoding::{Channel, Encoding};
use crate::{Error, Result};
use ndarray::{Array2, ArrayView1, ArrayView2, s};
use rayon::prelude::*;
use std::f32::consts::TAU;

/// Inverse responses of R, G, B and IR from one shot; without an infrared channel the plane of IR is not read, and its
/// response is `None`. `light` is the captured light in fractions of full scale, `phase`
/// the decoded phase of the first fringe number in rad, NaN for no data; all `(rows, columns)`.
///
/// A channel without a measurable nonlinearity (a gamma between about 0.9 and 1.1) has `None`. So has every channel if
/// fringes cover too little of the image; ten by ten fringes are enough. Decode the shot again with the result and repeat
/// the estimate until it converges, because a wrong response makes the phase wrong. The `pixels` of an estimate are tiles.
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
    let mut means = [(); 4].map(|()| Tiles { means: Array2::zeros([0, PHASE_STEPS]), overlap: false });
    let channels = if four.has_infrared() { 4 } else { 3 };
    means[..channels].par_iter_mut().zip(Channel::ALL).for_each(|(means, channel)| {
        let scale = (four.fringe_number(channel) / four.quadrature) as f32;
        let side = ((TILE_FRINGES * TAU / (slope * scale)).ceil() as usize).max(TILE_SIDE_MIN_PX);
        *means = tiles(light[channel.index()], phase_rad, scale, side);
    });
    let traces = means.each_ref().map(|tiles| traces_of(&tiles.means));
    let together: Vec<Trace<'_>> = traces.iter().flatten().copied().collect();
    if 4 * together.len() < channels * TILES_MIN {
        return Ok([None; 4]);
    }
    let all = Samples::new(&together);
    let before = rms_rad(&all, &Response::default());
    if !pays(0.0, before) {
        return Ok([None; 4]);
    }
    let response = fit(&all, offset_bound(&together));
    let shared = if pays(rms_rad(&all, &response), before) { response } else { Response::default() };
    let copies = copies_of(&means);
    let shared = Shared { response: shared, exponent_sd: exponent_sd(&all, &shared, copies), copies };
    Ok(traces.each_ref().map(|traces| of_channel(traces, &shared)))
}

/// Chooses the response shared by all channels, or a separate response for this channel if it fits much better.
///
/// One projector and one camera usually have the same response in all channels, and four times as many tiles make a more
/// stable estimate.
///
/// A correction that turns the sign of the second harmonic is taken back to where it vanishes. Light stays linear unless the correction makes
/// the second harmonic smaller, and either the exponent differs from 1 by several standard errors or the harmonic is larger than that of
/// any texture.
fn of_channel(traces: &[Trace<'_>], shared: &Shared) -> Option<ResponseEstimate> {
    if traces.len() < CHANNEL_TILES_MIN {
        return None;
    }
    let samples = Samples::new(traces);
    let before = rms_rad(&samples, &Response::default());
    let mut best = Fitted { response: shared.response, rms_rad: rms_rad(&samples, &shared.response) };
    let mut sd = shared.exponent_sd;
    if traces.len() >= SINGLE_CHANNEL_TILES_MIN && pays(0.0, best.rms_rad) {
        let response = fit(&samples, offset_bound(traces));
        let single = Fitted { response, rms_rad: rms_rad(&samples, &response) };
        if pays(single.rms_rad, best.rms_rad) {
            sd = exponent_sd(&samples, &response, shared.copies);
            best = single;
        }
    }
    let kept = without_excess(traces, best.response, HARMONIC_LEFT);
    let taken_back = f64::from((kept.exponent - best.response.exponent).abs());
    let found = ResponseEstimate {
        response: kept,
        two_step_rms_before_rad: before,
        two_step_rms_after_rad: rms_rad(&samples, &kept),
        pixels: traces.len(),
        exponent_sd: total_sd(sd, taken_back, harmonic_of_texture(traces, &kept), f64::from(kept.exponent)),
        second_harmonic_before: second_harmonic(traces, &Response::default()),
        second_harmonic_after: second_harmonic(traces, &kept),
    };
    let alone = shared.response == Response::default();
    let least = if alone { 2.0 * HARMONIC_LEAST } else { HARMONIC_LEAST };
    (pays(found.two_step_rms_after_rad, before) && is_certain(&found, least)).then_some(found)
}

/// The response that fits all channels together.
struct Shared {
    response: Response,
    exponent_sd: f64,
    /// Number of tiles that see the same pixels.
    copies: f64,
}

/// Standard error with the parts that the scatter of tiles does not show. A gamma g near 1 has the second harmonic
/// (g - 1) / 3.
fn total_sd(scatter: f64, taken_back: f64, harmonic_of_texture: f64, exponent: f64) -> f64 {
    let texture = 3.0 * exponent * harmonic_of_texture;
    scatter.hypot(EXPONENT_SHARED * (1.0 - exponent)).hypot(taken_back / 2.0).hypot(texture)
}

/// Whether a shot shows a response beyond doubt, in a channel whose light must have at least this second harmonic.
fn is_certain(found: &ResponseEstimate, harmonic_least: f64) -> bool {
    let differs = (f64::from(found.response.exponent) - 1.0).abs() > CERTAIN_SDS * found.exponent_sd;
    let [before, after] = [found.second_harmonic_before, found.second_harmonic_after].map(f64::abs);
    let shown = differs && before > harmonic_least || before > HARMONIC_SURE;
    found.response.knee > 0.0 || (shown && after < before)
}

/// How many tiles see the same pixel: those of a small image overlap by half along both axes.
fn copies_of(means: &[Tiles; 4]) -> f64 {
    if means.iter().any(|tiles| tiles.overlap) { 4.0 } else { 1.0 }
}

/// Mean light in each phase step, `(tiles, steps)`, and whether the tiles overlap by half.
struct Tiles {
    means: Array2<f32>,
    overlap: bool,
}

/// A response and the remaining two-step error.
struct Fitted {
    response: Response,
    rms_rad: f64,
}

fn rms_rad(samples: &Samples, response: &Response) -> f64 {
    root_mean_square(&samples.rms_rad(response))
}

fn pays(after_rad: f64, before_rad: f64) -> bool {
    before_rad * before_rad - after_rad * after_rad > GAIN_RAD * GAIN_RAD
}

fn traces_of(means: &Array2<f32>) -> Vec<Trace<'_>> {
    let waves = select::waves(PHASE_STEPS);
    let harmonic_of = |steps: ArrayView1<'_, f32>| {
        let peak = steps.fold(0.0f32, |a, &b| a.max(b));
        match select::mark_of(steps, &waves, peak, TILE_MODULATION_MIN) {
            Mark::Usable(harmonic) => Some(harmonic),
            _ => None,
        }
    };
    means.outer_iter().filter_map(|steps| Some(Trace { steps, harmonic: harmonic_of(steps)? })).collect()
}

/// Mean light in each phase step, `(tiles, steps)`, for the tiles that have every step and are not saturated.
fn tiles(light: ArrayView2<'_, f32>, phase: ArrayView2<'_, f32>, scale: f32, side: usize) -> Tiles {
    // The tiles of a small image overlap by half.
    let [rows, columns] = [light.nrows() / side, light.ncols() / side];
    let overlap = rows * columns < MANY_TILES;
    let step = if overlap { side / 2 } else { side };
    let starts = |length: usize| (0..(length + 1).saturating_sub(side)).step_by(step);
    let mut means = Vec::new();
    for (y, x) in starts(light.nrows()).flat_map(|y| starts(light.ncols()).map(move |x| (y, x))) {
        let tile = s![y..y + side, x..x + side];
        means.extend(steps_of(light.slice(tile), phase.slice(tile), scale).into_iter().flatten());
    }
    let shape = (means.len() / PHASE_STEPS, PHASE_STEPS);
    Tiles { means: Array2::from_shape_vec(shape, means).expect("whole tiles"), overlap }
}

fn steps_of(
    light: ArrayView2<'_, f32>,
    phase: ArrayView2<'_, f32>,
    scale: f32,
) -> Option<[f32; PHASE_STEPS]> {
    let pixels = lit_pixels(light, phase)?;
    let (mut sums, mut counts) = ([0.0f32; PHASE_STEPS], [0.0f32; PHASE_STEPS]);
    for pixel in &pixels {
        let turns = pixel.phase_rad * scale / TAU;
        let step = ((turns - turns.floor()) * PHASE_STEPS as f32) as usize % PHASE_STEPS;
        sums[step] += pixel.light;
        counts[step] += 1.0;
    }
    let all = pixels.len() as f32;
    let saturated = pixels.iter().filter(|pixel| pixel.light >= BRIGHT_MAX).count() as f32;
    let even = counts.iter().all(|&count| count >= EVENNESS_MIN * all / PHASE_STEPS as f32);
    let told = saturated <= SATURATED_MAX * all && even;
    // After the dark level is subtracted, noise can make light negative.
    told.then(|| std::array::from_fn(|i| (sums[i] / counts[i]).clamp(0.0, 1.0)))
}

/// Median of the phase gradient, rad per pixel; `None` without a phase.
fn median_slope(phase: ArrayView2<'_, f32>) -> Option<f32> {
    let (rows, columns) = phase.dim();
    let mut slopes = Vec::new();
    for y in (0..rows.saturating_sub(1)).step_by(SLOPE_STRIDE_PX) {
        for x in (0..columns.saturating_sub(1)).step_by(SLOPE_STRIDE_PX) {
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
