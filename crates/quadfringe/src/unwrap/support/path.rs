//! One sweep of semi-global matching.

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
            labels,
        };
        path.restart();
        path
    }

    pub fn restart(&mut self) {
        self.least = 0;
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
        let step = i32::from(node.phase) - i32::from(self.phase);
        // A wrapped phase that jumps up by more than half a turn has come from the order above.
        let shift = if step > 32768 {
            1
        } else if step < -32768 {
            -1isize
        } else {
            0
        };
        let at = (PAD as isize + shift) as usize;
        let n = self.labels;
        let same = &self.previous[at..at + n];
        let below = &self.previous[at - 1..at - 1 + n];
        let above = &self.previous[at + 1..at + 1 + n];
        let limit = self.least.saturating_add(JUMP);
        let mut least = i16::MAX;
        let target = &mut self.current[PAD..PAD + n];
        for k in 0..n {
            let neighbour = below[k].min(above[k]).saturating_add(STEP);
            let best = same[k].min(neighbour).min(limit);
            let value = self.own[k].saturating_add(best - self.least);
            target[k] = value;
            least = least.min(value);
        }
        self.least = least;
        self.phase = node.phase;
        let values = &self.current[PAD..PAD + n];
        if first {
            sums.iter_mut().zip(values).for_each(|(s, &v)| *s = v as u16);
        } else {
            sums.iter_mut().zip(values).for_each(|(s, &v)| *s = s.saturating_add(v as u16));
        }
        std::mem::swap(&mut self.previous, &mut self.current);
    }
}
