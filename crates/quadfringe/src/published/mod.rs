//! THE RECIPE of the published method: from one exposure to absolute phase, with the steps of
//! `docs/method/published.md`.
//!
//! | step | stage | equation |
//! |---|---|---|
//! | 1 linear light, registered, without crosstalk | `condition::linearise` | (S1) |
//! | 2 fringe period, and the background by the mean envelope | `row_period_px`, `block_means`, `background` | |
//! | 3 two-step phase of R and B with equal modulations | `modulation_ratio`, `two_step` | (S2) |
//! | 4 Fourier phase of G and IR in the improved band | `fourier_pair` | (S3) |
//! | 5 fringe orders by the ladder of beats | `unwrap` | (S4) |
//! |   or along the camera rays | `PairTable::unwrap_blocks` | |
//! | 6 absolute phase of each pixel; low modulation and doubtful orders are no data | `nearest_turn`, `discard_invalid` | |
//! | 7 uncertainty and wrong-order probability | `wrong_order_probability` | |
//! | 8 projector column and height | `columns_from_phase`, `height::Triangulator` | (S7) |
//!
//! Orders are found from means over blocks of a few pixels, which have less noise; the phase comes from single pixels. For a
//! given `encoding`, `shot` and `conditioner`, the functions of [`stages`](crate::stages) give results that are bit-identical
//! to those of the decoder (`tests/stages.rs` compares every map):
//!
//! ```
//! # use ndarray::{Array2, ArrayView2, Zip};
//! # use quadfringe::condition::linearise;
//! # use quadfringe::stages::*;
//! # use quadfringe::{Conditioner, Decoder, DmdLayout, Encoding, Method, Options, Shot};
//! # let encoding = Encoding::optimum(16, 400)?;
//! # let planes = encoding.patterns(64, DmdLayout::Regular);
//! # let shot = Shot::try_from(planes.as_slice())?;
//! # let conditioner = Conditioner::default();
//! # let (height, width) = (64, 400);
//! // 1. Linear light (S1). The Fourier filter needs rows without gaps.
//! let [red, green, blue, infrared] = linearise(&shot, &conditioner)?;
//! let filled = fill_gaps(infrared.view());
//! // 2. The fringe period along the rows, and the period of each phase in proportion to its fringe number.
//! let numbers = Phases::from_array(encoding.four_channel_view()?.numbers());
//! let period_px = row_period_px(red.view());
//! let periods_px = numbers.map(|number| period_px * numbers.quadrature / number);
//! let blocks = Blocks::for_periods(periods_px.green as f32, periods_px.infrared as f32, width);
//! // 2. Background by the mean envelope, of means over the rows of each block.
//! let fringes = |image: &Array2<f32>, columns: usize, period_px: f64| {
//!     let means = block_means(image.view(), blocks.rows, columns)?;
//!     let level = background(means.view(), Background::MeanEnvelope, period_px / columns as f64)?;
//!     Ok::<_, quadfringe::Error>((means - &level, level))
//! };
//! let (red_means, red_level) = fringes(&red, 1, periods_px.quadrature)?;
//! let (blue_means, blue_level) = fringes(&blue, 1, periods_px.quadrature)?;
//! let (green_means, _) = fringes(&green, blocks.columns, periods_px.green)?;
//! let (infrared_means, _) = fringes(&filled, blocks.columns, periods_px.infrared)?;
//! // 3. Two-step phase of R and B (S2), of the means and of single pixels.
//! let ratio = modulation_ratio(red_means.view(), blue_means.view())?.insert_axis(ndarray::Axis(1));
//! let pixels = |map: ArrayView2<f32>| repeat_rows(map, blocks.rows, height);
//! let coarse = two_step_coarse(red_means.view(), (&blue_means * &ratio).view())?;
//! let red_fringes = red - pixels(red_level.view())?;
//! let blue_fringes = (blue - pixels(blue_level.view())?) * pixels(ratio.view())?;
//! let wrapped = two_step(red_fringes.view(), blue_fringes.view())?;
//! // 4. Fourier phase of G and IR (S3).
//! let period = |period_px: f64| period_px / blocks.columns as f64;
//! let green = Fringes { means: green_means.view(), period: period(periods_px.green) };
//! let ir = Fringes { means: infrared_means.view(), period: period(periods_px.infrared) };
//! let [green, ir] = fourier_pair(green, ir, blocks.columns, width)?;
//! // 5. Fringe orders of the means by the ladder of beats (S4).
//! let phases = Phases { quadrature: coarse.view(), green: green.phase_rad.view(), infrared: ir.phase_rad.view() };
//! let means = unwrap(&encoding, phases)?;
//! // 6. Absolute phase of single pixels.
//! let phase_rad = nearest_turn(wrapped.view(), pixels(means.phase_rad.view())?.view())?;
//! let absolute = Absolute::new(phase_rad, pixels(means.margin.view())?)?;
//! // 6. Low modulation is no data. The least of all channels counts, and gaps in IR have none.
//! let mut modulation = modulation(red_fringes.view(), blue_fringes.view())?;
//! let (green, ir) = (pixels(green.modulation.view())?, pixels(ir.modulation.view())?);
//! Zip::from(&mut modulation).and(&green).and(&ir).for_each(|least, green, ir| *least = least.min(*green).min(*ir));
//! Zip::from(&mut modulation).and(&infrared).for_each(|least, ir| if ir.is_nan() { *least = f32::NAN });
//! let limits = Limits { modulation_min: 0.02, quality_min: 0.15 };
//! let valid = discard_invalid(&absolute, modulation.view(), limits)?;
//! // 7. Probability of a wrong order.
//! let wrong = wrong_order_probability(valid.quality.view());
//! // 8. Projector columns, from which the height follows (S7).
//! let columns = columns_from_phase(&encoding, valid.phase_rad.view());
//! # let options = Options::default().with_method(Method::published());
//! # let builder = Decoder::builder(&encoding, [height, width]).conditioner(conditioner).options(options);
//! # let decoded = builder.build()?.decode(&shot)?;
//! # let bits = |map: &Array2<f32>| map.mapv(f32::to_bits);
//! # assert_eq!(bits(&columns.column_px), bits(&decoded.column_px));
//! # assert_eq!(bits(&valid.quality), bits(&decoded.quality));
//! # assert_eq!(bits(&modulation), bits(&decoded.modulation));
//! # Ok::<(), quadfringe::Error>(())
//! ```
//!
//! Without an infrared channel (`Encoding::rgb`) there is no second beat: the one of R and B with G finds the order by itself.
//!
//! The decoder takes the same steps strip by strip (`strip.rs`); a strip has the rows of one block.

mod statistics;
mod strip;
mod uncertainty;

use crate::Shot;
use crate::condition::{Plan, Sample};
use crate::decode::options::Options;
use crate::decode::output::{Decoded, Finish};
use crate::decode::params::{MODULATION_MIN, ROWS_AT_ONCE};
use crate::encoding::FourChannel;
use crate::height::PairTable;
use crate::parallel::slots::Slots;
use crate::stages::{Band, Blocks, Ladder, Limits, LineSpectrum, Phases, RowFilter, period_rows};
use ndarray::ArrayView1;
use rayon::prelude::*;
use std::sync::Arc;
use strip::{Alone, FourierPair, Strip, StripPlan, decode_strip};
use uncertainty::ShotStatistics;

/// How fringe orders are found.
enum Unwrapping {
    /// By the ladder of beats, which assumes coaxial projectors.
    Ladder(Ladder),
    /// Along the camera ray, if both projectors are calibrated.
    AlongRay(Arc<PairTable>),
}

/// The published method for images of one size, planned once.
pub(crate) struct Published {
    unwrapping: Unwrapping,
    /// One Fourier filter for each width of blocks.
    filters: Vec<SizedFilter>,
    spectrum: LineSpectrum,
    slots: Slots<Strip>,
    numbers: Phases<f64>,
    /// Whether there is a third phase, of IR or of B alone.
    third: bool,
    /// Whether R and B are in quadrature.
    quadrature: bool,
    /// Rows and columns of the images.
    shape: [usize; 2],
}

/// The Fourier filter for rows of means over `columns` columns.
struct SizedFilter {
    columns: usize,
    filter: RowFilter,
}

impl Published {
    pub fn new(code: &FourChannel, shape: [usize; 2]) -> Self {
        let filter =
            |columns: usize| SizedFilter { columns, filter: RowFilter::new((shape[1] / columns).max(1)) };
        Self {
            unwrapping: Unwrapping::Ladder(Ladder::new(code)),
            filters: Blocks::all_columns().map(filter).collect(),
            spectrum: LineSpectrum::new(shape[1]),
            slots: Slots::default(),
            // The row of a channel that is absent is dark, and any period will do.
            numbers: Phases {
                infrared: if code.has_third() { code.numbers()[2] } else { code.green },
                ..Phases::from_array(code.numbers())
            },
            third: code.has_third(),
            quadrature: code.has_quadrature(),
            shape,
        }
    }

    /// Makes all later shots search fringe orders along the camera rays.
    pub fn unwrap_along_rays(&mut self, table: Arc<PairTable>) {
        self.unwrapping = Unwrapping::AlongRay(table);
    }

    pub fn run<T: Sample>(
        &mut self,
        conditioning: &Plan,
        shot: &Shot<'_, T>,
        options: &Options,
        finish: &Finish<'_>,
        out: &mut Decoded,
    ) {
        // 2. The fringe period.
        let period_px = options.period_px_or(|| self.period_px(conditioning, shot));
        let mut plan = self.plan(conditioning, options, period_px);
        let mut rows = out.row_by_row();
        // 7. Uncertainties follow from statistics of the shot, which come from a few strips.
        plan.statistics = self.sample(&plan, shot, &mut rows);
        let plan = plan;
        rows.par_chunks_mut(plan.blocks.rows)
            .with_min_len(ROWS_AT_ONCE.div_ceil(plan.blocks.rows))
            .enumerate()
            .for_each_init(
                || self.slots.take(),
                |strip, (index, rows)| {
                    let first = index * plan.blocks.rows;
                    if self.has_sampled_rows(first, rows.len()) {
                        rows.iter_mut().for_each(|row| plan.statistics.complete(row));
                    } else {
                        // 1. to 7., strip by strip.
                        decode_strip(strip, &plan, shot, first, rows);
                    }
                    // 8. Columns and heights (S7).
                    rows.iter_mut().zip(first..).for_each(|(row, y)| finish.row(y, row));
                },
            );
    }

    /// The data that all strips of a shot share, given its fringe period. The statistics are not known yet.
    fn plan<'a>(&'a self, conditioning: &'a Plan, options: &Options, period_px: f64) -> StripPlan<'a> {
        let numbers = self.numbers;
        let periods_px = numbers.map(|number| (period_px * numbers.quadrature / number) as f32);
        let blocks = Blocks::for_periods(periods_px.green, periods_px.infrared, self.shape[1]);
        let sized = self.filters.iter().find(|sized| sized.columns == blocks.columns);
        let filter = &sized.expect("a filter for every width of blocks").filter;
        let pixels = blocks.columns;
        let weights = |period_px: f32| filter.weights(Band::Improved, period_px / pixels as f32, pixels);
        StripPlan {
            conditioning,
            unwrapping: &self.unwrapping,
            filter,
            third: self.third,
            alone: (!self.quadrature)
                .then(|| Alone::new(filter, weights(periods_px.quadrature), pixels * blocks.rows)),
            weights: FourierPair { green: weights(periods_px.green), infrared: weights(periods_px.infrared) },
            blocks,
            periods_px,
            limits: Limits {
                modulation_min: options.modulation_min.unwrap_or(MODULATION_MIN),
                quality_min: options.quality_min,
            },
            statistics: ShotStatistics::unit_noise(),
        }
    }

    /// Fringe period along the rows in camera pixels, from a few rows of red light.
    fn period_px<T: Sample>(&mut self, conditioning: &Plan, shot: &Shot<'_, T>) -> f64 {
        let [height, width] = self.shape;
        let mut strip = self.slots.take();
        for y in period_rows(height) {
            conditioning.row(shot, y, &mut strip.light(width));
            self.spectrum.add(ArrayView1::from(strip.red()));
        }
        self.spectrum.take_row_period_px()
    }
}
