//! The fringe period in camera pixels, estimated from the quarter period between R and B.
//!
//! With R = a + b cos(phi) and B = a - b sin(phi), the cross-spectrum of R and B at the carrier is -i b^2 / 4. Its
//! imaginary part, the quadrature spectrum (Bendat and Piersol, Random Data), holds the fringes alone
//! (J28). What R and B share, as the outline of an object, its albedo and room light, makes the real part. What each has by
//! itself, as noise, has no fixed phase and averages out over lines.
//!
//! The carrier of a direction is the band with the greatest sum of the quadrature spectrum. The width of the band is a
//! ratio, because the period changes by a ratio over tilted and curved surfaces. The sum keeps its sign, so that parts
//! without a fixed phase cancel; its sign tells only in which direction the phase grows. Rows and columns cross the same
//! fringes, so a direction whose sum is far below that of the other crosses none.
//!
//! Each place counts by whether it shows fringes, not by its brightness (`even_weights`). If only a small part of the frame shows any,
//! the carrier is that of the part.

use super::band::Waves;
use super::carrier::{Carrier, LineTransform};
use super::even_weights::EvenWeights;
use super::lit_carrier::SmallPart;
use super::params::{
    CARRIER_CYCLES_MIN, CARRIER_LINES, CARRIER_POWER_MIN, DIRECTION_SHARE_MIN, MEAN_STRIDE, SMALL_PART,
};
use ndarray::{Array1, ArrayView2};

/// The carrier of the fringes that R and B show a quarter period apart, in linear light of equal shapes.
///
/// The images may have different gains, and fringes only in a part. NaN is replaced by the mean of its line.
///
/// ```
/// use ndarray::Array2;
/// use quadfringe::stages::quadrature_carrier;
/// use std::f32::consts::TAU;
/// let object = |y: usize, x: usize| if y.abs_diff(60) < 30 && x.abs_diff(300) < 80 { 1.0 } else { 0.0 };
/// let image = |shift: f32| {
///     Array2::from_shape_fn((128, 512), |(y, x)| object(y, x) * (2.0 + (x as f32 * TAU / 20.0 + shift).cos()))
/// };
/// let found = quadrature_carrier(image(0.0).view(), image(TAU / 4.0).view());
/// assert!((found.period_px() - 20.0).abs() < 0.5);
/// ```
#[must_use]
pub fn quadrature_carrier(red: ArrayView2<'_, f32>, blue: ArrayView2<'_, f32>) -> Carrier {
    let even = EvenWeights::of(red, blue);
    let part = if even.shown > SMALL_PART { None } else { SmallPart::of(red, blue) };
    let of_part = part.map(|part| stronger(part.waves(red, blue)));
    of_part.filter(|carrier| carrier.period_px().is_finite()).unwrap_or_else(|| {
        let along_rows = || line_waves(red, blue, |y, x| even.at(y, x));
        let along_columns = || line_waves(red.reversed_axes(), blue.reversed_axes(), |x, y| even.at(y, x));
        stronger(rayon::join(along_rows, along_columns).into())
    })
}

/// The carrier of waves along rows and along columns, of which the weaker may cross no fringes.
fn stronger([row, column]: [Waves; 2]) -> Carrier {
    let least = DIRECTION_SHARE_MIN * row.strength.max(column.strength);
    let [row_px, column_px] = [row, column].map(|found| match found.strength {
        strength if strength > 0.0 && strength >= least => found.period_px,
        _ => f64::INFINITY,
    });
    Carrier { row_px, column_px }
}

/// The carrier of the fringes of three images without a quadrature: `first`, and two `others` with other fringe numbers, in linear
/// light of equal shapes. It is found in the differences to the first image, in which the outline of an object, its grey albedo
/// and room light cancel, and lies between the carriers of the three.
///
/// NaN is replaced by the mean of its line.
///
/// ```
/// use ndarray::Array2;
/// use quadfringe::stages::difference_carrier;
/// use std::f32::consts::TAU;
/// let object = |y: usize, x: usize| if y.abs_diff(60) < 30 && x.abs_diff(300) < 80 { 1.0 } else { 0.0 };
/// let image = |period: f32| {
///     Array2::from_shape_fn((128, 512), |(y, x)| object(y, x) * (2.0 + (x as f32 * TAU / period).cos()))
/// };
/// let [red, green, blue] = [20.0, 20.6, 24.0].map(image);
/// let found = difference_carrier(red.view(), [green.view(), blue.view()]);
/// assert!((20.0..24.0).contains(&found.period_px()));
/// ```
#[must_use]
pub fn difference_carrier(first: ArrayView2<'_, f32>, others: [ArrayView2<'_, f32>; 2]) -> Carrier {
    let along_columns = || difference_waves(first.reversed_axes(), others.map(|other| other.reversed_axes()));
    stronger(rayon::join(|| difference_waves(first, others), along_columns).into())
}

/// The strongest waves along the lines of R and B. `weight` is that of a pixel, by its line and its place in the line.
fn line_waves(
    red: ArrayView2<'_, f32>,
    blue: ArrayView2<'_, f32>,
    weight: impl Fn(usize, usize) -> f32,
) -> Waves {
    let (lines, length) = red.dim();
    if length < 4 * CARRIER_CYCLES_MIN {
        return Waves::default();
    }
    let [mut r, mut b] = [(); 2].map(|()| LineTransform::new(length));
    let (mut quadrature, mut level) = (vec![0.0; length / 2 + 1], 0.0);
    let sampled = (0..lines).step_by(lines.div_ceil(CARRIER_LINES).max(1));
    let count = sampled.len() as f64;
    let mut weighted = Array1::zeros(length);
    let mut run = |transform: &mut LineTransform, image: ArrayView2<'_, f32>, line: usize| {
        let pixels = weighted.iter_mut().zip(image.row(line)).enumerate();
        pixels.for_each(|(at, (out, light))| *out = weight(line, at) * light);
        transform.run(weighted.view())
    };
    for line in sampled {
        let means = run(&mut r, red, line) * run(&mut b, blue, line);
        level += means * (length as f32).powi(2);
        for (sum, (r, b)) in quadrature.iter_mut().zip(r.spectrum.iter().zip(&b.spectrum)) {
            *sum += (r * b.conj()).im;
        }
    }
    Waves::strongest(&quadrature, CARRIER_POWER_MIN * level, count)
}

fn difference_waves(first: ArrayView2<'_, f32>, others: [ArrayView2<'_, f32>; 2]) -> Waves {
    let (lines, length) = first.dim();
    if length < 4 * CARRIER_CYCLES_MIN {
        return Waves::default();
    }
    let mean = |image: ArrayView2<'_, f32>| {
        image.iter().step_by(MEAN_STRIDE).filter(|light| light.is_finite()).sum::<f32>()
    };
    let gains = others.map(|other| mean(first) / mean(other).max(f32::MIN_POSITIVE));
    let [mut one, mut two] = [(); 2].map(|()| LineTransform::new(length));
    let (mut power, mut level) = (vec![0.0; length / 2 + 1], 0.0);
    let sampled = (0..lines).step_by(lines.div_ceil(CARRIER_LINES).max(1));
    let count = sampled.len() as f64;
    for line in sampled {
        let middle = one.run(first.row(line));
        level += (middle * length as f32).powi(2);
        for (other, gain) in others.iter().zip(gains) {
            two.run(other.row(line));
            for (sum, (a, b)) in power.iter_mut().zip(one.spectrum.iter().zip(&two.spectrum)) {
                *sum += (a - b * gain).norm_sqr();
            }
        }
    }
    Waves::strongest(&power, CARRIER_POWER_MIN * level, count)
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::Array2;
    use std::f32::consts::TAU;

    const SHAPE: (usize, usize) = (384, 512);

    /// Even noise of variance 1, the same for the same pixel and seed.
    fn noise(y: usize, x: usize, seed: u64) -> f32 {
        let mut bits = (y as u64) << 40 ^ (x as u64) << 20 ^ seed.wrapping_mul(0x9e37_79b9_7f4a_7c15);
        for _ in 0..3 {
            bits = (bits ^ bits >> 29).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        }
        ((bits >> 40) as f32 / (1u64 << 24) as f32 - 0.5) * 12f32.sqrt()
    }

    /// R and B of an albedo under fringes with contrast 0.3, and 1 % noise.
    fn shot(phase: impl Fn(f32, f32) -> f32, albedo: impl Fn(usize, f32, f32) -> f32) -> [Array2<f32>; 2] {
        [0, 1].map(|channel| {
            Array2::from_shape_fn(SHAPE, |(y, x)| {
                let (along, down) = (x as f32, y as f32);
                let fringes = 1.0 + 0.3 * (phase(along, down) + channel as f32 * TAU / 4.0).cos();
                0.7 * albedo(channel, along, down) * fringes + 0.01 * noise(y, x, channel as u64)
            })
        })
    }

    fn inclined(period: f32, degrees: f32) -> impl Fn(f32, f32) -> f32 {
        let (sine, cosine) = degrees.to_radians().sin_cos();
        move |x, y| TAU * (x * cosine + y * sine) / period
    }

    /// An ellipse that fills this share of the frame, on black.
    fn object(share: f32) -> impl Fn(usize, f32, f32) -> f32 {
        let radius = (share * (SHAPE.0 * SHAPE.1) as f32 / (TAU / 2.0)).sqrt();
        move |_, x, y| f32::from(u8::from(((x - 220.0) / 1.1).hypot((y - 190.0) * 1.1) < radius))
    }

    fn ratio([red, blue]: &[Array2<f32>; 2], period: f32) -> f64 {
        quadrature_carrier(red.view(), blue.view()).period_px() / f64::from(period)
    }

    #[test]
    fn fringes_on_a_small_object_are_found_within_a_third() {
        for degrees in [0.0, 20.0, 45.0] {
            for (share, longest) in [(0.02, 50.0), (0.05, 78.0), (0.2, 78.0), (1.0, 78.0)] {
                for period in [8.0, 20.0, 33.0, 50.0, 78.0].into_iter().filter(|&p| p <= longest) {
                    let found = ratio(&shot(inclined(period, degrees), object(share)), period);
                    let of = format!("{found} of {period} px, {degrees} degrees, {share} of the frame");
                    assert!((0.75..1.34).contains(&found), "{of}");
                }
            }
        }
    }

    #[test]
    fn bright_objects_on_a_dim_ground_do_not_outweigh_it() {
        // Inclined bars on a ground of a tenth of their albedo, with fringes of two thirds of its period.
        let on_bar = |x: f32, y: f32| (x + 0.5 * y) % 90.0 < 10.0;
        let phase = |x: f32, y: f32| TAU * x / if on_bar(x, y) { 20.0 } else { 30.0 };
        let found = ratio(&shot(phase, |_, x, y| if on_bar(x, y) { 1.0 } else { 0.1 }), 30.0);
        assert!((found - 1.0).abs() < 0.1, "{found}");
    }

    #[test]
    fn shades_of_an_image_without_noise_are_no_fringes() {
        // A small object before a ground whose light changes a little along the fringes, in red more than in blue.
        let lit = object(0.05);
        let light = |channel: usize, y: f32, x: f32| {
            let fringes = 1.0 + 0.3 * (TAU * x / 20.0 + channel as f32 * TAU / 4.0).cos();
            let shade = 1e-3 * (1.0 + channel as f32) * (TAU * y / 90.0 + channel as f32).cos();
            0.002 + shade + 0.7 * lit(channel, x, y) * fringes
        };
        let images = [0, 1].map(|c| Array2::from_shape_fn(SHAPE, |(y, x)| light(c, y as f32, x as f32)));
        let found = ratio(&images, 20.0);
        assert!((found - 1.0).abs() < 0.1, "{found}");
    }

    #[test]
    fn prints_of_other_colours_hide_no_fringes() {
        let colour = |channel: usize, x: f32, y: f32| {
            let patch = (x as usize / 48) * 31 + (y as usize / 48) * 17;
            0.3 + 0.2 * noise(patch, channel, 7)
        };
        for period in [8.0, 20.0, 33.0] {
            let found = ratio(&shot(inclined(period, 5.0), colour), period);
            assert!((0.75..1.34).contains(&found), "{found} of {period} px");
        }
    }

    #[test]
    fn a_period_that_doubles_over_the_frame_has_a_central_value() {
        // The frequency falls from 1 / 16 to 1 / 32 over the row.
        let phase = |x: f32, _: f32| TAU * (x / 16.0 - x * x / (64.0 * SHAPE.1 as f32));
        let found = ratio(&shot(phase, |_, _, _| 1.0), 1.0);
        assert!((16.0..32.0).contains(&found), "{found}");
    }

    #[test]
    fn the_period_of_a_white_frame_is_exact() {
        for degrees in [0.0, 10.0, 20.0, 30.0] {
            let found = ratio(&shot(inclined(25.0, degrees), |_, _, _| 1.0), 25.0);
            assert!((found - 1.0).abs() < 0.03, "{found} at {degrees} degrees");
        }
    }

    #[test]
    fn three_colours_without_a_quadrature_have_a_carrier() {
        for degrees in [0.0, 20.0, 45.0] {
            for share in [0.02, 0.2, 1.0] {
                let period = 20.0;
                let images = [1.0, 35.0 / 36.0, 30.0 / 36.0].map(|ratio| {
                    let [red, _] = shot(inclined(period / ratio, degrees), object(share));
                    red
                });
                let [red, green, blue] = images.each_ref().map(|image| image.view());
                let found = difference_carrier(red, [green, blue]).period_px() / f64::from(period);
                assert!((0.75..1.34).contains(&found), "{found} at {degrees} degrees, {share} of the frame");
            }
        }
        let same = shot(|_, _| 0.0, object(0.2)).map(|image| image);
        assert!(difference_carrier(same[0].view(), [same[0].view(); 2]).period_px().is_infinite());
    }

    #[test]
    fn images_without_fringes_have_no_carrier() {
        let plain = shot(|_, _| 0.0, object(0.2));
        assert!(ratio(&plain, 1.0).is_infinite());
        let same = [plain[0].clone(), plain[0].clone()];
        assert!(ratio(&same, 1.0).is_infinite());
    }
}
