//! How much the errors of neighbours have in common, estimated from the surface itself (T4).

use super::nodes::Nodes;
use super::params::{CORRELATION_ROWS, CORRELATION_SAMPLES_MIN, NORMAL_MEDIAN};

/// Share of the variance of two independent errors that their difference has.
#[derive(Debug, Clone, Copy)]
pub(super) struct Shares {
    /// Of nodes that are next to each other.
    pub next: f64,
    /// Of the two neighbours of a node.
    pub central: f64,
}

impl Shares {
    /// Along the rows (`stride` 1) or along the columns of the nodes, whose `links` tell which neighbours are joined.
    pub fn new(nodes: &Nodes, links: &[bool], stride: usize) -> Self {
        let rows = (0..nodes.rows).step_by(CORRELATION_ROWS);
        let places = rows.flat_map(|y| y * nodes.columns..(y + 1) * nodes.columns);
        let mut found: Vec<f64> = places.filter_map(|i| second_difference(nodes, links, i, stride)).collect();
        if found.len() < CORRELATION_SAMPLES_MIN {
            return Self { next: 1.0, central: 1.0 };
        }
        let middle = found.len() / 2;
        let (_, median, _) = found.select_nth_unstable_by(middle, f64::total_cmp);
        let central = correlation((*median / NORMAL_MEDIAN).powi(2));
        Self { next: 1.0 - central.powf(0.25), central: 1.0 - central }
    }
}

/// Size of the second difference of the depths two nodes before and behind, in standard deviations; `None` where they are
/// not all joined, or the standard deviation is unknown.
fn second_difference(nodes: &Nodes, links: &[bool], i: usize, stride: usize) -> Option<f64> {
    let from = i.checked_sub(2 * stride)?;
    let is_whole = (0..4).all(|k| links.get(from + k * stride).copied().unwrap_or(false));
    let depth = |i: usize| f64::from(nodes.all[i].point[2]);
    let deviation_mm = f64::from(nodes.all[i].deviation) * depth(i);
    (is_whole && deviation_mm > 0.0)
        .then(|| (depth(from) - 2.0 * depth(i) + depth(from + 4 * stride)).abs() / deviation_mm)
}

/// The correlation at a distance of two nodes, of errors whose second difference over two nodes has this variance, and
/// whose correlation falls with the distance as a Gaussian does: the root of `6 - 8 r + 2 r^4`, which falls from 6 to 0.
fn correlation(variance: f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..f64::MANTISSA_DIGITS {
        let middle: f64 = 0.5 * (low + high);
        let is_above = 6.0 - 8.0 * middle + 2.0 * middle.powi(4) > variance;
        (low, high) = if is_above { (middle, high) } else { (low, middle) };
    }
    low
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_correlation_is_that_of_the_variance() {
        for known in [0.0, 0.3, 0.9, 0.99] {
            let variance: f64 = 6.0 - 8.0 * known + 2.0 * f64::powi(known, 4);
            assert!((correlation(variance) - known).abs() < 1e-6, "{known}");
        }
        assert!(correlation(7.0) == 0.0, "more than independent errors have");
    }
}
