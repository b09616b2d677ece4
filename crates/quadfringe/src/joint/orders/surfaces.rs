//! Step 4: orders of doubtful surfaces. Neighbouring nodes whose phases continue each other form a surface.
//!
//! Near a rim, offsets and amplitudes are wrong in the same way for many nodes, so that the matching may give a whole strip of them
//! a wrong order. The wrapped phase continues across the border of such a strip, which shows as a step of the same number of whole
//! turns along all of the border. Between two real surfaces the step has any size, and is a whole number of turns within
//! [`SAME_SURFACE_RAD`] for one pair of surfaces in ten. If the orders of a surface are less certain than that, it takes the order with
//! which it continues its neighbour.

use crate::joint::cells::Grid;
use crate::joint::disjoint::{root, unite};
use crate::joint::params::validity::SAME_SURFACE_RAD;
use std::f32::consts::{FRAC_PI_2, PI, TAU};

/// How much more often the border of a wrong order is a step of whole turns than the border of two real surfaces: the former always
/// is.
const BORDER_ODDS: f32 = PI / SAME_SURFACE_RAD;

/// The surfaces of a shot, as sets of nodes.
#[derive(Debug, Clone, Default)]
pub(super) struct Surfaces {
    /// Wrong-order probability of every node.
    pub wrong: Vec<f32>,
    /// Wrong-order probability of every node whose order was changed, 0 for the others; empty if none was.
    pub moved: Vec<f32>,
    parents: Vec<u32>,
    /// Sum of the wrong-order probabilities and number of nodes, for the root of every surface.
    sums: Vec<f32>,
    sizes: Vec<u32>,
    edges: Vec<Edge>,
}

/// The step of the phase from one node to its neighbour, in rad, without what the slopes explain; `None` if one of them is not lit.
pub(super) type Step = Option<f32>;

/// Two neighbouring nodes on different surfaces.
#[derive(Debug, Clone, Copy)]
struct Edge {
    from: u32,
    to: u32,
    /// Whole turns by which `to` has a greater order than its phase, continued from `from`, has.
    turns: i16,
    /// Whether the step is a whole number of turns.
    whole: bool,
}

/// A border between a doubtful surface and a certain one, seen from the former.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Border {
    surface: u32,
    other: u32,
    /// Turns that the surface lacks to continue the other, if the step is a whole number of turns.
    lacks: Option<i16>,
}

impl Surfaces {
    /// Gives the nodes of doubtful surfaces the order with which they continue a surface that is not doubtful. `shared` nodes in a row
    /// take their evidence from the same window.
    pub fn settle(&mut self, shared: f32, order: &mut [i16]) {
        let shifts = self.shifts(shared);
        self.moved.clear();
        if shifts.is_empty() {
            return;
        }
        self.moved.resize(order.len(), 0.0);
        for (node, order) in order.iter_mut().enumerate() {
            let surface = root(&mut self.parents, node as u32);
            if let Ok(found) = shifts.binary_search_by_key(&surface, |shift| shift.surface) {
                *order += shifts[found].turns;
                self.moved[node] = self.wrong_after_shift(surface);
            }
        }
    }

    /// Finds the surfaces of nodes with the wrong-order probabilities `wrong`, and the edges between them. `step` measures the step
    /// from a node, by row and column, to its right or lower neighbour.
    pub fn find(&mut self, grid: &Grid, step: impl Fn([usize; 2], [usize; 2]) -> Step) {
        let Self { wrong, parents, sums, sizes, edges, .. } = self;
        let nodes = wrong.len() as u32;
        edges.clear();
        parents.clear();
        parents.extend(0..nodes);
        for (row, column) in (0..grid.rows).flat_map(|row| (0..grid.columns).map(move |column| (row, column)))
        {
            let from = (row * grid.columns + column) as u32;
            let right = (column + 1 < grid.columns).then_some(([row, column + 1], from + 1));
            let below = (row + 1 < grid.rows).then_some(([row + 1, column], from + grid.columns as u32));
            for (place, to) in right.into_iter().chain(below) {
                let Some(step) = step([row, column], place) else { continue };
                let turns = (step / TAU).round();
                let rest = (step - TAU * turns).abs();
                if turns == 0.0 && rest < FRAC_PI_2 {
                    unite(parents, from, to);
                } else {
                    let whole = turns != 0.0 && rest < SAME_SURFACE_RAD;
                    edges.push(Edge { from, to, turns: turns as i16, whole });
                }
            }
        }
        (*sums, *sizes) = (vec![0.0; wrong.len()], vec![0; wrong.len()]);
        for node in 0..nodes {
            let surface = root(parents, node) as usize;
            sums[surface] += wrong[node as usize];
            sizes[surface] += 1;
        }
    }

    /// Mean wrong-order probability of a surface by the evidence of its nodes.
    fn wrong_before(&self, surface: u32) -> f32 {
        self.sums[surface as usize] / self.sizes[surface as usize] as f32
    }

    /// Probability that the order with which a doubtful surface continues its neighbour is wrong: that its former order was
    /// right, and its border is a step of whole turns by chance.
    fn wrong_after_shift(&self, surface: u32) -> f32 {
        let wrong = self.wrong_before(surface);
        (1.0 - wrong) / (1.0 - wrong + BORDER_ODDS * wrong)
    }

    /// Whether a step of whole turns at the border of a surface means that its order is wrong, rather than another surface.
    fn is_doubtful(&self, surface: u32) -> bool {
        let wrong = self.wrong_before(surface);
        BORDER_ODDS * wrong > 1.0 - wrong
    }

    /// Doubtful surfaces with the turns that they lack, by their number. At least half of the border with the other surface must lack
    /// this number of turns, and this part must be longer than a window; of several other surfaces the longest border decides.
    fn shifts(&mut self, shared: f32) -> Vec<Shift> {
        let is_clear =
            |found: &Lack, border: &[Border]| 2 * found.count >= border.len() && found.count as f32 >= shared;
        let mut borders = self.borders();
        borders.sort_unstable();
        let mut shifts = Vec::new();
        for surface in borders.chunk_by(|a, b| a.surface == b.surface) {
            let longest = surface
                .chunk_by(|a, b| a.other == b.other)
                .filter_map(|border| most_frequent(border).filter(|found| is_clear(found, border)))
                .max_by_key(|found| found.count);
            shifts.extend(longest.map(|found| Shift { surface: surface[0].surface, turns: found.lacks }));
        }
        shifts
    }

    fn borders(&mut self) -> Vec<Border> {
        let mut borders = Vec::new();
        for Edge { from, to, turns, whole } in std::mem::take(&mut self.edges) {
            let (from, to) = (root(&mut self.parents, from), root(&mut self.parents, to));
            match (self.is_doubtful(from), self.is_doubtful(to)) {
                (true, false) => {
                    borders.push(Border { surface: from, other: to, lacks: whole.then_some(turns) })
                }
                (false, true) => {
                    borders.push(Border { surface: to, other: from, lacks: whole.then_some(-turns) })
                }
                _ => (),
            }
        }
        borders
    }
}

/// Turns that the order of a surface gains.
#[derive(Debug, Clone, Copy)]
struct Shift {
    surface: u32,
    turns: i16,
}

/// A number of turns, and how many edges of a border lack it.
#[derive(Debug, Clone, Copy)]
struct Lack {
    lacks: i16,
    count: usize,
}

/// The number of turns that the most edges of a sorted border lack.
fn most_frequent(border: &[Border]) -> Option<Lack> {
    let equal = border.chunk_by(|a, b| a.lacks == b.lacks);
    let found = equal.filter_map(|part| part[0].lacks.map(|lacks| Lack { lacks, count: part.len() }));
    found.max_by_key(|found| found.count)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Turns that the strip and the plane gain.
    fn gained(step: f32, wrong: f32, shared: f32) -> [i16; 2] {
        let Shifted { order, in_strip, .. } = shifted(step, wrong, shared);
        let of = |strip: bool| (0..order.len()).filter(move |&i| in_strip(i) == strip);
        assert!(of(true).all(|i| order[i] == order[0]));
        assert!(of(false).all(|i| order[i] == order[order.len() - 1]));
        [order[0] - 7, order[order.len() - 1] - 7]
    }

    /// The surfaces and the orders of the plane, and which nodes lie in the strip.
    struct Shifted {
        surfaces: Surfaces,
        order: Vec<i16>,
        in_strip: fn(usize) -> bool,
    }

    /// A plane of 12 x 20 nodes with a strip along its left side, whose phase is off by `step` rad and whose orders are wrong with
    /// the probability `wrong`; `shared` nodes share a window.
    fn shifted(step: f32, wrong: f32, shared: f32) -> Shifted {
        let grid = Grid::new([12 * 4, 20 * 4], 4.0);
        let in_strip: fn(usize) -> bool = |i| i % 20 < 4;
        let mut surfaces = Surfaces::default();
        let nodes = grid.rows * grid.columns;
        surfaces.wrong = (0..nodes).map(|i| if in_strip(i) { wrong } else { 1e-4 }).collect();
        let off = |[row, column]: [usize; 2]| if in_strip(row * 20 + column) { step } else { 0.0 };
        surfaces.find(&grid, |from, to| Some(off(to) - off(from)));
        let mut order = vec![7; nodes];
        surfaces.settle(shared, &mut order);
        Shifted { surfaces, order, in_strip }
    }

    #[test]
    fn a_doubtful_strip_continues_its_neighbour() {
        assert_eq!(gained(-TAU + 0.1, 0.2, 5.0), [1, 0]);
        assert_eq!(gained(3.0 * TAU - 0.1, 0.2, 5.0), [-3, 0]);
    }

    #[test]
    fn a_certain_strip_and_one_with_another_step_keep_their_order() {
        assert_eq!(gained(-TAU + 0.1, 0.01, 5.0), [0, 0]);
        assert_eq!(gained(-TAU + 1.0, 0.2, 5.0), [0, 0]);
        assert_eq!(gained(0.1, 0.2, 5.0), [0, 0]);
    }

    #[test]
    fn a_strip_that_was_shifted_is_as_uncertain_as_the_evidence_for_its_former_order() {
        for (wrong, expected) in [(0.1, 0.462), (0.2, 0.276), (0.5, 0.087)] {
            let moved = shifted(-TAU + 0.1, wrong, 5.0).surfaces.moved;
            assert!((moved[0] - expected).abs() < 1e-3, "{wrong} {}", moved[0]);
            assert_eq!(moved[19], 0.0);
        }
        assert!(shifted(-TAU + 0.1, 0.01, 5.0).surfaces.moved.is_empty());
    }

    #[test]
    fn a_border_within_one_window_is_no_evidence() {
        assert_eq!(gained(-TAU + 0.1, 0.2, 13.0), [0, 0]);
    }
}
