//! Rows of nodes as separate rows of numbers. Loops over them have no branches, so that the compiler makes vectors of them.

use super::nodes::{Node, are_joined};
use multiversion::multiversion;

/// Nodes of one row: x, y, z and the standard deviation of the depth as a share of the depth.
#[derive(Debug, Default)]
pub(super) struct NodeRow([Vec<f32>; 4]);

impl NodeRow {
    pub fn fill(&mut self, nodes: &[Node]) {
        let [x, y, z, deviation] = &mut self.0;
        for values in [&mut *x, y, z, deviation] {
            values.resize(nodes.len(), 0.0);
        }
        let out = x.iter_mut().zip(y).zip(z.iter_mut().zip(deviation));
        for (((x, y), (z, deviation)), node) in out.zip(nodes) {
            ([*x, *y, *z], *deviation) = (node.point, node.deviation);
        }
    }

    pub fn slices(&self, from: usize, count: usize) -> [&[f32]; 4] {
        self.0.each_ref().map(|values| &values[from..from + count])
    }
}

/// The node at place `i` of a row.
#[inline(always)]
pub(super) fn node([x, y, z, deviation]: [&[f32]; 4], i: usize) -> Node {
    Node { point: [x[i], y[i], z[i]], deviation: deviation[i] }
}

/// Tells for each pair of nodes at the same place whether they are joined.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
pub(super) fn joined(first: [&[f32]; 4], second: [&[f32]; 4], out: &mut [bool]) {
    let n = first[0].len();
    let (first, second) = (first.map(|values| &values[..n]), second.map(|values| &values[..n]));
    for (i, out) in out[..n].iter_mut().enumerate() {
        *out = are_joined(node(first, i), node(second, i));
    }
}
