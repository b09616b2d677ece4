//! Narrow gaps of the surface. Print that reflects next to no light, or a narrow shadow, cuts a surface in pieces, and the light of a
//! narrow piece can hardly tell its phase. So the cells of a gap become a part of the surface, without light, where the phases on both
//! sides continue each other. Torn cells do not, because there may be an edge of the surface.

use crate::joint::params::energy::GAP_MAX_CELLS;
use crate::joint::params::validity::SAME_SURFACE_RAD;

/// A cell of a gap.
#[derive(Debug, Clone, Copy)]
struct GapCell {
    /// Its place in the maps.
    at: usize,
    /// Phase between those of both sides, rad.
    phase: f32,
}

/// The gaps of a shot.
#[derive(Debug, Default)]
pub(super) struct Gaps {
    found: Vec<GapCell>,
}

/// Maps of cells in rows of `stride`.
pub(super) struct Maps<'a> {
    /// 1 for lit cells.
    pub inside: &'a mut [f32],
    /// 1 for torn cells.
    pub torn: &'a [f32],
    /// Mean phase of lit cells, rad.
    pub phase: &'a mut [f32],
    pub stride: usize,
}

/// The lit cells and their phase, as in [`Maps`].
#[derive(Clone, Copy)]
struct Lit<'a> {
    inside: &'a [f32],
    phase: &'a [f32],
    stride: usize,
}

impl Gaps {
    /// Makes the cells in gaps lit ones, in `height` rows and `width` columns.
    pub fn close(&mut self, Maps { inside, torn, phase, stride }: Maps<'_>, size: [usize; 2]) {
        self.find(Lit { inside, phase, stride }, size);
        // Where a cell lies in two gaps, that along the row counts.
        for &GapCell { at, phase: between } in self.found.iter().rev().filter(|cell| torn[cell.at] == 0.0) {
            (inside[at], phase[at]) = (1.0, between);
        }
    }

    /// Lists the cells in gaps along the rows, then those in gaps along the columns.
    fn find(&mut self, lit: Lit<'_>, [height, width]: [usize; 2]) {
        self.found.clear();
        for y in 0..height {
            lit.find_along(width, |x| y * lit.stride + x, &mut self.found);
        }
        for x in 0..width {
            lit.find_along(height, |y| y * lit.stride + x, &mut self.found);
        }
    }
}

impl Lit<'_> {
    /// Lists the cells in gaps along a line of cells.
    fn find_along(self, length: usize, at: impl Fn(usize) -> usize, out: &mut Vec<GapCell>) {
        let mut last = None;
        for to in (0..length).filter(|&i| self.inside[at(i)] > 0.0) {
            if let Some(from) = last.replace(to)
                && (2..=GAP_MAX_CELLS + 1).contains(&(to - from))
            {
                self.bridge([from, to], length, &at, out);
            }
        }
    }

    /// Lists the cells between two lit ones, if the phase continues from one side to the other, by the mean of their slopes.
    fn bridge(
        self,
        [from, to]: [usize; 2],
        length: usize,
        at: &impl Fn(usize) -> usize,
        out: &mut Vec<GapCell>,
    ) {
        if from == 0 || to + 1 == length || [from - 1, to + 1].iter().any(|&i| self.inside[at(i)] == 0.0) {
            return;
        }
        let phase = |i: usize| self.phase[at(i)];
        let (steps, rise) = ((to - from) as f32, phase(to) - phase(from));
        let slope = 0.5 * (phase(from) - phase(from - 1) + phase(to + 1) - phase(to));
        if (rise - slope * steps).abs() < SAME_SURFACE_RAD {
            let between = |i: usize| phase(from) + rise * (i - from) as f32 / steps;
            out.extend((from + 1..to).map(|i| GapCell { at: at(i), phase: between(i) }));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WIDTH: usize = 20;

    /// Columns of the cells found in a row of the slope 0.5 rad, of which `dark` are not lit, with a step of `step` rad behind them.
    fn found(dark: std::ops::Range<usize>, step: f32) -> Vec<usize> {
        let mut inside = [1.0; WIDTH];
        let phase: [f32; WIDTH] =
            std::array::from_fn(|x| 0.5 * x as f32 + if x >= dark.end { step } else { 0.0 });
        inside[dark.clone()].fill(0.0);
        let mut gaps = Gaps::default();
        gaps.find(Lit { inside: &inside, phase: &phase, stride: WIDTH }, [1, WIDTH]);
        for cell in gaps.found.iter().filter(|_| step == 0.0) {
            assert!((cell.phase - 0.5 * cell.at as f32).abs() < 1e-5, "{cell:?}");
        }
        gaps.found.iter().map(|cell| cell.at).collect()
    }

    #[test]
    fn narrow_gaps_of_one_surface_are_found() {
        assert_eq!(found(8..9, 0.0), [8]);
        assert_eq!(found(8..8 + GAP_MAX_CELLS, 0.0), Vec::from_iter(8..8 + GAP_MAX_CELLS));
        assert_eq!(found(8..10, 0.8 * SAME_SURFACE_RAD), [8, 9]);
    }

    #[test]
    fn wide_gaps_steps_and_gaps_without_a_slope_on_both_sides_are_not() {
        assert!(found(8..9 + GAP_MAX_CELLS, 0.0).is_empty());
        assert!(found(8..10, 1.2 * SAME_SURFACE_RAD).is_empty());
        assert!(found(0..2, 0.0).is_empty());
        assert!(found(1..2, 0.0).is_empty());
        assert!(found(WIDTH - 2..WIDTH - 1, 0.0).is_empty());
    }

    #[test]
    fn a_gap_along_a_column_is_closed_and_a_torn_cell_is_not() {
        let closed = |torn: &[f32]| {
            let mut inside = [1.0, 1.0, 0.0, 1.0, 1.0];
            let mut phase = [0.0, 0.1, 9.0, 0.3, 0.4];
            let maps = Maps { inside: &mut inside, torn, phase: &mut phase, stride: 1 };
            Gaps::default().close(maps, [5, 1]);
            (inside[2], phase[2])
        };
        let (inside, phase) = closed(&[0.0; 5]);
        assert!(inside == 1.0 && (phase - 0.2).abs() < 1e-6, "{inside} {phase}");
        assert_eq!(closed(&[0.0, 0.0, 1.0, 0.0, 0.0]), (0.0, 9.0));
    }
}
