//! The published chain: every row on its own, from bytes to absolute phase.

mod row;

use super::output::Finish;
use super::{Decoded, Options};
use crate::condition::{Plan, Sample};
use crate::demod::{Band, LineSpectrum, RowFilter};
use crate::height::PairTable;
use crate::unwrap::Ladder;
use crate::{FringeCode, Shot};
use ndarray::ArrayView1;
use rayon::prelude::*;
use row::{RowPlan, Rows, decode_row};

/// Rows of the red image that are looked at for the carrier.
const CARRIER_ROWS: usize = 16;

/// How the order of a pixel is found.
enum Unwrapping {
    /// By beats, taking both projectors as one.
    Ladder(Ladder),
    /// Among the points of the camera ray.
    AlongRay(Box<PairTable>),
}

pub(super) struct Published {
    unwrapping: Unwrapping,
    filter: RowFilter,
    spectrum: LineSpectrum,
    numbers: [f64; 3],
    shape: [usize; 2],
}

impl Published {
    pub fn new(code: &FringeCode, shape: [usize; 2]) -> Self {
        Self {
            unwrapping: Unwrapping::Ladder(Ladder::new(code)),
            filter: RowFilter::new(shape[1]),
            spectrum: LineSpectrum::new(shape[1]),
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
        let row_plan = RowPlan {
            conditioning: plan,
            unwrapping: &self.unwrapping,
            filter: &self.filter,
            periods_px,
            weights: [1, 2].map(|i: usize| self.filter.weights(Band::Improved, periods_px[i])),
            modulation_min: options.modulation_min,
            quality_min: options.quality_min,
        };
        out.rows().enumerate().for_each_init(
            || Rows::new(&self.filter, self.shape[1]),
            |rows, (y, mut out)| {
                decode_row(rows, &row_plan, shot, y, &mut out);
                finish.row(y, &mut out);
            },
        );
    }

    /// Fringe period along rows, from a few rows of red light; the whole row when there is none to see.
    fn period_px<T: Sample>(&mut self, plan: &Plan, shot: &Shot<'_, T>) -> f64 {
        let [height, width] = self.shape;
        let mut rows = Rows::new(&self.filter, width);
        for y in (0..height).step_by(height.div_ceil(CARRIER_ROWS)) {
            plan.row(shot, y, &mut rows.light_mut());
            self.spectrum.add(ArrayView1::from(rows.red()));
        }
        self.spectrum.take_period_px().clamp(3.0, width as f64)
    }
}
