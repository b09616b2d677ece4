//! Islands too small to be trusted.

use crate::joint::cells::Grid;
use multiversion::multiversion;
use rayon::prelude::*;
use std::f32::consts::PI;

/// Pixels of a row that are looked through at once.
const GROUP: usize = 64;

/// Connected regions by their runs along rows.
#[derive(Debug, Clone, Default)]
pub(super) struct Islands {
    rows: Vec<Vec<Run>>,
    parents: Vec<u32>,
    sizes: Vec<u32>,
}

/// Pixels side by side on one surface.
#[derive(Debug, Clone, Copy)]
struct Run {
    from: u32,
    to: u32,
    /// Number of the run in the image.
    number: u32,
}

impl Islands {
    /// Takes from `sure` every connected region of fewer than `least` pixels, and keeps those of `many` and more in `large`;
    /// neighbours whose `phase` (rad) is half a turn or more apart are not connected.
    pub fn remove(
        &mut self,
        grid: &Grid,
        phase: &[f32],
        [least, many]: [usize; 2],
        sure: &mut [u8],
        large: &mut [u8],
    ) {
        let stride = grid.stride;
        self.rows.resize_with(grid.height, Vec::new);
        let source = sure.par_chunks(stride).zip(phase.par_chunks(stride));
        self.rows.par_iter_mut().zip(source).for_each_init(Vec::new, |ends, (runs, (sure, phase))| {
            find_runs(&sure[..grid.width], phase, ends, runs);
        });
        self.number();
        for y in 1..grid.height {
            let (above, below) = (&self.rows[y - 1], &self.rows[y]);
            let lines = [y - 1, y].map(|row| &phase[row * stride..][..stride]);
            connect(above, below, lines, &mut self.parents);
        }
        self.sizes.clear();
        self.sizes.resize(self.parents.len(), 0);
        for run in self.rows.iter().flatten() {
            let root = root(&mut self.parents, run.number);
            self.sizes[root as usize] += run.to - run.from;
        }
        let rows = sure.chunks_mut(stride).zip(large.chunks_mut(stride));
        for (runs, (sure, large)) in self.rows.iter().zip(rows) {
            large.fill(0);
            for run in runs {
                let root = root(&mut self.parents, run.number);
                let (size, at) = (self.sizes[root as usize] as usize, run.from as usize..run.to as usize);
                if size < least {
                    sure[at].fill(0);
                } else if size >= many {
                    large[at].fill(1);
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

/// Runs of a row; `ends` is working memory.
fn find_runs(sure: &[u8], phase: &[f32], ends: &mut Vec<u8>, runs: &mut Vec<Run>) {
    runs.clear();
    ends.resize(sure.len(), 0);
    mark_ends(sure, &phase[..sure.len()], ends);
    let mut open = (sure[0] != 0).then_some(0);
    for (i, group) in ends.chunks(GROUP).enumerate() {
        if group.iter().fold(0, |any, end| any | end) == 0 {
            continue;
        }
        for x in (0..group.len()).filter(|&x| group[x] != 0).map(|x| (i * GROUP + x) as u32) {
            runs.extend(open.map(|from| Run { from, to: x, number: 0 }));
            open = (sure[x as usize] != 0).then_some(x);
        }
    }
    runs.extend(open.map(|from| Run { from, to: sure.len() as u32, number: 0 }));
}

/// 1 for every pixel but the first where a run begins or has ended.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn mark_ends(sure: &[u8], phase: &[f32], ends: &mut [u8]) {
    ends[0] = 0;
    let n = ends.len() - 1;
    let [before, own] = [0, 1].map(|from| (&sure[from..from + n], &phase[from..from + n]));
    for (x, end) in ends[1..].iter_mut().enumerate() {
        let changes = before.0[x] != own.0[x];
        *end = u8::from(changes | ((own.0[x] != 0) & !joined(before.1[x], own.1[x])));
    }
}

/// Unites runs of two rows that touch on one surface.
fn connect(above: &[Run], below: &[Run], [upper, lower]: [&[f32]; 2], parents: &mut [u32]) {
    let (mut i, mut k) = (0, 0);
    while i < above.len() && k < below.len() {
        let (a, b) = (above[i], below[k]);
        let mut common = a.from.max(b.from) as usize..a.to.min(b.to) as usize;
        if common.any(|x| joined(upper[x], lower[x])) {
            unite(parents, a.number, b.number);
        }
        if a.to < b.to {
            i += 1;
        } else {
            k += 1;
        }
    }
}

/// Neighbours on one surface.
fn joined(a: f32, b: f32) -> bool {
    (a - b).abs() < PI
}

fn root(parents: &mut [u32], mut i: u32) -> u32 {
    while parents[i as usize] != i {
        let next = parents[i as usize];
        parents[i as usize] = parents[next as usize];
        i = next;
    }
    i
}

fn unite(parents: &mut [u32], a: u32, b: u32) {
    let (a, b) = (root(parents, a), root(parents, b));
    parents[a.max(b) as usize] = a.min(b);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn islands_go_and_surfaces_stay() {
        let grid = Grid::new([20, 32], 4.0);
        let place = |x: usize, y: usize| y * grid.stride + x;
        let mut phase = vec![10.0f32; grid.pixels()];
        phase[place(5, 5)] = 20.0;
        for y in 0..20 {
            (15..20).for_each(|x| phase[place(x, y)] = 30.0);
        }
        let mut sure = vec![1u8; grid.pixels()];
        let mut large = vec![1u8; grid.pixels()];
        Islands::default().remove(&grid, &phase, [10, 101], &mut sure, &mut large);
        let at = |map: &[u8]| [place(5, 5), place(2, 3), place(17, 2), place(25, 2)].map(|at| map[at]);
        assert_eq!((at(&sure), at(&large)), ([0, 1, 1, 1], [0, 1, 0, 1]));
        Islands::default().remove(&grid, &phase, [101, 101], &mut sure, &mut large);
        assert_eq!(at(&sure), [0, 1, 0, 1]);
    }

    #[test]
    fn a_spiral_is_one_island() {
        let grid = Grid::new([16, 16], 4.0);
        let mut sure = vec![0u8; grid.pixels()];
        // Two columns joined at the bottom only.
        for y in 0..16 {
            sure[y * 16 + 3] = 1;
            sure[y * 16 + 6] = 1;
        }
        (3..=6).for_each(|x| sure[15 * 16 + x] = 1);
        let (before, mut large) = (sure.clone(), sure.clone());
        Islands::default().remove(&grid, &vec![0.0; grid.pixels()], [34, 99], &mut sure, &mut large);
        assert_eq!(sure, before);
        Islands::default().remove(&grid, &vec![0.0; grid.pixels()], [35, 99], &mut sure, &mut large);
        assert!(sure.iter().all(|&v| v == 0));
    }
}
