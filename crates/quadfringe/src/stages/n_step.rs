//! N-step phase shifting, pixel by pixel, from one image per step.
//!
//! The steps shift the fringes by equal parts of a period: `I_s = a + b cos(Phi + 2 pi s / N)`. Over a whole period the sum
//! of `I_s exp(-2 pi j s / N)` is `N b / 2 exp(j Phi)`, and the mean of `I_s` is `a`. Source:
//! Bruning et al., "Digital wavefront measuring interferometer for testing optical surfaces and lenses", Applied Optics
//! 13, 2693 (1974).

use crate::condition::Sample;
use crate::parallel::angle::atan2;
use crate::{Error, Result};
use ndarray::parallel::prelude::*;
use ndarray::{Array2, ArrayView2, ArrayView3, ArrayViewMut1, Axis, Zip};
use std::f32::consts::PI;
use std::f64::consts::TAU;

/// Least number of images that determine background, modulation and phase.
const STEPS_MIN: usize = 3;

/// The three unknowns of a fringe image, each `(rows, columns)`.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct NStep {
    /// Wrapped phase in rad, in (-pi, pi]; NaN where the modulation is exactly 0.
    pub phase_rad: Array2<f32>,
    /// Mean over the steps, in the unit of the images.
    pub background: Array2<f32>,
    /// Amplitude of the fringes, in the unit of the images.
    pub modulation: Array2<f32>,
}

/// Phase, background and modulation from equally spaced steps over one period, `I_s = a + b cos(Phi + 2 pi s / N)`.
/// `stack` has the shape `(steps, rows, columns)` with N >= 3 steps.
///
/// Harmonics of the fringes up to the order N - 2 do not change the phase.
///
/// # Errors
/// [`Error::Value`] for fewer than 3 steps, [`Error::Shape`] for images without pixels, [`Error::NotFinite`] for NaN or
/// infinity.
///
/// ```
/// use ndarray::Array3;
/// use quadfringe::stages::n_step;
/// use std::f32::consts::TAU;
/// let stack = Array3::from_shape_fn((5, 2, 8), |(s, _, x)| {
///     0.5 + 0.3 * (0.2 * x as f32 + TAU * s as f32 / 5.0).cos()
/// });
/// let fringes = n_step(stack.view())?;
/// assert!((fringes.phase_rad[[1, 7]] - 1.4).abs() < 1e-5);
/// assert!((fringes.modulation[[1, 7]] - 0.3).abs() < 1e-6);
/// # Ok::<(), quadfringe::Error>(())
/// ```
pub fn n_step(stack: ArrayView3<'_, f32>) -> Result<NStep> {
    check(&stack)?;
    let (steps, rows, columns) = stack.dim();
    let waves: Vec<Wave> = (0..steps).map(|step| Wave::of(step, steps)).collect();
    let mut phase_rad = Array2::zeros((rows, columns));
    let mut background = Array2::zeros((rows, columns));
    let mut modulation = Array2::zeros((rows, columns));
    Zip::indexed(phase_rad.rows_mut())
        .and(background.rows_mut())
        .and(modulation.rows_mut())
        .into_par_iter()
        .for_each(|(y, phase, background, modulation)| {
            let out = RowOut { phase, background, modulation };
            demodulate_row(stack.index_axis(Axis(1), y), &waves, out);
        });
    Ok(NStep { phase_rad, background, modulation })
}

fn check(stack: &ArrayView3<'_, f32>) -> Result<()> {
    let (steps, rows, columns) = stack.dim();
    if steps < STEPS_MIN {
        let expected = "at least 3 images, one per phase step along the first axis";
        return Err(Error::value("stack", expected, format!("{steps}")));
    }
    if rows == 0 || columns == 0 {
        let expected = [steps, rows.max(1), columns.max(1)];
        return Err(Error::shape("stack", &expected, stack.shape()));
    }
    let mut images = stack.outer_iter().enumerate();
    images.try_for_each(|(s, image)| f32::greatest(&image, &format!("step {s}")).map(|_| ()))
}

/// Weights of one step in the sums over all steps.
struct Wave {
    real: f64,
    imaginary: f64,
}

impl Wave {
    fn of(step: usize, steps: usize) -> Self {
        let (sin, cos) = (TAU * step as f64 / steps as f64).sin_cos();
        Self { real: 2.0 * cos / steps as f64, imaginary: -2.0 * sin / steps as f64 }
    }
}

/// Sums over the steps at one pixel, of the differences from the first step.
#[derive(Clone, Default)]
struct Sums {
    real: f64,
    imaginary: f64,
    change: f64,
}

/// One row of each result.
struct RowOut<'a> {
    phase: ArrayViewMut1<'a, f32>,
    background: ArrayViewMut1<'a, f32>,
    modulation: ArrayViewMut1<'a, f32>,
}

/// Demodulates one row, `(steps, columns)`.
///
/// The sums run over the differences from the first step. The weights add up to zero, so this changes only the
/// rounding, and equal images give a modulation of exactly 0.
fn demodulate_row(steps: ArrayView2<'_, f32>, waves: &[Wave], mut out: RowOut<'_>) {
    let first = steps.row(0);
    let mut sums = vec![Sums::default(); first.len()];
    for (step, wave) in steps.outer_iter().zip(waves).skip(1) {
        for ((sum, &value), &zero) in sums.iter_mut().zip(step).zip(first) {
            let change = f64::from(value) - f64::from(zero);
            sum.real += change * wave.real;
            sum.imaginary += change * wave.imaginary;
            sum.change += change;
        }
    }
    for (x, Sums { real, imaginary, change }) in sums.into_iter().enumerate() {
        let modulation = (real * real + imaginary * imaginary).sqrt() as f32;
        let phase = half_open(atan2(imaginary as f32, real as f32));
        out.background[x] = (f64::from(first[x]) + change / waves.len() as f64) as f32;
        out.modulation[x] = modulation;
        out.phase[x] = if modulation == 0.0 { f32::NAN } else { phase };
    }
}

/// Moves an angle from [-pi, pi] to (-pi, pi]: -pi becomes pi.
fn half_open(angle: f32) -> f32 {
    if angle <= -PI { PI } else { angle }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parallel::angle::wrap;
    use ndarray::{Array3, s};

    fn stack(steps: usize) -> Array3<f32> {
        Array3::from_shape_fn((steps, 3, 101), |(s, y, x)| {
            let phase = truth(x) + TAU * s as f64 / steps as f64;
            (0.5 + 0.1 * y as f64 + 0.2 * phase.cos()) as f32
        })
    }

    fn truth(x: usize) -> f64 {
        0.13 * x as f64 - 6.0
    }

    #[test]
    fn known_phase_is_recovered_for_any_number_of_steps() {
        for steps in 3..=20 {
            let found = n_step(stack(steps).view()).unwrap();
            for ((y, x), &phase) in found.phase_rad.indexed_iter() {
                assert!(wrap(phase - truth(x) as f32).abs() < 1e-5, "{steps} {x}");
                assert!(phase > -PI && phase <= PI);
                assert!((found.modulation[[y, x]] - 0.2).abs() < 1e-6);
                assert!((found.background[[y, x]] - 0.5 - 0.1 * y as f32).abs() < 1e-6);
            }
        }
    }

    #[test]
    fn half_a_turn_is_always_plus_pi() {
        let image = |v: f32| Array2::from_elem((1, 1), v);
        for nudge in [0.0, 1e-9, -1e-9] {
            let images = [image(-1.0), image(nudge), image(1.0), image(0.0)];
            let stack = ndarray::stack(Axis(0), &images.each_ref().map(|i| i.view())).unwrap();
            assert_eq!(n_step(stack.view()).unwrap().phase_rad[[0, 0]], PI);
        }
    }

    #[test]
    fn harmonics_up_to_n_minus_2_do_not_change_the_phase() {
        let squared = stack(6).mapv(|v| v * v * v * v);
        let found = n_step(squared.view()).unwrap();
        for ((_, x), &phase) in found.phase_rad.indexed_iter() {
            assert!(wrap(phase - truth(x) as f32).abs() < 1e-5);
        }
    }

    #[test]
    fn strided_views_give_the_same() {
        let wide = stack(4);
        let narrow = n_step(wide.slice(s![.., .., ..;3])).unwrap();
        let whole = n_step(wide.view()).unwrap();
        assert_eq!(narrow.phase_rad, whole.phase_rad.slice(s![.., ..;3]));
    }

    #[test]
    fn no_modulation_is_no_data() {
        for steps in 3..=16 {
            let flat = Array3::from_elem((steps, 2, 2), 0.3f32);
            let found = n_step(flat.view()).unwrap();
            assert!(found.phase_rad.iter().all(|p| p.is_nan()));
            assert!(found.modulation.iter().all(|&m| m == 0.0));
            assert!(found.background.iter().all(|&b| b == 0.3));
        }
    }

    #[test]
    fn bad_stacks_are_named() {
        let message = |stack: Array3<f32>| n_step(stack.view()).unwrap_err().to_string();
        assert!(message(Array3::zeros((2, 4, 4))).contains("at least 3 images"));
        assert!(message(Array3::zeros((4, 0, 4))).contains("[4, 1, 4]"));
        let mut broken = stack(4);
        broken[[2, 1, 5]] = f32::NAN;
        let text = message(broken);
        assert!(text.contains("step 2") && text.contains("row 1, column 5"), "{text}");
    }
}
