//! Surfaces that are sure grow into what is doubtful beside them.
//!
//! At a seam one of two sides is wrong, or a pixel sees both, and the marks take a strip from each; orders are known by cells, and one
//! cell across the rim of a surface doubts all of its pixels. A side that is wrong is most often a sliver, of which nothing is left.
//! What is left of a surface takes back the pixels into which its phase goes on straight, and whose own light agrees with that
//! (hysteresis; Canny, IEEE TPAMI 8, 679 (1986)). Where two surfaces meet, what lies between them stays holes.

use super::discontinuities::BLIND_REACH;
use crate::joint::cells::Grid;
use crate::joint::params::BEND_MAX;
use std::f32::consts::PI;

/// Pixels around which no other surface may be sure, when one grew there further than marks reach.
const FACING: usize = BLIND_REACH + 1;
/// Pixels that are looked through at once.
const GROUP: usize = 64;
/// What marks a pixel of a surface that it grew into; 1 marks the others.
pub(super) const GROWN: u8 = 2;

/// Working lists of the growth: places of pixels.
#[derive(Debug, Default)]
pub(super) struct Growth {
    open: Vec<u32>,
    taken: Vec<u32>,
    /// What was taken at a tear, or further away than marks reach.
    far: Vec<u32>,
}

impl Growth {
    /// Adds to `sure` and to the `surfaces`, which are part of it, those of the `agreeing` pixels, no more than a cell (or what
    /// marks reach) away, into which the `phase` (rad) of two pixels of a surface in a line goes on straight. Those that are
    /// `torn`, or further away than marks reach, stay holes where another surface is sure near by.
    pub fn run(
        &mut self,
        grid: &Grid,
        phase: &[f32],
        [agreeing, torn]: [&[u8]; 2],
        [sure, surfaces]: [&mut [u8]; 2],
    ) {
        let Self { open, taken, far } = self;
        open.clear();
        far.clear();
        for y in 0..grid.height {
            let [agreeing, sure] = [agreeing, &*sure].map(|map| &map[y * grid.stride..][..grid.width]);
            for (i, (agreeing, sure)) in agreeing.chunks(GROUP).zip(sure.chunks(GROUP)).enumerate() {
                let asked = |x: &usize| agreeing[*x] > sure[*x];
                // Groups without one are the rule, and told at once.
                if (0..agreeing.len()).fold(false, |any, x| any | asked(&x)) {
                    let first = y * grid.stride + i * GROUP;
                    open.extend((0..agreeing.len()).filter(asked).map(|x| (first + x) as u32));
                }
            }
        }
        for round in 0..grid.step.max(BLIND_REACH) {
            taken.clear();
            open.retain(|&at| {
                let goes_on = goes_on(grid, phase, surfaces, at as usize);
                if goes_on {
                    taken.push(at);
                }
                !goes_on
            });
            if taken.is_empty() {
                break;
            }
            for at in taken.iter().map(|&at| at as usize) {
                (sure[at], surfaces[at]) = (1, GROWN);
            }
            taken.retain(|&at| round >= BLIND_REACH || torn[at as usize] != 0);
            far.append(taken);
        }
        far.retain(|&at| faces_another(grid, phase, sure, at as usize));
        for at in far.iter().map(|&at| at as usize) {
            (sure[at], surfaces[at]) = (0, 0);
        }
    }
}

/// Whether two pixels of a surface side by side lead straight to the pixel, in one of four directions.
fn goes_on(grid: &Grid, phase: &[f32], surfaces: &[u8], at: usize) -> bool {
    directions(grid, at, 2).any(|step| {
        let (near, far) = (at.wrapping_add_signed(step), at.wrapping_add_signed(2 * step));
        let straight = (2.0 * phase[near] - phase[far] - phase[at]).abs() < BEND_MAX;
        (surfaces[near] != 0) & (surfaces[far] != 0) & straight
    })
}

/// Whether a pixel of another surface is sure near by, in one of four directions.
fn faces_another(grid: &Grid, phase: &[f32], sure: &[u8], at: usize) -> bool {
    (1..=FACING).any(|count| {
        directions(grid, at, count).any(|step| {
            let other = at.wrapping_add_signed(count as isize * step);
            (sure[other] != 0) & ((phase[other] - phase[at]).abs() >= PI)
        })
    })
}

/// Steps to the four neighbours of a pixel, as far as there are `count` pixels that way.
fn directions(grid: &Grid, at: usize, count: usize) -> impl Iterator<Item = isize> {
    let (y, x, down) = (at / grid.stride, at % grid.stride, grid.stride as isize);
    let left_or_up = [(x, -1), (y, -down)].map(|(before, step)| (before >= count, step));
    let right_or_down =
        [(grid.width - 1 - x, 1), (grid.height - 1 - y, down)].map(|(after, step)| (after >= count, step));
    left_or_up.into_iter().chain(right_or_down).filter_map(|(room, step)| room.then_some(step))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A surface, a step of 20 rad at column 16, and a strip of six columns marked around it: phase, torn pixels, sure ones.
    fn scene() -> (Grid, Vec<f32>, [Vec<u8>; 2]) {
        let grid = Grid::new([20, 32], 4.0);
        let place = |i: usize| (i % grid.stride, i / grid.stride);
        let phase = (0..grid.pixels())
            .map(place)
            .map(|(x, y)| 0.6 * x as f32 + 0.1 * y as f32 + if x >= 16 { 20.0 } else { 0.0 });
        let phase = phase.collect();
        let columns = |from: usize, to: usize| {
            (0..grid.pixels()).map(|i| u8::from((from..to).contains(&(i % grid.stride)))).collect::<Vec<_>>()
        };
        let sure = columns(13, 19).iter().map(|marked| 1 - marked).collect();
        let torn = columns(15, 17);
        (grid, phase, [torn, sure])
    }

    fn grown(grid: &Grid, phase: &[f32], agreeing: &[u8], [torn, sure]: &[Vec<u8>; 2]) -> Vec<u8> {
        let (mut sure, mut surfaces) = (sure.clone(), sure.clone());
        Growth::default().run(grid, phase, [agreeing, torn], [&mut sure, &mut surfaces]);
        assert!(sure.iter().zip(&surfaces).all(|(sure, surface)| *sure == u8::from(*surface > 0)));
        sure
    }

    #[test]
    fn both_surfaces_grow_up_to_the_pixels_at_their_step() {
        let (grid, phase, marks) = scene();
        let sure = grown(&grid, &phase, &vec![1; grid.pixels()], &marks);
        for (i, sure) in sure.iter().enumerate() {
            assert_eq!(*sure == 0, (15..17).contains(&(i % grid.stride)), "{i}");
        }
    }

    #[test]
    fn further_than_marks_reach_a_surface_stays_away_from_another() {
        let (grid, phase, [_, sure]) = scene();
        let untorn = [vec![0; grid.pixels()], sure];
        let sure = grown(&grid, &phase, &vec![1; grid.pixels()], &untorn);
        let holes = |sure: &[u8]| (0..32).filter(|&x| sure[5 * grid.stride + x] == 0).collect::<Vec<_>>();
        assert_eq!(holes(&sure), [15, 16]);
        // Beyond the step there is nothing.
        let [untorn, mut sure] = untorn;
        (0..grid.pixels()).filter(|i| i % grid.stride > 15).for_each(|i| sure[i] = 0);
        let sure = grown(&grid, &phase, &vec![1; grid.pixels()], &[untorn, sure]);
        assert_eq!(holes(&sure), (16..32).collect::<Vec<_>>());
    }

    #[test]
    fn what_does_not_agree_or_does_not_go_on_straight_stays_a_hole() {
        let (grid, mut phase, marks) = scene();
        let place = |x: usize, y: usize| y * grid.stride + x;
        let mut agreeing = vec![1; grid.pixels()];
        agreeing[place(14, 7)] = 0;
        // Beside the step a sliver has an order too few, so that nothing is sure near the other side; below, column 13 bends.
        for y in 0..20 {
            (17..19).for_each(|x| phase[place(x, y)] -= std::f32::consts::TAU);
            phase[place(13, y)] += if y < 10 { 0.0 } else { 3.0 };
        }
        let sure = grown(&grid, &phase, &agreeing, &marks);
        let row = |y: usize| (13..19).filter(|&x| sure[place(x, y)] == 1).collect::<Vec<_>>();
        assert_eq!((row(3), row(7), row(15)), (vec![13, 14, 15], vec![13, 15], vec![]));
    }

    #[test]
    fn growth_ends_after_a_cell() {
        let (grid, phase, _) = scene();
        let sure = (0..grid.pixels()).map(|i| u8::from(i % grid.stride < 4)).collect();
        let marks = [vec![0; grid.pixels()], sure];
        let sure = grown(&grid, &phase, &vec![1; grid.pixels()], &marks);
        assert_eq!(sure[5 * grid.stride..][..32].iter().position(|&sure| sure == 0), Some(4 + grid.step));
    }
}
