//! Step 8: the sizes of connected components of the valid pixels.

use crate::joint::cells::Grid;
use crate::joint::connected::Regions;

/// Connected components, with their sizes.
#[derive(Debug, Clone, Default)]
pub(super) struct Components {
    regions: Regions,
    sizes: Vec<u32>,
}

/// Sizes of components in pixels.
#[derive(Debug, Clone, Copy)]
pub(super) struct SizeLimits {
    /// Smaller components are removed.
    pub least: usize,
    /// Components of this size or more are seeds of region growing.
    pub seed: usize,
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
        let Self { regions, sizes } = self;
        regions.find(grid, valid, phase);
        sizes.clear();
        sizes.resize(regions.count(), 0);
        for run in (0..grid.height).flat_map(|y| regions.row(y)) {
            sizes[regions.of(run) as usize] += run.to - run.from;
        }
        let rows = valid.chunks_mut(grid.stride).zip(seeds.chunks_mut(grid.stride));
        for (y, (valid, seeds)) in rows.enumerate() {
            seeds.fill(0);
            for run in regions.row(y) {
                let (size, at) =
                    (sizes[regions.of(run) as usize] as usize, run.from as usize..run.to as usize);
                if size < limits.least {
                    valid[at].fill(0);
                } else if size >= limits.seed {
                    seeds[at].fill(1);
                }
            }
        }
    }
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
}
