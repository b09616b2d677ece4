//! Step 3: a second fit, for surfaces whose albedo changes within a fringe (J40, J41).
//!
//! The first fit takes every change of the light in a window for fringes, so that bars and letters spoil phase and beats. The ratio of
//! R and B does not depend on the albedo that they share. Its phasor is that of the fringes, though blurred at edges of the surface, and
//! gives the albedo of every pixel. With both, the light is fitted again. A cell keeps this fit where the first one does not explain
//! the light, this one explains more of it, and the ratio is that of one surface.

use super::rows::{
    ChannelRows, Products, Rows, StrengthRows, add_products, finish_row, map, products, solve_row, sum,
};
use super::{Lit, LocalFit, PixelMaps, Source, Textured};
use crate::joint::cells::{CellMaps, CellWindow};
use crate::joint::model::count;
use crate::joint::params::local_fit::{
    COMPARED_WINDOW, PURITY_MIN, UNEXPLAINED_MIN, UNEXPLAINED_NOISES_MIN, WINDOW,
};
use crate::joint::params::pyramid::SAMPLED_ROWS;
use crate::joint::scene::Scene;
use crate::parallel::lanes::{LANES, Lanes, add, lanes, take};
use multiversion::multiversion;
use rayon::prelude::*;

/// Sums of one cell: what each fit leaves of the light, and the weight of the pixels.
mod compared {
    pub const FIRST: usize = 0;
    pub const WEIGHT: usize = 2;
    pub const COUNT: usize = 3;
}

impl LocalFit {
    /// Fits a scene once more with the albedo of its pixels, and corrects `out` and all results in the cells where this explains
    /// more of the light. [`Self::run`] must have run with the same scene; without quadrature nothing changes. `noise` is the
    /// standard deviation of the intensities in linear light.
    pub fn fit_with_albedo(
        &mut self,
        scene: &Scene<'_>,
        light: Lit<'_>,
        noise: f32,
        out: PixelMaps<'_>,
        sums: &mut CellMaps,
    ) {
        if !self.is_of_pixels() {
            return;
        }
        self.carrier.find(scene, &self.slots, sums);
        self.fit_again(scene, sums);
        self.compare(scene, noise, sums);
        self.keep(scene);
        self.correct(scene, light, out);
    }

    fn fit_again(&mut self, scene: &Scene<'_>, sums: &mut CellMaps) {
        let Self { carrier, textured, slots, ratios, .. } = self;
        let (carrier, ratios) = (&*carrier, *ratios);
        scene.grid.window_sums::<{ sum::COUNT }, Rows>(
            CellWindow { sigma_cells: scene.cells(WINDOW), sampled_rows: SAMPLED_ROWS },
            slots,
            sums,
            &mut textured.maps,
            |Rows { maps, cos, sin, albedo: [albedo, ..], .. }, y, sums| {
                carrier.row(scene, y, maps, [cos, sin]);
                carrier.albedo(scene, y, maps, [cos, sin], albedo);
                add_products(scene.row(scene.usable, y), [cos, sin], Some(albedo), scene.rows(y), sums);
            },
            |_, sums, out| solve_row(sums, ratios, out),
        );
    }

    /// Finds the cells of one surface where the first fit leaves more of the light than noise does, and the second one less (J42).
    fn compare(&mut self, scene: &Scene<'_>, noise: f32, sums: &mut CellMaps) {
        let Self { carrier, textured, slots, ratios, maps: first, .. } = self;
        let Textured { maps: second, kept } = textured;
        let (carrier, second_maps) = (&*carrier, &*second);
        let fits = [(Source::TwoStep(first), &*first), (Source::Window(carrier), second_maps)];
        let channels = count(*ratios);
        let by_noise = (UNEXPLAINED_NOISES_MIN * noise).powi(2);
        scene.grid.window_sums::<{ compared::COUNT }, Rows>(
            CellWindow { sigma_cells: scene.cells(COMPARED_WINDOW), sampled_rows: SAMPLED_ROWS },
            slots,
            sums,
            kept,
            |Rows { maps, cos, sin, .. }, y, sums| {
                for (number, (source, fit)) in fits.into_iter().enumerate() {
                    source.row(scene, y, None, maps, [cos, sin]);
                    let model = ChannelRows::sample(maps, scene, fit, y);
                    add_misfit(model, [cos, sin], scene.rows(y), scene.row(scene.usable, y), number, sums);
                }
            },
            |row, [first, second, weight], out| {
                let modulation = second_maps.line(row, map::MODULATION);
                let purity = carrier.purity(row);
                for (x, out) in out.iter_mut().enumerate() {
                    let explained =
                        channels * weight[x] * ((UNEXPLAINED_MIN * modulation[x]).powi(2) + by_noise);
                    let better = (first[x] > explained) & (second[x] < first[x]);
                    *out = f32::from(u8::from(better & (purity[x] > PURITY_MIN)));
                }
            },
        );
    }

    /// Overwrites the first fit in the cells that keep the second one.
    fn keep(&mut self, scene: &Scene<'_>) {
        let Textured { maps: second, kept } = &self.textured;
        self.maps.fill::<{ map::COUNT }>(scene.grid, |row, lines| {
            for (k, line) in lines.into_iter().enumerate() {
                let fits = line.iter_mut().zip(second.line(row, k)).zip(kept.line(row, 0));
                fits.filter(|(_, kept)| **kept > 0.0).for_each(|((out, second), _)| *out = *second);
            }
        });
    }

    /// Phase and modulation of the pixels of cells that keep the second fit.
    fn correct(&self, scene: &Scene<'_>, Lit { lit, least }: Lit<'_>, out: PixelMaps<'_>) {
        let grid = scene.grid;
        let rows = out.phase.par_chunks_mut(grid.stride).zip(out.modulation.par_chunks_mut(grid.stride));
        rows.enumerate().for_each_init(
            || self.slots.take(),
            |slot, (y, (phase, modulation))| {
                let kept = self.textured.kept.line(y / grid.step, 0);
                if kept.iter().all(|kept| *kept == 0.0) {
                    return;
                }
                let Rows { maps, cos, sin, albedo: [albedo, ..], signal, total, .. } = &mut slot.rows;
                self.carrier.row(scene, y, maps, [cos, sin]);
                self.carrier.albedo(scene, y, maps, [cos, sin], albedo);
                let [weakest, mean] = maps.sample(grid, &self.maps, map::WEAKEST, y);
                let strength = StrengthRows { weakest, mean, lit: scene.row(lit, y), albedo };
                [&mut *signal, &mut *total].into_iter().for_each(|row| row.resize(grid.stride, 0.0));
                finish_row([cos, sin], &strength, least, signal, total);
                for (column, _) in kept.iter().enumerate().filter(|(_, kept)| **kept > 0.0) {
                    let pixels = column * grid.step..(column + 1) * grid.step;
                    phase[pixels.clone()].copy_from_slice(&signal[pixels.clone()]);
                    modulation[pixels.clone()].copy_from_slice(&total[pixels]);
                }
            },
        );
    }
}

/// Adds to term `number` what a model leaves of the light of each pixel with the albedo that suits it best, and once their weight.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn add_misfit(
    model: [ChannelRows; 4],
    phasor: [&[f32]; 2],
    light: [&[f32]; 4],
    usable: &[f32],
    number: usize,
    sums: &mut [[Lanes; compared::COUNT]],
) {
    let model = model.map(|rows| [rows.a, rows.p, rows.q].map(lanes));
    let (phasor, light, usable) = (phasor.map(lanes), light.map(lanes), lanes(usable));
    for (i, sums) in sums.iter_mut().enumerate() {
        let light = take(&light, i);
        let Products { with_light, squared } = products(&model, take(&phasor, i), light, i);
        let mut terms = [[0.0; LANES]; compared::COUNT];
        for x in 0..LANES {
            let square = light.iter().map(|light| light[x] * light[x]).sum::<f32>();
            terms[compared::WEIGHT][x] = if number == compared::FIRST { usable[i][x] } else { 0.0 };
            terms[number][x] = usable[i][x] * (square - with_light[x] * with_light[x] / squared[x]);
        }
        add(sums, &terms);
    }
}
