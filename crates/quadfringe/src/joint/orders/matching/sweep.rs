//! Sweeps of semi-global matching: costs summed along rows and columns, with a price for changes of surface.

use multiversion::multiversion;

/// Number of labels in a vector. Labels are padded to whole vectors.
pub(super) const LANES: usize = 16;
/// Cost of a label outside the field. It is more than any sum of costs along a path, and does not overflow when a price
/// is added.
pub(super) const IMPOSSIBLE: i16 = 16000;
/// Padding before and after the labels, so that shifted reads stay inside the memory.
const PAD: usize = 8;

/// The data of a node that the sweeps need.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Node {
    /// Wrapped phase of the first fringe number in units of 1/65536 turn.
    pub phase: u16,
    /// Whether the node is lit. An unlit node ends all paths.
    pub lit: bool,
}

/// One path, with the aggregated costs of its last node.
pub(super) struct Path {
    previous: Vec<i16>,
    current: Vec<i16>,
    least: i16,
    phase: u16,
    /// Whether the path starts here.
    fresh: bool,
    labels: usize,
    /// Price of a change by any number of orders.
    jump: i16,
    /// Price of a change by one order.
    step: i16,
}

impl Path {
    pub fn new(labels: usize, jump: i16) -> Self {
        let mut path = Self {
            previous: vec![IMPOSSIBLE; labels + 2 * PAD],
            current: vec![IMPOSSIBLE; labels + 2 * PAD],
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

    /// Advances to the next node. Its aggregated costs are added to the sums, or written to them if `starts_sums`.
    #[inline(always)]
    fn advance(&mut self, node: Node, costs: &[i16], sums: &mut [u16], starts_sums: bool) {
        if !node.lit {
            if !self.fresh {
                self.restart();
            }
            if starts_sums {
                sums.fill(0);
            }
            return;
        }
        // If the wrapped phase jumps up by more than half a turn, the surface continues in the order below; label n
        // continues the label n + 1 of the last node.
        let shift = match i32::from(node.phase) - i32::from(self.phase) {
            _ if self.fresh => 0,
            32769.. => 1,
            ..-32768 => -1isize,
            _ => 0,
        };
        self.aggregate(shift, costs, sums, starts_sums);
        (self.phase, self.fresh) = (node.phase, false);
        std::mem::swap(&mut self.previous, &mut self.current);
    }

    /// Adds to the costs of the node the cheapest way from the last node to each label. Label n continues the label n +
    /// `shift` of the last node.
    #[inline(always)]
    fn aggregate(&mut self, shift: isize, costs: &[i16], sums: &mut [u16], starts_sums: bool) {
        let at = (PAD as isize + shift) as usize;
        let blocks = self.labels / LANES;
        let costs = &costs.as_chunks::<LANES>().0[..blocks];
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
                let sum = costs[b][k].saturating_add(best - self.least);
                target[b][k] = sum;
                least[k] = if sum < least[k] { sum } else { least[k] };
                sums[b][k] = if starts_sums { sum as u16 } else { sums[b][k].saturating_add(sum as u16) };
            }
        }
        self.least = least.iter().copied().fold(i16::MAX, i16::min);
    }
}

/// Sweeps a row forwards. This sweep starts the sums.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
pub(super) fn sweep_on(path: &mut Path, nodes: &[Node], costs: &[i16], sums: &mut [u16]) {
    let labels = path.labels;
    for (x, &node) in nodes.iter().enumerate() {
        let at = x * labels..(x + 1) * labels;
        path.advance(node, &costs[at.clone()], &mut sums[at], true);
    }
}

/// Sweeps a row backwards.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
pub(super) fn sweep_back(path: &mut Path, nodes: &[Node], costs: &[i16], sums: &mut [u16]) {
    let labels = path.labels;
    for (x, &node) in nodes.iter().enumerate().rev() {
        let at = x * labels..(x + 1) * labels;
        path.advance(node, &costs[at.clone()], &mut sums[at], false);
    }
}

/// Advances the paths of adjacent columns by one row.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
pub(super) fn across(paths: &mut [Path], nodes: &[Node], costs: &[i16], sums: &mut [u16]) {
    for (x, (path, &node)) in paths.iter_mut().zip(nodes).enumerate() {
        let at = x * path.labels..(x + 1) * path.labels;
        path.advance(node, &costs[at.clone()], &mut sums[at], false);
    }
}
