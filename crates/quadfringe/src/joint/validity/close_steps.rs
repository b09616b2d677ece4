//! Step 8: cells close to a step of about one turn.
//!
//! Windows see both sides of a step, and at a step of about one turn the light of R and B is nearly the same on both. A strip along
//! it can take the order of the wrong side and so belong to the wrong region, without contradicting it: G differs by a tenth of a
//! radian and IR by one. A region therefore says nothing of the orders there.

use crate::joint::cells::Grid;
use crate::joint::params::validity::{CLOSE_CELLS, CLOSE_ROW_STEP, CLOSE_TURNS_MAX};
use crate::joint::scene::PhaseMap;
use multiversion::multiversion;
use rayon::prelude::*;
use std::f32::consts::{PI, TAU};

/// The cells close to a step of about one turn.
#[derive(Debug, Default)]
pub(super) struct CloseSteps {
    /// Not 0 for cells that a step crosses, then for cells in the same column close to one.
    crossed: Vec<u8>,
    close: Vec<u8>,
}

impl CloseSteps {
    /// Finds the steps between lit neighbours of an absolute phase in rad, with padded rows.
    pub fn mark(&mut self, grid: &Grid, map: PhaseMap<'_>) {
        let Self { crossed, close } = self;
        crossed.resize(grid.rows * grid.columns, 0);
        close.resize(grid.rows * grid.columns, 0);
        crossed.par_chunks_mut(grid.columns).enumerate().for_each_init(Vec::new, |at_step, (row, cells)| {
            cells.fill(0);
            for y in (row * grid.step..((row + 1) * grid.step).min(grid.height)).step_by(CLOSE_ROW_STEP) {
                mark_row(grid, map, y, at_step);
                for (cell, pixels) in cells.iter_mut().zip(at_step.chunks(grid.step)) {
                    *cell |= pixels.iter().fold(0, |any, pixel| any | pixel);
                }
            }
        });
        let crossed = &*crossed;
        close.par_chunks_mut(grid.columns).enumerate().for_each_init(Vec::new, |column, (row, close)| {
            column.clear();
            column.resize(grid.columns, 0);
            for near in row.saturating_sub(CLOSE_CELLS)..(row + CLOSE_CELLS + 1).min(grid.rows) {
                add(&crossed[near * grid.columns..][..grid.columns], column);
            }
            close.fill(0);
            for shift in 0..=CLOSE_CELLS {
                let n = grid.columns.saturating_sub(shift);
                add(&column[..n], &mut close[grid.columns - n..]);
                add(&column[grid.columns - n..], &mut close[..n]);
            }
        });
    }

    /// The cells along row `y` of the image: not 0 for those close to a step.
    pub fn row(&self, grid: &Grid, y: usize) -> &[u8] {
        &self.close[y / grid.step * grid.columns..][..grid.columns]
    }
}

/// Joins marks.
fn add(marks: &[u8], out: &mut [u8]) {
    out.iter_mut().zip(marks).for_each(|(out, mark)| *out |= *mark);
}

/// Marks with 1 the pixels of row `y` that a step parts from the next one of the row, or from that in the next row to be compared.
fn mark_row(grid: &Grid, map: PhaseMap<'_>, y: usize, at_step: &mut Vec<u8>) {
    let row = |y: usize| PhaseMap {
        phase: &map.phase[y * grid.stride..][..grid.width],
        modulation: &map.modulation[y * grid.stride..][..grid.width],
    };
    let (here, n) = (row(y), grid.width - 1);
    at_step.clear();
    at_step.resize(grid.width, 0);
    let next = PhaseMap { phase: &here.phase[1..], modulation: &here.modulation[1..] };
    compare(here, next, &mut at_step[..n]);
    if y + CLOSE_ROW_STEP < grid.height {
        compare(here, row(y + CLOSE_ROW_STEP), at_step);
    }
}

/// Marks pixels of a row that a step parts from those of another.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn compare(here: PhaseMap, there: PhaseMap, at_step: &mut [u8]) {
    let n = at_step.len();
    let (phase, lit) = (&here.phase[..n], &here.modulation[..n]);
    let (other, other_lit) = (&there.phase[..n], &there.modulation[..n]);
    for x in 0..n {
        let gap = (phase[x] - other[x]).abs();
        let both = (lit[x] > 0.0) & (other_lit[x] > 0.0);
        at_step[x] |= u8::from(both & (PI..CLOSE_TURNS_MAX * TAU).contains(&gap));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The first and the last cell of a row close to a step of this height in rad between columns 31 and 32.
    fn close_to(step: f32) -> Option<[usize; 2]> {
        let grid = Grid::new([40, 64], 4.0);
        let phase: Vec<f32> =
            (0..grid.pixels()).map(|i| if i % 64 < 32 { 10.0 } else { 10.0 + step }).collect();
        let lit = vec![1.0; grid.pixels()];
        let mut steps = CloseSteps::default();
        steps.mark(&grid, PhaseMap { phase: &phase, modulation: &lit });
        let row = steps.row(&grid, 13);
        Some([row.iter().position(|&cell| cell != 0)?, row.iter().rposition(|&cell| cell != 0)?])
    }

    #[test]
    fn a_step_of_a_turn_marks_the_cells_around_and_no_other_height_does() {
        assert_eq!(close_to(6.0), Some([7 - CLOSE_CELLS, 7 + CLOSE_CELLS]));
        assert_eq!([0.5, 12.0].map(close_to), [None; 2]);
    }

    #[test]
    fn a_step_is_close_along_the_column_too() {
        let grid = Grid::new([64, 32], 4.0);
        let phase: Vec<f32> = (0..grid.pixels()).map(|i| if i / 32 < 32 { 10.0 } else { 16.0 }).collect();
        let mut steps = CloseSteps::default();
        steps.mark(&grid, PhaseMap { phase: &phase, modulation: &vec![1.0; grid.pixels()] });
        let close: Vec<usize> = (0..64).step_by(4).filter(|&y| steps.row(&grid, y)[5] != 0).collect();
        assert_eq!(close, (7 - CLOSE_CELLS..=7 + CLOSE_CELLS).map(|row| 4 * row).collect::<Vec<_>>());
    }
}
