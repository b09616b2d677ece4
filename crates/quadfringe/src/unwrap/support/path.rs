//! One sweep of semi-global matching.

use multiversion::multiversion;

use super::{Evidence, JUMP, NEVER, STEP, Support};

/// Room beside the labels, so that shifted reads stay inside.
const PAD: usize = 8;

/// Aggregated costs of the last node of one path.
pub(super) struct Path {
    previous: Vec<i16>,
    current: Vec<i16>,
    own: Vec<i16>,
    least: i16,
    phase: u16,
    /// Nothing before it counts.
    fresh: bool,
    labels: usize,
}

impl Path {
    pub fn new(labels: usize) -> Self {
        let mut path = Self {
            previous: vec![NEVER; labels + 2 * PAD],
            current: vec![NEVER; labels + 2 * PAD],
            own: vec![0; labels],
            least: 0,
            phase: 0,
            fresh: true,
            labels,
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
    #[inline]
    pub fn advance(&mut self, support: &Support, node: &Evidence, sums: &mut [u16], first: bool) {
        if !node.lit {
            self.restart();
            if first {
                sums.fill(0);
            }
            return;
        }
        support.costs(node, &mut self.own);
        // A wrapped phase that jumps up by more than half a turn has come from the order above.
        let shift = match i32::from(node.phase) - i32::from(self.phase) {
            _ if self.fresh => 0,
            32769.. => 1,
            ..-32768 => -1isize,
            _ => 0,
        };
        let at = (PAD as isize + shift) as usize;
        let n = self.labels;
        let before = [at - 1, at, at + 1].map(|from| &self.previous[from..from + n]);
        let target = &mut self.current[PAD..PAD + n];
        let least = aggregate(before, &self.own, self.least, target);
        if first {
            sums.fill(0);
        }
        sums.iter_mut().zip(&*target).for_each(|(s, &v)| *s = s.saturating_add(v as u16));
        (self.least, self.phase, self.fresh) = (least, node.phase, false);
        std::mem::swap(&mut self.previous, &mut self.current);
    }
}

/// Own costs plus the cheapest way from the node before (its costs one label below, at, and one above); the least.
#[multiversion(targets("x86_64+avx2"))]
fn aggregate(before: [&[i16]; 3], own: &[i16], least_before: i16, target: &mut [i16]) -> i16 {
    let n = target.len();
    let [below, same, above] = before.map(|costs| &costs[..n]);
    let own = &own[..n];
    let limit = least_before.saturating_add(JUMP);
    let mut least = i16::MAX;
    for k in 0..n {
        let neighbour = below[k].min(above[k]).saturating_add(STEP);
        let best = same[k].min(neighbour).min(limit);
        target[k] = own[k].saturating_add(best - least_before);
        least = least.min(target[k]);
    }
    least
}
