//! Whether the channels see the same column (U17). In wax and skin the colours penetrate to different depths, and the phase is a
//! compromise between them that albedo and contrast hide from the residuals.

use super::data::{Cells, Line, Model, predict, predicted};
use super::plane::{Plane, total, vectors};
use super::tile::Tile;
use crate::joint::model::weights;
use crate::joint::params::energy::SIDE;
use crate::joint::params::uncertainty::{BLOCK_CELLS, BLOCKS_MIN};
use crate::parallel::exp::exp;
use crate::parallel::lanes::{LANES, Lanes};
use multiversion::multiversion;

/// Blocks along a side of a tile.
const BLOCKS: usize = SIDE / BLOCK_CELLS;

/// Normal equations of a phase step by R with B, and by G with IR, in one block; the brightness of each cell is eliminated.
#[derive(Debug, Default, Clone, Copy)]
struct Block {
    cells: f64,
    numerator: [f64; 2],
    information: [f64; 2],
}

impl Block {
    /// Whether most of the block is lit, and both pairs determine a phase.
    fn counts(&self) -> bool {
        let [first, second] = self.information;
        2.0 * self.cells > (BLOCK_CELLS * BLOCK_CELLS) as f64 && first.min(second) > 0.0
    }

    /// Difference between the steps of the pairs, rad.
    fn apart(&self) -> f64 {
        self.numerator[0] / self.information[0] - self.numerator[1] / self.information[1]
    }
}

/// Writes the variance of the phase by what the channels of a region disagree in, rad^2.
pub(super) fn disagreement(tile: &Tile, out: &mut Plane) {
    let colours = colours(tile);
    let blocks = if tile.pair { sums::<true>(tile, colours) } else { sums::<false>(tile, colours) };
    for place in (0..BLOCKS * BLOCKS).map(|n| [n / BLOCKS, n % BLOCKS]) {
        let [y, x] = place.map(|at| at * BLOCK_CELLS);
        let value = variance(&blocks, place);
        (y..y + BLOCK_CELLS).for_each(|y| out.row_mut(y)[x..x + BLOCK_CELLS].fill(value));
    }
}

/// Mean logarithm of the albedo of every channel relative to the mean of the channels.
fn colours(tile: &Tile) -> [f32; 4] {
    let (mut sums, mut cells) = ([0.0; 4], 1e-9);
    for y in 0..SIDE {
        for (x, inside) in tile.inside.row(y).iter().enumerate() {
            cells += f64::from(*inside);
            for (sum, albedo) in sums.iter_mut().zip(&tile.unknown.albedo) {
                *sum += f64::from(inside * albedo.row(y)[x]);
            }
        }
    }
    let present = weights(tile.ratios).map(f64::from);
    let mean = sums.iter().sum::<f64>() / present.iter().sum::<f64>();
    sums.map(|sum| ((sum - mean) / cells) as f32)
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2+fma"))]
fn sums<const PAIR: bool>(tile: &Tile, colours: [f32; 4]) -> [[Block; BLOCKS]; BLOCKS] {
    let Tile { light, usable, unknown, scales, ratios, infrared, .. } = tile;
    let present = weights(*ratios);
    let mut blocks = [[Block::default(); BLOCKS]; BLOCKS];
    for (n, at) in vectors().enumerate() {
        let (phase, usable) = (unknown.phase.get(at), usable.get(at));
        let modulation = unknown.contrast.get(at).map(exp);
        let light: [_; 4] = std::array::from_fn(|c| light[c].get(at));
        let models: [_; 4] = std::array::from_fn(|c| {
            let cells = Cells { phase, modulation, usable, albedo: [colours[c]; LANES], light: light[c] };
            let kept = scales.channel_contrast[c];
            if PAIR && c == 3 {
                predicted::<_, false, false>(&cells, Line::at(infrared, at), kept, 1.0)
            } else {
                predict(&cells, c, ratios[c], kept, present[c])
            }
        });
        let terms = normal_equations(&models, &light.map(|light| product(light, usable)), present);
        let (y, x) = (n / (SIDE / LANES), n % (SIDE / LANES) * LANES);
        let block = &mut blocks[y / BLOCK_CELLS][x / BLOCK_CELLS];
        block.cells += total(usable);
        for k in 0..2 {
            block.numerator[k] += total(terms[k]);
            block.information[k] += total(terms[2 + k]);
        }
    }
    blocks
}

/// Numerators of both pairs, then their information, with the brightness eliminated.
#[inline(always)]
fn normal_equations(models: &[Model; 4], light: &[Lanes; 4], present: [f32; 4]) -> [Lanes; 4] {
    let mut terms = [[0.0; LANES]; 4];
    for x in 0..LANES {
        let (mut mm, mut ml) = (1e-9, 0.0);
        let [mut ds, mut dd, mut dm] = [[0.0; 2]; 3];
        for c in 0..4 {
            let (m, d, l) = (models[c].whole(x), models[c].slope(x), present[c] * light[c][x]);
            mm += m * m;
            ml += m * l;
            ds[c % 2] += d * l;
            dd[c % 2] += d * d;
            dm[c % 2] += d * m;
        }
        let brightness = ml / mm;
        for k in 0..2 {
            terms[k][x] = brightness * (ds[k] - brightness * dm[k]);
            terms[2 + k][x] = brightness * brightness * (dd[k] - dm[k] * dm[k] / mm);
        }
    }
    terms
}

#[inline(always)]
fn product(one: Lanes, other: Lanes) -> Lanes {
    std::array::from_fn(|x| one[x] * other[x])
}

/// Variance of the mean of both pairs by the mean difference of the blocks around one, beyond two standard errors of it. The
/// errors of print have either sign from block to block, and those of a material have one.
fn variance(blocks: &[[Block; BLOCKS]; BLOCKS], [y, x]: [usize; 2]) -> f32 {
    let around = |at: usize| at.saturating_sub(1)..BLOCKS.min(at + 2);
    let near =
        || around(y).flat_map(|y| around(x).map(move |x| &blocks[y][x])).filter(|block| block.counts());
    let count = near().count() as f64;
    if near().count() < BLOCKS_MIN {
        return 0.0;
    }
    let mean = near().map(Block::apart).sum::<f64>() / count;
    let square = near().map(|block| (block.apart() - mean).powi(2)).sum::<f64>() / (count * (count - 1.0));
    let [first, second] = [0, 1].map(|k| near().map(|block| block.information[k]).sum::<f64>());
    let share = first.mul_add(first, second * second) / (2.0 * (first + second).powi(2));
    (share * (mean * mean - 4.0 * square).max(0.0)) as f32
}
