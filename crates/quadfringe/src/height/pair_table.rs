//! The infrared phase along each camera ray, as a function of the first phase.
//!
//! Along a camera ray, each depth corresponds to a column of the visible projector and to one of the infrared projector.
//! The second column is a smooth function of the first. Without lens distortion it is a quotient of two linear functions;
//! it is linear if the projectors are only translated against each other, and a rotation bends it slightly. The table
//! stores a cubic for each pixel, through four Chebyshev nodes on the part of the ray that can be lit.

use ndarray::{Array2, ArrayView2, Axis};
use rayon::prelude::*;
use std::f64::consts::{FRAC_PI_4, TAU};

use super::Triangulator;
use super::params::{FAR_MM, NEAR_MM, RAY_SLACK_PX};
use crate::encoding::Encoding;
use crate::error::{Error, Result};
use crate::optics::{Device, ProjectorPair};
use crate::stages::{Absolute, AlongRay, Phases, RayRow};

/// Number of nodes, and of coefficients, of the cubic.
const NODES: usize = 4;
/// Number of stored rows for each row of pixels: the coefficients of the cubic, then the two ends of the ray.
const LINES: usize = NODES + 2;

/// The infrared phase along every camera ray of a calibrated pair of projectors, planned once.
///
/// ```
/// use quadfringe::{Encoding, height::PairTable, optics::{ProjectorPair, Device}};
/// let camera = Device::pinhole(64, 48, [160.0; 2], [31.5, 23.5])?;
/// let visible = Device::pinhole(912, 1140, [1570.0; 2], [455.5, 569.5])?
///     .with_pose(camera.rotation, [-200.0, 0.0, 0.0])?;
/// let infrared = visible.clone().with_pose(camera.rotation, [-199.5, 0.0, 0.0])?;
/// let pair = ProjectorPair::new(visible, infrared);
/// let table = PairTable::new(&camera, &pair, &Encoding::optimum(36, 912)?, Some([700.0, 900.0]))?;
/// let (point, row) = (camera.ray([60.0, 20.0]).at(800.0), table.row(20));
/// let turns = pair.visible().project(point).expect("in front")[0] / 912.0;
/// let first = (turns * 36.0 * std::f64::consts::TAU) as f32;
/// let found = row.infrared_rad(60, first);
/// let expected = pair.infrared_turns(point).expect("lit") * 30.0 * std::f64::consts::TAU;
/// assert!((f64::from(found) - expected).abs() < 1e-3);
/// # Ok::<(), quadfringe::error::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct PairTable {
    search: AlongRay,
    shape: (usize, usize),
    numbers: Vec<f32>,
}

impl PairTable {
    /// Plans the table for a camera and two projectors in its frame. Depths outside `depth_range_mm` are not searched;
    /// without a range the search covers all depths that the visible projector can light.
    ///
    /// # Errors
    /// [`Error::Value`] when [`Triangulator`] cannot use the devices, when the encoding does not have the width of the
    /// visible projector or has no infrared channel, or when the range is not two increasing depths of at least 0;
    /// [`Error::NotFourChannel`] for another encoding.
    pub fn new(
        camera: &Device,
        pair: &ProjectorPair,
        encoding: &Encoding,
        depth_range_mm: Option<[f64; 2]>,
    ) -> Result<Self> {
        let range_mm = depth_range_mm.unwrap_or([0.0, FAR_MM]);
        if !(range_mm[0] >= 0.0 && range_mm[1] > range_mm[0]) {
            let expected = "two growing depths of at least 0";
            return Err(Error::value("depth_range_mm", expected, format!("{range_mm:?}")));
        }
        let width_px = pair.visible().width;
        let four = encoding.four_channel_view()?;
        if four.projector_width != width_px {
            let expected = format!("{width_px}, the columns of the visible projector");
            return Err(Error::value("columns of the fringes", expected, four.projector_width));
        }
        if !four.has_infrared() {
            let expected = "an encoding with an infrared channel, for a pair of projectors";
            return Err(Error::value("channels of the encoding", expected, "R, G and B"));
        }
        let (first, third) = (four.quadrature * TAU, four.infrared * TAU);
        let triangulator = Triangulator::new(camera, pair.visible())?;
        let plan = Plan { camera, pair, triangulator, range_mm, first, third };
        let (rows, columns) = (camera.height, camera.width);
        let mut numbers = vec![f32::NAN; rows * LINES * columns];
        let lines = numbers.par_chunks_mut(LINES * columns).enumerate();
        lines.for_each(|(row, out)| plan.row(row, out));
        Ok(Self { search: AlongRay::new(&four), shape: (rows, columns), numbers })
    }

    /// Size of the maps, which is the size of the camera image (rows, columns).
    #[must_use]
    pub const fn shape(&self) -> (usize, usize) {
        self.shape
    }

    /// The rays of one row.
    ///
    /// # Panics
    /// When `row` is outside the camera image.
    #[must_use]
    pub fn row(&self, row: usize) -> RayRow<'_> {
        let columns = self.shape.1;
        let lines = &self.numbers[row * LINES * columns..][..LINES * columns];
        let line = |k: usize| &lines[k * columns..][..columns];
        RayRow { infrared: std::array::from_fn(line), low_rad: line(NODES), high_rad: line(NODES + 1) }
    }

    /// The infrared phase in rad, not wrapped, for a map of the absolute phase of the first fringe number in rad. NaN in,
    /// NaN out; NaN also where the ray cannot be lit.
    ///
    /// # Errors
    /// [`Error::Shape`] when the map does not have the size of the camera image.
    pub fn infrared_rad(&self, phase_rad: ArrayView2<'_, f32>) -> Result<Array2<f32>> {
        check("phase map", phase_rad, self.shape)?;
        Ok(Array2::from_shape_fn(self.shape, |(row, column)| {
            self.row(row).infrared_rad(column, phase_rad[[row, column]])
        }))
    }

    /// Absolute phase and margin, both `(rows, columns)`, from wrapped phases in rad. Of the points on a camera ray with
    /// the measured first phase, the one whose green and infrared phases agree best with the measured ones is chosen. NaN
    /// in, NaN out; NaN also where no candidate lies on the ray.
    ///
    /// # Errors
    /// [`Error::Shape`] when a map does not have the size of the camera image.
    pub fn unwrap(&self, wrapped_rad: Phases<ArrayView2<'_, f32>>) -> Result<Absolute> {
        self.unwrap_blocks(wrapped_rad, 1)
    }

    /// [`Self::unwrap`] for the phases of [`block_means`](crate::stages::block_means) over `rows` rows. The maps have one
    /// row for each block; a block uses the rays of its middle row.
    ///
    /// # Errors
    /// [`Error::Shape`] when a map does not have one row for each block, and the columns, of the camera image;
    /// [`Error::Value`] when `rows` is 0.
    pub fn unwrap_blocks(&self, wrapped_rad: Phases<ArrayView2<'_, f32>>, rows: usize) -> Result<Absolute> {
        if rows == 0 {
            return Err(Error::value("rows of a block", "at least 1", rows));
        }
        let (height, columns) = self.shape;
        let shape = (height.div_ceil(rows), columns);
        let Phases { quadrature, green, infrared } = wrapped_rad;
        for (name, map) in
            [("quadrature phase", quadrature), ("green phase", green), ("infrared phase", infrared)]
        {
            check(name, map, shape)?;
        }
        let wrapped = wrapped_rad.map(|map| map.as_standard_layout().into_owned());
        let empty = || Array2::from_elem(shape, f32::NAN);
        let (mut phase_rad, mut margin) = (empty(), empty());
        let maps = (phase_rad.axis_iter_mut(Axis(0)).into_par_iter()).zip(margin.axis_iter_mut(Axis(0)));
        maps.enumerate().for_each(|(block, (mut phase, mut margin))| {
            let contiguous = "rows in standard layout are contiguous";
            let wrapped = wrapped.as_ref().map(|map| map.row(block).to_slice().expect(contiguous));
            let phase = phase.as_slice_mut().expect(contiguous);
            let first = block * rows;
            let middle = first + rows.min(height - first) / 2;
            self.order_row(middle, wrapped, phase, margin.as_slice_mut().expect(contiguous));
        });
        Absolute::new(phase_rad, margin)
    }

    /// [`Self::unwrap`] for one row of pixels, with the rays of row `y`.
    #[inline(always)]
    pub(crate) fn order_row(&self, y: usize, wrapped: Phases<&[f32]>, phase: &mut [f32], margin: &mut [f32]) {
        self.search.order_row(wrapped, &self.row(y), phase, margin);
    }
}

fn check(name: &str, map: ArrayView2<'_, f32>, shape: (usize, usize)) -> Result<()> {
    if map.dim() == shape {
        return Ok(());
    }
    Err(Error::shape(name.to_owned(), &[shape.0, shape.1], map.shape()))
}

struct Plan<'a> {
    camera: &'a Device,
    pair: &'a ProjectorPair,
    triangulator: Triangulator,
    range_mm: [f64; 2],
    /// Phase in rad over the whole field: of the first fringe number, and (`third`) of the infrared one.
    first: f64,
    third: f64,
}

impl Plan<'_> {
    /// Writes the stored rows of one row of pixels.
    fn row(&self, row: usize, out: &mut [f32]) {
        let columns = self.camera.width;
        let rays: Vec<_> = (0..columns).map(|x| self.camera.undistort([x as f64, row as f64])).collect();
        let field = [-0.5, self.pair.visible().width as f64 - 0.5];
        let edges_mm = field.map(|edge| self.depths(row, &vec![edge as f32; columns]));
        let ends_of = |x: usize| self.ends_px(rays[x], edges_mm.each_ref().map(|depths| depths[x]), field);
        let ends: Vec<_> = (0..columns).map(ends_of).collect();
        let node_px = |k: usize, [low, high]: [f64; 2]| {
            let half = (0.5 * (high - low)).max(RAY_SLACK_PX);
            0.5 * (low + high) - half * (FRAC_PI_4 * (0.5 + k as f64)).cos()
        };
        let nodes_mm: [Vec<f64>; NODES] = std::array::from_fn(|k| {
            let nodes: Vec<f32> = ends.iter().map(|ends| node_px(k, *ends) as f32).collect();
            self.depths(row, &nodes)
        });
        for (x, (ray, ends)) in rays.iter().zip(&ends).enumerate() {
            let points = nodes_mm.each_ref().map(|depths| at(*ray, depths[x]));
            let Some(cubic) = self.cubic(points) else { continue };
            let width = self.pair.visible().width as f64;
            let slack = RAY_SLACK_PX.min(0.5 * (width - (ends[1] - ends[0])));
            let range = [ends[0] - slack, ends[1] + slack].map(|px| self.first * px / width);
            for (k, value) in cubic.into_iter().chain(range).enumerate() {
                out[k * columns + x] = value as f32;
            }
        }
    }

    /// Depth at which each ray of a row meets its column of the visible projector; NaN where they do not meet.
    fn depths(&self, row: usize, columns_px: &[f32]) -> Vec<f64> {
        let mut xyz = vec![0.0; 3 * columns_px.len()];
        self.triangulator.xyz_row(row, columns_px, &mut xyz);
        xyz.chunks_exact(3).map(|point| f64::from(point[2])).collect()
    }

    /// Least and greatest column that light a ray within the range of depths; NaN if no column does. `edges_mm` are the
    /// depths at which the ray enters and leaves the field.
    fn ends_px(&self, ray: [f64; 2], edges_mm: [f64; 2], field: [f64; 2]) -> [f64; 2] {
        let column = |z_mm: f64| self.pair.visible().project(at(ray, z_mm)).map(|px| px[0]);
        let inside = |px: f64| px >= field[0] && px <= field[1];
        // The infinite end of the ray lies in the field, so the ray enters the field at the only edge that it meets, or
        // starts inside.
        let open = column(FAR_MM).is_some_and(inside);
        let [first, last] = edges_mm;
        let (near, far) = match (first.is_finite(), last.is_finite()) {
            _ if open => (first.max(last), FAR_MM),
            (true, true) => (first.min(last), first.max(last)),
            _ => (0.0, first.max(last)),
        };
        if far.is_nan() {
            return [f64::NAN; 2];
        }
        let (near, far) = (near.max(self.range_mm[0]).max(NEAR_MM), far.min(self.range_mm[1]));
        match (column(near), column(far)) {
            (Some(a), Some(b)) if near <= far => [a.min(b).max(field[0]), a.max(b).min(field[1])],
            _ => [f64::NAN; 2],
        }
    }

    /// The infrared phase as a cubic of the first phase through four points, by divided differences.
    fn cubic(&self, points: [[f64; 3]; NODES]) -> Option<[f64; NODES]> {
        let width = self.pair.visible().width as f64;
        let (mut x, mut y) = ([0.0; NODES], [0.0; NODES]);
        for (k, point) in points.into_iter().enumerate() {
            x[k] = self.first * self.pair.visible().project(point)?[0] / width;
            y[k] = self.third * self.pair.infrared_turns(point)?;
        }
        for level in 1..NODES {
            for k in (level..NODES).rev() {
                y[k] = (y[k] - y[k - 1]) / (x[k] - x[k - level]);
            }
        }
        let mut cubic = [0.0; NODES];
        for k in (0..NODES).rev() {
            // cubic = cubic (X - x[k]) + y[k]
            for power in (1..NODES).rev() {
                cubic[power] = cubic[power - 1] - x[k] * cubic[power];
            }
            cubic[0] = y[k] - x[k] * cubic[0];
        }
        cubic.iter().all(|c| c.is_finite()).then_some(cubic)
    }
}

fn at([x, y]: [f64; 2], z_mm: f64) -> [f64; 3] {
    [z_mm * x, z_mm * y, z_mm]
}
