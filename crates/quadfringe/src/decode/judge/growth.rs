//! Surfaces that are sure grow back into the marks beside their seams.
//!
//! At a seam one of two sides is wrong, or a pixel sees both, and the marks take a strip from each. A side that is wrong is most often a
//! sliver, of which nothing is left. What is left of a surface takes back the pixels into which its phase goes on straight,
//! and whose own light agrees with that (hysteresis; Canny, IEEE TPAMI 8, 679 (1986)). The pixels at the tear itself stay holes.

use super::seams::BLIND_REACH;
use crate::demod::cells::Grid;

/// Pixels that marks reach into a surface beyond those at the tear.
const REACH: usize = BLIND_REACH;
/// Greatest distance of a pixel from the straight line through two of the surface, in rad.
const BEND_MAX: f32 = 0.5;
/// What marks a pixel of a surface that it grew into; 1 marks the others.
pub(super) const GROWN: u8 = 2;

/// Working lists of the growth: places of pixels.
#[derive(Debug, Default)]
pub(super) struct Growth {
    open: Vec<u32>,
    taken: Vec<u32>,
}

impl Growth {
    /// Adds to `sure` and to the `surfaces`, which are part of it, those of the `agreeing` pixels that are not `torn`, no more than
    /// the reach of the marks away, into which the `phase` (rad) of two pixels of a surface in a line goes on straight.
    pub fn run(
        &mut self,
        grid: &Grid,
        phase: &[f32],
        [agreeing, torn]: [&[u8]; 2],
        [sure, surfaces]: [&mut [u8]; 2],
    ) {
        let stride = grid.stride;
        self.open.clear();
        for y in 0..grid.height {
            let [agreeing, torn, sure] = [agreeing, torn, &*sure].map(|map| &map[y * stride..][..grid.width]);
            let asked = (0..grid.width).filter(|&x| agreeing[x] > (torn[x] | sure[x]));
            self.open.extend(asked.map(|x| (y * stride + x) as u32));
        }
        for _ in 0..REACH {
            let Self { open, taken } = self;
            taken.clear();
            open.retain(|&at| {
                let goes_on = goes_on(grid, phase, surfaces, at as usize);
                if goes_on {
                    taken.push(at);
                }
                !goes_on
            });
            for at in taken.iter().map(|&at| at as usize) {
                (sure[at], surfaces[at]) = (1, GROWN);
            }
        }
    }
}

/// Whether two pixels of a surface side by side lead straight to the pixel, in one of four directions.
fn goes_on(grid: &Grid, phase: &[f32], surfaces: &[u8], at: usize) -> bool {
    let (y, x) = (at / grid.stride, at % grid.stride);
    let leads = |near: usize, far: usize| {
        let straight = (2.0 * phase[near] - phase[far] - phase[at]).abs() < BEND_MAX;
        (surfaces[near] != 0) & (surfaces[far] != 0) & straight
    };
    (x >= 2 && leads(at - 1, at - 2))
        || (x + 2 < grid.width && leads(at + 1, at + 2))
        || (y >= 2 && leads(at - grid.stride, at - 2 * grid.stride))
        || (y + 2 < grid.height && leads(at + grid.stride, at + 2 * grid.stride))
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
        let mut sure = sure.clone();
        let mut surfaces = sure.clone();
        Growth::default().run(grid, phase, [agreeing, torn], [&mut sure, &mut surfaces]);
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
    fn what_does_not_agree_or_does_not_go_on_straight_stays_a_hole() {
        let (grid, mut phase, [torn, sure]) = scene();
        let place = |x: usize, y: usize| y * grid.stride + x;
        let mut agreeing = vec![1; grid.pixels()];
        agreeing[place(14, 7)] = 0;
        // Beside the step a sliver has an order too few; below, column 13 bends.
        for y in 0..20 {
            (17..19).for_each(|x| phase[place(x, y)] -= std::f32::consts::TAU);
            phase[place(13, y)] += if y < 10 { 0.0 } else { 3.0 };
        }
        let sure = grown(&grid, &phase, &agreeing, &[torn, sure]);
        let row = |y: usize| (13..19).filter(|&x| sure[place(x, y)] == 1).collect::<Vec<_>>();
        assert_eq!((row(3), row(7), row(15)), (vec![13, 14], vec![13], vec![]));
    }

    #[test]
    fn growth_ends_where_the_marks_could_not_have_reached() {
        let (grid, phase, _) = scene();
        let sure = (0..grid.pixels()).map(|i| u8::from(i % grid.stride < 4)).collect();
        let marks = [vec![0; grid.pixels()], sure];
        let sure = grown(&grid, &phase, &vec![1; grid.pixels()], &marks);
        assert_eq!(sure[5 * grid.stride..][..32].iter().position(|&sure| sure == 0), Some(4 + REACH));
    }
}
