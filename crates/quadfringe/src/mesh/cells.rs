//! Triangles of each cell of the grid, which are four neighbouring nodes.

use super::links::Grid;
use super::node_rows::{NodeRow, node};
use super::nodes::{Connection, Node, Nodes, are_joined};
use multiversion::multiversion;
use rayon::prelude::*;

/// Nodes of a cell: upper left, upper right, lower left and lower right, as (row, column) from the upper left one.
const CORNERS: [[usize; 2]; 4] = [[0, 0], [0, 1], [1, 0], [1, 1]];

/// The triangles of a cell. Its diagonal falls from the upper left to the lower right node, or rises from the lower left
/// to the upper right one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Cell(u8);

impl Cell {
    /// The diagonal falls.
    const FALLS: u8 = 1;
    /// There is a first and a second triangle.
    const HOLDS: [u8; 2] = [2, 4];

    /// The triangles of a cell whose top, bottom, left and right are joined or not.
    #[inline(always)]
    pub fn new(corners: [Node; 4], [top, bottom, left, right]: [bool; 4]) -> Self {
        let [a, b, c, d] = corners;
        let falls = falls(corners);
        let (falling, rising) = (are_joined(a, d), are_joined(b, c));
        let first = if falls { left & bottom & falling } else { left & top & rising };
        let second = if falls { top & right & falling } else { right & bottom & rising };
        let mark = |is: bool, mark: u8| if is { mark } else { 0 };
        Self(mark(falls, Self::FALLS) | mark(first, Self::HOLDS[0]) | mark(second, Self::HOLDS[1]))
    }

    fn is_falling(self) -> bool {
        self.0 & Self::FALLS != 0
    }

    fn holds(self) -> [bool; 2] {
        Self::HOLDS.map(|mark| self.0 & mark != 0)
    }

    /// The triangles, as corners of the cell, counter-clockwise as the camera sees them.
    fn triangles(self) -> impl Iterator<Item = [usize; 3]> {
        let both = TRIANGLES[usize::from(self.is_falling())];
        both.into_iter().zip(self.holds()).filter(|(_, holds)| *holds).map(|(corners, _)| corners)
    }

    fn count(self) -> usize {
        self.holds().map(usize::from).iter().sum()
    }

    /// 1 if a triangle holds the corner at this place of [`CORNERS`], else 0.
    #[inline(always)]
    fn touches(self, corner: usize) -> u32 {
        u32::from(TOUCHES[usize::from(self.0)] >> corner) & 1
    }
}

/// Corners of both triangles, counter-clockwise as the camera sees them, of a cell whose diagonal rises and of one whose
/// diagonal falls.
const TRIANGLES: [[[usize; 3]; 2]; 2] = [[[0, 2, 1], [1, 2, 3]], [[0, 2, 3], [0, 3, 1]]];

/// For each value of a cell the corners that a triangle holds, one bit for each; see [`Cell::new`].
const TOUCHES: [u8; 8] = [0, 0, 0b0111, 0b1101, 0b1110, 0b1011, 0b1111, 0b1111];

/// Which diagonal divides a cell: of two, the one with the smaller step along the line of sight, so that an edge runs
/// along it and not across it; the rising one where both are the same.
#[inline(always)]
fn falls([a, b, c, d]: [Node; 4]) -> bool {
    let (falling, rising) = (a.is_some() & d.is_some(), b.is_some() & c.is_some());
    let flatter = Connection::new(a, d).is_flatter_than(&Connection::new(b, c));
    falling & (flatter | !rising)
}

/// Which sides of the cells of a row are joined.
struct SideRows<'a> {
    top: &'a [bool],
    bottom: &'a [bool],
    left: &'a [bool],
    right: &'a [bool],
}

/// Corners of the cells of a row: upper left, upper right, lower left and lower right.
type Corners<'a> = [[&'a [f32]; 4]; 4];

/// Divides the cells of a row into triangles.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn divide(corners: Corners, sides: &SideRows, out: &mut [Cell]) {
    let n = out.len();
    let corners = corners.map(|corner| corner.map(|values| &values[..n]));
    let [top, bottom] = [&sides.top[..n], &sides.bottom[..n]];
    let [left, right] = [&sides.left[..n], &sides.right[..n]];
    for (i, out) in out.iter_mut().enumerate() {
        let nodes = [node(corners[0], i), node(corners[1], i), node(corners[2], i), node(corners[3], i)];
        *out = Cell::new(nodes, [top[i], bottom[i], left[i], right[i]]);
    }
}

/// The nodes that triangles hold.
pub(super) struct Vertices {
    /// Node of each vertex, (row, column), in the order of the image.
    pub pixels: Vec<[u32; 2]>,
    /// Number of the vertex of each node that is one.
    pub numbers: Vec<u32>,
    /// Number of vertices in each row.
    pub counts: Vec<usize>,
}

/// Divides `all` into parts of these lengths.
pub(super) fn parts<'a, T>(all: &'a mut [T], counts: &[usize]) -> Vec<&'a mut [T]> {
    let mut rest = all;
    let next = |count: &usize| {
        let part;
        (part, rest) = std::mem::take(&mut rest).split_at_mut(*count);
        part
    };
    counts.iter().map(next).collect()
}

/// The cells of a grid, row by row; there is one row and one column less than of nodes.
pub(super) struct Cells {
    rows: usize,
    columns: usize,
    all: Vec<Cell>,
}

impl Cells {
    pub fn new(grid: &Grid) -> Self {
        let (nodes, links, stride) = (&grid.nodes.all, &grid.links, grid.nodes.columns);
        let (rows, columns) = (grid.nodes.rows.saturating_sub(1), stride.saturating_sub(1));
        let mut all = vec![Cell::default(); rows * columns];
        let rows_out = all.par_chunks_mut(columns.max(1)).enumerate();
        rows_out.for_each_init(<[NodeRow; 2]>::default, |[above, below], (y, out)| {
            let at = y * stride;
            above.fill(&nodes[at..][..stride]);
            below.fill(&nodes[at + stride..][..stride]);
            let [top, bottom] = [at, at + stride].map(|from| &links.right[from..][..columns]);
            let [left, right] = [at, at + 1].map(|from| &links.down[from..][..columns]);
            let corners = [above.slices(0, columns), above.slices(1, columns), below.slices(0, columns)];
            let [a, b, c] = corners;
            divide([a, b, c, below.slices(1, columns)], &SideRows { top, bottom, left, right }, out);
        });
        Self { rows, columns, all }
    }

    /// Numbers the nodes that a triangle holds, in the order of the image.
    pub fn numbered(&self, nodes: &Nodes) -> Vertices {
        let columns = nodes.columns;
        let mut numbers = vec![0; nodes.all.len()];
        let rows = numbers.par_chunks_mut(columns.max(1)).enumerate();
        let counts: Vec<usize> = rows.map(|(y, row)| self.mark_used(y, row) as usize).collect();
        let starts: Vec<u32> = counts
            .iter()
            .scan(0, |next, count| Some(std::mem::replace(next, *next + *count as u32)))
            .collect();
        let mut pixels = vec![[0; 2]; counts.iter().sum()];
        let parts = parts(&mut pixels, &counts);
        let rows = numbers.par_chunks_mut(columns.max(1)).zip(parts).zip(starts).enumerate();
        rows.for_each(|(y, ((row, pixels), start))| {
            let used = row.iter_mut().enumerate().filter(|(_, used)| **used != 0);
            for ((number, (x, used)), pixel) in (start..).zip(used).zip(pixels) {
                (*used, *pixel) = (number, [y as u32, x as u32]);
            }
        });
        Vertices { pixels, numbers, counts }
    }

    /// Writes 1 for each node of row `y` that a triangle holds, and returns their number.
    fn mark_used(&self, y: usize, used: &mut [u32]) -> u32 {
        let mut mark = |row: usize, [left, right]: [usize; 2]| {
            for (x, cell) in self.all[row * self.columns..][..self.columns].iter().enumerate() {
                used[x] |= cell.touches(left);
                used[x + 1] |= cell.touches(right);
            }
        };
        if y > 0 {
            mark(y - 1, [2, 3]);
        }
        if y < self.rows {
            mark(y, [0, 1]);
        }
        used.iter().sum()
    }

    /// All triangles, of nodes numbered by `numbers`.
    pub fn faces(&self, numbers: &[u32]) -> Vec<[u32; 3]> {
        let rows = self.all.par_chunks(self.columns.max(1));
        let counts: Vec<usize> = rows.clone().map(|row| row.iter().map(|cell| cell.count()).sum()).collect();
        let mut faces = vec![[0; 3]; counts.iter().sum()];
        let stride = self.columns + 1;
        parts(&mut faces, &counts).into_par_iter().zip(rows).enumerate().for_each(|(y, (out, row))| {
            let mut rest = out;
            for (x, cell) in row.iter().enumerate() {
                let i = y * stride + x;
                let corners = [numbers[i], numbers[i + 1], numbers[i + stride], numbers[i + stride + 1]];
                let [first, second] = TRIANGLES[usize::from(cell.is_falling())];
                let both = [first, second].map(|[a, b, c]| [corners[a], corners[b], corners[c]]);
                let count = cell.count();
                let here;
                (here, rest) = std::mem::take(&mut rest).split_at_mut(count);
                match here {
                    [first, second] => (*first, *second) = (both[0], both[1]),
                    [only] => *only = both[usize::from(!cell.holds()[0])],
                    _ => {}
                }
            }
        });
        faces
    }

    /// The triangles that hold the node at (`y`, `x`), each as places (row, column) relative to the node, plus one; the
    /// node itself, (1, 1), comes first.
    pub fn around(&self, [y, x]: [usize; 2]) -> impl Iterator<Item = [[usize; 2]; 3]> {
        CORNERS.into_iter().flat_map(move |[down, right]| {
            // The cell whose corner (1 - down, 1 - right) is the node.
            let inside = (y + down).checked_sub(1).zip((x + right).checked_sub(1));
            let inside = inside.filter(|(y, x)| *y < self.rows && *x < self.columns);
            let cell = inside.map_or_else(Cell::default, |(y, x)| self.all[y * self.columns + x]);
            let node = [1 - down, 1 - right];
            cell.triangles().filter_map(move |corners| {
                let first = corners.iter().position(|corner| CORNERS[*corner] == node)?;
                Some([0, 1, 2].map(|k| {
                    let [row, column] = CORNERS[corners[(first + k) % 3]];
                    [row + down, column + right]
                }))
            })
        })
    }
}
