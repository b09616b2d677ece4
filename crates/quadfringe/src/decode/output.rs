//! The maps of a decoded shot, and the last step of every method: columns and points from the absolute phase.

use super::params::ROWS_AT_ONCE;
use super::reason::{Reason, mark_out_of_range};
use crate::height::Triangulator;
use crate::parallel::{first_of_line, spare};
use multiversion::multiversion;
use ndarray::{Array, Array1, Array2, Array3, Dimension, Ix2, Ix3, s};
use rayon::prelude::*;
use std::f32::consts::TAU;

/// Maps of one decoded shot, with one value for each pixel of the visible chip; NaN is no data.
///
/// [`Decoder::decode`](crate::Decoder::decode) makes them. The default holds empty maps, which
/// [`Decoder::decode_into`](crate::Decoder::decode_into) replaces.
#[derive(Debug, Clone, Default)]
#[non_exhaustive]
pub struct Decoded {
    /// Absolute phase of the first fringe number in rad, 0 at projector column 0; `(rows, columns)`, like all maps but
    /// the last.
    pub phase_rad: Array2<f32>,
    /// Column of the visible projector.
    pub column_px: Array2<f32>,
    /// Modulation in linear light, as a fraction of full scale: modulation of R and B with the joint method, the least
    /// of all channels with the published method. Known wherever there is light.
    pub modulation: Array2<f32>,
    /// Margin of the fringe order over the next best one, in [0, 1]; known wherever there is light.
    pub quality: Array2<f32>,
    /// Upper bound of the probability that the fringe order is wrong, in [0, 1].
    pub wrong_order_probability: Array2<f32>,
    /// Standard deviation of the absolute phase in rad, provided that the fringe order is right. Only from a decoder
    /// without triangulator.
    pub uncertainty_rad: Option<Array2<f32>>,
    /// Standard deviation of the depth Z in mm, provided that the fringe order is right. Only from a decoder with
    /// triangulator.
    pub uncertainty_mm: Option<Array2<f32>>,
    /// Points in the camera frame in mm, `(rows, columns, 3)`. Only from a decoder with triangulator.
    pub xyz_mm: Option<Array3<f32>>,
    /// Light of R, G, B, IR without fringes, linear, as a fraction of full scale, `(rows, columns, 4)`: the albedo of the surface
    /// times the light on it. IR is NaN without an infrared channel. Only from the joint method, if [`Options::albedo`](crate::Options::albedo) is set.
    pub albedo: Option<Array3<f32>>,
    /// Why a pixel has no data.
    pub reason: Array2<Reason>,
}

/// Which of the optional maps are wanted.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Wanted {
    /// Points and the uncertainty of their depth, in place of the uncertainty of the phase.
    pub points: bool,
    pub albedo: bool,
}

/// Zeros of `shape` that start at a cache line. A vector that lies across two cache lines takes two stores, which slows
/// the decoder down.
fn aligned_zeros<T: Clone + Default, D: Dimension>(shape: D) -> Array<T, D> {
    let count = shape.size();
    let memory = vec![T::default(); count + spare::<T>()];
    let start = first_of_line(&memory);
    let aligned = Array1::from_vec(memory).slice_move(s![start..start + count]);
    aligned.into_shape_with_order(shape).expect("as many numbers as the shape has")
}

/// Replaces a map if it has another shape or layout.
fn fit<T: Clone + Default, D: Dimension>(map: &mut Array<T, D>, shape: D) {
    if map.raw_dim() != shape || !map.is_standard_layout() {
        *map = aligned_zeros(shape);
    }
}

/// As [`fit`], for a map that is removed if it is not wanted.
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

    /// Prepares every map for a decoder of images of `shape`. Maps that already fit keep their memory.
    pub(crate) fn fit(&mut self, shape: [usize; 2], wanted: Wanted) {
        let [rows, columns] = shape;
        let maps = [
            &mut self.phase_rad,
            &mut self.column_px,
            &mut self.modulation,
            &mut self.quality,
            &mut self.wrong_order_probability,
        ];
        maps.into_iter().for_each(|map| fit(map, Ix2(rows, columns)));
        fit(&mut self.reason, Ix2(rows, columns));
        let Wanted { points, albedo } = wanted;
        fit_if(!points, &mut self.uncertainty_rad, Ix2(rows, columns));
        fit_if(points, &mut self.uncertainty_mm, Ix2(rows, columns));
        fit_if(points, &mut self.xyz_mm, Ix3(rows, columns, 3));
        fit_if(albedo, &mut self.albedo, Ix3(rows, columns, 4));
    }

    /// The rows of all maps, for parallel iteration.
    pub(crate) fn rows(&mut self) -> impl IndexedParallelIterator<Item = OutputRow<'_>> {
        self.row_by_row().into_par_iter().with_min_len(ROWS_AT_ONCE)
    }

    /// The rows of all maps, as a list.
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
        let reasons = self.reason.as_slice_mut().expect("fitted maps are contiguous");
        let mut reasons = reasons.chunks_exact_mut(width);
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
                reason: reasons.next()?,
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
    /// Standard deviation of the phase. When the row is finished and the decoder is calibrated, it becomes the standard
    /// deviation of the depth.
    pub sigma: &'a mut [f32],
    pub xyz: Option<&'a mut [f32]>,
    pub reason: &'a mut [Reason],
}

/// The last step of every method, row by row: columns and points from the absolute phase, with their uncertainty.
pub(crate) struct Finish<'a> {
    /// Projector columns in one turn of the absolute phase.
    pub period_px: f64,
    /// First and last of the columns that light the scene.
    pub columns_px: [f64; 2],
    pub triangulator: Option<&'a Triangulator>,
}

impl Finish<'_> {
    /// Finishes row `y`. Its phase, modulation, quality, uncertainty of the phase, wrong-order probability and reasons must
    /// be known.
    pub fn row(&self, y: usize, row: &mut OutputRow<'_>) {
        let columns_per_rad = self.period_px as f32 / TAU;
        let [begin, end] = [self.columns_px[0] as f32 - 1.5, self.columns_px[1] as f32 + 0.5];
        let sigma_unit = if self.triangulator.is_some() { columns_per_rad } else { 1.0 };
        fill_columns(Projection { columns_per_rad, begin, end, sigma_unit }, row);
        if let (Some(triangulator), Some(xyz)) = (self.triangulator, &mut row.xyz) {
            triangulator.finish_row(y, row.column, xyz, row.sigma);
            mark_out_of_range(xyz.iter().skip(2).step_by(3), row.reason);
        } else {
            mark_out_of_range(row.column.iter(), row.reason);
        }
    }
}

/// 0 if `known`, else NaN. Adding it turns a number into no data. If code chose between the number and NaN instead, the compiler
/// would make masked stores, which are slow on some processors.
#[inline(always)]
pub(crate) fn hole_unless(known: bool) -> f32 {
    if known { 0.0 } else { f32::NAN }
}

/// Conversion from phase to projector columns.
#[derive(Clone, Copy)]
struct Projection {
    columns_per_rad: f32,
    /// Begin and end of the projector image in columns, with a tolerance of one column for noise.
    begin: f32,
    end: f32,
    /// Factor that converts the standard deviation from rad to its new unit.
    sigma_unit: f32,
}

/// Fills the columns of a row. Outside the projector image there is no light. A phase there becomes no data, and so do its
/// uncertainty and its wrong-order probability.
#[multiversion(targets("x86_64+avx2"))]
fn fill_columns(Projection { columns_per_rad, begin, end, sigma_unit }: Projection, row: &mut OutputRow) {
    let found = row.phase.iter_mut().zip(&mut *row.column);
    for ((phase, column), (wrong, sigma)) in found.zip(row.wrong.iter_mut().zip(&mut *row.sigma)) {
        let found = *phase * columns_per_rad;
        let hole = hole_unless((found >= begin) & (found < end));
        *phase += hole;
        *column = found + hole;
        *wrong += hole;
        *sigma = *sigma * sigma_unit + hole;
    }
}
