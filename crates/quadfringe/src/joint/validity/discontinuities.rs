//! Doubtful pixels by their nearest neighbours: seams of the absolute phase, and slivers.

use crate::joint::cells::Grid;
use crate::parallel::angle::wrap;
use multiversion::multiversion;
use rayon::prelude::*;
use std::f32::consts::PI;

/// Wrapped phases nearer than this are the same to R and B.
const BLIND_RAD: f32 = 0.3;
/// Pixels beside such a seam that may lie on its other side.
pub(super) const BLIND_REACH: usize = 2;

/// Tears of the phase: whether a pixel is torn from a neighbour, and whether R and B could not see it.
#[derive(Debug, Default)]
pub(super) struct Tears {
    torn: Vec<u8>,
    blind: Vec<u8>,
}

impl Tears {
    /// 1 for every pixel that is torn from a neighbour.
    pub fn torn(&self) -> &[u8] {
        &self.torn
    }

    /// Marks in `seams` every lit pixel whose absolute phase (rad) differs by half a turn or more from that of a lit
    /// neighbour - there one of the two has the wrong order, or sees two surfaces at once - and the pixels around it.
    /// Where the two wrapped phases agree only G and IR know on which side a pixel lies, and those are blurred: there
    /// more pixels around are marked.
    pub fn mark(&mut self, grid: &Grid, phase: &[f32], modulation: &[f32], seams: &mut Vec<u8>) {
        let stride = grid.stride;
        self.torn.resize(grid.pixels(), 0);
        self.blind.resize(grid.pixels(), 0);
        seams.resize(grid.pixels(), 0);
        let rows = self.torn.par_chunks_mut(stride).zip(self.blind.par_chunks_mut(stride)).enumerate();
        rows.for_each(|(y, (torn, blind))| {
            torn.fill(0);
            blind.fill(0);
            let row = |y: usize| [phase, modulation].map(|plane| &plane[y * stride..][..grid.width]);
            let here = row(y);
            let n = grid.width - 1;
            let [left, right] = [here.map(|map| &map[..n]), here.map(|map| &map[1..])];
            tear(left, right, [&mut torn[..n], &mut blind[..n]]);
            tear(left, right, [&mut torn[1..=n], &mut blind[1..=n]]);
            for other in [y.checked_sub(1), (y + 1 < grid.height).then_some(y + 1)].into_iter().flatten() {
                tear(here, row(other), [&mut torn[..=n], &mut blind[..=n]]);
            }
        });
        let (torn, blind) = (&self.torn, &self.blind);
        let work = || (Vec::new(), vec![0; stride]);
        seams.par_chunks_mut(stride).enumerate().for_each_init(work, |(sums, wide), (y, seams)| {
            let near = |reach: usize| y.saturating_sub(reach)..(y + reach + 1).min(grid.height);
            count_near(torn, stride, grid.width, (near(1), 1), sums, seams);
            count_near(blind, stride, grid.width, (near(BLIND_REACH), BLIND_REACH), sums, wide);
            seams.iter_mut().zip(wide).for_each(|(seam, wide)| *seam |= *wide);
        });
    }
}

/// Keeps of `pixels` those with at least `least` like them, themselves included, among the 5 x 5 around; what the border
/// of the image cuts off counts as present. Slivers beside edges, where two surfaces share a pixel, go.
pub(super) fn remove_slivers(grid: &Grid, least: u8, pixels: &[u8], out: &mut Vec<u8>) {
    out.resize(grid.pixels(), 0);
    out.par_chunks_mut(grid.stride).enumerate().for_each_init(Vec::new, |sums, (y, out)| {
        let near = y.saturating_sub(2)..(y + 3).min(grid.height);
        let (rows, missing) = (near.len(), 5 * (5 - near.len()) as u8);
        count_near(pixels, grid.stride, grid.width, (near, 2), sums, out);
        for x in (0..2).chain(grid.width - 2..grid.width) {
            let cut = (2usize.saturating_sub(x) + (x + 3).saturating_sub(grid.width)) * rows;
            out[x] += cut as u8;
        }
        let own = &pixels[y * grid.stride..][..grid.width];
        keep(own, least - missing, &mut out[..grid.width]);
    });
}

/// Counts become 1 for pixels that were there and have so many neighbours, 0 for the others.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn keep(own: &[u8], least: u8, counts: &mut [u8]) {
    for (count, own) in counts.iter_mut().zip(own) {
        *count = u8::from((*own != 0) & (*count >= least));
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn tear(here: [&[f32]; 2], there: [&[f32]; 2], out: [&mut [u8]; 2]) {
    let n = here[0].len();
    let ([phase, lit], [other, other_lit], [torn, blind]) = (here, there, out);
    let (lit, other, other_lit) = (&lit[..n], &other[..n], &other_lit[..n]);
    let (torn, blind) = (&mut torn[..n], &mut blind[..n]);
    for x in 0..n {
        let gap = phase[x] - other[x];
        let apart = (gap.abs() >= PI) & (lit[x] > 0.0) & (other_lit[x] > 0.0);
        torn[x] |= u8::from(apart);
        blind[x] |= u8::from(apart & (wrap(gap).abs() < BLIND_RAD));
    }
}

/// Sum of a map over `reach` columns to both sides and the rows `near`.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn count_near(
    map: &[u8],
    stride: usize,
    width: usize,
    (near, reach): (std::ops::Range<usize>, usize),
    sums: &mut Vec<u8>,
    out: &mut [u8],
) {
    sums.clear();
    sums.resize(width + 2 * reach, 0);
    for row in near {
        let row = &map[row * stride..][..width];
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
    fn seams_are_marked_on_both_sides() {
        let grid = Grid::new([20, 32], 4.0);
        let phase: Vec<f32> = (0..grid.pixels()).map(|i| if i % 32 < 15 { 10.0 } else { 32.0 }).collect();
        let mut seams = Vec::new();
        Tears::default().mark(&grid, &phase, &vec![1.0; grid.pixels()], &mut seams);
        let row: Vec<usize> = (0..32).filter(|x| seams[7 * 32 + x] > 0).collect();
        assert_eq!(row, [13, 14, 15, 16]);
        let lit: Vec<f32> = (0..grid.pixels()).map(|i| if i % 32 < 15 { 1.0 } else { 0.0 }).collect();
        Tears::default().mark(&grid, &phase, &lit, &mut seams);
        assert!(seams.iter().all(|&s| s == 0), "the dark has no seams");
    }

    #[test]
    fn slivers_go_and_straight_edges_stay() {
        let grid = Grid::new([20, 32], 4.0);
        let pixels: Vec<u8> = (0..grid.pixels()).map(|i| u8::from(i % 32 == 5 || i % 32 >= 20)).collect();
        let mut out = Vec::new();
        remove_slivers(&grid, 10, &pixels, &mut out);
        assert!(out[7 * 32 + 5] == 0 && out[7 * 32 + 20] == 1 && out[31] == 1);
    }
}
