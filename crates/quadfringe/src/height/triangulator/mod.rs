//! Triangulation: intersection of camera rays with projector columns (S7).
//!
//! In projector coordinates the points of a camera ray are `A + t B`, where `A` is the camera centre and `B` the rotated
//! direction `(x, y, 1)` of the pixel. For a column with the normalised coordinate `k`, the condition is `A0 + t B0 = k
//! (A2 + t B2)`, so
//!
//! `t = (k A2 - A0) / (B0 - k B2)` and `X, Y, Z = t x, t y, t`. This is a rational function of the column for each
//! pixel.
//!
//! Camera distortion is removed once, in the table of `x, y`. With projector distortion a column is a curved sheet of light,
//! but the camera ray is a straight line `m = m0 + s k` in ideal projector coordinates, so the distorted coordinate is a
//! polynomial in `k` alone. Three Newton steps from the measured value solve it. The result is exact to rounding at every
//! depth and needs no table with a limited depth range.

use multiversion::multiversion;
use ndarray::{Array2, Array3, ArrayView2, Axis};
use rayon::prelude::*;

use crate::error::{Error, Result};
use crate::optics::Device;

mod block;
mod sheets;

use block::{BLOCK, Block, Directions};
use sheets::ColumnSheets;

/// Points of the camera frame from projector columns, for a calibrated camera and projector (S7).
///
/// ```
/// use quadfringe::{height::Triangulator, optics::Device};
/// let camera = Device::pinhole(64, 48, [160.0, 160.0], [31.5, 23.5])?;
/// let identity = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
/// let projector = Device::pinhole(912, 1140, [1570.0, 1570.0], [455.5, 569.5])?
///     .with_pose(identity, [-200.0, 0.0, 0.0])?;
/// let point = camera.ray([40.0, 20.0]).at(800.0);
/// let column = projector.project(point).expect("in front")[0] as f32;
/// let mut columns = vec![f32::NAN; 64];
/// columns[40] = column;
/// let mut xyz = vec![0.0; 3 * 64];
/// Triangulator::new(&camera, &projector)?.xyz_row(20, &columns, &mut xyz);
/// assert!((f64::from(xyz[3 * 40 + 2]) - point[2]).abs() < 1e-3);
/// assert!(xyz[0].is_nan());
/// # Ok::<(), quadfringe::error::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Triangulator {
    camera: Device,
    /// Normalised `x, y` of every pixel if the camera has distortion; `None` without distortion, because they are then
    /// linear in the pixel.
    directions: Option<Array2<[f32; 2]>>,
    projector: ColumnSheets,
}

impl Triangulator {
    /// Plans the triangulation for a camera and a projector. Points are given in the camera frame.
    ///
    /// # Errors
    /// [`Error::Value`] when the camera's pose is not the identity (the projector's pose is relative to the camera), or
    /// when the baseline does not lie across the columns of the projector, so that columns do not depend on depth.
    pub fn new(camera: &Device, projector: &Device) -> Result<Self> {
        let offset = (0..3).fold(0f64, |worst, i| {
            let turn =
                (0..3).fold(0f64, |w, j| w.max((camera.rotation[i][j] - f64::from(u8::from(i == j))).abs()));
            worst.max(turn).max(camera.translation_mm[i].abs())
        });
        if offset > 1e-9 {
            let expected = "the identity; express the projector's pose in the camera frame";
            let actual =
                format!("rotation {:?}, translation {:?} mm", camera.rotation, camera.translation_mm);
            return Err(Error::value("pose of the camera", expected, actual));
        }
        let directions = camera.is_distorted().then(|| directions_of(camera));
        Ok(Self { camera: camera.clone(), directions, projector: ColumnSheets::new(projector)? })
    }

    /// Size of the column maps, which is the size of the camera image (rows, columns).
    #[must_use]
    pub fn shape(&self) -> (usize, usize) {
        (self.camera.height, self.camera.width)
    }

    /// Points of one image row. `out` receives X, Y, Z in mm for each pixel; NaN where the column is NaN, or where the
    /// column and the ray do not meet in front of the camera.
    ///
    /// # Panics
    /// When `row` is outside the camera image, or the slices do not hold `width` and `3 width` values.
    pub fn xyz_row(&self, row: usize, columns_px: &[f32], out: &mut [f32]) {
        let (height, width) = self.shape();
        assert!(row < height, "row {row} of an image of {height} rows");
        assert_eq!(columns_px.len(), width, "columns_px must hold one row");
        assert_eq!(out.len(), 3 * width, "out must hold three values for each column");
        points(self, row, columns_px, out);
    }

    /// Uncertainty of the depth for one image row. `uncertainty` holds the standard deviations of the columns in px and
    /// receives the standard deviations of Z in mm; NaN where [`Self::xyz_row`] has no point. The point moves along its ray,
    /// so X and Y change in proportion to Z.
    ///
    /// # Panics
    /// As [`Self::xyz_row`].
    ///
    /// ```
    /// use quadfringe::{height::Triangulator, rig::Bench};
    /// let bench = Bench::reference();
    /// let triangulator = Triangulator::new(&bench.camera, &bench.visible)?;
    /// let (mut uncertainty, mut points) = (vec![0.5; 1024], [vec![0.0; 3 * 1024], vec![0.0; 3 * 1024]]);
    /// triangulator.depth_uncertainty_row(384, &[450.0; 1024], &mut uncertainty);
    /// triangulator.xyz_row(384, &[449.5; 1024], &mut points[0]);
    /// triangulator.xyz_row(384, &[450.5; 1024], &mut points[1]);
    /// let z_mm = 3 * 512 + 2;
    /// assert!((2.0 * uncertainty[512] - (points[1][z_mm] - points[0][z_mm]).abs()).abs() < 1e-3);
    /// # Ok::<(), quadfringe::Error>(())
    /// ```
    pub fn depth_uncertainty_row(&self, row: usize, columns_px: &[f32], uncertainty: &mut [f32]) {
        let (height, width) = self.shape();
        assert!(row < height, "row {row} of an image of {height} rows");
        assert_eq!(columns_px.len(), width, "columns_px must hold one row");
        assert_eq!(uncertainty.len(), width, "uncertainty must hold one row");
        deviations(self, row, columns_px, uncertainty);
    }

    /// [`Self::xyz_row`] and [`Self::depth_uncertainty_row`] together.
    pub(crate) fn finish_row(
        &self,
        row: usize,
        columns_px: &[f32],
        out: &mut [f32],
        uncertainty: &mut [f32],
    ) {
        points_and_deviations(self, row, columns_px, out, uncertainty);
    }

    /// Points of a whole column map `(height, width)`, float32 `(height, width, 3)` in mm, NaN for no data; rows in
    /// parallel.
    ///
    /// # Errors
    /// [`Error::Shape`] when the map does not have the size of the camera image.
    pub fn xyz_mm(&self, columns_px: ArrayView2<'_, f32>) -> Result<Array3<f32>> {
        let (height, width) = self.shape();
        if columns_px.dim() != (height, width) {
            return Err(Error::shape("column map", &[height, width], columns_px.shape()));
        }
        let columns_px = columns_px.as_standard_layout();
        let mut xyz = Array3::zeros((height, width, 3));
        xyz.axis_iter_mut(Axis(0)).into_par_iter().zip(columns_px.axis_iter(Axis(0))).enumerate().for_each(
            |(row, (mut out, columns))| {
                let out = out.as_slice_mut().expect("rows of a new array are contiguous");
                let columns = columns.to_slice().expect("rows in standard layout are contiguous");
                self.xyz_row(row, columns, out);
            },
        );
        Ok(xyz)
    }

    /// Normalised `x, y` of the pixels of a row from `first` on.
    #[inline(always)]
    fn directions(&self, row: usize, first: usize, count: usize, directions: &mut Directions) {
        let Directions { x, y } = directions;
        if let Some(table) = &self.directions {
            let table = table.row(row).to_slice().expect("the table is in standard layout");
            for ((x, y), entry) in x.iter_mut().zip(y).zip(&table[first..first + count]) {
                [*x, *y] = *entry;
            }
            return;
        }
        let [fx, fy] = self.camera.focal_px;
        let [cx, cy] = self.camera.centre_px;
        let (from, step) = (((first as f64 - cx) / fx) as f32, (1.0 / fx) as f32);
        for (i, x) in x.iter_mut().enumerate() {
            *x = from + i as f32 * step;
        }
        y.fill(((row as f64 - cy) / fy) as f32);
    }

    /// Intersect the rays of a row, from pixel `first` on, with the sheets of `columns_px`.
    #[inline(always)]
    fn meet(&self, row: usize, first: usize, columns_px: &[f32], block: &mut Block) {
        self.directions(row, first, columns_px.len(), &mut block.directions);
        self.projector.intersect(columns_px, block);
    }
}

/// A row of points, block by block.
#[multiversion(targets("x86_64+avx2"))]
fn points(triangulator: &Triangulator, row: usize, columns_px: &[f32], out: &mut [f32]) {
    let mut block = Block::new();
    let blocks = columns_px.chunks(BLOCK).zip(out.chunks_mut(3 * BLOCK));
    for (index, (columns, xyz)) in blocks.enumerate() {
        triangulator.meet(row, index * BLOCK, columns, &mut block);
        block.write_points(xyz);
    }
}

/// A row of standard deviations, block by block.
#[multiversion(targets("x86_64+avx2"))]
fn deviations(triangulator: &Triangulator, row: usize, columns_px: &[f32], uncertainty: &mut [f32]) {
    let mut block = Block::new();
    let blocks = columns_px.chunks(BLOCK).zip(uncertainty.chunks_mut(BLOCK));
    for (index, (columns, uncertainty)) in blocks.enumerate() {
        triangulator.meet(row, index * BLOCK, columns, &mut block);
        block.scale_uncertainty(uncertainty);
    }
}

/// A row of points and standard deviations, from one intersection.
#[multiversion(targets("x86_64+avx2"))]
fn points_and_deviations(
    triangulator: &Triangulator,
    row: usize,
    columns_px: &[f32],
    out: &mut [f32],
    uncertainty: &mut [f32],
) {
    let mut block = Block::new();
    let blocks = columns_px.chunks(BLOCK).zip(out.chunks_mut(3 * BLOCK)).zip(uncertainty.chunks_mut(BLOCK));
    for (index, ((columns, xyz), uncertainty)) in blocks.enumerate() {
        triangulator.meet(row, index * BLOCK, columns, &mut block);
        block.write_points(xyz);
        block.scale_uncertainty(uncertainty);
    }
}

fn directions_of(camera: &Device) -> Array2<[f32; 2]> {
    let mut table = Array2::from_elem((camera.height, camera.width), [f32::NAN; 2]);
    table.axis_iter_mut(Axis(0)).into_par_iter().enumerate().for_each(|(row, mut line)| {
        for (column, entry) in line.iter_mut().enumerate() {
            *entry = camera.undistort([column as f64, row as f64]).map(|v| v as f32);
        }
    });
    table
}
