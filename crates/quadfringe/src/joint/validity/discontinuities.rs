//! Step 8: pixels that are doubtful because of their nearest neighbours, at order jumps of the absolute phase and in
//! narrow strips.

use crate::joint::cells::Grid;
use crate::joint::params::validity::{AMBIGUOUS_REACH, SAME_SURFACE_RAD};
use crate::joint::scene::PhaseMap;
use crate::parallel::angle::wrap;
use multiversion::multiversion;
use rayon::prelude::*;
use std::f32::consts::PI;

/// Order jumps: pixels that differ by half a turn or more from a neighbour.
#[derive(Debug, Default)]
pub(super) struct Discontinuities {
    at_jump: Vec<u8>,
    /// Pixels at a jump across which the wrapped phase hardly changes, so that R and B do not see it.
    ambiguous: Vec<u8>,
}

/// One row of pixels.
#[derive(Clone, Copy)]
struct Row<'a> {
    phase: &'a [f32],
    modulation: &'a [f32],
}

/// Marks of one row of pixels.
struct MarkRow<'a> {
    at_jump: &'a mut [u8],
    ambiguous: &'a mut [u8],
}

impl Discontinuities {
    /// 1 for every pixel that differs by half a turn or more from a neighbour.
    pub fn at_jump(&self) -> &[u8] {
        &self.at_jump
    }

    /// Marks in `excluded` every lit pixel whose absolute phase (rad) differs by half a turn or more from a lit neighbour, and
    /// the pixels around it: one of the two has the wrong order or sees two surfaces at once. If the wrapped phases agree, only G
    /// and IR show on which side a pixel lies. Their beats are blurred, so more pixels around it are marked.
    pub fn mark(&mut self, grid: &Grid, map: PhaseMap<'_>, excluded: &mut Vec<u8>) {
        let stride = grid.stride;
        self.at_jump.resize(grid.pixels(), 0);
        self.ambiguous.resize(grid.pixels(), 0);
        excluded.resize(grid.pixels(), 0);
        let rows = self.at_jump.par_chunks_mut(stride).zip(self.ambiguous.par_chunks_mut(stride)).enumerate();
        rows.for_each(|(y, (at_jump, ambiguous))| {
            at_jump.fill(0);
            ambiguous.fill(0);
            let row = |y: usize| Row {
                phase: &map.phase[y * stride..][..grid.width],
                modulation: &map.modulation[y * stride..][..grid.width],
            };
            let (here, n) = (row(y), grid.width - 1);
            let [left, right] = [0..n, 1..grid.width].map(|part| here.part(part));
            mark_row(left, right, MarkRow { at_jump: &mut at_jump[..n], ambiguous: &mut ambiguous[..n] });
            mark_row(left, right, MarkRow { at_jump: &mut at_jump[1..=n], ambiguous: &mut ambiguous[1..=n] });
            for other in [y.checked_sub(1), (y + 1 < grid.height).then_some(y + 1)].into_iter().flatten() {
                let out = MarkRow { at_jump: &mut at_jump[..=n], ambiguous: &mut ambiguous[..=n] };
                mark_row(here, row(other), out);
            }
        });
        let (at_jump, ambiguous) = (&self.at_jump, &self.ambiguous);
        let work = || (Vec::new(), vec![0; stride]);
        excluded.par_chunks_mut(stride).enumerate().for_each_init(work, |(sums, wide), (y, excluded)| {
            count_near(at_jump, grid, Near { y, reach: 1 }, sums, excluded);
            count_near(ambiguous, grid, Near { y, reach: AMBIGUOUS_REACH }, sums, wide);
            excluded.iter_mut().zip(wide).for_each(|(excluded, wide)| *excluded |= *wide);
        });
    }
}

impl<'a> Row<'a> {
    fn part(&self, columns: std::ops::Range<usize>) -> Row<'a> {
        Row { phase: &self.phase[columns.clone()], modulation: &self.modulation[columns] }
    }
}

/// Size of the square around each pixel of row `y`.
#[derive(Clone, Copy)]
struct Near {
    y: usize,
    /// Number of pixels on each side.
    reach: usize,
}

impl Near {
    fn rows(self, height: usize) -> std::ops::Range<usize> {
        self.y.saturating_sub(self.reach)..(self.y + self.reach + 1).min(height)
    }
}

/// Keeps the marked `pixels` that have at least `least` marked pixels in the 5 x 5 pixels around them, themselves included.
/// Pixels beyond the border of the image count as marked. This removes narrow strips near edges, where two surfaces share a
/// pixel.
pub(super) fn remove_narrow(grid: &Grid, least: u8, pixels: &[u8], out: &mut Vec<u8>) {
    out.resize(grid.pixels(), 0);
    out.par_chunks_mut(grid.stride).enumerate().for_each_init(Vec::new, |sums, (y, out)| {
        let near = Near { y, reach: 2 };
        let rows = near.rows(grid.height).len();
        let missing = 5 * (5 - rows) as u8;
        count_near(pixels, grid, near, sums, out);
        for x in (0..2).chain(grid.width - 2..grid.width) {
            let cut = (2usize.saturating_sub(x) + (x + 3).saturating_sub(grid.width)) * rows;
            out[x] += cut as u8;
        }
        let here = &pixels[y * grid.stride..][..grid.width];
        keep(here, least - missing, &mut out[..grid.width]);
    });
}

/// Replaces the counts by 1 for pixels that are marked and have a count of at least `least`, and by 0 for the others.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn keep(pixels: &[u8], least: u8, counts: &mut [u8]) {
    for (count, pixel) in counts.iter_mut().zip(pixels) {
        *count = u8::from((*pixel != 0) & (*count >= least));
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn mark_row(here: Row, there: Row, out: MarkRow) {
    let n = here.phase.len();
    let (phase, lit) = (here.phase, &here.modulation[..n]);
    let (other, other_lit) = (&there.phase[..n], &there.modulation[..n]);
    let (at_jump, ambiguous) = (&mut out.at_jump[..n], &mut out.ambiguous[..n]);
    for x in 0..n {
        let gap = phase[x] - other[x];
        let apart = (gap.abs() >= PI) & (lit[x] > 0.0) & (other_lit[x] > 0.0);
        at_jump[x] |= u8::from(apart);
        ambiguous[x] |= u8::from(apart & (wrap(gap).abs() < SAME_SURFACE_RAD));
    }
}

/// Sum of a map over the square around every pixel of a row.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn count_near(map: &[u8], grid: &Grid, near: Near, sums: &mut Vec<u8>, out: &mut [u8]) {
    let (width, reach) = (grid.width, near.reach);
    sums.clear();
    sums.resize(width + 2 * reach, 0);
    for row in near.rows(grid.height) {
        let row = &map[row * grid.stride..][..width];
        sums[reach..reach + width].iter_mut().zip(row).for_each(|(sum, v)| *sum += v);
    }
    let out = &mut out[..width];
    out.fill(0);
    for k in 0..=2 * reach {
        out.iter_mut().zip(&sums[k..]).for_each(|(out, sum)| *out += sum);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn order_jumps_are_marked_on_both_sides() {
        let grid = Grid::new([20, 32], 4.0);
        let phase: Vec<f32> = (0..grid.pixels()).map(|i| if i % 32 < 15 { 10.0 } else { 32.0 }).collect();
        let (lit, mut excluded) = (vec![1.0; grid.pixels()], Vec::new());
        let map = PhaseMap { phase: &phase, modulation: &lit };
        Discontinuities::default().mark(&grid, map, &mut excluded);
        let row: Vec<usize> = (0..32).filter(|x| excluded[7 * 32 + x] > 0).collect();
        assert_eq!(row, [13, 14, 15, 16]);
        let lit: Vec<f32> = (0..grid.pixels()).map(|i| if i % 32 < 15 { 1.0 } else { 0.0 }).collect();
        Discontinuities::default().mark(&grid, PhaseMap { modulation: &lit, ..map }, &mut excluded);
        assert!(excluded.iter().all(|&s| s == 0), "unlit pixels have no order jumps");
    }

    #[test]
    fn narrow_strips_go_and_straight_edges_stay() {
        let grid = Grid::new([20, 32], 4.0);
        let pixels: Vec<u8> = (0..grid.pixels()).map(|i| u8::from(i % 32 == 5 || i % 32 >= 20)).collect();
        let mut out = Vec::new();
        remove_narrow(&grid, 10, &pixels, &mut out);
        assert!(out[7 * 32 + 5] == 0 && out[7 * 32 + 20] == 1 && out[31] == 1);
    }
}
