//! Normals of the nodes and their uncertainty (T2, T3).

use super::cells::Cells;
use super::correlation::Shares;
use super::links::Grid;
use super::nodes::{Node, Nodes};
use super::normal_rows::{Normal, NormalRow};
use super::vector::{Vector, cross, difference, dot, length, scaled, sum, wide};

/// What the normals of a grid are made from.
pub(super) struct Field<'a> {
    grid: &'a Grid,
    cells: &'a Cells,
    rows: Shares,
    columns: Shares,
}

impl<'a> Field<'a> {
    pub fn new(grid: &'a Grid, cells: &'a Cells) -> Self {
        let Grid { nodes, links } = grid;
        let [rows, columns] = [(&links.right, 1), (&links.down, nodes.columns)]
            .map(|(links, stride)| Shares::new(nodes, links, stride));
        Self { grid, cells, rows, columns }
    }

    /// Gives the normals of the nodes at these columns of row `y` to `put`.
    pub fn row(
        &self,
        y: usize,
        columns: impl Iterator<Item = usize>,
        row: &mut NormalRow,
        mut put: impl FnMut(Normal),
    ) {
        row.fill(self.grid, y, self.rows, self.columns);
        for x in columns {
            let found = row.at(x);
            put(if found.direction[2].is_nan() { self.normal([y, x]) } else { found });
        }
    }

    /// The normal of the node at (row, column), from its neighbours along row and column, else from the triangles that
    /// hold it.
    fn normal(&self, [y, x]: [usize; 2]) -> Normal {
        let Grid { nodes, links } = self.grid;
        let i = y * nodes.columns + x;
        let node = wide(nodes.all[i].point);
        let right = Tangent::new(nodes, &links.right, self.rows, [i, 1]);
        let down = Tangent::new(nodes, &links.down, self.columns, [i, nodes.columns]);
        if let Some((down, right)) = down.zip(right) {
            let levers = [Lever::new(&down, right.vector), Lever::new(&right, down.vector)];
            return Normal::of(node, cross(down.vector, right.vector), &levers);
        }
        let share = 0.5 * (self.rows.next + self.columns.next);
        Star::new(nodes, self.cells, [y, x]).normal(node, share)
    }
}

impl Normal {
    const NONE: Self = Self { direction: [f32::NAN; 3], uncertainty_rad: f32::NAN };

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
        let [x, y, z] = direction;
        Self { direction: [x as f32, y as f32, z as f32], uncertainty_rad: (variance.sqrt() / size) as f32 }
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
    /// The central difference at a node where both neighbours at this distance are joined to it, else that to the one
    /// which is.
    fn new(nodes: &Nodes, links: &[bool], shares: Shares, [i, stride]: [usize; 2]) -> Option<Self> {
        let before = i.checked_sub(stride).filter(|before| links[*before]);
        let after = links[i].then_some(i + stride);
        let share = if before.is_some() && after.is_some() { shares.central } else { shares.next };
        let (from, to) = match (before, after) {
            (None, None) => return None,
            (before, after) => (nodes.all[before.unwrap_or(i)], nodes.all[after.unwrap_or(i)]),
        };
        let deviation2 = share * (square(from.deviation) + square(to.deviation));
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

    fn normal(mut self, node: Vector, share: f64) -> Normal {
        self.levers.iter_mut().for_each(|lever| lever.deviation2 *= share);
        Normal::of(node, self.normal, &self.levers)
    }
}
