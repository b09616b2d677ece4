//! The order of a pixel is as sure as that of the surface it belongs to.
//!
//! Costs of orders are summed over windows, and a window that sees both sides of a seam doubts the order on either. But from one
//! pixel of a surface to the next the phase goes on, and so does the order: what a window some cells deeper says, which sees this
//! surface alone, holds up to the seam.

use super::regrow::GROWN;
use crate::joint::cells::Grid;
use crate::parallel::slots::Slots;
use multiversion::multiversion;
use rayon::prelude::*;
use std::f32::consts::PI;
use std::ops::Range;

/// Probability of another order from which on an order is doubted.
const DOUBT: f32 = 0.01;
/// Cells that windows reach across a seam.
const REACH_CELLS: usize = 3;
/// What stays of a doubt that a surface settles, as a probability, and of one at pixels that a surface grew into, of which some
/// belong to what lies behind: bounds, about twice of what the captures show (`tests/test_captures.py`).
const SETTLED_DOUBT: f32 = 0.005;
const GROWN_DOUBT: f32 = 0.1;
/// Rows that one task works on, and pixels of a row that are looked through at once.
const BLOCK: usize = 64;
const GROUP: usize = 64;

/// Working memory of the tasks.
#[derive(Debug, Default)]
pub(super) struct Odds {
    /// Places without padding, with the probability and the quality that they take, by task.
    settled: Vec<Vec<(usize, [f32; 2])>>,
    slots: Slots<Reach>,
}

impl Odds {
    /// Doubtful pixels of the `surfaces` take the probability of another order, and the quality, of the surest of the four pixels
    /// some cells along their row and column, as far as the surface goes on to there. Both maps are without padding.
    pub fn settle(&mut self, grid: &Grid, phase: &[f32], surfaces: &[u8], [wrong, quality]: [&mut [f32]; 2]) {
        let Self { settled, slots } = self;
        let scene = Scene { grid, phase, surfaces, known: [&*wrong, &*quality] };
        settled.resize_with(grid.height.div_ceil(BLOCK), Vec::new);
        settled.par_iter_mut().enumerate().for_each_init(
            || slots.take(),
            |reach, (block, settled)| {
                settled.clear();
                let rows = block * BLOCK..((block + 1) * BLOCK).min(grid.height);
                if rows.clone().any(|y| scene.doubted(y).next().is_some()) {
                    reach.settle(&scene, rows, settled);
                }
            },
        );
        for &(at, odds) in settled.iter().flatten() {
            [wrong[at], quality[at]] = odds;
        }
    }
}

/// The absolute phase (rad) and the surfaces of an image; the probability of another order and the quality, without padding.
struct Scene<'a> {
    grid: &'a Grid,
    phase: &'a [f32],
    surfaces: &'a [u8],
    known: [&'a [f32]; 2],
}

impl Scene<'_> {
    /// Groups of pixels of row `y` with a doubt among them.
    fn doubted(&self, y: usize) -> impl Iterator<Item = Range<usize>> {
        let wrong = &self.known[0][y * self.grid.width..][..self.grid.width];
        let groups = wrong.chunks(GROUP).enumerate();
        // Without a way out in the middle a group takes a few instructions.
        let doubted = |group: &[f32]| group.iter().fold(false, |any, &wrong| any | (wrong > DOUBT));
        groups.filter(move |(_, group)| doubted(group)).map(|(i, group)| i * GROUP..i * GROUP + group.len())
    }

    fn row(&self, y: usize) -> (&[f32], &[u8]) {
        let row = y * self.grid.stride..y * self.grid.stride + self.grid.width;
        (&self.phase[row.clone()], &self.surfaces[row])
    }
}

/// How many pixels the surface of a pixel goes on, as far as is asked for: to the right and up, in one row, and down, in the last
/// row looked at and in those of a task.
#[derive(Debug, Default)]
struct Reach {
    /// 0 where a pixel and the one on its left are of one surface.
    apart: Vec<u8>,
    right: Vec<u8>,
    up: Vec<u8>,
    below: Vec<u8>,
    down: Vec<u8>,
}

impl Reach {
    fn settle(&mut self, scene: &Scene<'_>, rows: Range<usize>, settled: &mut Vec<(usize, [f32; 2])>) {
        let Self { apart, right, up, below, down } = self;
        let Grid { width, height, .. } = *scene.grid;
        let reach = REACH_CELLS * scene.grid.step;
        let most = u8::try_from(reach).expect("cells are at most sixteen pixels wide");
        for counts in [&mut *right, &mut *up, &mut *below] {
            counts.clear();
            counts.resize(width, 0);
        }
        apart.resize(width, 1);
        down.resize(rows.len() * width, 0);
        for y in (rows.start..(rows.end + reach).min(height)).rev() {
            if y + 1 < height {
                go_on(scene.row(y), scene.row(y + 1), most, below);
            }
            if y < rows.end {
                down[(y - rows.start) * width..][..width].copy_from_slice(below);
            }
        }
        for y in rows.start.saturating_sub(reach)..rows.end {
            if y > 0 {
                go_on(scene.row(y), scene.row(y - 1), most, up);
            }
            let mut groups = scene.doubted(y).peekable();
            if y < rows.start || groups.peek().is_none() {
                continue;
            }
            let (phase, surfaces) = scene.row(y);
            side_by_side(phase, surfaces, apart);
            let down = &down[(y - rows.start) * width..][..width];
            let doubts = &scene.known[0][y * width..][..width];
            for group in groups {
                let seen = group.start.saturating_sub(reach)..(group.end + reach).min(width);
                let mut run = 0;
                for x in seen.clone().rev() {
                    right[x] = run;
                    run = if apart[x] == 0 { (run + 1).min(most) } else { 0 };
                }
                let mut left = 0;
                for x in seen.start..group.end {
                    left = if apart[x] == 0 { (left + 1).min(most) } else { 0 };
                    if group.contains(&x) && doubts[x] > DOUBT && surfaces[x] != 0 {
                        let at = y * width + x;
                        let [left, right, up, down] = [left, right[x], up[x], down[x]].map(usize::from);
                        let ends = [at - left, at + right, at - up * width, at + down * width];
                        settled.extend(surest(scene.known, ends, surfaces[x], at).map(|odds| (at, odds)));
                    }
                }
            }
        }
    }
}

/// Whether one surface goes on between two pixels.
#[inline(always)]
fn joined((phase, surface): (f32, u8), (other, other_surface): (f32, u8)) -> bool {
    (surface != 0) & (other_surface != 0) & ((phase - other).abs() < PI)
}

/// 0 for pixels that are of one surface with the one on their left, 1 for others and for the first.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn side_by_side(phase: &[f32], surfaces: &[u8], apart: &mut [u8]) {
    let n = apart.len() - 1;
    let [left, right] = [0, 1].map(|from| (&phase[from..from + n], &surfaces[from..from + n]));
    for (x, apart) in apart[1..].iter_mut().enumerate() {
        *apart = u8::from(!joined((left.0[x], left.1[x]), (right.0[x], right.1[x])));
    }
}

/// Counts of the pixels that a surface goes on, from those of the row it goes on to.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn go_on(here: (&[f32], &[u8]), there: (&[f32], &[u8]), most: u8, counts: &mut [u8]) {
    let n = counts.len();
    let [(phase, surfaces), (other, other_surfaces)] = [here, there].map(|row| (&row.0[..n], &row.1[..n]));
    for x in 0..n {
        let on = joined((phase[x], surfaces[x]), (other[x], other_surfaces[x]));
        let longer = if counts[x] < most { counts[x] + 1 } else { most };
        counts[x] = if on { longer } else { 0 };
    }
}

/// Probability of another order and quality at a doubted pixel, with the help of the ends of its surface.
fn surest([wrong, quality]: [&[f32]; 2], ends: [usize; 4], surface: u8, at: usize) -> Option<[f32; 2]> {
    // NaN beside the field of the projector says nothing.
    let known = ends.into_iter().filter(|&end| wrong[end] < wrong[at]);
    let surest = known.min_by(|&a, &b| wrong[a].total_cmp(&wrong[b]))?;
    let doubt = if surface == GROWN { GROWN_DOUBT } else { SETTLED_DOUBT };
    Some([wrong[at].min(wrong[surest].max(doubt)), quality[at].max(quality[surest])])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn doubts_at_a_seam_go_as_far_as_the_surface_reaches() {
        // Two surfaces two turns apart; windows doubt the orders of eight columns at their seam, and beyond column 28 there is none.
        let grid = Grid::new([6, 32], 4.0);
        let columns = |value: fn(usize) -> f32| (0..6 * 32).map(|i| value(i % 32)).collect::<Vec<_>>();
        let phase = columns(|x| 0.2 * x as f32 + if x < 16 { 0.0 } else { 4.0 * PI });
        let mut wrong = columns(|x| if (12..20).contains(&x) || x >= 28 { 0.4 } else { 1e-5 });
        let mut quality = columns(|x| if (12..20).contains(&x) { 0.1 } else { 0.9 });
        let surfaces: Vec<u8> = (0..grid.pixels())
            .map(|i| [1, GROWN, 0][usize::from(i % 32 == 15) + 2 * usize::from(i % 32 >= 28)])
            .collect();
        Odds::default().settle(&grid, &phase, &surfaces, [&mut wrong, &mut quality]);
        let row = |map: &[f32]| [11, 14, 15, 16, 30].map(|x| map[3 * 32 + x]);
        assert_eq!(row(&wrong), [1e-5, SETTLED_DOUBT, GROWN_DOUBT, SETTLED_DOUBT, 0.4]);
        assert_eq!(row(&quality), [0.9; 5]);
    }

    #[test]
    fn where_all_of_a_surface_is_doubted_it_stays_doubted() {
        let grid = Grid::new([6, 32], 4.0);
        let (phase, surfaces) = (vec![1.0; grid.pixels()], vec![1; grid.pixels()]);
        let (mut wrong, mut quality) = (vec![0.3; 6 * 32], vec![0.2; 6 * 32]);
        wrong[40] = f32::NAN;
        Odds::default().settle(&grid, &phase, &surfaces, [&mut wrong, &mut quality]);
        assert!(wrong[40].is_nan() && wrong.iter().filter(|wrong| **wrong == 0.3).count() == 6 * 32 - 1);
    }
}
