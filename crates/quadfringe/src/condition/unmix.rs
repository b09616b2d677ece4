//! Removal of crosstalk and then of the projector response, in this order because light mixes after it has left the
//! projector.

use super::params::{CURVE_ENTRIES, CURVE_STEEP_ENTRIES};
use super::{Conditioner, Response};
use crate::Result;

/// The inverse of a crosstalk matrix, and the inverse responses of the projected channels.
#[derive(Debug, Clone)]
pub(super) struct Unmix {
    inverse: [[f32; 4]; 4],
    curves: [Option<Curve>; 4],
}

impl Unmix {
    /// # Errors
    /// As [`Conditioner::check`], for a crosstalk matrix without inverse.
    pub fn new(conditioner: &Conditioner) -> Result<Self> {
        Ok(Self {
            inverse: conditioner.crosstalk_inverse()?,
            curves: conditioner.projector_response.map(Curve::new),
        })
    }

    /// Removes crosstalk from a row of the four channels. In gaps of the infrared image the other channels are computed
    /// with an infrared light of 0, because a NaN would spread along their rows in later filters.
    pub fn row(&self, rows: &mut [&mut [f32]; 4]) {
        for x in 0..rows[0].len() {
            let mut seen = [rows[0][x], rows[1][x], rows[2][x], rows[3][x]];
            let gap = seen[3].is_nan();
            seen[3] = if gap { 0.0 } else { seen[3] };
            for ((row, weights), curve) in rows.iter_mut().zip(&self.inverse).zip(&self.curves) {
                let light = weights.iter().zip(seen).map(|(w, s)| w * s).sum();
                row[x] = curve.as_ref().map_or(light, |curve| curve.at(light));
            }
            rows[3][x] = if gap { f32::NAN } else { rows[3][x] };
        }
    }
}

/// A response as a table, because computing a power for every pixel and channel would take longer than the published
/// method.
#[derive(Debug, Clone)]
struct Curve {
    response: Response,
    table: Vec<f32>,
    /// Range of entries in which straight lines replace the response.
    range: std::ops::Range<f32>,
}

impl Curve {
    /// Makes the table; `None` for the identity, which needs none.
    fn new(response: Response) -> Option<Self> {
        let entry = |i: usize| response.linear(i as f32 / CURVE_ENTRIES as f32);
        let range = response.offset * CURVE_ENTRIES as f32 + CURVE_STEEP_ENTRIES..CURVE_ENTRIES as f32;
        (response != Response::default()).then(|| Self {
            response,
            table: (0..=CURVE_ENTRIES).map(entry).collect(),
            range,
        })
    }

    fn at(&self, light: f32) -> f32 {
        let place = light * CURVE_ENTRIES as f32;
        if !self.range.contains(&place) {
            return self.response.linear(light);
        }
        let first = place as usize;
        let share = place - first as f32;
        self.table[first] + share * (self.table[first + 1] - self.table[first])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_follows_the_response() {
        let response = Response { offset: 0.02, exponent: 1.0 / 2.2, knee: 0.0 };
        let curve = Curve::new(response).expect("bent");
        for i in -20..2400 {
            let light = i as f32 * 5e-4;
            assert!((curve.at(light) - response.linear(light)).abs() < 2e-5, "{light}");
        }
        assert!(Curve::new(Response::default()).is_none());
    }
}
