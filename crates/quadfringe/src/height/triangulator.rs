//! Camera ray meets projector column (S7).
//!
//! In projector coordinates the points of a camera ray are `A + t B`, with `A` the camera centre and `B` the turned
//! direction `(x, y, 1)` of the pixel. A column whose normalised coordinate is `k` asks for `A0 + t B0 = k (A2 + t B2)`:
//!
//! `t = (k A2 - A0) / (B0 - k B2)`, and `X, Y, Z = t x, t y, t`: a rational function of the column for each pixel.
//!
//! Camera distortion is removed once, when the table of `x, y` is made. With projector distortion a column is a curved
//! sheet, but the projector sees the camera ray as a straight line `m = m0 + s k` in ideal coordinates, so the distorted
//! coordinate is a polynomial in `k` alone. It is solved for `k` by three Newton steps from the measured value: exact to
//! rounding at every depth, without a table and without a depth range to stay in.

use multiversion::multiversion;
use ndarray::{Array2, Array3, ArrayView2, Axis};
use rayon::prelude::*;

use crate::error::{Error, Result};
use crate::optics::Device;

const CHUNK: usize = 64;
const NEWTON_STEPS: usize = 3;

/// Turns projector columns into points of the camera frame, for one calibrated pair of camera and projector.
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
    /// Normalised `x, y` of every pixel when the camera has distortion; without it they are linear.
    directions: Option<Array2<[f32; 2]>>,
    projector: ColumnSheets,
}

impl Triangulator {
    /// Plan for one pair of devices; the frame of the result is that of the camera.
    ///
    /// # Errors
    /// [`Error::Value`] when the camera's pose is not the identity (the projector's pose is relative to the camera), or
    /// when the projector does not stand beside the camera across its columns, so that columns carry no depth.
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

    /// Size of the column maps (rows, columns): that of the camera.
    #[must_use]
    pub fn shape(&self) -> (usize, usize) {
        (self.camera.height, self.camera.width)
    }

    /// Points of one image row: `out` receives X, Y, Z in mm pixel by pixel, NaN where the column is NaN or where the
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

    /// What an uncertain column means for the depth, of one image row: `uncertainty` holds standard deviations of the columns in
    /// px and receives those of Z in mm, NaN where [`Self::xyz_row`] has no point. The point moves along its ray, so X and Y
    /// go with Z.
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

    /// [`Self::xyz_row`] and [`Self::depth_uncertainty_row`] in one go.
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
    /// [`Error::Shape`] when the map has another size than the camera image.
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
    fn directions(&self, row: usize, first: usize, count: usize, [x, y]: &mut [[f32; CHUNK]; 2]) {
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

    /// Where the rays of a row, from pixel `first` on, meet the sheets of `columns_px`.
    #[inline(always)]
    fn meet(&self, row: usize, first: usize, columns_px: &[f32], block: &mut Block) {
        self.directions(row, first, columns_px.len(), &mut block.directions);
        self.projector.intersect(columns_px, block);
    }
}

/// A block of pixels on its way from columns to points: only as much of it as there are columns means anything.
struct Block {
    directions: [[f32; CHUNK]; 2],
    /// Ideal normalised coordinates of the columns, and how they change with the column.
    ideal: [[f32; CHUNK]; 2],
    depth: [f32; CHUNK],
    /// Change of the depth with the column.
    growth: [f32; CHUNK],
}

impl Block {
    fn new() -> Self {
        let (row, rows) = ([0.0; CHUNK], [[0.0; CHUNK]; 2]);
        Self { directions: rows, ideal: rows, depth: row, growth: row }
    }

    /// `t x, t y, t` pixel by pixel.
    #[inline(always)]
    fn write_points(&self, xyz: &mut [f32]) {
        let [x, y] = &self.directions;
        let (points, _) = xyz.as_chunks_mut::<3>();
        for (((point, x), y), t) in points.iter_mut().zip(x).zip(y).zip(&self.depth) {
            *point = [t * x, t * y, *t];
        }
    }

    /// Standard deviations of columns become those of depths.
    #[inline(always)]
    fn carry(&self, uncertainty: &mut [f32]) {
        for (value, growth) in uncertainty.iter_mut().zip(&self.growth) {
            *value *= growth.abs();
        }
    }
}

/// A row of points, a block of pixels at a time.
#[multiversion(targets("x86_64+avx2"))]
fn points(triangulator: &Triangulator, row: usize, columns_px: &[f32], out: &mut [f32]) {
    let mut block = Block::new();
    let blocks = columns_px.chunks(CHUNK).zip(out.chunks_mut(3 * CHUNK));
    for (index, (columns, xyz)) in blocks.enumerate() {
        triangulator.meet(row, index * CHUNK, columns, &mut block);
        block.write_points(xyz);
    }
}

/// A row of standard deviations, a block of pixels at a time.
#[multiversion(targets("x86_64+avx2"))]
fn deviations(triangulator: &Triangulator, row: usize, columns_px: &[f32], uncertainty: &mut [f32]) {
    let mut block = Block::new();
    let blocks = columns_px.chunks(CHUNK).zip(uncertainty.chunks_mut(CHUNK));
    for (index, (columns, uncertainty)) in blocks.enumerate() {
        triangulator.meet(row, index * CHUNK, columns, &mut block);
        block.carry(uncertainty);
    }
}

/// Both, with the work that they have in common done once.
#[multiversion(targets("x86_64+avx2"))]
fn points_and_deviations(
    triangulator: &Triangulator,
    row: usize,
    columns_px: &[f32],
    out: &mut [f32],
    uncertainty: &mut [f32],
) {
    let mut block = Block::new();
    let blocks = columns_px.chunks(CHUNK).zip(out.chunks_mut(3 * CHUNK)).zip(uncertainty.chunks_mut(CHUNK));
    for (index, ((columns, xyz), uncertainty)) in blocks.enumerate() {
        triangulator.meet(row, index * CHUNK, columns, &mut block);
        block.write_points(xyz);
        block.carry(uncertainty);
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

/// The sheets of light of a projector's columns, as the camera meets them.
#[derive(Debug, Clone)]
struct ColumnSheets {
    rotation: [[f32; 3]; 3],
    /// Camera centre in projector coordinates, mm.
    centre: [f32; 3],
    focal_px: f32,
    centre_px: f32,
    distortion: Option<[f32; 5]>,
}

impl ColumnSheets {
    fn new(projector: &Device) -> Result<Self> {
        let a = projector.translation_mm;
        let middle = (0.5 * (projector.width as f64 - 1.0) - projector.centre_px[0]) / projector.focal_px[0];
        let across = (a[0] - middle * a[2]).abs() / middle.hypot(1.0);
        let length = (a[0] * a[0] + a[1] * a[1] + a[2] * a[2]).sqrt();
        if across <= 1e-3 * length || length <= 1e-6 {
            let expected = "a projector that stands beside the camera across its columns";
            let actual = format!("camera at {a:?} mm in the projector's frame");
            return Err(Error::value("pose of the projector", expected, actual));
        }
        Ok(Self {
            rotation: projector.rotation.map(|row| row.map(|v| v as f32)),
            centre: a.map(|v| v as f32),
            focal_px: projector.focal_px[0] as f32,
            centre_px: projector.centre_px[0] as f32,
            distortion: projector.is_distorted().then(|| projector.distortion.map(|v| v as f32)),
        })
    }

    /// Depths at which rays `(x, y, 1)` meet the sheets of `columns`, NaN behind the camera, and how they grow with the
    /// column: `t = (k A2 - A0) / (B0 - k B2)` by `k`, times `dk / du`.
    #[inline(always)]
    fn intersect(&self, columns: &[f32], block: &mut Block) {
        let Block { directions: [x, y], ideal, depth, growth } = block;
        self.ideal(columns, [x, y], ideal);
        let ([r0, _, r2], [a0, _, a2]) = (self.rotation, self.centre);
        let [k, stretch] = ideal;
        for i in 0..CHUNK {
            let b0 = r0[0] * x[i] + r0[1] * y[i] + r0[2];
            let b2 = r2[0] * x[i] + r2[1] * y[i] + r2[2];
            let inverse = 1.0 / (b0 - k[i] * b2);
            let t = (k[i] * a2 - a0) * inverse;
            let seen = (t > 0.0) & (t <= f32::MAX);
            depth[i] = if seen { t } else { f32::NAN };
            growth[i] = if seen { (a2 + t * b2) * inverse * stretch[i] } else { f32::NAN };
        }
    }

    /// Ideal normalised coordinates of `columns`, and how they change with the column.
    #[inline(always)]
    fn ideal(&self, columns: &[f32], [x, y]: [&[f32; CHUNK]; 2], [k, stretch]: &mut [[f32; CHUNK]; 2]) {
        let scale = 1.0 / self.focal_px;
        stretch.fill(scale);
        for (k, u) in k.iter_mut().zip(columns) {
            *k = (u - self.centre_px) * scale;
        }
        if let Some(distortion) = &self.distortion {
            for i in 0..CHUNK {
                let (ideal, slope) = self.ideal_coordinate(distortion, k[i], x[i], y[i]);
                (k[i], stretch[i]) = (ideal, scale / slope);
            }
        }
    }

    /// Ideal normalised column where the projector's image of the ray `(x, y, 1)` has the distorted column `measured`, and how
    /// the distorted coordinate changes with the ideal one there.
    #[inline(always)]
    fn ideal_coordinate(&self, distortion: &[f32; 5], measured: f32, x: f32, y: f32) -> (f32, f32) {
        let [k1, k2, p1, p2, k3] = *distortion;
        let b = self.rotation.map(|r| r[0] * x + r[1] * y + r[2]);
        let a = self.centre;
        // The projector sees the ray as the line n . (k, m, 1) = 0 with n = A x B.
        let across = 1.0 / (a[2] * b[0] - a[0] * b[2]);
        let m0 = (a[1] * b[0] - a[0] * b[1]) * across;
        let s = (a[2] * b[1] - a[1] * b[2]) * across;
        let (mut k, mut slope) = (measured, 1.0);
        for _ in 0..NEWTON_STEPS {
            let m = m0 + s * k;
            let r2 = k * k + m * m;
            let along = k + m * s;
            let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
            let growth = 2.0 * (k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3));
            let value = k * radial + 2.0 * p1 * k * m + p2 * (r2 + 2.0 * k * k);
            slope = radial + k * growth * along + 2.0 * p1 * (m + k * s) + p2 * (2.0 * along + 4.0 * k);
            k -= (value - measured) / slope;
        }
        (k, slope)
    }
}
