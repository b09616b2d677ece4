//! The fringe period that the camera sees, estimated from the shot itself.

use super::fourier::RowFilter;
use ndarray::ArrayView2;

/// Lines that are looked at in each direction: enough to average out objects, few enough to cost nothing.
const LINES: usize = 48;
/// Fewest fringes over the image that count as a carrier.
const FEWEST: usize = 4;
/// Share of the power that a carrier must hold to be believed.
const SHARE: f32 = 0.2;

/// Fringe period in camera pixels along rows and columns; infinite where no carrier stands out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Carrier {
    /// Period along a row.
    pub row_px: f64,
    /// Period along a column.
    pub column_px: f64,
}

impl Carrier {
    /// Period across the fringes, for fringes in any direction.
    #[must_use]
    pub fn period_px(&self) -> f64 {
        1.0 / (1.0 / self.row_px).hypot(1.0 / self.column_px)
    }
}

/// The carrier of a fringe image: the strongest line of the mean power spectrum of its rows and of its columns.
///
/// ```
/// use ndarray::Array2;
/// use quadfringe::demod::carrier;
/// let image = Array2::from_shape_fn((64, 512), |(_, x)| (x as f32 * std::f32::consts::TAU / 20.0).cos());
/// let found = carrier(image.view());
/// assert!((found.row_px - 20.0).abs() < 0.2);
/// assert!((found.period_px() - 20.0).abs() < 0.2);
/// ```
#[must_use]
pub fn carrier(image: ArrayView2<'_, f32>) -> Carrier {
    Carrier { row_px: line_period(image), column_px: line_period(image.reversed_axes()) }
}

fn line_period(image: ArrayView2<'_, f32>) -> f64 {
    let (lines, length) = image.dim();
    if length < 4 * FEWEST {
        return f64::INFINITY;
    }
    let filter = RowFilter::new(length);
    let mut scratch = filter.scratch();
    let mut power = vec![0.0f32; length / 2 + 1];
    let window: Vec<f32> = (0..length)
        .map(|x| (std::f32::consts::PI * (x as f32 + 0.5) / length as f32).sin().powi(2))
        .collect();
    for line in (0..lines).step_by(lines.div_ceil(LINES)) {
        let row = image.row(line);
        let mean = row.sum() / length as f32;
        for ((value, &sample), weight) in scratch.input.iter_mut().zip(row).zip(&window) {
            *value = if sample.is_finite() { (sample - mean) * weight } else { 0.0 };
        }
        filter.add_power(&mut scratch, &mut power);
    }
    strongest(&power).map_or(f64::INFINITY, |cycles| length as f64 / cycles)
}

/// Centre of the strongest line in cycles, when it holds a fair share of all power above the lowest frequencies.
fn strongest(power: &[f32]) -> Option<f64> {
    let total: f32 = power[FEWEST..].iter().sum();
    let peak = (FEWEST..power.len()).max_by(|&a, &b| power[a].total_cmp(&power[b]))?;
    let around = peak.saturating_sub(3).max(FEWEST)..(peak + 4).min(power.len());
    let near: f32 = power[around.clone()].iter().sum();
    let moment: f32 = around.map(|bin| bin as f32 * power[bin]).sum();
    (near > SHARE * total).then(|| f64::from(moment / near))
}
