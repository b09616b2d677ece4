//! Bias of the phase by the prior of bending (U18). Where relief is finer than the prior allows, the light of the cells pulls the
//! phase one way, and the bending holds it back.

use super::plane::{Plane, vectors};
use super::start::{filter, smooth};
use crate::joint::params::uncertainty::{BIAS_CHANCE, BIAS_PASSES, CELL_INFORMATION_MIN};
use crate::parallel::lanes::LANES;

/// Weights of the outer, the next and the middle one of five cells over which a pull is averaged: a cell alone, and 3 x 3.
const WINDOWS: [[f32; 3]; 2] = [[0.0, 0.0, 1.0], [0.0, 0.25, 0.5]];

/// Working planes.
pub(super) struct Work<'a> {
    pub pull: &'a mut Plane,
    pub known: &'a mut Plane,
    pub spare: &'a mut Plane,
}

/// Writes the square of the bias, rad^2. `gradient` is the negative gradient of the data by the phase, `information` that of a cell
/// about its phase, and `noise` the variance of the intensity of a cell.
#[inline(always)]
pub(super) fn bias(gradient: &Plane, information: &Plane, noise: f32, work: Work<'_>, out: &mut Plane) {
    let Work { pull, known, spare } = work;
    out.clear();
    for window in WINDOWS {
        pull.copy(gradient);
        known.copy(information);
        filter(pull, spare, window);
        filter(known, spare, window);
        let [outer, next, middle] = window.map(|weight| weight * weight);
        square(pull, known, BIAS_CHANCE * noise * (2.0 * (outer + next) + middle).powi(2));
        (0..BIAS_PASSES).for_each(|_| smooth(pull, spare));
        for at in vectors() {
            let (found, mut most) = (pull.get(at), out.get(at));
            for x in 0..LANES {
                most[x] = if found[x] > most[x] { found[x] } else { most[x] };
            }
            out.set(at, most);
        }
    }
}

/// Replaces gradients by the squares of the changes of the phase that they ask for, less those by noise of this variance.
#[inline(always)]
fn square(gradient: &mut Plane, information: &Plane, noise: f32) {
    for at in vectors() {
        let (pull, known, mut out) = (gradient.get(at), information.get(at), [0.0; LANES]);
        for x in 0..LANES {
            let squared = (pull[x] * pull[x] / known[x] - noise) / known[x];
            out[x] = if known[x] > CELL_INFORMATION_MIN { squared } else { 0.0 };
        }
        gradient.set(at, out);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::joint::energy::plane::{Fields, total};
    use crate::joint::energy::tests::random;
    use crate::joint::params::energy::SIDE;

    const NOISE: f32 = 1e-4;
    const INFORMATION: f32 = 0.5;

    /// Mean of the bias squared over the cells, for the change of the phase of each cell that its light asks for. A cell has `lit`
    /// times the information.
    fn mean_bias(asked: impl Fn(usize, usize) -> f32, lit: impl Fn(usize, usize) -> f32) -> f32 {
        let Fields {
            phase: mut gradient,
            contrast: mut information,
            albedo: [mut pull, mut known, mut spare, mut out],
        } = Fields::default();
        for y in 0..SIDE {
            for x in 0..SIDE {
                information.row_mut(y)[x] = INFORMATION * lit(x, y);
                gradient.row_mut(y)[x] = INFORMATION * lit(x, y) * asked(x, y);
            }
        }
        let work = Work { pull: &mut pull, known: &mut known, spare: &mut spare };
        bias(&gradient, &information, NOISE, work, &mut out);
        vectors().map(|at| total(out.get(at))).sum::<f64>() as f32 / (SIDE * SIDE) as f32
    }

    /// Noise of the phase of a cell: uniform, with the variance of its light over its information.
    fn noise(x: usize, y: usize) -> f32 {
        random(1, y * SIDE + x) * (3.0 * NOISE / INFORMATION).sqrt()
    }

    #[test]
    fn noise_alone_is_no_bias() {
        let found = mean_bias(noise, |_, _| 1.0);
        assert!(found < 0.05 * NOISE / INFORMATION, "{found}");
    }

    #[test]
    fn a_weak_pull_of_many_cells_and_a_strong_one_of_single_cells_are_found_in_noise() {
        let square = 0.3 * NOISE / INFORMATION;
        let even = mean_bias(|x, y| noise(x, y) + square.sqrt(), |_, _| 1.0);
        assert!((0.6..1.3).contains(&(even / square)), "{even} {square}");
        let square = 2.0 * NOISE / INFORMATION;
        let sign = |x: usize| if x % 4 < 2 { 1.0 } else { -1.0 };
        let waves = mean_bias(|x, y| noise(x, y) + sign(x) * square.sqrt(), |_, _| 1.0);
        assert!((0.7..1.2).contains(&(waves / square)), "{waves} {square}");
    }

    #[test]
    fn cells_without_light_have_no_bias() {
        assert_eq!(mean_bias(|_, _| 1.0, |_, _| 0.0), 0.0);
        let square = 1.0;
        let half = mean_bias(|_, _| 1.0, |x, _| if x < SIDE / 2 { 1.0 } else { 0.0 });
        assert!((0.45..0.6).contains(&(half / square)), "{half}");
    }
}
