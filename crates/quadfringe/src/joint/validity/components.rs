//! Step 8: connected components of the valid pixels, and their sizes.

use crate::joint::cells::Grid;
use crate::joint::disjoint::{root, unite};
use crate::joint::params::tasks::GROUP;
use multiversion::multiversion;
use rayon::prelude::*;
use std::f32::consts::PI;

/// Connected components, found by union-find over runs of pixels along rows.
#[derive(Debug, Clone, Default)]
pub(super) struct Components {
    rows: Vec<Vec<Run>>,
    parents: Vec<u32>,
    sizes: Vec<u32>,
}

/// A run: adjacent pixels of a row on one surface.
#[derive(Debug, Clone, Copy)]
struct Run {
    from: u32,
    to: u32,
    /// Number of the run in the image.
    number: u32,
}

/// Sizes of components in pixels.
#[derive(Debug, Clone, Copy)]
pub(super) struct SizeLimits {
    /// Smaller components are removed.
    pub least: usize,
    /// Components of this size or more are seeds of region growing.
    pub seed: usize,
}

/// One row of pixels.
#[derive(Clone, Copy)]
struct Row<'a> {
    runs: &'a [Run],
    phase: &'a [f32],
}

impl Components {
    /// Removes small components from `valid`. Writes 1 into `seeds` for pixels of large components, 0 elsewhere. Neighbours
    /// whose `phase` (rad) differs by half a turn or more are not connected.
    pub fn remove_small(
        &mut self,
        grid: &Grid,
        phase: &[f32],
        limits: SizeLimits,
        valid: &mut [u8],
        seeds: &mut [u8],
    ) {
        let stride = grid.stride;
        self.rows.resize_with(grid.height, Vec::new);
        let source = valid.par_chunks(stride).zip(phase.par_chunks(stride));
        self.rows.par_iter_mut().zip(source).for_each_init(Vec::new, |ends, (runs, (valid, phase))| {
            find_runs(&valid[..grid.width], phase, ends, runs);
        });
        self.number();
        for y in 1..grid.height {
            let [above, below] =
                [y - 1, y].map(|y| Row { runs: &self.rows[y], phase: &phase[y * stride..][..stride] });
            connect(above, below, &mut self.parents);
        }
        self.sizes.clear();
        self.sizes.resize(self.parents.len(), 0);
        for run in self.rows.iter().flatten() {
            let root = root(&mut self.parents, run.number);
            self.sizes[root as usize] += run.to - run.from;
        }
        let rows = valid.chunks_mut(stride).zip(seeds.chunks_mut(stride));
        for (runs, (valid, seeds)) in self.rows.iter().zip(rows) {
            seeds.fill(0);
            for run in runs {
                let root = root(&mut self.parents, run.number);
                let (size, at) = (self.sizes[root as usize] as usize, run.from as usize..run.to as usize);
                if size < limits.least {
                    valid[at].fill(0);
                } else if size >= limits.seed {
                    seeds[at].fill(1);
                }
            }
        }
    }

    fn number(&mut self) {
        let mut count = 0;
        for run in self.rows.iter_mut().flatten() {
            run.number = count;
            count += 1;
        }
        self.parents.clear();
        self.parents.extend(0..count);
    }
}

/// Finds the runs of a row; `ends` is working memory.
fn find_runs(valid: &[u8], phase: &[f32], ends: &mut Vec<u8>, runs: &mut Vec<Run>) {
    runs.clear();
    ends.resize(valid.len(), 0);
    mark_ends(valid, &phase[..valid.len()], ends);
    let mut open = (valid[0] != 0).then_some(0);
    for (i, group) in ends.chunks(GROUP).enumerate() {
        if group.iter().fold(0, |any, end| any | end) == 0 {
            continue;
        }
        for x in (0..group.len()).filter(|&x| group[x] != 0).map(|x| (i * GROUP + x) as u32) {
            runs.extend(open.map(|from| Run { from, to: x, number: 0 }));
            open = (valid[x as usize] != 0).then_some(x);
        }
    }
    runs.extend(open.map(|from| Run { from, to: valid.len() as u32, number: 0 }));
}

/// Marks with 1 every pixel at which a run begins or before which one has ended; the first pixel is never marked.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn mark_ends(valid: &[u8], phase: &[f32], ends: &mut [u8]) {
    ends[0] = 0;
    let n = ends.len() - 1;
    let [valid_before, valid] = [0, 1].map(|from| &valid[from..from + n]);
    let [phase_before, phase] = [0, 1].map(|from| &phase[from..from + n]);
    for (x, end) in ends[1..].iter_mut().enumerate() {
        let changes = valid_before[x] != valid[x];
        *end = u8::from(changes | ((valid[x] != 0) & !joined(phase_before[x], phase[x])));
    }
}

/// Unites runs of two rows that touch on one surface.
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

/// Whether two neighbours with these phases lie on one surface.
fn joined(a: f32, b: f32) -> bool {
    (a - b).abs() < PI
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_components_go_and_large_ones_stay() {
        let grid = Grid::new([20, 32], 4.0);
        let place = |x: usize, y: usize| y * grid.stride + x;
        let mut phase = vec![10.0f32; grid.pixels()];
        phase[place(5, 5)] = 20.0;
        for y in 0..20 {
            (15..20).for_each(|x| phase[place(x, y)] = 30.0);
        }
        let (mut valid, mut seeds) = (vec![1u8; grid.pixels()], vec![1u8; grid.pixels()]);
        let limits = SizeLimits { least: 10, seed: 101 };
        Components::default().remove_small(&grid, &phase, limits, &mut valid, &mut seeds);
        let at = |map: &[u8]| [place(5, 5), place(2, 3), place(17, 2), place(25, 2)].map(|at| map[at]);
        assert_eq!((at(&valid), at(&seeds)), ([0, 1, 1, 1], [0, 1, 0, 1]));
        let limits = SizeLimits { least: 101, seed: 101 };
        Components::default().remove_small(&grid, &phase, limits, &mut valid, &mut seeds);
        assert_eq!(at(&valid), [0, 1, 0, 1]);
    }

    #[test]
    fn a_spiral_is_one_component() {
        let grid = Grid::new([16, 16], 4.0);
        let mut valid = vec![0u8; grid.pixels()];
        // Two columns that are connected only at the bottom.
        for y in 0..16 {
            valid[y * 16 + 3] = 1;
            valid[y * 16 + 6] = 1;
        }
        (3..=6).for_each(|x| valid[15 * 16 + x] = 1);
        let (before, mut seeds, phase) = (valid.clone(), valid.clone(), vec![0.0; grid.pixels()]);
        let limits = SizeLimits { least: 34, seed: 99 };
        Components::default().remove_small(&grid, &phase, limits, &mut valid, &mut seeds);
        assert_eq!(valid, before);
        let limits = SizeLimits { least: 35, seed: 99 };
        Components::default().remove_small(&grid, &phase, limits, &mut valid, &mut seeds);
        assert!(valid.iter().all(|&v| v == 0));
    }
}
