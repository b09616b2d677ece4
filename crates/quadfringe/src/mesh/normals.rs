//! Normals of the nodes and their uncertainty (M2, M3).

use super::cells::Cells;
use super::nodes::{Grid, Node, Nodes};
use super::vector::{Vector, cross, difference, dot, length, scaled, sum, wide};

/// Unit normal of a node towards the camera, and the root mean square angle in rad between it and the true one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Normal {
    pub direction: [f32; 3],
    pub uncertainty_rad: f32,
}

impl Normal {
    pub const NONE: Self = Self { direction: [f32::NAN; 3], uncertainty_rad: f32::NAN };

    /// The normal of a node, from its neighbours along row and column, else from the triangles that hold it.
    pub fn new(grid: &Grid, cells: &Cells, at: [usize; 2]) -> Self {
        let tangents = Tangent::along_column(grid, at).zip(Tangent::along_row(grid, at));
        let node = wide(grid.nodes.all[at[0] * grid.nodes.columns + at[1]].point);
        match tangents {
            Some((down, right)) => {
                let sum = cross(down.vector, right.vector);
                let levers = [Lever::new(&down, right.vector), Lever::new(&right, down.vector)];
                Self::of(node, sum, &levers)
            }
            None => Star::new(&grid.nodes, cells, at).normal(node),
        }
    }

    /// The direction of a normal of any length that changes by `p x lever` times the deviation when noise moves a point
    /// `p` of the surface. All points near the node have its ray.
    fn of(node: Vector, normal: Vector, levers: &[Lever]) -> Self {
        let size = length(normal);
        if !(size > 0.0 && size.is_finite()) {
            return Self::NONE;
        }
        let direction = scaled(normal, 1.0 / size);
        let (node2, across) = (dot(node, node), cross(direction, node));
        // The part of `node x lever` along the normal lengthens it and turns nothing.
        let turned2 = |lever: &Lever| {
            let v = lever.vector;
            lever.deviation2 * (node2 * dot(v, v) - dot(node, v).powi(2) - dot(across, v).powi(2)).max(0.0)
        };
        let variance: f64 = levers.iter().map(turned2).sum();
        Self { direction: direction.map(|c| c as f32), uncertainty_rad: (variance.sqrt() / size) as f32 }
    }
}

/// The effect of a point, or of points together, on a normal.
#[derive(Clone, Copy)]
struct Lever {
    vector: Vector,
    /// Variance of the depth as a share of the squared depth.
    deviation2: f64,
}

impl Lever {
    fn new(tangent: &Tangent, vector: Vector) -> Self {
        Self { vector, deviation2: tangent.deviation2 }
    }
}

fn square(deviation: f32) -> f64 {
    f64::from(deviation) * f64::from(deviation)
}

/// Difference of two points along a row or a column.
struct Tangent {
    vector: Vector,
    deviation2: f64,
}

impl Tangent {
    fn along_row(grid: &Grid, [y, x]: [usize; 2]) -> Option<Self> {
        let i = y * grid.nodes.columns + x;
        let before = (x > 0 && grid.links.right[i - 1]).then(|| i - 1);
        let after = grid.links.right[i].then_some(i + 1);
        Self::new(&grid.nodes, before, i, after)
    }

    fn along_column(grid: &Grid, [y, x]: [usize; 2]) -> Option<Self> {
        let columns = grid.nodes.columns;
        let i = y * columns + x;
        let before = (y > 0 && grid.links.down[i - columns]).then(|| i - columns);
        let after = grid.links.down[i].then(|| i + columns);
        Self::new(&grid.nodes, before, i, after)
    }

    /// The central difference where both neighbours are joined, else that to the one that is.
    fn new(nodes: &Nodes, before: Option<usize>, here: usize, after: Option<usize>) -> Option<Self> {
        let (from, to) = match (before, after) {
            (None, None) => return None,
            (before, after) => (nodes.all[before.unwrap_or(here)], nodes.all[after.unwrap_or(here)]),
        };
        let deviation2 = square(from.deviation) + square(to.deviation);
        Some(Self { vector: difference(wide(to.point), wide(from.point)), deviation2 })
    }
}

/// The triangles around a node: the sum of their normals, each as long as twice the area, and the levers of the node and
/// its eight neighbours, row by row.
struct Star {
    normal: Vector,
    levers: [Lever; 9],
}

impl Star {
    fn new(nodes: &Nodes, cells: &Cells, [y, x]: [usize; 2]) -> Self {
        let lever = Lever { vector: [0.0; 3], deviation2: 0.0 };
        let mut star = Self { normal: [0.0; 3], levers: [lever; 9] };
        for triangle in cells.around([y, x]) {
            let corners: [Node; 3] =
                triangle.map(|[row, column]| nodes.all[(y + row - 1) * nodes.columns + x + column - 1]);
            let [a, b, c] = corners.map(|corner| wide(corner.point));
            star.normal = sum(star.normal, cross(difference(b, a), difference(c, a)));
            let opposite = [difference(b, c), difference(c, a), difference(a, b)];
            for k in 0..3 {
                let lever = &mut star.levers[3 * triangle[k][0] + triangle[k][1]];
                lever.vector = sum(lever.vector, opposite[k]);
                lever.deviation2 = square(corners[k].deviation);
            }
        }
        star
    }

    fn normal(&self, node: Vector) -> Normal {
        Normal::of(node, self.normal, &self.levers)
    }
}
