use super::*;
use crate::joint::cells::{CellMaps, Grid};
use crate::joint::noise::noise_of_phase;
use crate::joint::scene::PhaseMap;

/// A phase averaged by a window in which all pixels have equal information.
fn averaged(window: &Window<'_>, seen: &[f32]) -> Vec<f32> {
    let grid = window.scene.grid;
    let (mut along, mut weight) = (seen.to_vec(), vec![1.0; grid.pixels()]);
    let mut rows = WindowRows::default();
    let lines = along.chunks_mut(grid.stride).zip(weight.chunks_mut(grid.stride));
    for (y, (phase, weight)) in lines.enumerate() {
        let level = |NormalRows { numerator, denominator }: NormalRows<'_>| {
            numerator.fill(0.0);
            denominator[..grid.width].fill(1.0);
        };
        let out = AverageRow { phase, weight };
        window.along(y, &mut rows, &seen[y * grid.stride..][..grid.stride], level, out);
    }
    let average = Average { phase: &along, weight: &weight };
    let (mut phase, mut information) = (vec![0.0; grid.pixels()], vec![0.0; grid.pixels()]);
    let mut lines: Vec<_> = information.chunks_mut(grid.stride).collect();
    window.down(&average, &Slots::<WindowRows>::default(), |rows| rows, &mut phase, &mut lines);
    phase
}

#[test]
fn a_wide_window_takes_ripples_out_where_the_model_leaves_as_much() {
    let grid = Grid::new([96, 256], 4.0);
    // A two-step phase with the error that wrong offsets cause, next to a step of 1.3 rad.
    let truth = |i: usize| 0.25 * (i % 256) as f32 + if i % 256 >= 128 { 1.3 } else { 0.0 };
    let ripple = |i: usize| 0.05 * (2.0 * truth(i)).sin();
    let seen: Vec<f32> = (0..grid.pixels()).map(|i| truth(i) + ripple(i)).collect();
    let light = vec![0.5; grid.pixels()];
    let (usable, modulation) = (vec![1.0; grid.pixels()], vec![0.4; grid.pixels()]);
    let scene =
        Scene { light: [&light; 4], usable: &usable, grid: &grid, period_px: 25.0, factor: 1, pair: None };
    let mut slopes = Slopes::default();
    slopes.measure(&scene, PhaseMap { phase: &seen, modulation: &modulation }, &mut CellMaps::default());
    let mut residuals = Residuals::default();
    let squared_residual = vec![(0.04f32 * 0.4).powi(2); grid.pixels()];
    residuals.measure(&scene, &squared_residual, &modulation, &mut CellMaps::default());
    let window = || Window::new(&scene, &slopes, &modulation, 1e-4);
    let worst = |phase: &[f32], columns: std::ops::Range<usize>| {
        let inside = |i: &usize| (32..64).contains(&(i / 256)) && columns.contains(&(i % 256));
        let errors = (0..grid.pixels()).filter(inside).map(|i| (phase[i] - truth(i)).abs());
        errors.fold(0.0, f32::max)
    };
    let flat = 40..88;
    let [narrow, strict, wide] =
        [window().loosened(&residuals), window().wide(), window().wide().loosened(&residuals)]
            .map(|window| averaged(&window, &seen));
    let [narrow, strict, loose] = [&narrow, &strict, &wide].map(|phase| worst(phase, flat.clone()));
    assert!(loose < 0.012 && strict > 0.04 && narrow > 0.015, "{narrow} {strict} {loose}");
    // The step is not averaged away.
    assert!(worst(&wide, 112..144) < 0.15, "{}", worst(&wide, 112..144));
}

#[test]
fn noise_goes_edges_and_curvature_stay() {
    let grid = Grid::new([64, 128], 4.0);
    // A curved surface with a step of 1.3 rad.
    let truth = |i: usize| {
        let (x, y) = ((i % 128) as f32, (i / 128) as f32);
        0.25 * x + 1e-3 * (x - 64.0).powi(2) - 8e-4 * (y - 32.0).powi(2) + if x >= 60.0 { 1.3 } else { 0.0 }
    };
    let mut state = 1u32;
    let mut uniform = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32 / 8_388_608.0 - 1.0
    };
    let seen: Vec<f32> = (0..grid.pixels()).map(|i| truth(i) + 0.02 * uniform()).collect();
    let light = vec![0.5; grid.pixels()];
    let (usable, modulation) = (vec![1.0; grid.pixels()], vec![0.4; grid.pixels()]);
    let scene =
        Scene { light: [&light; 4], usable: &usable, grid: &grid, period_px: 25.0, factor: 1, pair: None };
    let mut slopes = Slopes::default();
    slopes.measure(&scene, PhaseMap { phase: &seen, modulation: &modulation }, &mut CellMaps::default());
    let window = Window::new(
        &scene,
        &slopes,
        &modulation,
        noise_of_phase(&scene, PhaseMap { phase: &seen, modulation: &modulation }),
    );
    let phase = averaged(&window, &seen);
    let error = |i: usize| (phase[i] - truth(i)).abs();
    let worst = (0..grid.pixels()).map(error).fold(0.0, f32::max);
    // Near the step, its height leaks into the slopes.
    assert!(worst < 0.05, "{worst}");
    // Away from the step and the borders, where the window is whole, it reduces noise of 0.0115 rad to a fifth.
    let inside = |i: usize| (16..48).contains(&(i / 128)) && (76..112).contains(&(i % 128));
    let errors: Vec<f32> = (0..grid.pixels()).filter(|&i| inside(i)).map(|i| error(i).powi(2)).collect();
    let rms = (errors.iter().sum::<f32>() / errors.len() as f32).sqrt();
    assert!(rms < 0.0022, "{rms}");
}
