//! Both bands on fringes of varying period.

use super::*;
use std::f32::consts::TAU;

/// Fringes whose local frequency swings between (1 - s) and (1 + s) times the carrier.
fn swinging(s: f32) -> (Array2<f32>, Vec<f32>) {
    let phase: Vec<f32> =
        (0..1024).map(|x| TAU * x as f32 / 32.0 + s * 8.0 * (TAU * x as f32 / 256.0).sin()).collect();
    let image = Array2::from_shape_fn((1, 1024), |(_, x)| 0.5 + 0.4 * phase[x].cos());
    (image, phase)
}

fn rms(found: &Array2<f32>, phase: &[f32]) -> f32 {
    let errors = (64..960).map(|x| crate::parallel::angle::wrap(found[[0, x]] - phase[x]));
    (errors.map(|e| e * e).sum::<f32>() / 896.0).sqrt()
}

#[test]
fn the_improved_band_follows_slopes_where_the_traditional_one_fails() {
    for (swing, bound) in [(0.5, 0.02), (0.75, 0.1)] {
        let (image, phase) = swinging(swing);
        // A moving mean over a period would remove most of the slow fringes as background.
        let run = |band| fourier(image.view(), band, Background::MeanEnvelope, 32.0).unwrap();
        let old = rms(&run(Band::Traditional), &phase);
        let new = rms(&run(Band::Improved), &phase);
        assert!(old > 0.1, "{old}");
        assert!(new < bound && new < old / 5.0, "{new} against {old}");
    }
}

#[test]
fn gentle_slopes_are_right_either_way() {
    let (image, phase) = swinging(0.1);
    for band in [Band::Traditional, Band::Improved] {
        let found = fourier(image.view(), band, Background::MeanEnvelope, 32.0).unwrap();
        assert!(rms(&found, &phase) < 0.02, "{band:?} {}", rms(&found, &phase));
    }
}
