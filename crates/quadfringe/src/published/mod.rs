//! The published chain: every strip of a few rows on its own, from bytes to absolute phase.

mod means;
mod strip;
mod uncertainty;

use crate::condition::{Plan, Sample};
use crate::decode::options::Options;
use crate::decode::output::Decoded;
use crate::decode::output::{Finish, OutputRow, ROWS_AT_ONCE};
use crate::height::PairTable;
use crate::parallel::slots::Slots;
use crate::stages::Ladder;
use crate::stages::{Band, LineSpectrum, RowFilter};
use crate::{FringeCode, Shot};
use ndarray::ArrayView1;
use rayon::prelude::*;
use strip::{Strip, StripPlan, decode_strip};
use uncertainty::Sureness;

/// Rows of the red image that are looked at for the carrier.
const CARRIER_ROWS: usize = 16;
/// One pixel in so many of those rows is asked for noise and margin.
const LOOK_STRIDE: usize = 3;

/// Fewest samples of a fringe of G or IR when means of two or four pixels of a row take the place of pixels. The band ends at 2.3 times the
/// carrier, where a turn has more than five of them: from one to the next the phase is far from half a turn, and nearly
/// straight in between.
const SAMPLES_PER_FRINGE: f32 = 13.0;

/// Rows of a strip for each pixel of a row that goes into a mean.
const ROWS_PER_PIXEL: usize = 2;

/// How the order of a pixel is found.
enum Unwrapping {
    /// By beats, taking both projectors as one.
    Ladder(Ladder),
    /// Among the points of the camera ray.
    AlongRay(Box<PairTable>),
}

pub(crate) struct Published {
    unwrapping: Unwrapping,
    /// For rows of pixels, and of means of two and of four.
    filters: [RowFilter; 3],
    spectrum: LineSpectrum,
    slots: Slots<Strip>,
    numbers: [f64; 3],
    shape: [usize; 2],
}

impl Published {
    pub fn new(code: &FringeCode, shape: [usize; 2]) -> Self {
        Self {
            unwrapping: Unwrapping::Ladder(Ladder::new(code)),
            filters: [1, 2, 4].map(|pixels| RowFilter::new((shape[1] / pixels).max(1))),
            spectrum: LineSpectrum::new(shape[1]),
            slots: Slots::default(),
            numbers: code.numbers(),
            shape,
        }
    }

    /// Search the camera rays from now on.
    pub fn unwrap_along_rays(&mut self, table: PairTable) {
        self.unwrapping = Unwrapping::AlongRay(Box::new(table));
    }

    pub fn searches_rays(&self) -> bool {
        matches!(self.unwrapping, Unwrapping::AlongRay(_))
    }

    pub fn run<T: Sample>(
        &mut self,
        plan: &Plan,
        shot: &Shot<'_, T>,
        options: &Options,
        finish: &Finish<'_>,
        out: &mut Decoded,
    ) {
        let period = match options.period_px {
            Some(period) => period,
            None => self.period_px(plan, shot),
        };
        let periods_px = self.numbers.map(|n| (period * self.numbers[0] / n) as f32);
        let finest = periods_px[1].min(periods_px[2]).min(self.shape[1] as f32);
        let sparse = |halvings: &usize| finest >= SAMPLES_PER_FRINGE * (1 << halvings) as f32;
        let halvings = (1..self.filters.len()).take_while(sparse).last().unwrap_or(0);
        let (filter, pixels) = (&self.filters[halvings], 1 << halvings);
        let weights = |period_px: f32| filter.weights(Band::Improved, period_px / pixels as f32, pixels);
        let mut strips = StripPlan {
            conditioning: plan,
            unwrapping: &self.unwrapping,
            filter,
            pixels,
            rows: ROWS_PER_PIXEL * pixels,
            periods_px,
            weights: [weights(periods_px[1]), weights(periods_px[2])],
            modulation_min: options.modulation_min,
            quality_min: options.quality_min,
            sureness: Sureness::none(),
        };
        let mut rows = out.row_by_row();
        strips.sureness = self.look(&strips, shot, &mut rows);
        let strips = strips;
        rows.par_chunks_mut(strips.rows)
            .with_min_len(ROWS_AT_ONCE.div_ceil(strips.rows))
            .enumerate()
            .for_each_init(
                || self.slots.take(),
                |strip, (index, rows)| {
                    let first = index * strips.rows;
                    if self.looked_at(first, rows.len()).next().is_some() {
                        rows.iter_mut().for_each(|row| strips.sureness.tell(row));
                    } else {
                        decode_strip(strip, &strips, shot, first, rows);
                    }
                    rows.iter_mut().zip(first..).for_each(|(row, y)| finish.row(y, row));
                },
            );
    }

    /// Those of `count` rows from the `first` on that tell what all have in common: they have neighbours above and below.
    fn looked_at(&self, first: usize, count: usize) -> impl Iterator<Item = usize> {
        let height = self.shape[0];
        let every = height.div_ceil(CARRIER_ROWS);
        let told = move |y: &usize| y % every == 1 % every && (1..height - 1).contains(y);
        (first..first + count).filter(told)
    }

    /// Noise of the shot and of its orders, from a few rows, whose strips are decoded in units of the noise.
    fn look<T: Sample>(
        &self,
        plan: &StripPlan<'_>,
        shot: &Shot<'_, T>,
        rows: &mut [OutputRow<'_>],
    ) -> Sureness {
        let width = self.shape[1];
        let strips = rows.chunks_mut(plan.rows).enumerate().map(|(index, rows)| (index * plan.rows, rows));
        let strips: Vec<_> =
            strips.filter(|(first, rows)| self.looked_at(*first, rows.len()).next().is_some()).collect();
        let seen = strips.into_par_iter().map_init(
            || (self.slots.take(), [vec![0.0; width], vec![0.0; width]]),
            |(strip, bend), (first, rows)| {
                decode_strip(strip, plan, shot, first, rows);
                let (mut bends, mut margins) = (Vec::new(), Vec::new());
                for y in self.looked_at(first, rows.len()) {
                    for (other, weight) in [(y - 1, 1.0), (y, -2.0), (y + 1, 1.0)] {
                        plan.conditioning.row(shot, other, &mut strip.light(width));
                        for (bend, light) in bend.iter_mut().zip([strip.red(), strip.blue()]) {
                            let kept = if other < y { 0.0 } else { 1.0 };
                            bend.iter_mut()
                                .zip(light)
                                .for_each(|(bend, light)| *bend = kept * *bend + weight * light);
                        }
                    }
                    let quality = &rows[y - first].quality;
                    let trusted = || (0..width).step_by(LOOK_STRIDE).filter(|&x| quality[x].is_finite());
                    bends.extend(trusted().flat_map(|x| [bend[0][x], bend[1][x]]));
                    margins.extend(trusted().map(|x| quality[x]));
                }
                (bends, margins)
            },
        );
        let (bends, margins): (Vec<_>, Vec<_>) = seen.unzip();
        Sureness::new(&mut bends.concat(), &mut margins.concat())
    }

    /// Fringe period along rows, from a few rows of red light; the whole row when there is none to see.
    fn period_px<T: Sample>(&mut self, plan: &Plan, shot: &Shot<'_, T>) -> f64 {
        let [height, width] = self.shape;
        let mut strip = self.slots.take();
        for y in (0..height).step_by(height.div_ceil(CARRIER_ROWS)) {
            plan.row(shot, y, &mut strip.light(width));
            self.spectrum.add(ArrayView1::from(strip.red()));
        }
        self.spectrum.take_period_px().clamp(3.0, width as f64)
    }
}
