use super::*;
use crate::joint::cells::Grid;
use crate::joint::model::{Wave, carriers};
use crate::joint::scene::{PhaseMap, Scene};
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

    /// Share of the pixels, two periods from the border, whose wrapped phase is off by more than half a radian, after both fits.
    fn wrong(&self, second: bool) -> f32 {
        let Self { grid, truth, light } = self;
        let ones = vec![1.0; grid.pixels()];
        let light = light.each_ref().map(Vec::as_slice);
        let period_px = f64::from(PERIOD_PX);
        let scene = Scene { light, usable: &ones, grid, period_px, factor: 1, pair: None };
        let (mut phase, mut modulation) = (vec![0.0; grid.pixels()], vec![0.0; grid.pixels()]);
        let (mut fit, mut sums) = (LocalFit::new(RATIOS), CellMaps::default());
        let mut run = |again: bool| {
            let out = PixelMaps { phase: &mut phase, modulation: &mut modulation };
            let light = Lit { lit: &ones, least: 0.0 };
            if again {
                fit.divide_albedo_out(&scene, light, 0.0, out, &mut sums);
            } else {
                fit.run(&scene, light, out, &mut sums);
            }
        };
        run(false);
        if second {
            run(true);
        }
        let map = PhaseMap { phase: &phase, modulation: &modulation };
        let inside =
            (40..grid.height - 40).flat_map(|y| (40..grid.width - 40).map(move |x| y * grid.stride + x));
        let found: Vec<bool> = inside.map(|i| wrap(map.phase[i] - truth[i]).abs() > 0.5).collect();
        found.iter().filter(|wrong| **wrong).count() as f32 / found.len() as f32
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
        let [before, after] = [false, true].map(|second| print.wrong(second));
        assert!(before > 0.3 && after < 0.2, "{direction:?}: {before} {after}");
    }
}

#[test]
fn a_surface_of_one_colour_keeps_the_first_fit() {
    let print = Print::new([1.0, 0.0], |_, _| [0.9, 0.6, 0.5, 0.7]);
    assert_eq!([false, true].map(|second| print.wrong(second)), [0.0, 0.0]);
}

#[test]
fn channels_without_light_leave_finite_results() {
    let mut print = Print::new([1.0, 0.0], bars);
    for dark in [2, 0] {
        print.light[dark].fill(0.0);
        assert!(print.wrong(true).is_finite(), "channel {dark}");
    }
}
