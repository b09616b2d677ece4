//! What comes out of a shot.

use crate::angle::floor;
use crate::height::Triangulator;
use crate::{Error, FringeCode, Result};
use ndarray::{Array2, Array3};
use rayon::prelude::*;
use std::f32::consts::TAU;

/// Maps of one decoded shot, pixel by pixel on the visible chip; NaN is no data.
#[derive(Debug, Clone)]
pub struct Decoded {
    /// Absolute phase of the first fringe number in rad, 0 at projector column 0.
    pub phase_rad: Array2<f32>,
    /// Projector column.
    pub column_px: Array2<f32>,
    /// Fringe order: whole turns of the absolute phase, rounded down.
    pub order: Array2<f32>,
    /// Modulation of R and B in linear light, as a fraction of full scale; known wherever there is light.
    pub modulation: Array2<f32>,
    /// How far the order is from another one, in [0, 1]; known wherever there is light.
    pub quality: Array2<f32>,
    /// Points in the camera frame in mm, `(rows, columns, 3)`, when the decoder is calibrated.
    pub xyz_mm: Option<Array3<f32>>,
}

impl Decoded {
    /// Maps for a decoder to fill, for images of `shape`.
    #[must_use]
    pub fn new(shape: [usize; 2], calibrated: bool) -> Self {
        let map = || Array2::zeros(shape);
        Self {
            phase_rad: map(),
            column_px: map(),
            order: map(),
            modulation: map(),
            quality: map(),
            xyz_mm: calibrated.then(|| Array3::zeros([shape[0], shape[1], 3])),
        }
    }

    pub(super) fn check(&self, shape: [usize; 2], calibrated: bool) -> Result<()> {
        for map in [&self.phase_rad, &self.column_px, &self.order, &self.modulation, &self.quality] {
            if map.shape() != shape || !map.is_standard_layout() {
                return Err(Error::shape("output map", &shape, map.shape()));
            }
        }
        let expected = [shape[0], shape[1], 3];
        match &self.xyz_mm {
            Some(xyz) if xyz.shape() != expected || !xyz.is_standard_layout() => {
                Err(Error::shape("xyz_mm", &expected, xyz.shape()))
            }
            None if calibrated => Err(Error::shape("xyz_mm", &expected, &[0])),
            _ => Ok(()),
        }
    }

    /// Rows of phase, modulation and quality, for an engine to fill.
    pub(super) fn rows(&mut self) -> impl IndexedParallelIterator<Item = [&mut [f32]; 3]> {
        let width = self.phase_rad.ncols();
        let phase = self.phase_rad.as_slice_mut().expect("checked layout");
        let modulation = self.modulation.as_slice_mut().expect("checked layout");
        let quality = self.quality.as_slice_mut().expect("checked layout");
        phase
            .par_chunks_mut(width)
            .zip(modulation.par_chunks_mut(width))
            .zip(quality.par_chunks_mut(width))
            .map(|((p, m), q)| [p, m, q])
    }

    /// Columns, orders and points from the phase.
    pub(super) fn finish(&mut self, code: &FringeCode, triangulator: Option<&Triangulator>) {
        let width = self.phase_rad.ncols();
        let per_rad = code.period_px(0) as f32 / TAU;
        let field = -1.5..code.projector_width() as f32 + 0.5;
        let phase = self.phase_rad.as_slice_mut().expect("checked layout");
        let column = self.column_px.as_slice_mut().expect("checked layout");
        let order = self.order.as_slice_mut().expect("checked layout");
        column
            .par_chunks_mut(width)
            .zip(order.par_chunks_mut(width))
            .zip(phase.par_chunks_mut(width))
            .for_each(|((column, order), phase)| {
                for ((column, order), phase) in column.iter_mut().zip(order).zip(phase) {
                    // No light comes from beside the projector's image; a column on each side is noise.
                    if !field.contains(&(*phase * per_rad)) {
                        *phase = f32::NAN;
                    }
                    *column = *phase * per_rad;
                    *order = floor(*phase / TAU);
                }
            });
        if let (Some(triangulator), Some(xyz)) = (triangulator, &mut self.xyz_mm) {
            let column = self.column_px.as_slice().expect("checked layout");
            let xyz = xyz.as_slice_mut().expect("checked layout");
            xyz.par_chunks_mut(3 * width)
                .zip(column.par_chunks(width))
                .enumerate()
                .for_each(|(row, (xyz, column))| triangulator.xyz_row(row, column, xyz));
        }
    }
}
