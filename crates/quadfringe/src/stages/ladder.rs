//! Fringe orders point by point.

use crate::parallel::angle::{round, sin_cos, wrap_positive};
use crate::{Error, FringeCode, Result};
use ndarray::{Array2, ArrayView2, Axis};
use rayon::prelude::*;
use std::f32::consts::TAU;

/// Pixels that are searched together.
const BLOCK: usize = 64;

/// Orders of one pixel at a time: the beat of the first two fringe numbers has at most one fringe over the field; it
/// orders the beat of the first and the third, which orders the first (S4). A triple without such a beat is
/// searched order by order instead.
#[derive(Debug, Clone)]
pub struct Ladder {
    numbers: [f32; 3],
    columns_per_turn: f32,
    width: f32,
    /// Orders after which all three phases repeat, when the whole field is one such cycle.
    cycle: Option<f32>,
    climbs: bool,
    orders: usize,
}

/// Absolute phase of one pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ordered {
    /// Phase of the first fringe number in rad, 0 at column 0.
    pub phase_rad: f32,
    /// 1 when every order was hit in the middle, 0 when one was a coin's toss.
    pub margin: f32,
}

impl Ladder {
    /// Plan for one code.
    #[must_use]
    pub fn new(code: &FringeCode) -> Self {
        let numbers = code.numbers();
        let beat = (numbers[0] - numbers[1]).abs();
        let whole = numbers.iter().all(|n| n.fract() == 0.0);
        Self {
            numbers: numbers.map(|n| n as f32),
            columns_per_turn: (code.projector_width() as f64 / numbers[0]) as f32,
            width: code.projector_width() as f32,
            cycle: (whole && beat == 1.0).then_some(numbers[0] as f32),
            climbs: beat > 0.0 && beat <= 1.0 && numbers[2] != numbers[0],
            orders: code.orders(),
        }
    }

    /// Order one pixel from its three wrapped phases in rad.
    ///
    /// ```
    /// use quadfringe::{FringeCode, stages::Ladder};
    /// let code = FringeCode::optimum(36, 912)?;
    /// let at = |n: f64| (std::f64::consts::TAU * n * 700.25 / 912.0) as f32;
    /// let found = Ladder::new(&code).order(code.numbers().map(at));
    /// assert!((found.phase_rad - at(36.0)).abs() < 1e-3);
    /// # Ok::<(), quadfringe::Error>(())
    /// ```
    #[must_use]
    pub fn order(&self, phases: [f32; 3]) -> Ordered {
        let [first, second, third] = phases.map(|p| [p]);
        let (mut phase_rad, mut margin) = ([0.0], [0.0]);
        self.order_row([&first, &second, &third], &mut phase_rad, &mut margin);
        Ordered { phase_rad: phase_rad[0], margin: margin[0] }
    }

    /// Order a row of pixels: absolute phase and margin as in [`Ordered`]; NaN in, NaN out.
    #[inline(always)]
    pub(crate) fn order_row(&self, wrapped: [&[f32]; 3], phase: &mut [f32], margin: &mut [f32]) {
        // Column 0 and the end of the field look alike when all phases repeat; the field starts half a column before 0.
        let end = (self.width - 0.5) / self.columns_per_turn;
        let repeat = self.cycle.map_or([f32::INFINITY, 0.0], |cycle| [end, cycle]);
        if self.climbs {
            self.climb(wrapped, repeat, phase, margin);
        } else {
            self.search(wrapped, phase, margin);
            let [end, cycle] = repeat.map(|turns| turns * TAU);
            for phase in phase {
                let below = *phase - cycle;
                *phase = if *phase >= end { below } else { *phase };
            }
        }
    }

    /// In turns, of which whole ones are easily told. From `end` on there is one cycle less.
    #[inline(always)]
    fn climb(&self, wrapped: [&[f32]; 3], [end, cycle]: [f32; 2], phase: &mut [f32], margin: &mut [f32]) {
        let [n1, n2, n3] = self.numbers;
        let (coarse, middle) = (n1 - n2, n1 - n3);
        let sign = coarse.signum();
        let (to_middle, to_first) = (middle / coarse.abs(), n1 / middle);
        let out = phase.iter_mut().zip(margin);
        let seen = wrapped[0].iter().zip(wrapped[1]).zip(wrapped[2]);
        for (((&first_rad, second_rad), third_rad), (phase, margin)) in seen.zip(out) {
            let [first, second, third] = [first_rad, *second_rad, *third_rad].map(|rad| rad * (1.0 / TAU));
            let start = (first - second) * sign;
            let start = start - round(start);
            let start = if start < 0.0 { start + 1.0 } else { start };
            let (more, low) = whole(start * to_middle - (first - third));
            let beat = (first - third) + more;
            let (more, high) = whole(beat * to_first - first);
            let more = if first + more >= end { more - cycle } else { more };
            *phase = first_rad + TAU * more;
            *margin = 1.0 - 2.0 * if low > high { low } else { high };
        }
    }

    fn search(&self, wrapped: [&[f32]; 3], phase: &mut [f32], margin: &mut [f32]) {
        let [first, second, third] = wrapped.map(|row| row.chunks(BLOCK));
        let out = phase.chunks_mut(BLOCK).zip(margin.chunks_mut(BLOCK));
        for (((first, second), third), (phase, margin)) in first.zip(second).zip(third).zip(out) {
            self.search_block([first, second, third], phase, margin);
        }
    }

    /// Every order in turn for a block of pixels: the one with the least squared miss of the other two phasors, and how
    /// far behind the next one is.
    fn search_block(&self, wrapped: [&[f32]; 3], phase: &mut [f32], margin: &mut [f32]) {
        let [first, second, third] = wrapped;
        let ratios = [1, 2].map(|i| self.numbers[i] / self.numbers[0]);
        let (mut least, mut next) = ([f32::INFINITY; BLOCK], [f32::INFINITY; BLOCK]);
        for order in 0..self.orders {
            for i in 0..first.len() {
                let guess = wrap_positive(first[i]) + TAU * order as f32;
                let miss = |ratio: f32, seen: f32| 1.0 - sin_cos(guess * ratio - seen).1;
                let cost = miss(ratios[0], second[i]) + miss(ratios[1], third[i]);
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
            let seen = (first[i] + second[i] + third[i]).is_finite();
            (phase[i], margin[i]) = if seen { (phase[i], margin[i]) } else { (f32::NAN, f32::NAN) };
        }
    }
}

/// Whole turns, and how far they are from the choice between two.
#[inline(always)]
fn whole(turns: f32) -> (f32, f32) {
    let whole = round(turns);
    (whole, (turns - whole).abs())
}

/// Absolute phase in rad and order margin in [0, 1], both `(rows, columns)`, from three wrapped phases in rad; NaN in,
/// NaN out.
///
/// # Errors
/// [`Error::Shape`] when the maps differ in size.
///
/// ```
/// use ndarray::Array2;
/// use quadfringe::{FringeCode, stages::unwrap};
/// let code = FringeCode::optimum(36, 912)?;
/// let wrapped = |n: f64| Array2::from_shape_fn((1, 912), |(_, u)| {
///     let phase = std::f64::consts::TAU * n * u as f64 / 912.0;
///     phase.sin().atan2(phase.cos()) as f32
/// });
/// let [a, b, c] = code.numbers().map(wrapped);
/// let (phase, margin) = unwrap(&code, [a.view(), b.view(), c.view()])?;
/// assert!((phase[[0, 500]] / std::f32::consts::TAU * 912.0 / 36.0 - 500.0).abs() < 1e-2);
/// assert!(margin[[0, 500]] > 0.9);
/// # Ok::<(), quadfringe::Error>(())
/// ```
pub fn unwrap(code: &FringeCode, wrapped: [ArrayView2<'_, f32>; 3]) -> Result<(Array2<f32>, Array2<f32>)> {
    let [first, second, third] = &wrapped;
    for (map, name) in [(second, "second wrapped phase"), (third, "third wrapped phase")] {
        if map.dim() != first.dim() {
            return Err(Error::shape(name, first.shape(), map.shape()));
        }
    }
    let ladder = Ladder::new(code);
    let mut phase = Array2::from_elem(first.raw_dim(), f32::NAN);
    let mut margin = phase.clone();
    let wrapped = wrapped.map(|map| map.as_standard_layout().into_owned());
    let rows = (phase.axis_iter_mut(Axis(0)).into_par_iter()).zip(margin.axis_iter_mut(Axis(0)));
    rows.enumerate().for_each(|(y, (mut phase, mut margin))| {
        let contiguous = "rows in standard layout are contiguous";
        let [a, b, c] = wrapped.each_ref().map(|map| map.row(y).to_slice().expect(contiguous));
        let phase = phase.as_slice_mut().expect(contiguous);
        ladder.order_row([a, b, c], phase, margin.as_slice_mut().expect(contiguous));
    });
    Ok((phase, margin))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn phases(code: &FringeCode, column: f64) -> [f32; 3] {
        code.numbers().map(|n| {
            let phase = std::f64::consts::TAU * n * column / code.projector_width() as f64;
            phase.sin().atan2(phase.cos()) as f32
        })
    }

    #[test]
    fn every_column_of_every_kind_of_code_is_found() {
        let codes = [
            FringeCode::optimum(36, 912).unwrap(),
            FringeCode::optimum(64, 1280).unwrap(),
            FringeCode::new([1920.0 / 42.0, 1920.0 / 45.0, 40.0], 1920).unwrap(),
            FringeCode::new([30.0, 31.0, 36.0], 912).unwrap(),
        ];
        for code in codes {
            let ladder = Ladder::new(&code);
            for i in 0..2 * code.projector_width() {
                let column = i as f64 / 2.0 + 0.1;
                if column >= code.projector_width() as f64 - 0.5 {
                    continue;
                }
                let found = ladder.order(phases(&code, column)).phase_rad / TAU * ladder.columns_per_turn;
                assert!((f64::from(found) - column).abs() < 0.01, "{code:?} {column} {found}");
            }
        }
    }

    #[test]
    fn the_first_column_does_not_jump_to_the_last_under_noise() {
        let code = FringeCode::optimum(36, 912).unwrap();
        let ladder = Ladder::new(&code);
        for noise in [-0.05f32, 0.05] {
            let wrapped = phases(&code, 0.0).map(|p| p + noise);
            let found = ladder.order([wrapped[0], wrapped[1] - 2.0 * noise, wrapped[2]]);
            assert!(found.phase_rad.abs() < 0.1, "{noise} {found:?}");
        }
    }
}
