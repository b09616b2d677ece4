//! Step 11: the order of a pixel is as certain as the order of its component.
//!
//! Costs of orders are summed over windows. A window that sees both sides of a discontinuity makes the order doubtful on both. In
//! a component the phase continues from pixel to pixel, and so does the order. A window some cells further inside sees only this
//! component, and its order holds up to the discontinuity.

use super::cells::Grid;
use super::params::tasks::{GROUP, PROPAGATION_ROWS};
use super::params::uncertainty::{
    DOUBTFUL, GROWN_PROBABILITY_MIN, PROPAGATION_CELLS, SETTLED_PROBABILITY_MIN,
};
use super::validity::GROWN;
use crate::parallel::slots::Slots;
use multiversion::multiversion;
use rayon::prelude::*;
use std::f32::consts::PI;
use std::ops::Range;

/// Propagation along components, with working memory.
#[derive(Debug, Default)]
pub(super) struct Propagation {
    /// Pixels that each task has settled.
    settled: Vec<Vec<Settled>>,
    slots: Slots<Reach>,
}

/// New values for a doubtful pixel.
#[derive(Debug, Clone, Copy)]
struct Settled {
    /// Index in maps without padding.
    at: usize,
    wrong_order: f32,
    quality: f32,
}

impl Propagation {
    /// Settles the doubtful pixels of the `components`. Four pixels of the same component are candidates: some cells away along
    /// the row and the column, or where the component ends. A doubtful pixel takes wrong-order probability and quality from the
    /// most certain of them. These two maps are without padding.
    pub fn run(&mut self, known: Components<'_>, wrong_order: &mut [f32], quality: &mut [f32]) {
        let Self { settled, slots } = self;
        let (grid, image) = (known.grid, Image { known, wrong_order: &*wrong_order, quality: &*quality });
        settled.resize_with(grid.height.div_ceil(PROPAGATION_ROWS), Vec::new);
        settled.par_iter_mut().enumerate().for_each_init(
            || slots.take(),
            |reach, (block, settled)| {
                settled.clear();
                let rows = block * PROPAGATION_ROWS..((block + 1) * PROPAGATION_ROWS).min(grid.height);
                if rows.clone().any(|y| image.doubtful(y).next().is_some()) {
                    reach.settle(&image, rows, settled);
                }
            },
        );
        for pixel in settled.iter().flatten() {
            (wrong_order[pixel.at], quality[pixel.at]) = (pixel.wrong_order, pixel.quality);
        }
    }
}

/// The surfaces of a shot. Absolute phase (rad) and components have padded rows.
#[derive(Clone, Copy)]
pub(super) struct Components<'a> {
    pub grid: &'a Grid,
    pub phase: &'a [f32],
    pub components: &'a [u8],
    /// Not 0 for nodes whose order was changed to continue a neighbour; empty for none. That they continue it is no new evidence.
    pub moved: &'a [f32],
}

impl Components<'_> {
    fn is_moved(&self, y: usize, x: usize) -> bool {
        let Grid { step, columns, .. } = *self.grid;
        self.moved.get(y / step * columns + x / step).is_some_and(|&moved| moved > 0.0)
    }
}

/// An image. Wrong-order probability and quality are without padding.
struct Image<'a> {
    known: Components<'a>,
    wrong_order: &'a [f32],
    quality: &'a [f32],
}

/// One row of pixels.
#[derive(Clone, Copy)]
struct Row<'a> {
    phase: &'a [f32],
    components: &'a [u8],
}

impl Image<'_> {
    /// Groups of pixels of row `y` that contain a doubtful pixel.
    fn doubtful(&self, y: usize) -> impl Iterator<Item = Range<usize>> {
        let wrong_order = &self.wrong_order[y * self.known.grid.width..][..self.known.grid.width];
        let groups = wrong_order.chunks(GROUP).enumerate();
        // A loop over the group without early exit compiles to a few vector instructions.
        let doubtful = |group: &[f32]| group.iter().fold(false, |any, &wrong| any | (wrong > DOUBTFUL));
        groups.filter(move |(_, group)| doubtful(group)).map(|(i, group)| i * GROUP..i * GROUP + group.len())
    }

    fn row(&self, y: usize) -> Row<'_> {
        let Components { grid, phase, components, .. } = self.known;
        let row = y * grid.stride..y * grid.stride + grid.width;
        Row { phase: &phase[row.clone()], components: &components[row] }
    }

    /// New values for a doubtful pixel, from the ends of its component in four directions.
    fn settle(&self, at: usize, ends: [usize; 4], component: u8) -> Option<Settled> {
        let (wrong_order, quality) = (self.wrong_order, self.quality);
        // Outside the projector image the probability is NaN, and comparisons with NaN are false.
        let certain = ends.into_iter().filter(|&end| wrong_order[end] < wrong_order[at]);
        let best = certain.min_by(|&a, &b| wrong_order[a].total_cmp(&wrong_order[b]))?;
        let floor = if component == GROWN { GROWN_PROBABILITY_MIN } else { SETTLED_PROBABILITY_MIN };
        Some(Settled {
            at,
            wrong_order: wrong_order[at].min(wrong_order[best].max(floor)),
            quality: quality[at].max(quality[best]),
        })
    }
}

/// Number of pixels, up to a limit, for which the component of each pixel continues to the right, up and down.
#[derive(Debug, Default)]
struct Reach {
    /// 0 where a pixel and its left neighbour belong to one component.
    apart: Vec<u8>,
    right: Vec<u8>,
    /// Counts upwards, for the row visited last.
    up: Vec<u8>,
    /// Counts downwards, for the row visited last.
    below: Vec<u8>,
    /// Counts downwards, for all rows of the task.
    down: Vec<u8>,
}

impl Reach {
    fn settle(&mut self, image: &Image<'_>, rows: Range<usize>, settled: &mut Vec<Settled>) {
        let Grid { width, .. } = *image.known.grid;
        let reach = PROPAGATION_CELLS * image.known.grid.step;
        let most = u8::try_from(reach).expect("cells are at most sixteen pixels wide");
        for counts in [&mut self.right, &mut self.up, &mut self.below] {
            counts.clear();
            counts.resize(width, 0);
        }
        self.apart.resize(width, 1);
        self.count_down(image, rows.clone(), most);
        for y in rows.start.saturating_sub(reach)..rows.end {
            if y > 0 {
                count_on(image.row(y), image.row(y - 1), most, &mut self.up);
            }
            let mut groups = image.doubtful(y).peekable();
            if y < rows.start || groups.peek().is_none() {
                continue;
            }
            mark_apart(image.row(y), &mut self.apart);
            for group in groups {
                self.settle_group(image, y, y - rows.start, group, settled);
            }
        }
    }

    /// Computes the counts downwards for all rows of a task.
    fn count_down(&mut self, image: &Image<'_>, rows: Range<usize>, most: u8) {
        let Grid { width, height, .. } = *image.known.grid;
        self.down.resize(rows.len() * width, 0);
        for y in (rows.start..(rows.end + usize::from(most)).min(height)).rev() {
            if y + 1 < height {
                count_on(image.row(y), image.row(y + 1), most, &mut self.below);
            }
            if y < rows.end {
                self.down[(y - rows.start) * width..][..width].copy_from_slice(&self.below);
            }
        }
    }

    /// Settles the doubtful pixels of a group of row `y`, which has the number `index` in its task.
    fn settle_group(
        &mut self,
        image: &Image<'_>,
        y: usize,
        index: usize,
        group: Range<usize>,
        settled: &mut Vec<Settled>,
    ) {
        let Self { apart, right, up, down, .. } = self;
        let width = image.known.grid.width;
        let reach = PROPAGATION_CELLS * image.known.grid.step;
        let most = reach as u8;
        let down = &down[index * width..][..width];
        let components = image.row(y).components;
        let seen = group.start.saturating_sub(reach)..(group.end + reach).min(width);
        let mut run = 0;
        for x in seen.clone().rev() {
            right[x] = run;
            run = if apart[x] == 0 { (run + 1).min(most) } else { 0 };
        }
        let mut left = 0;
        for x in seen.start..group.end {
            left = if apart[x] == 0 { (left + 1).min(most) } else { 0 };
            let at = y * width + x;
            let doubtful = image.wrong_order[at] > DOUBTFUL && !image.known.is_moved(y, x);
            if group.contains(&x) && doubtful && components[x] != 0 {
                let [left, right, up, down] = [left, right[x], up[x], down[x]].map(usize::from);
                let ends = [at - left, at + right, at - up * width, at + down * width];
                settled.extend(image.settle(at, ends, components[x]));
            }
        }
    }
}

/// Whether a component continues between two pixels.
#[inline(always)]
fn joined(here: Row<'_>, there: Row<'_>, x: usize) -> bool {
    let near = (here.phase[x] - there.phase[x]).abs() < PI;
    (here.components[x] != 0) & (there.components[x] != 0) & near
}

/// Marks the start of components along a row: 0 for pixels that belong to one component with their left neighbour, 1
/// for the others and for the first pixel.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn mark_apart(row: Row, apart: &mut [u8]) {
    let n = apart.len() - 1;
    let part =
        |from: usize| Row { phase: &row.phase[from..from + n], components: &row.components[from..from + n] };
    let (left, right) = (part(0), part(1));
    for (x, apart) in apart[1..].iter_mut().enumerate() {
        *apart = u8::from(!joined(left, right, x));
    }
}

/// Updates the counts from the row `there` to its neighbour `here`: one more if the component continues from `here` to
/// `there`, else 0.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn count_on(here: Row, there: Row, most: u8, counts: &mut [u8]) {
    let n = counts.len();
    let [here, there] =
        [here, there].map(|row| Row { phase: &row.phase[..n], components: &row.components[..n] });
    for x in 0..n {
        let longer = if counts[x] < most { counts[x] + 1 } else { most };
        counts[x] = if joined(here, there, x) { longer } else { 0 };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn certainty_reaches_a_discontinuity_and_the_end_of_the_component() {
        // Two components whose phases are two turns apart. The orders of eight columns at their border are doubtful, and the
        // second component ends at column 28.
        let grid = Grid::new([6, 32], 4.0);
        let columns = |value: fn(usize) -> f32| (0..6 * 32).map(|i| value(i % 32)).collect::<Vec<_>>();
        let phase = columns(|x| 0.2 * x as f32 + if x < 16 { 0.0 } else { 4.0 * PI });
        let mut wrong_order = columns(|x| if (12..20).contains(&x) || x >= 28 { 0.4 } else { 1e-5 });
        let mut quality = columns(|x| if (12..20).contains(&x) { 0.1 } else { 0.9 });
        let components: Vec<u8> = (0..grid.pixels())
            .map(|i| [1, GROWN, 0][usize::from(i % 32 == 15) + 2 * usize::from(i % 32 >= 28)])
            .collect();
        // The order of the cell of columns 12 to 15 in the last two rows was changed.
        let mut moved = vec![0.0; grid.rows * grid.columns];
        moved[grid.columns + 3] = 0.4;
        let known = Components { grid: &grid, phase: &phase, components: &components, moved: &moved };
        Propagation::default().run(known, &mut wrong_order, &mut quality);
        let row = |map: &[f32]| [11, 14, 15, 16, 30].map(|x| map[3 * 32 + x]);
        let (settled, grown) = (SETTLED_PROBABILITY_MIN, GROWN_PROBABILITY_MIN);
        assert_eq!(row(&wrong_order), [1e-5, settled, grown, settled, 0.4]);
        assert_eq!(row(&quality), [0.9; 5]);
        assert_eq!([4, 3].map(|y| wrong_order[y * 32 + 13]), [0.4, settled]);
        assert_eq!([4, 3].map(|y| quality[y * 32 + 13]), [0.1, 0.9]);
    }

    #[test]
    fn a_component_without_certain_pixels_stays_doubtful() {
        let grid = Grid::new([6, 32], 4.0);
        let (phase, components) = (vec![1.0; grid.pixels()], vec![1; grid.pixels()]);
        let (mut wrong_order, mut quality) = (vec![0.3; 6 * 32], vec![0.2; 6 * 32]);
        wrong_order[40] = f32::NAN;
        let known = Components { grid: &grid, phase: &phase, components: &components, moved: &[] };
        Propagation::default().run(known, &mut wrong_order, &mut quality);
        assert!(wrong_order[40].is_nan());
        assert_eq!(wrong_order.iter().filter(|wrong| **wrong == 0.3).count(), 6 * 32 - 1);
    }
}
