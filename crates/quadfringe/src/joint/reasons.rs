//! Step 8: the reason why a pixel has no data. Each step marks the pixels that it excludes; those without fringes remain.

use super::cells::RowMaps;
use super::illumination::LitMask;
use super::scene::{Pixels, Scene};
use super::validity::Validity;
use crate::Reason;
use multiversion::multiversion;

/// A range counts as greater than the least one from this factor of its square on; rounding is smaller.
const GREATER: f32 = 1.0 - 1e-3;

/// What is known about the pixels of a shot, in padded rows.
#[derive(Clone, Copy)]
pub(super) struct Reasons<'a> {
    pub pixels: &'a Pixels,
    pub validity: &'a Validity,
    pub lit_mask: &'a LitMask,
}

impl Reasons<'_> {
    /// Writes the reasons of row `y`.
    pub fn write(&self, scene: &Scene<'_>, y: usize, maps: &mut RowMaps, out: &mut [Reason]) {
        let row =
            Row { found: scene.row(&self.pixels.reasons, y), valid: scene.row(&self.validity.valid, y) };
        if choose(&row, out) {
            self.without_fringes(scene, y, maps, &row, out);
        }
    }

    /// The reasons of the pixels without fringes. Next to fringes such a pixel is in shadow, whatever its ambient light.
    fn without_fringes(
        &self,
        scene: &Scene<'_>,
        y: usize,
        maps: &mut RowMaps,
        row: &Row<'_>,
        out: &mut [Reason],
    ) {
        let precision = self.lit_mask.precision(scene.grid, y, maps);
        let light = scene.rows(y);
        let greater = GREATER / self.lit_mask.range_min.powi(2);
        for x in (0..out.len()).filter(|x| row.is_without_fringes(*x)) {
            let most = light.iter().fold(f32::NEG_INFINITY, |most, light| most.max(light[x]));
            out[x] = if precision.iter().any(|precision| precision[x] < greater) {
                Reason::Shadow
            } else {
                // The range of a fringe is twice its modulation.
                Reason::without_fringes(most, 0.5 * self.lit_mask.range_min)
            };
        }
    }
}

/// One row of pixels.
struct Row<'a> {
    /// Why a pixel is not valid; `Returned` for pixels without fringes.
    found: &'a [Reason],
    valid: &'a [u8],
}

impl Row<'_> {
    #[inline(always)]
    fn is_without_fringes(&self, x: usize) -> bool {
        (self.valid[x] == 0) & (self.found[x] == Reason::Returned)
    }
}

/// Chooses the reasons of all pixels but those without fringes; tells whether there are any of these.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn choose(row: &Row, out: &mut [Reason]) -> bool {
    let n = out.len();
    let (found, valid) = (&row.found[..n], &row.valid[..n]);
    let mut any = 0u8;
    for x in 0..n {
        out[x] = if valid[x] != 0 { Reason::Returned } else { found[x] };
        any |= u8::from((valid[x] == 0) & (found[x] == Reason::Returned));
    }
    any != 0
}
