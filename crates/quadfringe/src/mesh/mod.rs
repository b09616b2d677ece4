//! A surface from the points of a shot: triangles on the grid of pixels, normals, and small holes filled.
//!
//! Two neighbouring pixels are joined unless only a surface that the camera sees at a grazing angle could hold both of their
//! points, noise allowed for (T1). Four joined neighbours give two triangles, three give one. The normal of a point is that
//! of its neighbours along row and column (T2); its uncertainty follows from that of the depths (T3) and from how much the
//! errors of neighbours have in common (T4). Small holes may be filled from their rims (T5).

mod cells;
mod correlation;
mod holes;
mod links;
mod node_rows;
mod nodes;
mod normal_rows;
mod normals;
mod params;
mod vector;

use cells::{Cells, Vertices, parts};
use links::{Grid, Links, thinned};
use ndarray::{Array2, Array3, ArrayView2, ArrayView3, Axis};
use nodes::Nodes;
use normal_rows::NormalRow;
use normals::Field;
use params::HOLE_MAX_PX;
use rayon::prelude::*;

use crate::error::{Error, Result};

/// Points of an image in the camera frame.
#[derive(Debug, Clone, Copy)]
pub struct Points<'a> {
    /// `(rows, columns, 3)` in mm. No data where a number is not finite or the point is not in front of the camera.
    pub xyz_mm: ArrayView3<'a, f32>,
    /// Standard deviation of the depth in mm, `(rows, columns)`; 0 where it is not finite, and without it.
    pub uncertainty_mm: Option<ArrayView2<'a, f32>>,
}

/// How to make a mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MeshOptions {
    /// Take every n-th pixel of every n-th row; 1 takes all.
    pub step: usize,
    /// Greatest number of pixels of a hole that is filled; 0 fills none.
    pub holes_px: usize,
}

impl Default for MeshOptions {
    fn default() -> Self {
        Self { step: 1, holes_px: 0 }
    }
}

/// Triangles on the grid of pixels; all vectors but `faces` hold one value for each vertex.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Mesh {
    /// Pixel of each vertex, (row, column), in the order of the image.
    pub pixels: Vec<[u32; 2]>,
    /// Points in mm.
    pub points_mm: Vec<[f32; 3]>,
    /// Unit normals towards the camera; NaN where the triangles have no area.
    pub normals: Vec<[f32; 3]>,
    /// Root mean square angle in rad between a normal and the true one, as noise of the depths makes it.
    pub normal_uncertainty_rad: Vec<f32>,
    /// Whether the vertex lies in a filled hole, where nothing was measured.
    pub filled: Vec<bool>,
    /// Vertices of the triangles, counter-clockwise as the camera sees them.
    pub faces: Vec<[u32; 3]>,
}

/// Normals of an image.
#[derive(Debug, Clone, PartialEq)]
pub struct Normals {
    /// Unit normals towards the camera, `(rows, columns, 3)`; NaN where a point has no
    /// neighbours on its surface.
    pub normals: Array3<f32>,
    /// As [`Mesh::normal_uncertainty_rad`], `(rows, columns)`.
    pub uncertainty_rad: Array2<f32>,
}

/// Triangulates the points of an image.
///
/// # Errors
/// [`Error::Shape`] when the maps have different sizes; [`Error::Value`] when the last axis of `xyz_mm` is not 3, the step
/// is 0, the holes are too large, or the image has more than 2^31 pixels.
///
/// ```
/// use ndarray::Array3;
/// use quadfringe::mesh::{MeshOptions, Points, mesh_from_points};
/// // A plane 800 mm away, and a nearer one on the right of it.
/// let depth_mm = |column: usize| if column < 3 { 800.0 } else { 790.0 };
/// let xyz_mm = Array3::from_shape_fn((4, 6, 3), |(row, column, axis)| {
///     depth_mm(column) * [column as f32 / 2500.0, row as f32 / 2500.0, 1.0][axis]
/// });
/// let found = mesh_from_points(&Points { xyz_mm: xyz_mm.view(), uncertainty_mm: None }, &MeshOptions::default())?;
/// assert_eq!(found.points_mm.len(), 24);
/// // Two squares in each of three rows on either side, two triangles in each, and nothing between the planes.
/// assert_eq!(found.faces.len(), 2 * 3 * 2 * 2);
/// assert!((found.normals[0][2] + 1.0).abs() < 1e-4);
/// # Ok::<(), quadfringe::Error>(())
/// ```
pub fn mesh_from_points(points: &Points<'_>, options: &MeshOptions) -> Result<Mesh> {
    check(points)?;
    let from = |parameter, expected: String, actual: usize| Err(Error::value(parameter, expected, actual));
    if options.step == 0 {
        return from("step", "at least 1".into(), 0);
    }
    if options.holes_px > HOLE_MAX_PX {
        return from("holes_px", format!("at most {HOLE_MAX_PX}"), options.holes_px);
    }
    let mut nodes = Nodes::new(points);
    let filled = holes::fill(&mut nodes, options.holes_px);
    let links = Links::new(&nodes);
    let grid = thinned(nodes, links, options);
    let width = points.xyz_mm.dim().1;
    Ok(gathered(&grid, options.step, |[y, x]| filled[y as usize * width + x as usize]))
}

/// Finds the normals of the points of an image, those of the mesh of every pixel.
///
/// # Errors
/// [`Error::Shape`] and [`Error::Value`] as in [`mesh_from_points`].
///
/// ```
/// use ndarray::Array3;
/// use quadfringe::mesh::{Points, normals_from_points};
/// let ray = |row, column, axis: usize| [column as f32 / 2500.0, row as f32 / 2500.0, 1.0][axis];
/// let plane = Array3::from_shape_fn((4, 6, 3), |(row, column, axis)| 800.0 * ray(row, column, axis));
/// let found = normals_from_points(&Points { xyz_mm: plane.view(), uncertainty_mm: None })?;
/// assert!((found.normals[[2, 3, 2]] + 1.0).abs() < 1e-4);
/// # Ok::<(), quadfringe::Error>(())
/// ```
pub fn normals_from_points(points: &Points<'_>) -> Result<Normals> {
    check(points)?;
    let nodes = Nodes::new(points);
    let links = Links::new(&nodes);
    let grid = thinned(nodes, links, &MeshOptions::default());
    let cells = Cells::new(&grid);
    let field = Field::new(&grid, &cells);
    let (rows, columns, _) = points.xyz_mm.dim();
    let mut normals = Array3::zeros((rows, columns, 3));
    let mut uncertainty_rad = Array2::zeros((rows, columns));
    let outs = normals.axis_iter_mut(Axis(0)).into_par_iter().zip(uncertainty_rad.axis_iter_mut(Axis(0)));
    outs.enumerate().for_each_init(NormalRow::default, |row, (y, (mut directions, mut uncertainties))| {
        let mut next = directions.rows_mut().into_iter().zip(&mut uncertainties);
        field.row(y, 0..columns, row, |normal| {
            let (mut out, uncertainty_rad) = next.next().expect("one for each column");
            out.iter_mut().zip(normal.direction).for_each(|(out, c)| *out = c);
            *uncertainty_rad = normal.uncertainty_rad;
        });
    });
    Ok(Normals { normals, uncertainty_rad })
}

fn check(points: &Points<'_>) -> Result<()> {
    let (rows, columns, axes) = points.xyz_mm.dim();
    if axes != 3 {
        return Err(Error::value("xyz_mm", "3 numbers for each pixel", format!("{axes}")));
    }
    if rows.saturating_mul(columns) > 1 << 31 {
        return Err(Error::value("xyz_mm", "at most 2^31 pixels", format!("{rows} x {columns}")));
    }
    match &points.uncertainty_mm {
        Some(map) if map.dim() != (rows, columns) => {
            Err(Error::shape("uncertainty_mm", &[rows, columns], map.shape()))
        }
        _ => Ok(()),
    }
}

/// The triangles of a grid, whose nodes are numbered in the order of the image.
fn gathered(grid: &Grid, step: usize, is_filled: impl Fn([u32; 2]) -> bool + Sync) -> Mesh {
    let (nodes, cells) = (&grid.nodes, Cells::new(grid));
    let Vertices { mut pixels, numbers, counts } = cells.numbered(nodes);
    let (field, count) = (Field::new(grid, &cells), pixels.len());
    let (mut points_mm, mut normals) = (vec![[0.0; 3]; count], vec![[0.0; 3]; count]);
    let mut normal_uncertainty_rad = vec![0.0; count];
    let out = parts(&mut normals, &counts).into_par_iter().zip(parts(&mut normal_uncertainty_rad, &counts));
    let out = out.zip(parts(&mut points_mm, &counts)).zip(parts(&mut pixels, &counts));
    out.enumerate().for_each_init(NormalRow::default, |row, (y, (((normals, angles), points), pixels))| {
        let columns = pixels.iter().map(|[_, x]| *x as usize);
        let mut next = normals.iter_mut().zip(angles);
        field.row(y, columns.clone(), row, |found| {
            let (normal, angle) = next.next().expect("one for each column");
            (*normal, *angle) = (found.direction, found.uncertainty_rad);
        });
        points.iter_mut().zip(columns).for_each(|(point, x)| *point = nodes.all[y * nodes.columns + x].point);
        pixels.iter_mut().flatten().for_each(|at| *at *= step as u32);
    });
    Mesh {
        points_mm,
        normals,
        normal_uncertainty_rad,
        filled: pixels.par_iter().map(|at| is_filled(*at)).collect(),
        faces: cells.faces(&numbers),
        pixels,
    }
}
