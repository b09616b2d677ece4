//! The peaks function as a relief.

use super::relief::relief_rate;
use super::{REFERENCE_Z_MM, Surface};
use crate::error::{Error, Result};

/// The peaks function as a relief: `z = z0 - scale peaks(x / x_scale, -y / y_scale)`, with
/// `peaks(a, b) = 3 (1 - a)^2 e^(-a^2 - (b+1)^2) - 10 (a/5 - a^3 - b^5) e^(-a^2 - b^2) - e^(-(a+1)^2 - b^2) / 3`.
///
/// ```
/// use quadfringe::surface::{Peaks, Surface};
/// let peaks = Peaks::default();
/// assert!(peaks.value([0.0, 0.0, 700.0]) > 0.0 && peaks.value([0.0, 0.0, 820.0]) < 0.0);
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Peaks {
    z_mm: f64,
    scale_mm: f64,
}

/// Lengths of one unit of the peaks function.
const PEAKS_UNIT_MM: [f64; 2] = [53.333_333, 40.0];
/// Least and greatest value of the peaks function, rounded outwards.
const PEAKS_RANGE: [f64; 2] = [-6.56, 8.11];
/// Greatest slope of the function with the units above, for a scale of 1 mm: 0.3281, rounded up.
const PEAKS_SLOPE_PER_MM: f64 = 0.34;

impl Peaks {
    /// Peaks on the plane z = `z_mm`; a scale of 2.729016 mm gives 40 mm from peak to valley.
    ///
    /// # Errors
    /// [`Error::Value`] when a number is not finite or the scale is not positive.
    pub fn new(z_mm: f64, scale_mm: f64) -> Result<Self> {
        if !(z_mm.is_finite() && scale_mm.is_finite() && scale_mm > 0.0) {
            let actual = format!("z {z_mm} mm, scale {scale_mm} mm");
            return Err(Error::value("peaks", "a finite depth and a positive scale", actual));
        }
        Ok(Self { z_mm, scale_mm })
    }
}

impl Default for Peaks {
    /// 40 mm from peak to valley, on the reference plane of the ready scenes.
    fn default() -> Self {
        Self { z_mm: REFERENCE_Z_MM, scale_mm: 2.729_016 }
    }
}

fn peaks(a: f64, b: f64) -> f64 {
    let (a2, b2) = (a * a, b * b);
    let common = (-a2 - b2).exp();
    let first = 3.0 * (1.0 - a) * (1.0 - a) * (-a2 - (b + 1.0) * (b + 1.0)).exp();
    let third = (-(a + 1.0) * (a + 1.0) - b2).exp() / 3.0;
    first - 10.0 * (a / 5.0 - a * a2 - b2 * b2 * b) * common - third
}

impl Surface for Peaks {
    fn value(&self, [x, y, z]: [f64; 3]) -> f64 {
        self.z_mm - self.scale_mm * peaks(x / PEAKS_UNIT_MM[0], -y / PEAKS_UNIT_MM[1]) - z
    }

    fn bounds_mm(&self) -> [[f64; 3]; 2] {
        let [low, high] = PEAKS_RANGE.map(|value| self.z_mm - self.scale_mm * value);
        let far = f64::INFINITY;
        [[-far, -far, high], [far, far, low]]
    }

    fn rate_limit(&self, direction: [f64; 3]) -> f64 {
        relief_rate(PEAKS_SLOPE_PER_MM * self.scale_mm, direction)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forty_millimetres_from_peak_to_valley() {
        let steps = 600;
        let place = |i: i32| 7.0 * f64::from(i) / f64::from(steps) - 3.5;
        let values = (0..steps).flat_map(|i| (0..steps).map(move |j| peaks(place(i), place(j))));
        let [low, high] = values.fold([0f64; 2], |[l, h], v| [l.min(v), h.max(v)]);
        assert!((Peaks::default().scale_mm * (high - low) - 40.0).abs() < 0.01);
        assert!(PEAKS_RANGE[0] <= low && high <= PEAKS_RANGE[1]);
        assert!(Peaks::new(800.0, -1.0).is_err());
    }
}
