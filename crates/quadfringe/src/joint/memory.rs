//! The maps of the result serve as working memory until they are written. This saves some ten megabytes for each megapixel,
//! and large planes stay in the caches (`quadfringe bench`).

use super::phase::FitRows;
use super::scene::Scratch;
use crate::decode::output::Decoded;
use ndarray::Array2;

/// Maps of the result that have not been written yet.
pub(super) struct OutputMemory<'a> {
    /// Two working planes in the map of points or of the albedo, which the steps use one after the other.
    pub scratch: Scratch<'a>,
    /// Output of the phase fit at full resolution. Modulation goes into its map, squared residuals go into the map of the
    /// wrong-order probability, and information goes into the map of the uncertainty.
    pub found: FitRows<'a>,
}

impl<'a> OutputMemory<'a> {
    /// Borrows the maps of `out`. If `out` has neither points nor albedo, `spare` holds the working planes.
    pub fn new(out: &'a mut Decoded, spare: &'a mut Vec<f32>, pixels: usize) -> Self {
        let width = out.phase_rad.ncols();
        let rows = |map: &'a mut Array2<f32>| {
            map.as_slice_mut().expect("checked layout").chunks_exact_mut(width).collect::<Vec<_>>()
        };
        let uncertainty = out.uncertainty_mm.as_mut().or(out.uncertainty_rad.as_mut()).expect("checked");
        let planes = match [&mut out.xyz_mm, &mut out.albedo]
            .into_iter()
            .flatten()
            .find(|map| map.len() >= 2 * pixels)
        {
            Some(map) => &mut map.as_slice_mut().expect("checked layout")[..2 * pixels],
            None => {
                spare.resize(2 * pixels, 0.0);
                spare.as_mut_slice()
            }
        };
        let (first, second) = planes.split_at_mut(pixels);
        let found = FitRows {
            squared_residual: rows(&mut out.wrong_order_probability),
            modulation: rows(&mut out.modulation),
            information: rows(uncertainty),
        };
        Self { scratch: Scratch { first, second }, found }
    }
}
