//! Bias of the phase by the prior of bending (U18). Where relief is finer than the prior allows, the light of the cells pulls the
//! phase one way, and the bending holds it back.

use super::plane::{Plane, vectors};
use super::start::{filter, smooth};
use crate::joint::params::uncertainty::{BIAS_CHANCE, BIAS_PASSES, CELL_INFORMATION_MIN};
use crate::parallel::lanes::LANES;

/// Cells over which a pull is averaged.
struct Window {
    /// Weights of the outer, the next and the middle one of five cells, along both directions.
    weights: [f32; 3],
    /// Information over weight of the bending at which half of the noise pulls, or for a cell alone a third.
    stiffness: f32,
    /// Whether the share falls faster on loose surfaces, as that of a cell alone does.
    alone: bool,
}

/// A cell alone, and 3 x 3 cells.
const WINDOWS: [Window; 2] = [
    Window { weights: [0.0, 0.0, 1.0], stiffness: 11.0, alone: true },
    Window { weights: [0.0, 0.25, 0.5], stiffness: 0.53, alone: false },
];

impl Window {
    /// Share of the variance of the noise that pulls at the phase; the surface follows the rest. It is the mean of the square of one less
    /// the gain in (U13), over all frequencies that the window passes.
    #[inline(always)]
    fn noise_left(&self, information: f32, bend: f32) -> f32 {
        let stiff = self.stiffness * bend;
        let share = stiff / (information + stiff);
        if self.alone { share * share.sqrt() } else { share }
    }
}

/// Working planes.
pub(super) struct Work<'a> {
    pub pull: &'a mut Plane,
    pub known: &'a mut Plane,
    pub spare: &'a mut Plane,
}

/// What is known at the minimum.
pub(super) struct Minimum<'a> {
    /// Negative gradient of the data by the phase.
    pub gradient: &'a Plane,
    /// Information of a cell about its phase, in linear light squared.
    pub information: &'a Plane,
    /// Weight of the bending, in the same unit.
    pub bend: &'a Plane,
    /// Variance of the intensity of a cell.
    pub noise: f32,
}

/// Writes the square of the bias, rad^2.
#[inline(always)]
pub(super) fn bias(minimum: &Minimum<'_>, work: Work<'_>, out: &mut Plane) {
    let Minimum { gradient, information, bend, noise } = *minimum;
    let Work { pull, known, spare } = work;
    out.clear();
    for window in WINDOWS {
        pull.copy(gradient);
        known.copy(information);
        filter(pull, spare, window.weights);
        filter(known, spare, window.weights);
        let [outer, next, middle] = window.weights.map(|weight| weight * weight);
        let noise = BIAS_CHANCE * noise * (2.0 * (outer + next) + middle).powi(2);
        square(pull, known, bend, &window, noise);
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

/// Replaces gradients by the squares of the changes of the phase that they ask for, less those by noise, which has this variance before
/// the surface follows it.
#[inline(always)]
fn square(gradient: &mut Plane, information: &Plane, bend: &Plane, window: &Window, noise: f32) {
    for at in vectors() {
        let (pull, known, mut out) = (gradient.get(at), information.get(at), [0.0; LANES]);
        let bend = bend.get(at);
        for x in 0..LANES {
            let noise = noise * window.noise_left(known[x], bend[x]);
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
    /// times the information, and the bending `relative` times its weight.
    fn mean_bias_of(
        relative: f32,
        asked: impl Fn(usize, usize) -> f32,
        lit: impl Fn(usize, usize) -> f32,
    ) -> f32 {
        let Fields {
            phase: mut gradient,
            contrast: mut information,
            albedo: [mut pull, mut known, mut spare, mut out],
        } = Fields::default();
        let mut bend = Plane::default();
        for y in 0..SIDE {
            for x in 0..SIDE {
                information.row_mut(y)[x] = INFORMATION * lit(x, y);
                bend.row_mut(y)[x] = INFORMATION * relative;
                gradient.row_mut(y)[x] = INFORMATION * lit(x, y) * asked(x, y);
            }
        }
        let work = Work { pull: &mut pull, known: &mut known, spare: &mut spare };
        let minimum = Minimum { gradient: &gradient, information: &information, bend: &bend, noise: NOISE };
        bias(&minimum, work, &mut out);
        vectors().map(|at| total(out.get(at))).sum::<f64>() as f32 / (SIDE * SIDE) as f32
    }

    /// The same on a surface so stiff that it follows no noise.
    fn mean_bias(asked: impl Fn(usize, usize) -> f32, lit: impl Fn(usize, usize) -> f32) -> f32 {
        mean_bias_of(1e6, asked, lit)
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
    fn what_noise_pulls_is_the_mean_square_of_what_the_surface_does_not_follow() {
        let response = |n: usize| 2.0 - 2.0 * (std::f32::consts::PI * (n as f32 + 0.5) / 64.0).cos();
        for relative in [0.03, 0.1, 1.0, 10.0, 100.0] {
            for window in &WINDOWS {
                let [_, next, middle] = window.weights;
                let passed = |n: usize| (middle + next * (2.0 - response(n))).powi(2);
                let (mut sum, mut all) = (0.0, 0.0);
                for i in 0..4096 {
                    let [x, y] = [i / 64, i % 64];
                    let stiff = relative * (response(x) + response(y)).powi(2);
                    let weight = passed(x) * passed(y);
                    sum += weight * (stiff / (1.0 + stiff)).powi(2);
                    all += weight;
                }
                let ratio = window.noise_left(2.0, 2.0 * relative) * all / sum;
                assert!((0.75..1.3).contains(&ratio), "{relative} {} {ratio}", window.alone);
            }
        }
    }

    #[test]
    fn a_loose_surface_follows_most_of_the_noise_and_a_weaker_pull_shows() {
        let square = 0.3 * NOISE / INFORMATION;
        let sign = |x: usize| if x % 4 < 2 { 1.0 } else { -1.0 };
        let waves = |x: usize, y: usize| 0.3 * noise(x, y) + sign(x) * square.sqrt();
        let [stiff, loose] = [1e6, 0.03].map(|relative| mean_bias_of(relative, waves, |_, _| 1.0));
        assert!(stiff < 0.01 * square && (0.6..1.3).contains(&(loose / square)), "{stiff} {loose} {square}");
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
