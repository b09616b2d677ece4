//! The reference measurement: N-step phase shifting at several fringe numbers, from many images of a still object.
//!
//! It is the criterion by which a single shot is judged, and a way to scan objects that keep still. Any number of
//! fringe numbers, each with three steps or more. The steps of `docs/method/reference.md`:
//!
//! | step | file | equation |
//! |---|---|---|
//! | 1 phase and modulation of each fringe number, by least squares over its steps | `demodulate.rs` | (R1), (R2) |
//! | 2 noise of the intensities | `noise.rs` | (R3), (R4) |
//! | 3 column from all phases, by maximum likelihood over all orders | `search.rs` | (R5), (R6) |
//! | 4 disagreement beyond noise, and strays | `trust.rs` | (R7), (R8) |
//! | 5 columns and heights | `height::Triangulator` | (S7) |
//!
//! Steps 1 to 3 of a few rows come first, for steps 2 and 4; then every row takes all steps.
//!
//! ```
//! use ndarray::Array3;
//! use quadfringe::reference::{Reference, ReferenceOptions, StepImages, StepSet};
//! use std::f32::consts::TAU;
//! // A camera that sees the projector's columns one to one, with 4 steps at 36, 35 and 30 fringes.
//! let sets = [36.0, 35.0, 30.0].map(|number| StepSet::new(number, 4));
//! let stacks = sets.map(|set| Array3::from_shape_fn((4, 8, 912), |(s, _, u)| {
//!     0.5 + 0.3 * (TAU * (set.fringe_number as f32 * u as f32 / 912.0 + s as f32 / 4.0)).cos()
//! }));
//! let reference = Reference::new(sets, 912, [8, 912], ReferenceOptions::default(), None)?;
//! let decoded = reference.decode(&StepImages::new(stacks.iter().map(|stack| stack.view()).collect())?)?;
//! assert!((decoded.column_px[[4, 700]] - 700.0).abs() < 1e-2);
//! assert!(decoded.wrong_order_probability[[4, 700]] < 1e-3);
//! # Ok::<(), quadfringe::Error>(())
//! ```

mod demodulate;
mod images;
mod noise;
mod params;
mod plan;
mod row;
mod search;
mod trust;

pub use images::StepImages;
pub use plan::{ReferenceOptions, StepSet};

use crate::condition::Sample;
use crate::decode::Decoded;
use crate::decode::output::{Finish, Wanted};
use crate::error::{Error, Result};
use crate::height::Triangulator;
use crate::parallel::slots::Slots;
use demodulate::{Light, SetPlan};
use noise::{NoiseSamples, noise_of};
use params::{EXCESS_QUANTILE, SAMPLE_ROWS};
use plan::Code;
use rayon::prelude::*;
use row::{RowPlan, Work, Writer};
use search::{Search, Variances};
use trust::{chi_square, disagreement_rad, stray_share};

/// Decodes reference measurements of one size, planned once. Results are bit-identical for any number of threads.
#[derive(Debug)]
pub struct Reference {
    code: Code,
    plans: Vec<SetPlan>,
    search: Search,
    shape: [usize; 2],
    options: ReferenceOptions,
    triangulator: Option<Triangulator>,
    slots: Slots<Work>,
}

impl Reference {
    /// Version of the method, for saved results. It changes whenever the method gives different maps for the same images.
    pub const VERSION: &'static str = "1";

    /// Plans the decoding of images of `shape` (rows, columns) that show `sets` over `projector_width` columns. The phase of the
    /// result is that of the first set. With a triangulator it has points in mm.
    ///
    /// # Errors
    /// [`Error::Value`] for no set, fewer than 3 steps, a fringe number or an option out of range; [`Error::JointRange`] when two
    /// columns have nearly the same phases; [`Error::Shape`] when the calibrated camera has another size.
    pub fn new(
        sets: impl Into<Vec<StepSet>>,
        projector_width: usize,
        shape: [usize; 2],
        options: ReferenceOptions,
        triangulator: Option<Triangulator>,
    ) -> Result<Self> {
        let code = Code::new(sets.into(), projector_width, &options)?;
        let camera = triangulator.as_ref().map_or(shape, |known| <[usize; 2]>::from(known.shape()));
        if camera != shape {
            return Err(Error::shape("calibrated camera", &shape, &camera));
        }
        let plans = code.sets.iter().map(SetPlan::new).collect();
        Ok(Self {
            search: Search::new(&code),
            plans,
            code,
            shape,
            options,
            triangulator,
            slots: Slots::default(),
        })
    }

    /// All options, including those that have their default.
    #[must_use]
    pub const fn options(&self) -> &ReferenceOptions {
        &self.options
    }

    /// Decodes one measurement. `modulation` of the result is the least of all fringe numbers; `quality` is
    /// `1 - sqrt(cost / next cost)` of the two cheapest orders.
    ///
    /// # Errors
    /// As [`Self::decode_into`].
    pub fn decode<T: Sample>(&self, images: &StepImages<'_, T>) -> Result<Decoded> {
        let mut decoded = Decoded::default();
        self.decode_into(images, &mut decoded)?;
        Ok(decoded)
    }

    /// Decodes one measurement into the maps of an earlier one.
    ///
    /// # Errors
    /// [`Error::Value`] for another number of stacks, and for intensities of more than 10 000 times full scale; [`Error::Shape`]
    /// for another number of steps or another size; [`Error::NotFinite`] for NaN or infinity.
    pub fn decode_into<T: Sample>(&self, images: &StepImages<'_, T>, out: &mut Decoded) -> Result<()> {
        images.check(&self.code.sets, self.shape)?;
        out.fit(self.shape, Wanted { points: self.triangulator.is_some(), albedo: false });
        let ReferenceOptions { modulation_min, saturation, response, .. } = self.options;
        let light = Light::new::<T>(images.full_scale(), saturation, response);
        let row = RowPlan { images, plans: &self.plans, light: &light, search: &self.search, modulation_min };
        let writer = self.writer(&row);
        let number = self.code.sets[0].fringe_number;
        let finish = Finish {
            period_px: self.code.projector_width as f64 / number,
            columns_px: [0.0, self.code.projector_width as f64],
            triangulator: self.triangulator.as_ref(),
        };
        out.rows().enumerate().for_each_init(
            || self.slots.take(),
            |work, (y, mut row_out)| {
                row.decode(work, y, &writer, &mut row_out);
                finish.row(y, &mut row_out);
            },
        );
        Ok(())
    }

    /// Steps 2 and 4: the statistics of the measurement, from a few rows.
    fn writer<T: Sample>(&self, row: &RowPlan<'_, '_, T>) -> Writer {
        let height = self.shape[0];
        let every = height.div_ceil(SAMPLE_ROWS).max(1);
        let sampled: Vec<usize> = (every / 2..height).step_by(every).collect();
        let noise: Vec<Vec<NoiseSamples>> =
            sampled.par_iter().map_init(|| self.slots.take(), |work, y| row.noise(work, *y)).collect();
        let mut joined = vec![NoiseSamples::default(); self.plans.len()];
        for row in noise {
            joined.iter_mut().zip(row).for_each(|(joined, samples)| joined.join(samples));
        }
        let noise = noise_of(&mut joined, &self.plans);
        let by_noise = Variances { noise, disagreement_rad: 0.0 };
        let agreements: Vec<Vec<_>> = sampled
            .par_iter()
            .map_init(|| self.slots.take(), |work, y| row.agreements(work, *y, by_noise))
            .collect();
        let variances = Variances {
            noise,
            disagreement_rad: disagreement_rad(&agreements.concat(), self.search.freedom()),
        };
        let evidence: Vec<Vec<f32>> = sampled
            .par_iter()
            .map_init(|| self.slots.take(), |work, y| row.evidence(work, *y, variances))
            .collect();
        let strays = if self.search.freedom() > 0 { stray_share(&evidence.concat()) } else { 0.0 };
        let freedom = self.search.freedom();
        let usual = if freedom > 0 { chi_square(freedom, EXCESS_QUANTILE) as f32 } else { f32::MAX };
        let images: usize = self.code.sets.iter().map(|set| set.steps).sum();
        // The largest of n normal values is expected at sqrt(2 ln n) standard deviations or less.
        let noise_peak = noise * (2.0 * (images as f32).ln()).sqrt();
        let number = self.code.sets[0].fringe_number as f32;
        Writer { variances, strays, usual, number, noise_peak }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::{Array3, s};
    use rayon::ThreadPoolBuilder;
    use std::f64::consts::TAU;

    /// Steps with a little arbitrary noise; every tenth row and a block are dark.
    fn stacks(sets: &[StepSet]) -> Vec<Array3<u8>> {
        let light = |set: &StepSet| {
            let (number, steps) = (set.fringe_number, set.steps);
            Array3::from_shape_fn((steps, 50, 150), |(s, y, x)| {
                let turns =
                    number * (3.0 + 5.7 * x as f64 + 0.2 * y as f64) / 912.0 + s as f64 / steps as f64;
                let noise = ((s * 7919 + y * 104_729 + x * 1_299_709) % 101) as f64 / 10.0;
                let amplitude = if y % 10 == 3 { 0.0 } else { 80.0 };
                (120.0 + noise + amplitude * (TAU * turns).cos()).round() as u8
            })
        };
        sets.iter().map(light).collect()
    }

    fn bits(decoded: &Decoded) -> Vec<u32> {
        let sigma = decoded.uncertainty_rad.as_ref().expect("not calibrated");
        let maps = [&decoded.phase_rad, &decoded.quality, &decoded.wrong_order_probability, sigma];
        maps.into_iter().flatten().map(|value| value.to_bits()).collect()
    }

    #[test]
    fn results_are_the_same_for_any_number_of_threads_and_any_strides() {
        let sets = [StepSet::new(36.0, 5), StepSet::new(35.0, 4), StepSet::new(30.0, 3)];
        let stacks = stacks(&sets);
        let reference =
            Reference::new(sets, 912, [50, 150], ReferenceOptions::default(), None).expect("a plan");
        let images = StepImages::new(stacks.iter().map(|stack| stack.view()).collect()).expect("images");
        let expected = bits(&reference.decode(&images).expect("decodes"));
        for threads in [1, 2, 5] {
            let pool = ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            let found = pool.install(|| reference.decode(&images)).expect("decodes");
            assert_eq!(bits(&found), expected, "{threads} threads");
        }
        let wide: Vec<_> = stacks
            .iter()
            .map(|stack| Array3::from_shape_fn((stack.dim().0, 50, 300), |(s, y, x)| stack[[s, y, x / 2]]))
            .collect();
        let strided = wide.iter().map(|stack| stack.slice(s![.., .., ..;2])).collect();
        let found = reference.decode(&StepImages::new(strided).expect("images")).expect("decodes");
        assert_eq!(bits(&found), expected);
        let dark = found.phase_rad.row(13);
        assert!(dark.iter().all(|phase| phase.is_nan()) && found.phase_rad[[20, 75]].is_finite());
    }
}
