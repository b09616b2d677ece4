//! Fringe orders by a ladder of beats, pixel by pixel (S4).
//!
//! The beat of the phases of N and N - 1 fringes has one fringe over the field, so it has no ambiguity. It gives the order
//! of the beat of N and N - sqrt(N), which has sqrt(N) fringes, and this second beat gives the order of N. Noise grows by
//! the factor sqrt(N) at each of the two rungs 1 -> sqrt(N) -> N.

use super::{Absolute, Phases};
use crate::encoding::{Encoding, FourChannel};
use crate::parallel::angle::{round, sin_cos, wrap_positive};
use crate::{Error, Result};
use ndarray::{Array2, ArrayView2, Axis};
use rayon::prelude::*;
use std::f32::consts::TAU;

/// Number of pixels that are searched together, as vectors.
const BLOCK: usize = 64;

/// Fringe orders of one pixel at a time (S4).
///
/// If no beat of the fringe numbers has at most one fringe, or if there is no infrared phase, there is no ladder, and every order is
/// tried in turn.
#[derive(Debug, Clone)]
pub struct Ladder {
    numbers: Phases<f32>,
    columns_per_turn: f32,
    width: f32,
    /// Number of orders after which all three phases repeat, if the whole field is one such cycle.
    cycle: Option<f32>,
    climbs: bool,
    /// The orders that are tried.
    orders: std::ops::Range<usize>,
}

/// Absolute phase of one pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Ordered {
    /// Phase of the first fringe number in rad, 0 at column 0.
    pub phase_rad: f32,
    /// Distance of the worst beat from the decision between two orders: 1 in the middle of an order, 0 at the decision.
    pub margin: f32,
}

/// The end of the field, where all phases repeat, in turns of the first phase.
#[derive(Clone, Copy)]
struct Repeat {
    /// End of the field.
    end: f32,
    /// Length of the cycle, which is subtracted from phases beyond the end.
    cycle: f32,
}

impl Ladder {
    /// Plans the ladder for the fringe numbers of an encoding.
    #[must_use]
    pub fn new(code: &FourChannel) -> Self {
        let numbers = Phases::from_array(code.numbers());
        let beat = (numbers.quadrature - numbers.green).abs();
        let whole = code.numbers().iter().all(|n| n.fract() == 0.0);
        Self {
            numbers: numbers.map(|n| n as f32),
            columns_per_turn: (code.projector_width as f64 / numbers.quadrature) as f32,
            width: code.projector_width as f32,
            cycle: (whole && beat == 1.0).then_some(numbers.quadrature as f32),
            climbs: code.has_infrared()
                && beat > 0.0
                && beat <= 1.0
                && numbers.infrared != numbers.quadrature,
            orders: (code.columns_px[0] / code.period_px()) as usize
                ..(code.columns_px[1] / code.period_px()).ceil() as usize,
        }
    }

    /// Absolute phase of one pixel from its wrapped phases in rad. NaN in, NaN out.
    ///
    /// ```
    /// use quadfringe::{Encoding, stages::{Ladder, Phases}};
    /// let code = Encoding::optimum(36, 912)?.four_channel_view()?;
    /// let at = |n: f64| (std::f64::consts::TAU * n * 700.25 / 912.0) as f32;
    /// let wrapped = Phases { quadrature: at(36.0), green: at(35.0), infrared: at(30.0) };
    /// let found = Ladder::new(&code).order(wrapped);
    /// assert!((found.phase_rad - at(36.0)).abs() < 1e-3);
    /// # Ok::<(), quadfringe::Error>(())
    /// ```
    #[must_use]
    pub fn order(&self, wrapped_rad: Phases<f32>) -> Ordered {
        let wrapped = wrapped_rad.map(|phase| [phase]);
        let (mut phase_rad, mut margin) = ([0.0], [0.0]);
        self.order_row(wrapped.as_ref().map(|row| &row[..]), &mut phase_rad, &mut margin);
        Ordered { phase_rad: phase_rad[0], margin: margin[0] }
    }

    /// [`Self::order`] for a row of pixels.
    #[inline(always)]
    pub(crate) fn order_row(&self, wrapped: Phases<&[f32]>, phase: &mut [f32], margin: &mut [f32]) {
        // If all phases repeat, column 0 and the end of the field cannot be distinguished. The field starts half a
        // column before column 0.
        let end = (self.width - 0.5) / self.columns_per_turn;
        let never = Repeat { end: f32::INFINITY, cycle: 0.0 };
        let repeat = self.cycle.map_or(never, |cycle| Repeat { end, cycle });
        if self.climbs {
            self.climb(wrapped, repeat, phase, margin);
        } else {
            self.search(wrapped, phase, margin);
            let (end, cycle) = (repeat.end * TAU, repeat.cycle * TAU);
            for phase in phase {
                let below = *phase - cycle;
                *phase = if *phase >= end { below } else { *phase };
            }
        }
    }

    /// Climbs the ladder. Phases are in turns, so that orders are integers.
    #[inline(always)]
    fn climb(&self, wrapped: Phases<&[f32]>, repeat: Repeat, phase: &mut [f32], margin: &mut [f32]) {
        let Phases { quadrature: n1, green: n2, infrared: n3 } = self.numbers;
        let Repeat { end, cycle } = repeat;
        let (coarse, middle) = (n1 - n2, n1 - n3);
        let sign = coarse.signum();
        let (to_middle, to_first) = (middle / coarse.abs(), n1 / middle);
        let out = phase.iter_mut().zip(margin);
        let seen = wrapped.quadrature.iter().zip(wrapped.green).zip(wrapped.infrared);
        for (((&first_rad, second_rad), third_rad), (phase, margin)) in seen.zip(out) {
            let [first, second, third] = [first_rad, *second_rad, *third_rad].map(|rad| rad * (1.0 / TAU));
            let start = (first - second) * sign;
            let start = start - round(start);
            let start = if start < 0.0 { start + 1.0 } else { start };
            let low = Nearest::to(start * to_middle - (first - third));
            let beat = (first - third) + low.turns;
            let high = Nearest::to(beat * to_first - first);
            let more = if first + high.turns >= end { high.turns - cycle } else { high.turns };
            *phase = first_rad + TAU * more;
            *margin = 1.0 - 2.0 * if low.rest > high.rest { low.rest } else { high.rest };
        }
    }

    fn search(&self, wrapped: Phases<&[f32]>, phase: &mut [f32], margin: &mut [f32]) {
        let rows = wrapped.map(|row| row.chunks(BLOCK));
        let out = phase.chunks_mut(BLOCK).zip(margin.chunks_mut(BLOCK));
        let blocks = rows.quadrature.zip(rows.green).zip(rows.infrared);
        for (((quadrature, green), infrared), (phase, margin)) in blocks.zip(out) {
            let wrapped = Phases { quadrature, green, infrared };
            if self.numbers.infrared > 0.0 {
                self.search_block::<true>(wrapped, phase, margin);
            } else {
                self.search_block::<false>(wrapped, phase, margin);
            }
        }
    }

    /// Tries every order for a block of pixels. The best order has the least squared error of the other phasors, of which
    /// `INFRARED` is one; the margin follows from the second best order.
    fn search_block<const INFRARED: bool>(
        &self,
        wrapped: Phases<&[f32]>,
        phase: &mut [f32],
        margin: &mut [f32],
    ) {
        let Phases { quadrature: first, green: second, infrared: third } = wrapped;
        let to_second = self.numbers.green / self.numbers.quadrature;
        let to_third = self.numbers.infrared / self.numbers.quadrature;
        let (mut least, mut next) = ([f32::INFINITY; BLOCK], [f32::INFINITY; BLOCK]);
        for order in self.orders.clone() {
            for i in 0..first.len() {
                let guess = wrap_positive(first[i]) + TAU * order as f32;
                let error = |ratio: f32, seen: f32| 1.0 - sin_cos(guess * ratio - seen).1;
                let by_second = error(to_second, second[i]);
                let cost = if INFRARED { by_second + error(to_third, third[i]) } else { by_second };
                let better = cost < least[i];
                let behind = if better { least[i] } else { cost };
                next[i] = if behind < next[i] { behind } else { next[i] };
                least[i] = if better { cost } else { least[i] };
                phase[i] = if better { guess } else { phase[i] };
            }
        }
        for i in 0..first.len() {
            let known = least[i].is_finite() && next[i] > 0.0;
            margin[i] = if known { 1.0 - (least[i].max(0.0) / next[i]).sqrt() } else { 0.0 };
            let all = first[i] + second[i] + if INFRARED { third[i] } else { 0.0 };
            let seen = all.is_finite();
            (phase[i], margin[i]) = if seen { (phase[i], margin[i]) } else { (f32::NAN, f32::NAN) };
        }
    }
}

/// The nearest integer number of turns.
struct Nearest {
    turns: f32,
    /// Distance from it.
    rest: f32,
}

impl Nearest {
    #[inline(always)]
    fn to(number: f32) -> Self {
        let turns = round(number);
        Self { turns, rest: (number - turns).abs() }
    }
}

/// Absolute phase and margin, both `(rows, columns)`, from wrapped phases in rad by the ladder of beats (S4).
///
/// NaN in, NaN out. Without an infrared channel the third map is not read.
///
/// # Errors
/// [`Error::Shape`] when the maps differ in size; [`Error::NotFourChannel`] for another encoding.
///
/// ```
/// use ndarray::Array2;
/// use quadfringe::{Encoding, stages::{Phases, unwrap}};
/// let encoding = Encoding::optimum(36, 912)?;
/// let wrapped = |n: f64| Array2::from_shape_fn((1, 912), |(_, u)| {
///     let phase = std::f64::consts::TAU * n * u as f64 / 912.0;
///     phase.sin().atan2(phase.cos()) as f32
/// });
/// let wrapped = Phases::from_array([36.0, 35.0, 30.0]).map(wrapped);
/// let found = unwrap(&encoding, wrapped.as_ref().map(|map| map.view()))?;
/// assert!((found.phase_rad[[0, 500]] / std::f32::consts::TAU * 912.0 / 36.0 - 500.0).abs() < 1e-2);
/// assert!(found.margin[[0, 500]] > 0.9);
/// # Ok::<(), quadfringe::Error>(())
/// ```
pub fn unwrap(encoding: &Encoding, wrapped_rad: Phases<ArrayView2<'_, f32>>) -> Result<Absolute> {
    let shape = wrapped_rad.quadrature.raw_dim();
    for (map, name) in [(wrapped_rad.green, "green phase"), (wrapped_rad.infrared, "infrared phase")] {
        if map.raw_dim() != shape {
            return Err(Error::shape(name, wrapped_rad.quadrature.shape(), map.shape()));
        }
    }
    let ladder = Ladder::new(&encoding.four_channel_view()?);
    let mut out = Absolute {
        phase_rad: Array2::from_elem(shape, f32::NAN),
        margin: Array2::from_elem(shape, f32::NAN),
    };
    let wrapped = wrapped_rad.map(|map| map.as_standard_layout().into_owned());
    let rows = out.phase_rad.axis_iter_mut(Axis(0)).into_par_iter().zip(out.margin.axis_iter_mut(Axis(0)));
    rows.enumerate().for_each(|(y, (mut phase, mut margin))| {
        let contiguous = "rows in standard layout are contiguous";
        let wrapped = wrapped.as_ref().map(|map| map.row(y).to_slice().expect(contiguous));
        let phase = phase.as_slice_mut().expect(contiguous);
        ladder.order_row(wrapped, phase, margin.as_slice_mut().expect(contiguous));
    });
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn phases(code: &FourChannel, column: f64) -> Phases<f32> {
        Phases::from_array(code.numbers()).map(|n| {
            let phase = std::f64::consts::TAU * n * column / code.projector_width as f64;
            phase.sin().atan2(phase.cos()) as f32
        })
    }

    #[test]
    fn every_column_of_every_kind_of_code_is_found() {
        let codes = [
            FourChannel::of(Encoding::optimum(36, 912)),
            FourChannel::of(Encoding::optimum(64, 1280)),
            FourChannel::of(Encoding::four_channel([1920.0 / 42.0, 1920.0 / 45.0, 40.0], 1920)),
            FourChannel::of(Encoding::four_channel([30.0, 31.0, 36.0], 912)),
            FourChannel::of(Encoding::rgb([16.0, 15.0], 912)),
            FourChannel::of(Encoding::rgb([15.0, 16.0], 912)),
        ];
        for code in codes {
            let ladder = Ladder::new(&code);
            for i in 0..2 * code.projector_width {
                let column = i as f64 / 2.0 + 0.1;
                if column >= code.projector_width as f64 - 0.5 {
                    continue;
                }
                let found = ladder.order(phases(&code, column)).phase_rad / TAU * ladder.columns_per_turn;
                assert!((f64::from(found) - column).abs() < 0.01, "{code:?} {column} {found}");
            }
        }
    }

    #[test]
    fn the_first_column_does_not_jump_to_the_last_under_noise() {
        let code = FourChannel::of(Encoding::optimum(36, 912));
        let ladder = Ladder::new(&code);
        for noise in [-0.05f32, 0.05] {
            let wrapped = phases(&code, 0.0).map(|p| p + noise);
            let found = ladder.order(Phases { green: wrapped.green - 2.0 * noise, ..wrapped });
            assert!(found.phase_rad.abs() < 0.1, "{noise} {found:?}");
        }
    }
}
