use super::edge::{EDGE, Edge, RATIOS};
use super::*;
use crate::joint::cells::Grid;
use crate::joint::local_fit::{Lit, PixelMaps};
use crate::joint::model::{Wave, carriers};
use std::f32::consts::TAU;

#[test]
fn a_window_on_two_colours_keeps_its_size() {
    let textures = [[0.5, 0.4, 0.2, 0.15, 0.6, 0.45, 0.4, 0.35], [0.3, 0.25, 0.5, 0.4, 0.2, 0.15, 0.4, 0.3]];
    let edge = Edge::new(textures, 0.0);
    let (grid, phase) = (&edge.grid, &edge.phase);
    let (usable, modulation) = (edge.plane(1.0), edge.plane(0.3));
    let scene = edge.scene(&usable);
    let (mut fit, mut found, mut sums) = (LocalFit::new(RATIOS), Photometry::new(), CellMaps::default());
    let (mut wrapped, mut spare) = (vec![0.0; grid.pixels()], vec![0.0; grid.pixels()]);
    let maps = PixelMaps { phase: &mut wrapped, modulation: &mut spare };
    fit.run(&scene, Lit { lit: &usable, least: 0.02 }, maps, &mut sums);
    found.start(&scene, &fit, &mut sums);
    let size_at = |found: &Photometry| {
        let mut maps = RowMaps::default();
        let rows = found.sample_in_place(&scene, 30, &mut maps);
        let sum = |rows: [&[f32]; 4]| rows.map(|row| row[EDGE].powi(2)).iter().sum::<f32>();
        (sum(rows.offset) + sum(rows.amplitude)).sqrt()
    };
    let before = size_at(&found);
    for _ in 0..6 {
        found.fit(&scene, RATIOS, PhaseMap { phase, modulation: &modulation }, 0.0, &mut sums);
    }
    let after = size_at(&found);
    assert!((after / before - 1.0).abs() < 0.15, "{before} {after}");
}

#[test]
fn offsets_and_amplitudes_are_found_under_texture_and_an_error_of_the_phase() {
    let grid = Grid::new([96, 256], 4.0);
    let truth: Vec<f32> = (0..grid.pixels()).map(|i| 40.0 + TAU * (i % 256) as f32 / 25.0).collect();
    let texture = |i: usize| 0.7 + 0.2 * ((i / 256) as f32 * 0.9).sin() * ((i % 256) as f32 * 0.7).cos();
    let fringes = [[0.5, 0.4], [0.45, 0.38], [0.55, 0.42], [0.4, 0.37]];
    let planes: [Vec<f32>; 4] = std::array::from_fn(|c| {
        let [a, b] = fringes[c];
        (0..grid.pixels())
            .map(|i| {
                texture(i)
                    * (a + b * carriers(truth[i], RATIOS, Wave::coaxial(truth[i], RATIOS[3])).cosine[c])
            })
            .collect()
    });
    let (usable, modulation) = (vec![1.0; grid.pixels()], vec![0.3; grid.pixels()]);
    let light = planes.each_ref().map(Vec::as_slice);
    let scene = Scene { light, usable: &usable, grid: &grid, period_px: 25.0, factor: 1, pair: None };
    let (mut fit, mut found, mut sums) = (LocalFit::new(RATIOS), Photometry::new(), CellMaps::default());
    let (mut phase, mut spare) = (vec![0.0; grid.pixels()], vec![0.0; grid.pixels()]);
    let maps = PixelMaps { phase: &mut phase, modulation: &mut spare };
    fit.run(&scene, Lit { lit: &usable, least: 0.02 }, maps, &mut sums);
    found.start(&scene, &fit, &mut sums);
    // The given phase has an error of 0.05 rad, like a two-step phase with wrong offsets.
    let phase: Vec<f32> = truth.iter().map(|t| t + 0.05 * (2.0 * t).sin()).collect();
    for _ in 0..3 {
        let map = PhaseMap { phase: &phase, modulation: &modulation };
        found.fit(&scene, RATIOS, map, 0.0, &mut sums);
    }
    let mut maps = RowMaps::default();
    let rows = found.sample(&scene, 48, &mut maps);
    for x in 40..216 {
        // Only ratios have a meaning.
        let scale = rows.offset[0][x] / fringes[0][0];
        for c in 0..4 {
            let (a, b) = (rows.offset[c][x] / scale, rows.amplitude[c][x] / scale);
            assert!((a - fringes[c][0]).abs() < 0.02 && (b - fringes[c][1]).abs() < 0.02, "{c} {x} {a} {b}");
        }
    }
}
