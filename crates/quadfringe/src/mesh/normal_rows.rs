//! Normals of a whole row of nodes that have neighbours along both directions (T2, T3), in single precision and without
//! branches, so that the compiler makes vectors of it.

use super::correlation::Shares;
use super::links::Grid;
use super::node_rows::NodeRow;
use super::nodes::dot;
use multiversion::multiversion;

/// Unit normal of a node towards the camera, and the root mean square angle in rad between it and the true one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Normal {
    pub direction: [f32; 3],
    pub uncertainty_rad: f32,
}

/// Normals of one row; NaN where single precision or the neighbours do not suffice.
#[derive(Debug, Default)]
pub(super) struct NormalRow {
    /// Unit normals towards the camera: x, y, z.
    pub direction: [Vec<f32>; 3],
    pub uncertainty_rad: Vec<f32>,
    /// Rows of nodes above, at and below.
    nodes: [NodeRow; 3],
}

/// Which neighbours of the nodes of a row are joined to them.
struct Joined<'a> {
    left: &'a [bool],
    right: &'a [bool],
    up: &'a [bool],
    down: &'a [bool],
}

/// Neighbours of the nodes of a row, each by x, y, z and deviation.
struct Around<'a> {
    left: [&'a [f32]; 4],
    here: [&'a [f32]; 4],
    right: [&'a [f32]; 4],
    above: [&'a [f32]; 4],
    below: [&'a [f32]; 4],
}

impl NormalRow {
    /// The normal of the node at column `x`.
    pub fn at(&self, x: usize) -> Normal {
        let [a, b, c] = &self.direction;
        Normal { direction: [a[x], b[x], c[x]], uncertainty_rad: self.uncertainty_rad[x] }
    }

    /// Fills row `y`. The first and the last node of a row, and those of the first and the last row, stay NaN.
    pub fn fill(&mut self, grid: &Grid, y: usize, rows: Shares, columns: Shares) {
        let (nodes, links, n) = (&grid.nodes, &grid.links, grid.nodes.columns);
        for out in self.direction.iter_mut().chain([&mut self.uncertainty_rad]) {
            out.clear();
            out.resize(n, f32::NAN);
        }
        if y == 0 || y + 1 >= nodes.rows || n < 3 {
            return;
        }
        for (row, out) in (y - 1..).zip(&mut self.nodes) {
            out.fill(&nodes.all[row * n..][..n]);
        }
        let inner = n - 2;
        let (right, down, at) = (&links.right, &links.down, y * n);
        let [left, right, up, down] = [&right[at..], &right[at + 1..], &down[at - n + 1..], &down[at + 1..]]
            .map(|links| &links[..inner]);
        let joined = Joined { left, right, up, down };
        let [above, here, below] = &self.nodes;
        let around = Around {
            left: here.slices(0, inner),
            here: here.slices(1, inner),
            right: here.slices(2, inner),
            above: above.slices(1, inner),
            below: below.slices(1, inner),
        };
        let [x, y, z] = self.direction.each_mut().map(|out| &mut out[1..=inner]);
        central(&around, &joined, [rows, columns], [x, y, z, &mut self.uncertainty_rad[1..=inner]]);
    }
}

/// Differences of the nodes on both sides, or of the node and the only one that is joined to it, with the variance of the
/// depth as a share of its square.
#[derive(Clone, Copy)]
struct Tangent {
    vector: [f32; 3],
    deviation2: f32,
    known: bool,
}

impl Tangent {
    #[inline(always)]
    fn new(before: [f32; 4], here: [f32; 4], after: [f32; 4], joined: [bool; 2], shares: [f32; 2]) -> Self {
        let [is_before, is_after] = joined;
        let (from, to) = (either(is_before, before, here), either(is_after, after, here));
        let share = if is_before & is_after { shares[1] } else { shares[0] };
        Self {
            vector: [to[0] - from[0], to[1] - from[1], to[2] - from[2]],
            deviation2: share * (from[3] * from[3] + to[3] * to[3]),
            known: is_before | is_after,
        }
    }
}

#[inline(always)]
fn cross(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Without closures, which the compiler would not inline into vector code.
#[inline(always)]
fn either(is_first: bool, first: [f32; 4], second: [f32; 4]) -> [f32; 4] {
    let mut chosen = second;
    for k in 0..4 {
        chosen[k] = if is_first { first[k] } else { second[k] };
    }
    chosen
}

/// Square of `node x lever` across the normal. The part along the normal lengthens it and turns nothing.
#[inline(always)]
fn turned2(node: [f32; 3], lever: [f32; 3], direction: [f32; 3]) -> f32 {
    let turn = cross(node, lever);
    let along = dot(turn, direction);
    let turned2 = dot(turn, turn) - along * along;
    if turned2 > 0.0 { turned2 } else { 0.0 }
}

#[inline(always)]
fn at(node: [&[f32]; 4], i: usize) -> [f32; 4] {
    [node[0][i], node[1][i], node[2][i], node[3][i]]
}

/// Normals (T2) and their uncertainty (T3): x, y, z and rad. `shares` are those along rows and columns.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn central(around: &Around, joined: &Joined, shares: [Shares; 2], out: [&mut [f32]; 4]) {
    let [x_out, y_out, z_out, angle_out] = out;
    let n = x_out.len();
    let (y_out, z_out, angle_out) = (&mut y_out[..n], &mut z_out[..n], &mut angle_out[..n]);
    let Around { left, here, right, above, below } = around;
    let [left, here, right, above, below] =
        [left, here, right, above, below].map(|node| node.map(|values| &values[..n]));
    let [is_left, is_right] = [&joined.left[..n], &joined.right[..n]];
    let [is_up, is_down] = [&joined.up[..n], &joined.down[..n]];
    let [along_row, along_column] = shares.map(|shares| [shares.next as f32, shares.central as f32]);
    for i in 0..n {
        let middle = at(here, i);
        let across = Tangent::new(at(left, i), middle, at(right, i), [is_left[i], is_right[i]], along_row);
        let down = Tangent::new(at(above, i), middle, at(below, i), [is_up[i], is_down[i]], along_column);
        let normal = cross(down.vector, across.vector);
        let size2 = dot(normal, normal);
        let inverse = 1.0 / size2.sqrt();
        let direction = [normal[0] * inverse, normal[1] * inverse, normal[2] * inverse];
        let node = [middle[0], middle[1], middle[2]];
        let turned2 = [turned2(node, across.vector, direction), turned2(node, down.vector, direction)];
        let variance = down.deviation2 * turned2[0] + across.deviation2 * turned2[1];
        let sound = across.known & down.known & (size2 > f32::MIN_POSITIVE) & (size2 < f32::MAX);
        let hole = if sound { 0.0 } else { f32::NAN };
        x_out[i] = direction[0] + hole;
        y_out[i] = direction[1] + hole;
        z_out[i] = direction[2] + hole;
        angle_out[i] = variance.sqrt() * inverse + hole;
    }
}
