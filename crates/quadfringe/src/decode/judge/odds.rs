//! The order of a pixel is as sure as that of the surface it belongs to.
//!
//! Costs of orders are summed over windows, and a window that sees both sides of a seam doubts the order on either. But from one
//! pixel of a surface to the next the phase goes on, and so does the order: what a window some cells deeper says, which sees this
//! surface alone, holds up to the seam.

use super::growth::GROWN;
use crate::demod::cells::Grid;
use rayon::prelude::*;
use std::f32::consts::PI;

/// Probability of another order from which on an order is doubted.
const DOUBT: f32 = 0.01;
/// Cells that windows reach across a seam.
const REACH_CELLS: usize = 3;
/// What stays of a doubt that a surface settles, as a probability, and of one at pixels that a surface grew into, of which some
/// belong to what lies behind: bounds, about twice of what the captures show (`tests/test_captures.py`).
const SETTLED_DOUBT: f32 = 0.005;
const GROWN_DOUBT: f32 = 0.1;
/// Rows that one task works on.
const BLOCK: usize = 32;

/// Working lists, one for each task: places without padding, with the probability and the quality that they take.
#[derive(Debug, Default)]
pub(super) struct Odds {
    settled: Vec<Vec<(usize, [f32; 2])>>,
}

impl Odds {
    /// Doubtful pixels of the `surfaces` take the probability of another order, and the quality, of the surest of the four pixels
    /// some cells along their row and column, as far as the surface goes on to there. Both maps are without padding.
    pub fn settle(&mut self, grid: &Grid, phase: &[f32], surfaces: &[u8], [wrong, quality]: [&mut [f32]; 2]) {
        self.settled.resize_with(grid.height.div_ceil(BLOCK), Vec::new);
        let known = [&*wrong, &*quality];
        let blocks = self.settled.par_iter_mut().zip(known[0].par_chunks(BLOCK * grid.width)).enumerate();
        blocks.for_each(|(block, (settled, doubts))| {
            settled.clear();
            let first = block * BLOCK * grid.width;
            for (at, _) in doubts.iter().enumerate().filter(|(_, wrong)| **wrong > DOUBT) {
                let at = first + at;
                settled.extend(surest(grid, phase, surfaces, known, at).map(|odds| (at, odds)));
            }
        });
        for &(at, odds) in self.settled.iter().flatten() {
            [wrong[at], quality[at]] = odds;
        }
    }
}

/// Probability of another order and quality at the pixel `at` of maps without padding, with the help of its surface.
fn surest(
    grid: &Grid,
    phase: &[f32],
    surfaces: &[u8],
    [wrong, quality]: [&[f32]; 2],
    at: usize,
) -> Option<[f32; 2]> {
    let [y, x] = [at / grid.width, at % grid.width];
    let own = y * grid.stride + x;
    if surfaces[own] == 0 {
        return None;
    }
    let down = grid.stride as isize;
    let lines = [(x, -1), (grid.width - 1 - x, 1), (y, -down), (grid.height - 1 - y, down)];
    let ends = lines.map(|(room, step)| {
        let place = |times: usize| own.wrapping_add_signed(times as isize * step);
        let ends = |times: usize| {
            let (here, next) = (place(times), place(times + 1));
            (surfaces[next] == 0) | ((phase[here] - phase[next]).abs() >= PI)
        };
        let reach = room.min(REACH_CELLS * grid.step);
        let end = place((0..reach).find(|&times| ends(times)).unwrap_or(reach));
        end / grid.stride * grid.width + end % grid.stride
    });
    // NaN beside the field of the projector says nothing.
    let known = ends.into_iter().filter(|&end| wrong[end] < wrong[at]);
    let surest = known.min_by(|&a, &b| wrong[a].total_cmp(&wrong[b]))?;
    let doubt = if surfaces[own] == GROWN { GROWN_DOUBT } else { SETTLED_DOUBT };
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
