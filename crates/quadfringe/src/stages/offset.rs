//! By which angle fringes lie off a phase that is known, in tiles of pixels.
//!
//! The light of a tile with the albedo `b` is `b (a + p cos t - q sin t)` at the phase `t`. Least squares give `a`, `p` and `q`, and
//! the fringes lie off the phase by `atan2(q, p)`. Where R and B are a quarter period apart, they show the albedo of every pixel
//! ([`shared_brightness`]), so that texture that all channels share does not move the fringes of the others.

use super::params::{BRIGHT_RATIO_MIN, BRIGHT_SQUARE_MIN, OFFSET_RIDGE, SHARED_LEFT_MAX};
use crate::parallel::angle::sin_cos;
use crate::parallel::lanes::{LANES, Lanes, lanes, lanes_mut};
use crate::{Error, Result};
use multiversion::multiversion;
use ndarray::{Array1, Array2, ArrayView1, ArrayView2, Zip};

/// Rows of one tile, padded to whole vectors.
#[derive(Debug, Default)]
struct Rows {
    /// Terms whose sum is fitted to the light.
    terms: [Vec<f32>; 3],
    light: Vec<f32>,
    phase: Vec<f32>,
}

impl Rows {
    /// Light and phase of a tile, and the terms `1, cos t, -sin t`.
    fn load(&mut self, light: impl Iterator<Item = f32>, phase: ArrayView1<'_, f32>) {
        let Self { terms, light: light_row, phase: phase_row } = self;
        fill(light_row, light);
        fill(phase_row, phase.iter().copied());
        terms.iter_mut().for_each(|row| row.resize(light_row.len(), 0.0));
        waves(lanes_mut(light_row), lanes(phase_row), terms.each_mut().map(|row| lanes_mut(row)));
    }

    fn fit(&self) -> Fit {
        let (terms, light) = (self.terms.each_ref().map(|row| lanes(row)), lanes(&self.light));
        let factors = solve(sums(terms, light));
        Fit { factors, left: squares_left(terms, light, factors.map(|factor| factor as f32)) }
    }
}

/// The sum of terms that comes nearest to the light.
struct Fit {
    factors: [f64; 3],
    /// Sum of the squares that it leaves.
    left: f64,
}

impl Fit {
    /// The angle of fringes off their phase.
    fn angle_rad(&self) -> f64 {
        let [_, p, q] = self.factors;
        q.atan2(p)
    }
}

/// Fills a row, and pads it with NaN.
fn fill(row: &mut Vec<f32>, values: impl Iterator<Item = f32>) {
    row.clear();
    row.extend(values);
    row.resize(row.len().next_multiple_of(LANES), f32::NAN);
}

/// Terms of fringes at a phase. Where it or the light is not finite, all become 0.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn waves(light: &mut [Lanes], phase: &[Lanes], [one, cosine, sine]: [&mut [Lanes]; 3]) {
    for i in 0..phase.len() {
        let (seen, phase) = (light[i], phase[i]);
        let mut found = [[0.0; LANES]; 4];
        for x in 0..LANES {
            let known = seen[x].is_finite() & phase[x].is_finite();
            let (s, c) = sin_cos(if known { phase[x] } else { 0.0 });
            let terms = [seen[x], 1.0, c, -s];
            for k in 0..4 {
                found[k][x] = if known { terms[k] } else { 0.0 };
            }
        }
        [light[i], one[i], cosine[i], sine[i]] = found;
    }
}

/// The angle in rad, `(tiles,)`, by which fringes lie off the phase in rad, `(tiles, pixels)`, in linear light of the same shape.
///
/// A tile has one albedo, or that of `brightness` up to a factor, whichever explains its light better. A pixel that is NaN in light or
/// phase does not count; a tile without any gives 0.
///
/// # Errors
/// [`Error::Shape`] when the shapes differ.
///
/// ```
/// use ndarray::Array2;
/// use quadfringe::stages::fringe_offsets;
/// let phase = Array2::from_shape_fn((2, 200), |(_, x)| 0.1 * x as f32);
/// let light = phase.mapv(|t| 0.4 + 0.3 * (t + 0.25).cos());
/// let off = fringe_offsets(light.view(), phase.view(), None)?;
/// assert!(off.iter().all(|angle| (angle - 0.25).abs() < 1e-4));
/// # Ok::<(), quadfringe::Error>(())
/// ```
pub fn fringe_offsets(
    light: ArrayView2<'_, f32>,
    phase_rad: ArrayView2<'_, f32>,
    brightness: Option<ArrayView2<'_, f32>>,
) -> Result<Array1<f64>> {
    check("phase_rad", phase_rad, light)?;
    brightness.map_or(Ok(()), |brightness| check("brightness", brightness, light))?;
    let mut rows = Rows::default();
    let mut off = |tile: usize| {
        rows.load(light.row(tile).iter().copied(), phase_rad.row(tile));
        let alone = rows.fit();
        let Some(brightness) = brightness else { return alone.angle_rad() };
        for row in &mut rows.terms {
            row.iter_mut().zip(brightness.row(tile)).for_each(|(term, brightness)| *term *= brightness);
        }
        let shared = rows.fit();
        if shared.left < SHARED_LEFT_MAX * alone.left { shared.angle_rad() } else { alone.angle_rad() }
    };
    Ok((0..light.nrows()).map(&mut off).collect())
}

/// The brightness of the pixels of tiles, `(tiles, pixels)`: the albedo that all channels have in common, up to a factor. It is 0 for a
/// pixel that is NaN in R, B or the phase in rad.
///
/// With `R = b (1 + m cos t)` and `B = g b (1 - n sin t)` the brightness `b` drops out of `g R (1 - n sin t) = B (1 + m cos t)`. Least
/// squares give `1 / g`, `m / g` and `n`; then `b` follows from both channels.
///
/// # Errors
/// [`Error::Shape`] when the shapes differ.
///
/// ```
/// use ndarray::Array2;
/// use quadfringe::stages::shared_brightness;
/// let phase = Array2::from_shape_fn((1, 200), |(_, x)| 0.1 * x as f32);
/// let albedo = Array2::from_shape_fn((1, 200), |(_, x)| if x < 90 { 0.8 } else { 0.2 });
/// let red = &albedo * &phase.mapv(|t| 1.0 + 0.3 * t.cos());
/// let blue = &albedo * &phase.mapv(|t| 1.0 - 0.3 * t.sin());
/// let found = shared_brightness(red.view(), blue.view(), phase.view())?;
/// assert!((found[[0, 10]] / found[[0, 150]] - 4.0).abs() < 0.02);
/// # Ok::<(), quadfringe::Error>(())
/// ```
pub fn shared_brightness(
    red: ArrayView2<'_, f32>,
    blue: ArrayView2<'_, f32>,
    phase_rad: ArrayView2<'_, f32>,
) -> Result<Array2<f32>> {
    check("blue", blue, red)?;
    check("phase_rad", phase_rad, red)?;
    let mut out = Array2::zeros(red.raw_dim());
    let (mut seen, mut fitted) = (Rows::default(), Rows::default());
    let tiles = Zip::from(out.outer_iter_mut()).and(red.outer_iter()).and(blue.outer_iter());
    tiles.and(phase_rad.outer_iter()).for_each(|mut out, red, blue, phase_rad| {
        let of_both = red.iter().zip(blue).map(|(red, blue)| if blue.is_finite() { *red } else { f32::NAN });
        seen.load(of_both, phase_rad);
        let Rows { terms: [known, cosines, sines], light, .. } = &seen;
        fitted.light.clone_from(light);
        fitted.terms.iter_mut().for_each(|row| row.clone_from(known));
        let [ratio_terms, red_terms, blue_terms] = &mut fitted.terms;
        for (x, &blue) in blue.iter().enumerate().filter(|(x, _)| known[*x] > 0.0) {
            (ratio_terms[x], red_terms[x], blue_terms[x]) = (blue, blue * cosines[x], -light[x] * sines[x]);
        }
        let [ratio, of_red, of_blue] = fitted.fit().factors;
        let ratio = (ratio as f32).max(BRIGHT_RATIO_MIN);
        let (of_red, of_blue) = ((of_red as f32 / ratio).clamp(0.0, 1.0), (of_blue as f32).clamp(0.0, 1.0));
        for (x, (out, blue)) in out.iter_mut().zip(blue).enumerate().filter(|(x, _)| known[*x] > 0.0) {
            let (by_red, by_blue) = (1.0 + of_red * cosines[x], (1.0 + of_blue * sines[x]) / ratio);
            *out = (light[x] * by_red + blue * by_blue)
                / (by_red * by_red + by_blue * by_blue + BRIGHT_SQUARE_MIN);
        }
    });
    Ok(out)
}

fn check(what: &'static str, array: ArrayView2<'_, f32>, like: ArrayView2<'_, f32>) -> Result<()> {
    if array.dim() == like.dim() { Ok(()) } else { Err(Error::shape(what, like.shape(), array.shape())) }
}

/// Sums of the products of the terms with each other, row by row of their matrix, then with the light.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn sums([a, b, c]: [&[Lanes]; 3], light: &[Lanes]) -> [f64; 9] {
    let mut sums = [[0.0f32; LANES]; 9];
    for (((a, b), c), light) in a.iter().zip(b).zip(c).zip(light) {
        for x in 0..LANES {
            let terms = [a[x], b[x], c[x]];
            let products = [
                terms[0] * terms[0],
                terms[0] * terms[1],
                terms[0] * terms[2],
                terms[1] * terms[1],
                terms[1] * terms[2],
                terms[2] * terms[2],
                terms[0] * light[x],
                terms[1] * light[x],
                terms[2] * light[x],
            ];
            for k in 0..9 {
                sums[k][x] += products[k];
            }
        }
    }
    sums.map(|lanes| lanes.iter().map(|&value| f64::from(value)).sum())
}

/// Solution of the normal equations by the adjugate of their matrix.
fn solve([aa, ab, ac, bb, bc, cc, al, bl, cl]: [f64; 9]) -> [f64; 3] {
    let (aa, bb, cc) = (aa + OFFSET_RIDGE, bb + OFFSET_RIDGE, cc + OFFSET_RIDGE);
    let (xx, xy, xz) = (bb * cc - bc * bc, ac * bc - ab * cc, ab * bc - ac * bb);
    let (yy, yz, zz) = (aa * cc - ac * ac, ab * ac - aa * bc, aa * bb - ab * ab);
    let scale = 1.0 / (aa * xx + ab * xy + ac * xz);
    [
        scale * (xx * al + xy * bl + xz * cl),
        scale * (xy * al + yy * bl + yz * cl),
        scale * (xz * al + yz * bl + zz * cl),
    ]
}

/// Sum of the squared differences between the light and the sum of the terms with these factors.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn squares_left([a, b, c]: [&[Lanes]; 3], light: &[Lanes], factors: [f32; 3]) -> f64 {
    let mut sum = [0.0f32; LANES];
    for (((a, b), c), light) in a.iter().zip(b).zip(c).zip(light) {
        for x in 0..LANES {
            let left = light[x] - (factors[0] * a[x] + factors[1] * b[x] + factors[2] * c[x]);
            sum[x] += left * left;
        }
    }
    sum.iter().map(|&value| f64::from(value)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Phase, and an albedo in steps, of two tiles; their number of pixels is no multiple of a vector.
    fn tiles() -> [Array2<f32>; 2] {
        let phase = Array2::from_shape_fn((2, 203), |(tile, x)| 40.0 + 0.13 * x as f32 + tile as f32);
        let albedo = Array2::from_shape_fn((2, 203), |(_, x)| [0.9, 0.3, 0.6, 0.2][x / 23 % 4]);
        [phase, albedo]
    }

    #[test]
    fn pixels_without_data_do_not_count() {
        let [phase, _] = tiles();
        let mut light = phase.mapv(|t| 0.5 + 0.2 * (t - 0.4).cos());
        light.row_mut(0).iter_mut().step_by(3).for_each(|light| *light = f32::NAN);
        light.row_mut(1).fill(f32::NAN);
        let off = fringe_offsets(light.view(), phase.view(), None).unwrap();
        assert!((off[0] + 0.4).abs() < 1e-4 && off[1] == 0.0, "{off}");
    }

    #[test]
    fn texture_that_all_channels_share_moves_no_fringes() {
        let [phase, albedo] = tiles();
        let red = &albedo * &phase.mapv(|t| 0.5 + 0.15 * t.cos());
        let blue = &albedo * &phase.mapv(|t| 0.4 - 0.12 * t.sin());
        let green = &albedo * &phase.mapv(|t| 0.6 + 0.2 * (t + 0.3).cos());
        let brightness = shared_brightness(red.view(), blue.view(), phase.view()).unwrap();
        let alone = fringe_offsets(green.view(), phase.view(), None).unwrap();
        let shared = fringe_offsets(green.view(), phase.view(), Some(brightness.view())).unwrap();
        assert!(shared.iter().all(|angle| (angle - 0.3).abs() < 2e-3), "{shared}");
        assert!(alone.iter().all(|angle| (angle - 0.3).abs() > 0.02), "{alone}");
    }

    #[test]
    fn a_brightness_that_explains_little_is_not_taken() {
        let [phase, albedo] = tiles();
        // The channel has another texture, so that the brightness of the others leaves as much as one albedo does.
        let green = &albedo.slice(ndarray::s![.., ..;-1]) * &phase.mapv(|t| 0.6 + 0.2 * (t + 0.3).cos());
        let alone = fringe_offsets(green.view(), phase.view(), None).unwrap();
        assert_eq!(fringe_offsets(green.view(), phase.view(), Some(albedo.view())).unwrap(), alone);
    }

    #[test]
    fn arrays_of_other_shapes_are_an_error() {
        let [phase, albedo] = tiles();
        let short = albedo.slice(ndarray::s![.., ..200]);
        let wrong = |found: Option<Error>| assert!(matches!(found, Some(Error::Shape { .. })), "{found:?}");
        wrong(fringe_offsets(albedo.view(), phase.slice(ndarray::s![..1, ..]), None).err());
        wrong(fringe_offsets(albedo.view(), phase.view(), Some(short)).err());
        wrong(shared_brightness(albedo.view(), short, phase.view()).err());
    }
}
