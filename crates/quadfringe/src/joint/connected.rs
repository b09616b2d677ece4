//! Connected regions of pixels, found by union-find over runs of pixels along rows. Neighbours whose phase differs by half a turn or
//! more are not connected.

use super::cells::Grid;
use super::disjoint::{root, unite};
use super::params::tasks::GROUP;
use multiversion::multiversion;
use rayon::prelude::*;
use std::f32::consts::PI;

/// The connected regions of an image.
#[derive(Debug, Clone, Default)]
pub(super) struct Regions {
    rows: Vec<Vec<Run>>,
    /// Number of the region of every run.
    numbers: Vec<u32>,
}

/// A run: adjacent pixels of a row that belong to one region.
#[derive(Debug, Clone, Copy)]
pub(super) struct Run {
    pub from: u32,
    pub to: u32,
    /// Number of the run in the image.
    number: u32,
}

/// One row of pixels.
#[derive(Clone, Copy)]
struct Row<'a> {
    runs: &'a [Run],
    phase: &'a [f32],
}

impl Regions {
    /// Finds the regions of the pixels that are not 0 in `inside`, by their `phase` in rad; both in padded rows.
    pub fn find(&mut self, grid: &Grid, inside: &[u8], phase: &[f32]) {
        let stride = grid.stride;
        self.rows.resize_with(grid.height, Vec::new);
        let source = inside.par_chunks(stride).zip(phase.par_chunks(stride));
        self.rows.par_iter_mut().zip(source).for_each_init(Vec::new, |ends, (runs, (inside, phase))| {
            find_runs(&inside[..grid.width], phase, ends, runs);
        });
        self.number();
        for y in 1..grid.height {
            let [above, below] =
                [y - 1, y].map(|y| Row { runs: &self.rows[y], phase: &phase[y * stride..][..stride] });
            connect(above, below, &mut self.numbers);
        }
        for run in 0..self.numbers.len() as u32 {
            self.numbers[run as usize] = root(&mut self.numbers, run);
        }
    }

    /// The runs of row `y`, from left to right.
    pub fn row(&self, y: usize) -> &[Run] {
        &self.rows[y]
    }

    /// The region of a run, less than [`Self::count`].
    pub fn of(&self, run: &Run) -> u32 {
        self.numbers[run.number as usize]
    }

    /// An upper bound of the numbers of regions.
    pub fn count(&self) -> usize {
        self.numbers.len()
    }

    fn number(&mut self) {
        let mut count = 0;
        for run in self.rows.iter_mut().flatten() {
            run.number = count;
            count += 1;
        }
        self.numbers.clear();
        self.numbers.extend(0..count);
    }
}

/// Finds the runs of a row; `ends` is working memory.
fn find_runs(inside: &[u8], phase: &[f32], ends: &mut Vec<u8>, runs: &mut Vec<Run>) {
    runs.clear();
    ends.resize(inside.len(), 0);
    mark_ends(inside, &phase[..inside.len()], ends);
    let mut open = (inside[0] != 0).then_some(0);
    for (i, group) in ends.chunks(GROUP).enumerate() {
        if group.iter().fold(0, |any, end| any | end) == 0 {
            continue;
        }
        for x in (0..group.len()).filter(|&x| group[x] != 0).map(|x| (i * GROUP + x) as u32) {
            runs.extend(open.map(|from| Run { from, to: x, number: 0 }));
            open = (inside[x as usize] != 0).then_some(x);
        }
    }
    runs.extend(open.map(|from| Run { from, to: inside.len() as u32, number: 0 }));
}

/// Marks with 1 every pixel at which a run begins or before which one has ended; the first pixel is never marked.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn mark_ends(inside: &[u8], phase: &[f32], ends: &mut [u8]) {
    ends[0] = 0;
    let n = ends.len() - 1;
    let [before, inside] = [0, 1].map(|from| &inside[from..from + n]);
    let [phase_before, phase] = [0, 1].map(|from| &phase[from..from + n]);
    for (x, end) in ends[1..].iter_mut().enumerate() {
        let changes = before[x] != inside[x];
        *end = u8::from(changes | ((inside[x] != 0) & !joined(phase_before[x], phase[x])));
    }
}

/// Unites runs of two rows that touch in one region.
fn connect(above: Row<'_>, below: Row<'_>, parents: &mut [u32]) {
    let (mut i, mut k) = (0, 0);
    while i < above.runs.len() && k < below.runs.len() {
        let (a, b) = (above.runs[i], below.runs[k]);
        let mut common = a.from.max(b.from) as usize..a.to.min(b.to) as usize;
        if common.any(|x| joined(above.phase[x], below.phase[x])) {
            unite(parents, a.number, b.number);
        }
        if a.to < b.to {
            i += 1;
        } else {
            k += 1;
        }
    }
}

/// Whether two neighbours with these phases are connected.
fn joined(a: f32, b: f32) -> bool {
    (a - b).abs() < PI
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_jump_of_the_phase_and_pixels_outside_part_regions() {
        let grid = Grid::new([20, 32], 4.0);
        let place = |x: usize, y: usize| y * grid.stride + x;
        let (mut phase, mut inside) = (vec![10.0f32; grid.pixels()], vec![1u8; grid.pixels()]);
        for y in 0..20 {
            (15..20).for_each(|x| phase[place(x, y)] = 30.0);
            inside[place(25, y)] = 0;
        }
        let mut regions = Regions::default();
        regions.find(&grid, &inside, &phase);
        let found: Vec<_> = regions.row(7).iter().map(|run| (run.from, run.to, regions.of(run))).collect();
        assert_eq!(found, [(0, 15, 0), (15, 20, 1), (20, 25, 2), (26, 32, 3)]);
        assert!((1..20).all(|y| regions.row(y).iter().zip(0..).all(|(run, n)| regions.of(run) == n)));
    }

    #[test]
    fn a_spiral_is_one_region() {
        let grid = Grid::new([16, 16], 4.0);
        let mut inside = vec![0u8; grid.pixels()];
        // Two columns that are connected only at the bottom.
        for y in 0..16 {
            inside[y * 16 + 3] = 1;
            inside[y * 16 + 6] = 1;
        }
        (3..=6).for_each(|x| inside[15 * 16 + x] = 1);
        let mut regions = Regions::default();
        regions.find(&grid, &inside, &vec![0.0; grid.pixels()]);
        assert!((0..16).flat_map(|y| regions.row(y)).all(|run| regions.of(run) == 0));
    }
}
