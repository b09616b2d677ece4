//! Pixels without data: low modulation and doubtful fringe orders.
//!
//! A pixel in shadow has no fringes, so its phase is noise; its modulation is low. A pixel whose beat lies near the
//! decision between two orders may have the wrong one; its margin is low. Both become NaN.

use super::Absolute;
use crate::{Error, Reason, Result};
use ndarray::{Array2, ArrayView2, Zip};

/// Limits below which a pixel has no data.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Least modulation, as a fraction of full scale.
    pub modulation_min: f32,
    /// Least margin of the order, in [0, 1].
    pub quality_min: f32,
}

/// Phase and quality of the valid pixels, each `(rows, columns)`.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Valid {
    /// Absolute phase in rad; NaN where the modulation or the margin is too low.
    pub phase_rad: Array2<f32>,
    /// Margin of the order in [0, 1]; NaN where the modulation is too low.
    pub quality: Array2<f32>,
}

/// Discards pixels of low modulation, and phases whose order has a low margin. `modulation` is the least modulation of
/// all channels.
///
/// # Errors
/// [`Error::Shape`] when the maps differ in size.
///
/// ```
/// use ndarray::{Array2, array};
/// use quadfringe::{Encoding, stages::{Limits, Phases, discard_invalid, unwrap}};
/// let encoding = Encoding::optimum(36, 912)?;
/// let zero = Array2::<f32>::zeros((1, 2));
/// let absolute = unwrap(&encoding, Phases { quadrature: zero.view(), green: zero.view(), infrared: zero.view() })?;
/// let limits = Limits { modulation_min: 0.02, quality_min: 0.15 };
/// let valid = discard_invalid(&absolute, array![[0.3f32, 0.01]].view(), limits)?;
/// assert!(valid.phase_rad[[0, 0]] == 0.0 && valid.phase_rad[[0, 1]].is_nan());
/// # Ok::<(), quadfringe::Error>(())
/// ```
pub fn discard_invalid(
    absolute: &Absolute,
    modulation: ArrayView2<'_, f32>,
    limits: Limits,
) -> Result<Valid> {
    let (phase, margin) = (&absolute.phase_rad, &absolute.margin);
    for (name, map) in [("margin", margin.view()), ("modulation", modulation)] {
        if map.dim() != phase.dim() {
            return Err(Error::shape(name, phase.shape(), map.shape()));
        }
    }
    let pixels = Zip::from(phase).and(margin).and(modulation);
    let phase_rad = pixels
        .par_map_collect(|&phase, &margin, &modulation| Judged::of(margin, modulation, limits).phase(phase));
    let pixels = Zip::from(margin).and(modulation);
    let quality =
        pixels.par_map_collect(|&margin, &modulation| Judged::of(margin, modulation, limits).quality(margin));
    Ok(Valid { phase_rad, quality })
}

/// The decision about one pixel.
#[derive(Clone, Copy)]
pub(crate) struct Judged {
    /// Enough modulation.
    lit: bool,
    /// Enough modulation and a sufficient margin.
    valid: bool,
}

impl Judged {
    #[inline(always)]
    pub fn of(margin: f32, modulation: f32, limits: Limits) -> Self {
        let lit = modulation >= limits.modulation_min;
        Self { lit, valid: lit & (margin >= limits.quality_min) }
    }

    #[inline(always)]
    pub fn phase(self, phase: f32) -> f32 {
        if self.valid { phase } else { f32::NAN }
    }

    /// Why a pixel has no data, of which R and B have at most this `light`.
    #[inline(always)]
    pub fn reason(self, light: f32, limits: Limits) -> Reason {
        let doubt = if self.lit { Reason::DoubtfulOrder } else { Reason::LowModulation };
        let doubt = if light < limits.modulation_min { Reason::Shadow } else { doubt };
        if self.valid { Reason::Returned } else { doubt }
    }

    #[inline(always)]
    pub fn quality(self, margin: f32) -> f32 {
        let positive = if margin > 0.0 { margin } else { 0.0 };
        if self.lit { positive } else { f32::NAN }
    }
}
