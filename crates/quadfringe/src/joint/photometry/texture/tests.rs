use super::*;
use crate::joint::photometry::edge::{ALBEDO, EDGE, Edge, RATIOS};

const CONTRASTS: [f32; 4] = [0.8, 0.7, 0.9, 0.6];
const INKS: [[f32; 4]; 2] = [[0.5, 0.2, 0.6, 0.4], [0.3, 0.5, 0.2, 0.4]];

/// The albedo found for a print of two inks that meet.
struct Print {
    edge: Edge,
    albedo: PixelAlbedo,
}

impl Print {
    fn new(noise: f32, usable: impl Fn(usize) -> f32) -> Self {
        let texture = |ink: [f32; 4]| {
            std::array::from_fn(|k| ink[k / 2] * if k % 2 == 0 { 1.0 } else { CONTRASTS[k / 2] })
        };
        let edge = Edge::new(INKS.map(texture), noise);
        let usable: Vec<f32> = (0..edge.grid.pixels()).map(usable).collect();
        let (modulation, mut sums) = (edge.plane(0.2), CellMaps::default());
        let mut albedo = PixelAlbedo::default();
        let how = (RATIOS, &Slopes::flat(&edge.grid));
        let pixels = [edge.phase.as_slice(), &modulation];
        let cells = (&edge.grid, &edge.maps);
        albedo.measure(cells, &edge.scene(&usable), how, pixels, noise, &mut sums);
        Self { edge, albedo }
    }

    /// Offset and amplitude of a channel in row 30, divided by their true values.
    fn ratios(&self, c: usize, columns: impl Iterator<Item = usize>) -> Vec<[f32; 2]> {
        let mut maps = RowMaps::default();
        let rows = self.albedo.sample(&self.edge.grid, 30, &mut maps);
        let ratio = |x: usize, k: usize| rows[k][x] / (ALBEDO * self.edge.texture(x)[k]);
        columns.map(|x| [ratio(x, 2 * c), ratio(x, 2 * c + 1)]).collect()
    }
}

#[test]
fn near_an_edge_every_pixel_has_the_albedo_of_its_side() {
    let print = Print::new(1e-3, |_| 1.0);
    for c in 0..4 {
        // In the two columns at the edge, a pixel and its neighbours see both inks.
        let columns = (20..236).filter(|x| !(EDGE - 1..=EDGE).contains(x));
        for (at, ratios) in print.ratios(c, columns).into_iter().enumerate() {
            assert!(ratios.iter().all(|ratio| (ratio - 1.0).abs() < 0.03), "{c} {at} {ratios:?}");
        }
    }
}

#[test]
fn albedos_are_means_where_pixels_differ_by_noise() {
    let noise = 0.02;
    let print = Print::new(noise, |_| 1.0);
    for c in 0..4 {
        let errors = print.ratios(c, 24..108).into_iter().map(|[a, _]| (a - 1.0).powi(2));
        let rms = (errors.sum::<f32>() / 84.0).sqrt();
        // The albedo of one pixel has the relative error noise / light; the mean is over hundreds of pixels.
        assert!(rms < 0.25 * noise / (ALBEDO * INKS[0][c]), "{c} {rms}");
    }
}

#[test]
fn unusable_pixels_take_the_albedo_around_them() {
    let hole = |i: usize| (28..33).contains(&(i / 256)) && (60..65).contains(&(i % 256));
    let print = Print::new(1e-3, |i| if hole(i) { 0.0 } else { 1.0 });
    for c in 0..4 {
        for [a, b] in print.ratios(c, 58..67) {
            assert!((a - 1.0).abs() < 0.02 && (b - 1.0).abs() < 0.02, "{c} {a} {b}");
        }
    }
}
