//! The band of a carrier in a spectrum over lines.

use super::params::{CARRIER_BAND, CARRIER_CYCLES_MIN, QUADRATURE_SHARE_MIN};

/// The strongest waves along the lines of one direction.
#[derive(Default)]
pub(super) struct Waves {
    pub period_px: f64,
    /// Size of the band, to compare the two directions of one image; 0 if no waves stand out.
    pub strength: f64,
}

impl Waves {
    /// The strongest waves in a spectrum over `lines`, if they exceed `least`.
    pub fn strongest(spectrum: &[f32], least: f32, lines: f64) -> Self {
        let length = 2 * (spectrum.len() - 1);
        strongest_band(spectrum, least).map_or_else(Self::default, |band| Self {
            period_px: length as f64 / band.cycles,
            strength: band.sum / (lines * (length as f64).powi(2)),
        })
    }
}

/// The band of a carrier in a quadrature spectrum.
pub(super) struct Band {
    /// Centre of gravity of the squares in cycles per line.
    pub cycles: f64,
    pub sum: f64,
}

/// The band with the greatest sum, if it holds enough of the spectrum.
pub(super) fn strongest_band(quadrature: &[f32], least: f32) -> Option<Band> {
    let bins = CARRIER_CYCLES_MIN..quadrature.len();
    let total: f32 = quadrature[bins.clone()].iter().map(|q| q.abs()).sum();
    let band = |bin: usize| {
        let [low, high] = [bin as f64 / CARRIER_BAND, bin as f64 * CARRIER_BAND];
        &quadrature[low.ceil() as usize..quadrature.len().min(high as usize + 1)]
    };
    let sums = bins.map(|bin| (bin, band(bin).iter().sum::<f32>()));
    let (best, sum) = sums.max_by(|(_, one), (_, other)| one.abs().total_cmp(&other.abs()))?;
    let first = (best as f64 / CARRIER_BAND).ceil();
    // Squares keep what is left of noise in a wide band from moving the centre.
    let weights = band(best).iter().map(|q| f64::from((sum.signum() * q).max(0.0)).powi(2));
    let weight: f64 = weights.clone().sum();
    let moment: f64 = weights.enumerate().map(|(i, weight)| (first + i as f64) * weight).sum();
    let stands_out = sum.abs() > least && sum.abs() > QUADRATURE_SHARE_MIN * total && sum.is_finite();
    stands_out.then(|| Band { cycles: moment / weight, sum: f64::from(sum.abs()) })
}
