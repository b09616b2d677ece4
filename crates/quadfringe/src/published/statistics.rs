//! Statistics of a shot from a few sampled rows.

use super::Published;
use super::strip::{StripPlan, decode_strip};
use super::uncertainty::ShotStatistics;
use crate::Shot;
use crate::condition::Sample;
use crate::decode::output::OutputRow;
use crate::stages::{SAMPLE_STRIDE, is_sampled};
use rayon::prelude::*;

use super::strip::Strip;

/// Second differences of R and B along the columns, for one row.
struct SecondDifferences {
    red: Vec<f32>,
    blue: Vec<f32>,
}

impl SecondDifferences {
    fn new(width: usize) -> Self {
        Self { red: vec![0.0; width], blue: vec![0.0; width] }
    }

    /// Computes the second differences of row `y`.
    fn measure<T: Sample>(&mut self, y: usize, strip: &mut Strip, plan: &StripPlan<'_>, shot: &Shot<'_, T>) {
        let width = self.red.len();
        for (row, weight) in [(y - 1, 1.0), (y, -2.0), (y + 1, 1.0)] {
            plan.conditioning.row(shot, row, &mut strip.light(width));
            let kept = if row < y { 0.0 } else { 1.0 };
            for (sum, light) in [(&mut self.red, strip.red()), (&mut self.blue, strip.blue())] {
                sum.iter_mut().zip(light).for_each(|(sum, light)| *sum = kept * *sum + weight * light);
            }
        }
    }
}

/// Samples from which the statistics are computed.
#[derive(Default)]
struct Sampled {
    second_differences: Vec<f32>,
    margins: Vec<f32>,
}

impl Published {
    /// Whether a strip of `count` rows that starts at row `first` contains sampled rows.
    pub(super) fn has_sampled_rows(&self, first: usize, count: usize) -> bool {
        (first..first + count).any(|y| is_sampled(y, self.shape[0]))
    }

    /// Decodes the strips that contain sampled rows, with uncertainties in units of the noise, and returns the
    /// statistics of these rows.
    pub(super) fn sample<T: Sample>(
        &self,
        plan: &StripPlan<'_>,
        shot: &Shot<'_, T>,
        rows: &mut [OutputRow<'_>],
    ) -> ShotStatistics {
        let [height, width] = self.shape;
        let strip_rows = plan.blocks.rows;
        let strips = rows.chunks_mut(strip_rows).enumerate().map(|(index, rows)| (index * strip_rows, rows));
        let strips: Vec<_> =
            strips.filter(|(first, rows)| self.has_sampled_rows(*first, rows.len())).collect();
        let sampled = strips.into_par_iter().map_init(
            || (self.slots.take(), SecondDifferences::new(width)),
            |(strip, differences), (first, rows)| {
                decode_strip(strip, plan, shot, first, rows);
                let mut found = Sampled::default();
                for y in (first..first + rows.len()).filter(|y| is_sampled(*y, height)) {
                    differences.measure(y, strip, plan, shot);
                    let quality = &rows[y - first].quality;
                    for x in (0..width).step_by(SAMPLE_STRIDE).filter(|&x| quality[x].is_finite()) {
                        found.second_differences.extend([differences.red[x], differences.blue[x]]);
                        found.margins.push(quality[x]);
                    }
                }
                found
            },
        );
        let mut all = Sampled::default();
        for mut found in sampled.collect::<Vec<_>>() {
            all.second_differences.append(&mut found.second_differences);
            all.margins.append(&mut found.margins);
        }
        ShotStatistics::new(&mut all.second_differences, &all.margins)
    }
}
