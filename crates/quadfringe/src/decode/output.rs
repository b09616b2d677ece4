//! What comes out of a shot.

use crate::height::Triangulator;
use crate::parallel::{first_of_line, spare};
use crate::{Error, FringeCode, Result};
use multiversion::multiversion;
use ndarray::{Array, Array1, Array2, Array3, Dimension, IntoDimension, s};
use rayon::prelude::*;
use std::f32::consts::TAU;

/// Maps of one decoded shot, pixel by pixel on the visible chip; NaN is no data.
#[derive(Debug, Clone)]
pub struct Decoded {
    /// Absolute phase of the first fringe number in rad, 0 at projector column 0.
    pub phase_rad: Array2<f32>,
    /// Projector column.
    pub column_px: Array2<f32>,
    /// Modulation of R and B in linear light, as a fraction of full scale, by the published method the least of all channels;
    /// known wherever there is light.
    pub modulation: Array2<f32>,
    /// How far the order is from another one, in [0, 1]; known wherever there is light.
    pub quality: Array2<f32>,
    /// Probability that the order is another one, in [0, 1]; an upper bound.
    pub wrong_order_probability: Array2<f32>,
    /// Standard deviation of the absolute phase in rad, for the order that was chosen, when the decoder is not calibrated.
    pub uncertainty_rad: Option<Array2<f32>>,
    /// Standard deviation of the depth Z in mm, for the order that was chosen, when the decoder is calibrated.
    pub uncertainty_mm: Option<Array2<f32>>,
    /// Points in the camera frame in mm, `(rows, columns, 3)`, when the decoder is calibrated.
    pub xyz_mm: Option<Array3<f32>>,
}

/// Zeros of `shape` that begin with a cache line, as [`Decoded::new`] makes them: vectors across two lines are written in two
/// goes, and a decoder takes longer to fill maps that lie anywhere.
///
/// ```
/// use quadfringe::aligned_zeros;
/// let map = aligned_zeros((3, 5));
/// assert_eq!(map.dim(), (3, 5));
/// assert_eq!(map.as_ptr().addr() % 64, 0);
/// ```
#[must_use]
pub fn aligned_zeros<S: IntoDimension>(shape: S) -> Array<f32, S::Dim> {
    let shape = shape.into_dimension();
    let count = shape.size();
    let memory = vec![0.0; count + spare::<f32>()];
    let start = first_of_line(&memory);
    let aligned = Array1::from_vec(memory).slice_move(s![start..start + count]);
    aligned.into_shape_with_order(shape).expect("as many numbers as the shape has")
}

impl Decoded {
    /// Maps for a decoder to fill, for images of `shape`.
    #[must_use]
    pub fn new(shape: [usize; 2], calibrated: bool) -> Self {
        let map = || aligned_zeros(shape);
        Self {
            phase_rad: map(),
            column_px: map(),
            modulation: map(),
            quality: map(),
            wrong_order_probability: map(),
            uncertainty_rad: (!calibrated).then(map),
            uncertainty_mm: calibrated.then(map),
            xyz_mm: calibrated.then(|| aligned_zeros([shape[0], shape[1], 3])),
        }
    }

    /// Fringe order: whole turns of the absolute phase, rounded down; NaN is no data.
    ///
    /// ```
    /// use quadfringe::Decoded;
    /// let mut decoded = Decoded::new([1, 2], false);
    /// decoded.phase_rad[[0, 1]] = 20.0;
    /// assert_eq!(decoded.order(), ndarray::array![[0.0, 3.0]]);
    /// ```
    #[must_use]
    pub fn order(&self) -> Array2<f32> {
        self.phase_rad.mapv(|phase| (phase / TAU).floor())
    }

    pub(super) fn check(&self, shape: [usize; 2], calibrated: bool) -> Result<()> {
        let maps = [
            &self.phase_rad,
            &self.column_px,
            &self.modulation,
            &self.quality,
            &self.wrong_order_probability,
        ];
        // One of the two, or rows would not know which to fill.
        let (name, uncertainty, other) = match calibrated {
            true => ("uncertainty_mm", &self.uncertainty_mm, &self.uncertainty_rad),
            false => ("uncertainty_rad", &self.uncertainty_rad, &self.uncertainty_mm),
        };
        if uncertainty.is_none() || other.is_some() {
            let only = format!("{name}, the only map of uncertainty");
            return Err(Error::shape(only, &shape, &[0]));
        }
        for map in maps.into_iter().chain(uncertainty) {
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

    /// All maps row by row, for an engine to fill.
    pub(crate) fn rows(&mut self) -> impl IndexedParallelIterator<Item = OutputRow<'_>> {
        self.row_by_row().into_par_iter().with_min_len(ROWS_AT_ONCE)
    }

    /// The same one after the other.
    pub(crate) fn row_by_row(&mut self) -> Vec<OutputRow<'_>> {
        let width = self.phase_rad.ncols();
        let maps = [
            &mut self.phase_rad,
            &mut self.column_px,
            &mut self.modulation,
            &mut self.quality,
            &mut self.wrong_order_probability,
            self.uncertainty_mm.as_mut().or(self.uncertainty_rad.as_mut()).expect("checked"),
        ];
        let mut maps = maps.map(|map| map.as_slice_mut().expect("checked layout").chunks_exact_mut(width));
        let xyz = self.xyz_mm.as_mut().map(|xyz| xyz.as_slice_mut().expect("checked layout"));
        let mut xyz = xyz.map(|xyz| xyz.chunks_exact_mut(3 * width));
        let mut next = || {
            let [phase, column, modulation, quality, wrong, sigma] = maps.each_mut().map(Iterator::next);
            Some(OutputRow {
                phase: phase?,
                column: column?,
                modulation: modulation?,
                quality: quality?,
                sigma: sigma?,
                wrong: wrong?,
                xyz: xyz.as_mut().and_then(Iterator::next),
            })
        };
        std::iter::from_fn(&mut next).collect()
    }
}

/// Fewest rows that a thread takes at once.
pub(crate) const ROWS_AT_ONCE: usize = 8;

/// One row of every map.
pub(crate) struct OutputRow<'a> {
    pub phase: &'a mut [f32],
    pub column: &'a mut [f32],
    pub modulation: &'a mut [f32],
    pub quality: &'a mut [f32],
    /// Probability of another order.
    pub wrong: &'a mut [f32],
    /// Standard deviation: of the phase until the row is finished, then of the depth when calibrated.
    pub sigma: &'a mut [f32],
    pub xyz: Option<&'a mut [f32]>,
}

/// The last step of either method, row by row: columns, points and their uncertainty from the phase and its own.
pub(crate) struct Finish<'a> {
    pub code: &'a FringeCode,
    pub triangulator: Option<&'a Triangulator>,
}

impl Finish<'_> {
    /// Row `y`, of which phase, modulation, quality, uncertainty of the phase and probability of a wrong order are known.
    pub fn row(&self, y: usize, row: &mut OutputRow<'_>) {
        let columns_per_rad = self.code.period_px(0) as f32 / TAU;
        let end = self.code.projector_width() as f32 + 0.5;
        let sigma_unit = if self.triangulator.is_some() { columns_per_rad } else { 1.0 };
        fill_columns(Projection { columns_per_rad, end, sigma_unit }, row);
        if let (Some(triangulator), Some(xyz)) = (self.triangulator, &mut row.xyz) {
            triangulator.finish_row(y, row.column, xyz, row.sigma);
        }
    }
}

/// 0, or NaN, to be added to a number that is no data. For a choice between a number in memory and NaN the compiler would make masked
/// stores, which are slow on some processors.
#[inline(always)]
pub(crate) fn hole_unless(known: bool) -> f32 {
    if known { 0.0 } else { f32::NAN }
}

/// From the phase to projector columns.
#[derive(Clone, Copy)]
struct Projection {
    columns_per_rad: f32,
    /// First column behind the projector's image, with a column of tolerance for noise.
    end: f32,
    /// Unit that the standard deviation is brought to, per rad.
    sigma_unit: f32,
}

/// Fills the columns of a row. Outside the projector's image there is no light, so a phase found there is no data, and neither are
/// its uncertainty and the probability of a wrong order.
#[multiversion(targets("x86_64+avx2"))]
fn fill_columns(Projection { columns_per_rad, end, sigma_unit }: Projection, row: &mut OutputRow) {
    let found = row.phase.iter_mut().zip(&mut *row.column);
    for ((phase, column), (wrong, sigma)) in found.zip(row.wrong.iter_mut().zip(&mut *row.sigma)) {
        let found = *phase * columns_per_rad;
        let hole = hole_unless((found >= -1.5) & (found < end));
        *phase += hole;
        *column = found + hole;
        *wrong += hole;
        *sigma = *sigma * sigma_unit + hole;
    }
}
