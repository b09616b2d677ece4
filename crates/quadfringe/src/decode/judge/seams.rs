//! Doubtful pixels by their nearest neighbours: seams of the absolute phase, and slivers.

use crate::demod::cells::Grid;
use multiversion::multiversion;
use rayon::prelude::*;
use std::f32::consts::PI;

/// Marks every lit pixel whose absolute phase (rad) differs by half a turn or more from that of a lit neighbour - there
/// one of the two has the wrong order, or sees two surfaces at once - and the pixels around it.
pub(super) fn mark_seams(
    grid: &Grid,
    phase: &[f32],
    modulation: &[f32],
    torn: &mut Vec<u8>,
    seams: &mut Vec<u8>,
) {
    let stride = grid.stride;
    torn.resize(grid.pixels(), 0);
    seams.resize(grid.pixels(), 0);
    torn.par_chunks_mut(stride).enumerate().for_each(|(y, torn)| {
        torn.fill(0);
        let here = [&phase[y * stride..][..grid.width], &modulation[y * stride..][..grid.width]];
        tear_along(here, torn);
        for other in [y.checked_sub(1), (y + 1 < grid.height).then_some(y + 1)].into_iter().flatten() {
            tear_down(here, [&phase[other * stride..], &modulation[other * stride..]], torn);
        }
    });
    let torn = &*torn;
    seams.par_chunks_mut(stride).enumerate().for_each_init(Vec::new, |sums, (y, seams)| {
        let near = y.saturating_sub(1)..(y + 2).min(grid.height);
        count_near(torn, stride, grid.width, (near, 1), sums, seams);
    });
}

/// Keeps of `pixels` those with at least `least` like them, themselves included, among the 5 x 5 around; what the border
/// of the image cuts off counts as present. Slivers beside edges, where two surfaces share a pixel, go.
pub(super) fn remove_slivers(grid: &Grid, least: u8, pixels: &[u8], out: &mut Vec<u8>) {
    out.resize(grid.pixels(), 0);
    out.par_chunks_mut(grid.stride).enumerate().for_each_init(Vec::new, |sums, (y, out)| {
        let near = y.saturating_sub(2)..(y + 3).min(grid.height);
        let (rows, missing) = (near.len(), 5 * (5 - near.len()) as u8);
        count_near(pixels, grid.stride, grid.width, (near, 2), sums, out);
        let own = &pixels[y * grid.stride..];
        for x in 0..grid.width {
            let cut = (2usize.saturating_sub(x) + (x + 3).saturating_sub(grid.width)) * rows;
            out[x] = u8::from(own[x] != 0 && out[x] + missing + cut as u8 >= least);
        }
    });
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn tear_along([phase, modulation]: [&[f32]; 2], torn: &mut [u8]) {
    let n = phase.len() - 1;
    let (left, right) = (&phase[..n], &phase[1..]);
    let (left_lit, right_lit) = (&modulation[..n], &modulation[1..=n]);
    for x in 0..n {
        let apart = (left[x] - right[x]).abs() >= PI;
        torn[x] |= u8::from(apart & (left_lit[x] > 0.0) & (right_lit[x] > 0.0));
    }
    for x in 0..n {
        let apart = (left[x] - right[x]).abs() >= PI;
        torn[x + 1] |= u8::from(apart & (left_lit[x] > 0.0) & (right_lit[x] > 0.0));
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn tear_down([phase, modulation]: [&[f32]; 2], [other, other_lit]: [&[f32]; 2], torn: &mut [u8]) {
    let n = phase.len();
    let (other, other_lit, modulation, torn) = (&other[..n], &other_lit[..n], &modulation[..n], &mut torn[..n]);
    for x in 0..n {
        let apart = (phase[x] - other[x]).abs() >= PI;
        torn[x] |= u8::from(apart & (modulation[x] > 0.0) & (other_lit[x] > 0.0));
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
        let phase: Vec<f32> = (0..grid.pixels()).map(|i| if i % 32 < 15 { 10.0 } else { 30.0 }).collect();
        let mut seams = Vec::new();
        mark_seams(&grid, &phase, &vec![1.0; grid.pixels()], &mut Vec::new(), &mut seams);
        let row: Vec<usize> = (0..32).filter(|x| seams[7 * 32 + x] > 0).collect();
        assert_eq!(row, [13, 14, 15, 16]);
        let lit: Vec<f32> = (0..grid.pixels()).map(|i| if i % 32 < 15 { 1.0 } else { 0.0 }).collect();
        mark_seams(&grid, &phase, &lit, &mut Vec::new(), &mut seams);
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
