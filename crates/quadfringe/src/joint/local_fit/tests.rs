use super::*;
use crate::joint::cells::Grid;
use crate::joint::model::{Wave, carriers};
use crate::joint::scene::Scene;
use crate::parallel::angle::wrap;
use std::f32::consts::TAU;

const RATIOS: [f32; 4] = [1.0, 35.0 / 36.0, 1.0, 30.0 / 36.0];
const PERIOD_PX: f32 = 20.0;

/// Fringes on a plane, in one direction or the other, and what the pixels of each albedo send back in the four channels.
struct Print {
    grid: Grid,
    truth: Vec<f32>,
    light: [Vec<f32>; 4],
}

impl Print {
    fn new([along, down]: [f32; 2], albedo: impl Fn(usize, usize) -> [f32; 4]) -> Self {
        let grid = Grid::new([96, 192], 4.0);
        let place = |i: usize| (i % grid.stride, i / grid.stride);
        let turn = |(x, y): (usize, usize)| TAU / PERIOD_PX * (along * x as f32 + down * y as f32);
        let truth: Vec<f32> = (0..grid.pixels()).map(|i| 100.0 + turn(place(i))).collect();
        let light = std::array::from_fn(|c| {
            let seen = |(i, &phase): (usize, &f32)| {
                let (x, y) = place(i);
                let wave = carriers(phase, RATIOS, Wave::coaxial(phase, RATIOS[3])).cosine[c];
                albedo(x, y)[c] * (0.5 + 0.4 * wave)
            };
            truth.iter().enumerate().map(seen).collect()
        });
        Self { grid, truth, light }
    }

    /// Wrapped phase and modulation after the first fit, or after both.
    fn fitted(&self, fits: usize) -> [Vec<f32>; 2] {
        let Self { grid, light, .. } = self;
        let ones = vec![1.0; grid.pixels()];
        let light = light.each_ref().map(Vec::as_slice);
        let period_px = f64::from(PERIOD_PX);
        let scene = Scene { light, usable: &ones, grid, period_px, factor: 1, pair: None };
        let [mut phase, mut modulation] = [(); 2].map(|()| vec![0.0; grid.pixels()]);
        let (mut fit, mut sums) = (LocalFit::new(RATIOS), CellMaps::default());
        for number in 0..fits {
            let out = PixelMaps { phase: &mut phase, modulation: &mut modulation };
            let lit = Lit { lit: &ones, least: 0.0 };
            if number == 0 {
                fit.run(&scene, lit, out, &mut sums);
            } else {
                fit.fit_with_albedo(&scene, lit, 0.0, out, &mut sums);
            }
        }
        [phase, modulation]
    }

    /// Share of the pixels, two periods from the border, whose wrapped phase is not within half a radian of the truth.
    fn wrong(&self, fits: usize) -> f32 {
        let Self { grid, truth, .. } = self;
        let [phase, _] = self.fitted(fits);
        let inside =
            (40..grid.height - 40).flat_map(|y| (40..grid.width - 40).map(move |x| y * grid.stride + x));
        let right: Vec<bool> = inside.map(|i| wrap(phase[i] - truth[i]).abs() <= 0.5).collect();
        right.iter().filter(|right| !**right).count() as f32 / right.len() as f32
    }
}

/// Bars of several widths, below a third of a fringe, in ink that is brighter in the infrared.
fn bars(x: usize, _: usize) -> [f32; 4] {
    if [0, 1, 5, 6, 7, 11, 15, 16].contains(&(x % 19)) {
        [0.12, 0.1, 0.1, 0.5]
    } else {
        [0.9, 0.8, 0.85, 0.9]
    }
}

#[test]
fn the_phase_of_bars_within_a_fringe_comes_from_the_ratio_of_red_and_blue() {
    for direction in [[1.0, 0.0], [-1.0, 0.0], [0.8, 0.6], [0.8, -0.6]] {
        let print = Print::new(direction, bars);
        let [before, after] = [1, 2].map(|fits| print.wrong(fits));
        assert!(before > 0.3 && after < 0.2, "{direction:?}: {before} {after}");
    }
}

#[test]
fn a_surface_of_one_colour_keeps_the_first_fit() {
    let print = Print::new([1.0, 0.0], |_, _| [0.9, 0.6, 0.5, 0.7]);
    assert_eq!(print.wrong(1), 0.0);
    assert_eq!(print.fitted(1), print.fitted(2));
}

#[test]
fn channels_without_light_leave_finite_results() {
    for dark in 0..4 {
        let mut print = Print::new([1.0, 0.0], bars);
        print.light[dark].fill(0.0);
        let found = print.fitted(2);
        assert!(found.iter().flatten().all(|value| value.is_finite()), "channel {dark}");
    }
}
