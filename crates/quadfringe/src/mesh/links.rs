//! Which neighbours are joined by one surface.

use super::MeshOptions;
use super::node_rows::{NodeRow, joined};
use super::nodes::Nodes;
use rayon::prelude::*;

/// For each node, whether a surface joins it with the next one to the right and with the next one below.
#[derive(Debug)]
pub(super) struct Links {
    pub right: Vec<bool>,
    pub down: Vec<bool>,
}

impl Links {
    /// Finds which neighbours are joined.
    pub fn new(nodes: &Nodes) -> Self {
        let (columns, all) = (nodes.columns, &nodes.all);
        let mut right = vec![false; all.len()];
        let mut down = vec![false; all.len()];
        let rows = right.par_chunks_mut(columns.max(1)).zip(down.par_chunks_mut(columns.max(1)));
        rows.enumerate().for_each_init(<[NodeRow; 2]>::default, |[here, below], (y, (right, down))| {
            here.fill(&all[y * columns..][..columns]);
            joined(here.slices(0, columns - 1), here.slices(1, columns - 1), right);
            if y + 1 < nodes.rows {
                below.fill(&all[(y + 1) * columns..][..columns]);
                joined(here.slices(0, columns), below.slices(0, columns), down);
            }
        });
        Self { right, down }
    }

    /// The grid of every `step`-th node. Two of its neighbours are joined if all pixels between them are.
    pub fn every(&self, nodes: &Nodes, step: usize) -> Self {
        let (rows, columns) = (nodes.rows.div_ceil(step), nodes.columns.div_ceil(step));
        let whole = |links: &[bool], i: usize, stride: usize| {
            let from = i / columns * step * nodes.columns + i % columns * step;
            (0..step).all(|k| links.get(from + k * stride).copied().unwrap_or(false))
        };
        let collect = |links: &[bool], stride| (0..rows * columns).map(|i| whole(links, i, stride)).collect();
        Self { right: collect(&self.right, 1), down: collect(&self.down, nodes.columns) }
    }
}

/// The grid that the options ask for.
pub(super) fn thinned(nodes: Nodes, links: Links, options: &MeshOptions) -> Grid {
    if options.step == 1 {
        return Grid { nodes, links };
    }
    let links = links.every(&nodes, options.step);
    Grid { nodes: nodes.every(options.step), links }
}

/// Nodes and their links.
#[derive(Debug)]
pub(super) struct Grid {
    pub nodes: Nodes,
    pub links: Links,
}
