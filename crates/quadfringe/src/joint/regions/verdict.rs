//! Step 8: the order that a region gives its pixels, and how certain it is.

use super::scores::Contradiction;
use crate::joint::params::regions::{CERTAIN_EVIDENCE, CONTRADICTION_MAX, QUALITY};

/// The order of a part of a region, and the evidence for and against it. All evidence is a log-likelihood ratio.
#[derive(Debug, Clone, Copy)]
pub(in crate::joint) struct Verdict {
    pub(super) region: u32,
    /// Turns that it lacks.
    pub(super) turns: f32,
    /// Evidence for this number of turns against all others; 0 if the part alone speaks for another.
    pub(super) lead: f32,
    /// Evidence for shifts of G and IR that no number of turns explains.
    pub(super) contradiction: Contradiction,
    /// Greatest evidence for the order in the tiles around: the order of a region is the same up to its border.
    pub(super) around: f32,
}

impl Verdict {
    /// Raises the quality of orders, which the nodes have given, to what the region gives with this `support` by the neighbourhood:
    /// where that is lower, another surface is near. An order that is not that of the nodes has the quality of the region.
    pub fn raise(&self, support: &[f32], quality: &mut [f32]) {
        let most = QUALITY * (self.evidence() / CERTAIN_EVIDENCE).clamp(0.0, 1.0);
        let of_nodes = if self.is_of_nodes() { 1.0 } else { 0.0 };
        for (quality, support) in quality.iter_mut().zip(support) {
            *quality = (of_nodes * *quality).max(support.min(most));
        }
    }

    /// Probability that the order is wrong; that of the nodes is wrong with probability `of_nodes`. The region makes no pixel more certain
    /// than `least`.
    pub fn wrong_order(&self, of_nodes: f32, least: f32) -> f32 {
        let by_region = (1.0 / (1.0 + self.around.exp())).max(least);
        if self.is_of_nodes() { of_nodes.min(by_region) } else { of_nodes.max(by_region) }
    }

    /// Evidence for its order.
    pub(super) fn evidence(&self) -> f32 {
        if self.contradiction.whole > CONTRADICTION_MAX { 0.0 } else { self.lead - self.contradiction.whole }
    }

    /// Whether it has the order that its nodes have, and nothing contradicts it.
    fn is_of_nodes(&self) -> bool {
        self.turns == 0.0 && self.contradiction.of_order <= CONTRADICTION_MAX
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A verdict with this evidence in the tiles around, that lacks `turns`.
    fn verdict(turns: f32, around: f32) -> Verdict {
        Verdict { region: 0, turns, lead: 0.0, contradiction: Contradiction::default(), around }
    }

    #[test]
    fn a_region_makes_the_order_of_its_nodes_more_certain_and_another_one_never() {
        for of_nodes in [1e-5, 0.1, 0.9] {
            assert_eq!(verdict(0.0, 50.0).wrong_order(of_nodes, 0.01), of_nodes.min(0.01));
            assert_eq!(verdict(0.0, 0.0).wrong_order(of_nodes, 0.01), of_nodes.min(0.5));
            assert_eq!(verdict(2.0, 50.0).wrong_order(of_nodes, 0.01), of_nodes.max(0.01));
        }
    }

    #[test]
    fn evidence_is_a_logarithm_of_odds() {
        let wrong = verdict(0.0, 9.0f32.ln()).wrong_order(0.9, 0.0);
        assert!((wrong - 0.1).abs() < 1e-6, "{wrong}");
    }

    #[test]
    fn a_contradicted_order_is_not_that_of_the_nodes() {
        let contradiction = Contradiction { whole: 0.0, of_order: 1.01 * CONTRADICTION_MAX };
        let verdict = Verdict { contradiction, ..verdict(0.0, 50.0) };
        assert_eq!(verdict.wrong_order(0.3, 0.01), 0.3);
    }
}
