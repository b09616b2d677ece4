//! The maps of a decoded shot, and the last step of every method: columns and points from the absolute phase.

use super::params::ROWS_AT_ONCE;
use crate::encoding::FourChannel;
use crate::height::Triangulator;
use crate::parallel::{first_of_line, spare};
use multiversion::multiversion;
use ndarray::{Array, Array1, Array2, Array3, Dimension, Ix2, Ix3, s};
use rayon::prelude::*;
use std::f32::consts::TAU;

/// Maps of one decoded shot, pixel by pixel of the visible chip; NaN is no data.
///
/// [`Decoder::decode`](crate::Decoder::decode) makes them. The default holds empty maps, which
/// [`Decoder::decode_into`](crate::Decoder::decode_into) replaces.
#[derive(Debug, Clone, Default)]
#[non_exhaustive]
pub struct Decoded {
    /// Absolute phase of the first fringe number in rad, 0 at projector column 0; `(rows, columns)`, as all maps but the
    /// last.
    pub phase_rad: Array2<f32>,
    /// Column of the visible projector.
    pub column_px: Array2<f32>,
    /// Modulation in linear light, as a fraction of full scale: that of R and B by the joint method, the least of all
    /// channels by the published one. Known wherever there is light.
    pub modulation: Array2<f32>,
    /// Margin of the fringe order over the next best one, in [0, 1]; known wherever there is light.
    pub quality: Array2<f32>,
    /// Upper bound of the probability that the fringe order is wrong, in [0, 1].
    pub wrong_order_probability: Array2<f32>,
    /// Standard deviation of the absolute phase in rad, given that the fringe order is right; of a decoder without
    /// triangulator.
    pub uncertainty_rad: Option<Array2<f32>>,
    /// Standard deviation of the depth Z in mm, given that the fringe order is right; of a decoder with triangulator.
    pub uncertainty_mm: Option<Array2<f32>>,
    /// Points in the camera frame in mm, `(rows, columns, 3)`; of a decoder with triangulator.
    pub xyz_mm: Option<Array3<f32>>,
}

/// Zeros of `shape` that begin with a cache line: a vector across two lines takes two stores, which slows a decoder down.
fn aligned_zeros<D: Dimension>(shape: D) -> Array<f32, D> {
    let count = shape.size();
    let memory = vec![0.0; count + spare::<f32>()];
    let start = first_of_line(&memory);
    let aligned = Array1::from_vec(memory).slice_move(s![start..start + count]);
    aligned.into_shape_with_order(shape).expect("as many numbers as the shape has")
}

/// Replace a map of another shape or layout.
fn fit<D: Dimension>(map: &mut Array<f32, D>, shape: D) {
    if map.raw_dim() != shape || !map.is_standard_layout() {
        *map = aligned_zeros(shape);
    }
}

/// As [`fit`] for a map that may not be wanted.
fn fit_if<D: Dimension>(wanted: bool, map: &mut Option<Array<f32, D>>, shape: D) {
    match map {
        Some(map) if wanted => fit(map, shape),
        _ => *map = wanted.then(|| aligned_zeros(shape)),
    }
}

impl Decoded {
    /// Fringe order of every pixel: whole turns of the absolute phase, rounded down; NaN is no data.
    ///
    /// ```
    /// use ndarray::array;
    /// let mut decoded = quadfringe::Decoded::default();
    /// decoded.phase_rad = array![[0.0, 20.0]];
    /// assert_eq!(decoded.order(), array![[0.0, 3.0]]);
    /// ```
    #[must_use]
    pub fn order(&self) -> Array2<f32> {
        self.phase_rad.mapv(|phase| (phase / TAU).floor())
    }

    /// Make every map ready for a decoder of images of `shape`; those that are ready keep their memory.
    pub(super) fn fit(&mut self, shape: [usize; 2], calibrated: bool) {
        let [rows, columns] = shape;
        let maps = [
            &mut self.phase_rad,
            &mut self.column_px,
            &mut self.modulation,
            &mut self.quality,
            &mut self.wrong_order_probability,
        ];
        maps.into_iter().for_each(|map| fit(map, Ix2(rows, columns)));
        fit_if(!calibrated, &mut self.uncertainty_rad, Ix2(rows, columns));
        fit_if(calibrated, &mut self.uncertainty_mm, Ix2(rows, columns));
        fit_if(calibrated, &mut self.xyz_mm, Ix3(rows, columns, 3));
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
            self.uncertainty_mm.as_mut().or(self.uncertainty_rad.as_mut()).expect("one of the two is there"),
        ];
        let mut maps =
            maps.map(|map| map.as_slice_mut().expect("fitted maps are contiguous").chunks_exact_mut(width));
        let xyz = self.xyz_mm.as_mut().map(|xyz| xyz.as_slice_mut().expect("fitted maps are contiguous"));
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

/// One row of every map.
pub(crate) struct OutputRow<'a> {
    pub phase: &'a mut [f32],
    pub column: &'a mut [f32],
    pub modulation: &'a mut [f32],
    pub quality: &'a mut [f32],
    /// Wrong-order probability.
    pub wrong: &'a mut [f32],
    /// Standard deviation: of the phase until the row is finished, then of the depth when calibrated.
    pub sigma: &'a mut [f32],
    pub xyz: Option<&'a mut [f32]>,
}

/// The last step of either method, row by row: columns and points from the absolute phase, with their uncertainty.
pub(crate) struct Finish<'a> {
    pub four: &'a FourChannel,
    pub triangulator: Option<&'a Triangulator>,
}

impl Finish<'_> {
    /// Finish row `y`, of which phase, modulation, quality, uncertainty of the phase and wrong-order probability are
    /// known.
    pub fn row(&self, y: usize, row: &mut OutputRow<'_>) {
        let columns_per_rad = self.four.period_px() as f32 / TAU;
        let end = self.four.projector_width as f32 + 0.5;
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
