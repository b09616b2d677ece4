//! The points as nodes of a grid, and when a surface may join two of them.

use super::Points;
use super::params::{COTANGENT, DEVIATIONS};
use ndarray::{ArrayView1, Axis};
use rayon::prelude::*;

/// A point in mm, NaN where there is none, and the standard deviation of its depth as a share of the depth, 0 where
/// unknown. Noise moves a point along its ray by this share.
#[derive(Debug, Clone, Copy)]
pub(super) struct Node {
    pub point: [f32; 3],
    pub deviation: f32,
}

/// The nodes of a grid, row by row.
#[derive(Debug)]
pub(super) struct Nodes {
    pub rows: usize,
    pub columns: usize,
    pub all: Vec<Node>,
}

impl Node {
    pub const NONE: Self = Self { point: [f32::NAN; 3], deviation: 0.0 };

    /// A point in front of the camera, all of whose numbers are finite; anything else is no data.
    pub fn new(point: [f32; 3], depth_deviation_mm: f32) -> Self {
        if !(point.iter().all(|x| x.is_finite()) && point[2] > 0.0) {
            return Self::NONE;
        }
        let deviation = depth_deviation_mm / point[2];
        Self { point, deviation: if deviation.is_finite() { deviation.max(0.0) } else { 0.0 } }
    }

    /// Squared distance by which one standard deviation moves the point along its ray, mm^2.
    #[inline(always)]
    fn moved2(&self) -> f32 {
        self.deviation * self.deviation * dot(self.point, self.point)
    }

    #[inline(always)]
    pub fn is_some(&self) -> bool {
        self.point[2] > 0.0
    }
}

impl Nodes {
    pub fn new(points: &Points<'_>) -> Self {
        let (rows, columns, _) = points.xyz_mm.dim();
        let mut all = vec![Node::NONE; rows * columns];
        all.par_chunks_mut(columns.max(1)).enumerate().for_each(|(y, out)| {
            let row = points.xyz_mm.index_axis(Axis(0), y);
            let nodes = out.iter_mut().zip(row.rows());
            let point = |p: ArrayView1<'_, f32>| [p[0], p[1], p[2]];
            match points.uncertainty_mm {
                None => nodes.for_each(|(out, p)| *out = Node::new(point(p), 0.0)),
                Some(map) => {
                    nodes.zip(map.row(y)).for_each(|((out, p), sigma)| *out = Node::new(point(p), *sigma));
                }
            }
        });
        Self { rows, columns, all }
    }

    /// Every `step`-th node of every `step`-th row.
    pub fn every(&self, step: usize) -> Self {
        let (rows, columns) = (self.rows.div_ceil(step), self.columns.div_ceil(step));
        let place = |i: usize| i / columns * step * self.columns + i % columns * step;
        let all = (0..rows * columns).map(|i| self.all[place(i)]).collect();
        Self { rows, columns, all }
    }
}

#[inline(always)]
pub(super) fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The connection of two points as the camera sees it, from its middle. Points so far away that single precision overflows
/// have no length and are not joined.
#[derive(Debug, Clone, Copy)]
pub(super) struct Connection {
    /// Squared length, mm^2.
    length2: f32,
    /// Squared length along the line of sight, mm^2.
    along2: f32,
}

impl Connection {
    #[inline(always)]
    pub fn new(a: Node, b: Node) -> Self {
        // Without closures, which the compiler would not inline into vector code.
        let ([ax, ay, az], [bx, by, bz]) = (a.point, b.point);
        let (connection, middle) = ([bx - ax, by - ay, bz - az], [ax + bx, ay + by, az + bz]);
        let along = dot(connection, middle);
        Self { length2: dot(connection, connection), along2: along * along / dot(middle, middle) }
    }

    /// Whether this one goes less along the line of sight.
    #[inline(always)]
    pub fn is_flatter_than(&self, other: &Self) -> bool {
        self.along2 < other.along2
    }
}

/// Whether a surface that the camera sees may hold both points: the angle between their connection and the line of sight
/// is at least the limit, or noise explains the rest (T1). False where there is no point.
#[inline(always)]
pub(super) fn are_joined(a: Node, b: Node) -> bool {
    let Connection { length2, along2 } = Connection::new(a, b);
    let rest = length2 - along2;
    let across = if rest > 0.0 { rest.sqrt() } else { 0.0 };
    let moved2 = a.moved2() + b.moved2();
    along2.sqrt() <= across * COTANGENT as f32 + DEVIATIONS as f32 * moved2.sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn node(x: f32, z: f32, deviation: f32) -> Node {
        Node { point: [x, 0.0, z], deviation }
    }

    #[test]
    fn the_angle_decides_and_noise_is_allowed_for() {
        // 0.3 mm apart across the line of sight and 1.7 mm along it are 10 degrees.
        let noise = 0.05 / 800.0;
        assert!(are_joined(node(0.0, 800.0, 0.0), node(0.3, 801.6, 0.0)));
        assert!(!are_joined(node(0.0, 800.0, 0.0), node(0.3, 801.8, 0.0)));
        assert!(are_joined(node(0.0, 800.0, noise), node(0.3, 801.8, noise)));
        assert!(!are_joined(node(0.0, 800.0, noise), node(0.3, 802.0, noise)));
        assert!(!are_joined(node(0.0, 800.0, 0.0), Node::NONE));
    }

    #[test]
    fn hostile_points_are_no_data_or_far_apart() {
        for point in [[0.0, 0.0, -1.0], [f32::INFINITY, 0.0, 1.0], [0.0, f32::NAN, 1.0], [0.0; 3]] {
            assert!(!Node::new(point, 0.1).is_some(), "{point:?}");
        }
        for deviation in [f32::NAN, f32::INFINITY, -1.0] {
            assert!(Node::new([0.0, 0.0, 1.0], deviation).deviation == 0.0);
        }
        let far = Node::new([f32::MAX, f32::MAX, f32::MAX], 0.0);
        assert!(!are_joined(Node::new([0.0, 0.0, 1.0], 0.0), far));
    }
}
