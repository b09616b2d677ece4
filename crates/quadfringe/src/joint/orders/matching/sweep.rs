//! Sweeps of semi-global matching.

use super::{LANES, NEVER, Node};
use multiversion::multiversion;

/// Room beside the labels, so that shifted reads stay inside.
const PAD: usize = 8;

/// Aggregated costs of the last node of one path.
pub(super) struct Path {
    previous: Vec<i16>,
    current: Vec<i16>,
    least: i16,
    phase: u16,
    /// Nothing before it counts.
    fresh: bool,
    labels: usize,
    /// Cost of any change of the surface, and of one by a single order.
    jump: i16,
    step: i16,
}

impl Path {
    pub fn new(labels: usize, jump: i16) -> Self {
        let mut path = Self {
            previous: vec![NEVER; labels + 2 * PAD],
            current: vec![NEVER; labels + 2 * PAD],
            least: 0,
            phase: 0,
            fresh: true,
            labels,
            jump,
            step: jump / 2,
        };
        path.restart();
        path
    }

    pub fn restart(&mut self) {
        self.least = 0;
        self.fresh = true;
        self.previous[PAD..PAD + self.labels].fill(0);
    }

    /// One node further; its aggregated costs replace or join `sums`.
    #[inline(always)]
    fn advance(&mut self, node: Node, own: &[i16], sums: &mut [u16], first: bool) {
        if !node.lit {
            if !self.fresh {
                self.restart();
            }
            if first {
                sums.fill(0);
            }
            return;
        }
        // A wrapped phase that jumps up by more than half a turn has come from the order above.
        let shift = match i32::from(node.phase) - i32::from(self.phase) {
            _ if self.fresh => 0,
            32769.. => 1,
            ..-32768 => -1isize,
            _ => 0,
        };
        let at = (PAD as isize + shift) as usize;
        let blocks = self.labels / LANES;
        let own = &own.as_chunks::<LANES>().0[..blocks];
        let sums = &mut sums.as_chunks_mut::<LANES>().0[..blocks];
        let target = &mut self.current[PAD..].as_chunks_mut::<LANES>().0[..blocks];
        let [below, same, above] =
            [at - 1, at, at + 1].map(|from| &self.previous[from..].as_chunks::<LANES>().0[..blocks]);
        let limit = self.least.saturating_add(self.jump);
        let mut least = [i16::MAX; LANES];
        for b in 0..blocks {
            for k in 0..LANES {
                let (low, high) = (below[b][k], above[b][k]);
                let neighbour = (if low < high { low } else { high }).saturating_add(self.step);
                let best = if same[b][k] < neighbour { same[b][k] } else { neighbour };
                let best = if best < limit { best } else { limit };
                let sum = own[b][k].saturating_add(best - self.least);
                target[b][k] = sum;
                least[k] = if sum < least[k] { sum } else { least[k] };
                sums[b][k] = if first { sum as u16 } else { sums[b][k].saturating_add(sum as u16) };
            }
        }
        self.least = least.iter().copied().fold(i16::MAX, i16::min);
        (self.phase, self.fresh) = (node.phase, false);
        std::mem::swap(&mut self.previous, &mut self.current);
    }
}

/// Along a row; the sums start here.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
pub(super) fn sweep_on(path: &mut Path, nodes: &[Node], costs: &[i16], sums: &mut [u16]) {
    let labels = path.labels;
    for (x, &node) in nodes.iter().enumerate() {
        let at = x * labels..(x + 1) * labels;
        path.advance(node, &costs[at.clone()], &mut sums[at], true);
    }
}

/// Back along a row.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
pub(super) fn sweep_back(path: &mut Path, nodes: &[Node], costs: &[i16], sums: &mut [u16]) {
    let labels = path.labels;
    for (x, &node) in nodes.iter().enumerate().rev() {
        let at = x * labels..(x + 1) * labels;
        path.advance(node, &costs[at.clone()], &mut sums[at], false);
    }
}

/// One row further for as many paths side by side.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
pub(super) fn across(paths: &mut [Path], nodes: &[Node], costs: &[i16], sums: &mut [u16]) {
    for (x, (path, &node)) in paths.iter_mut().zip(nodes).enumerate() {
        let at = x * path.labels..(x + 1) * path.labels;
        path.advance(node, &costs[at.clone()], &mut sums[at], false);
    }
}
