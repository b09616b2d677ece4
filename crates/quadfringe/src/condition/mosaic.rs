//! A raw Bayer mosaic as linear R, G and B at every pixel.
//!
//! Each colour is interpolated from its own samples alone: the channels carry different fringes, so that nothing is
//! known about one colour from another. R and B, one sample in two columns and two rows, go half way between samples by
//! Lagrange's polynomial through six of them, row by row and column by column. G, on the squares of one colour of a
//! chessboard, goes half way along both diagonals by the polynomial through four. Both are exact for the mean and weaken
//! fringes by less than a thousandth down to periods of 14 pixels, where the mean of neighbours takes a twentieth.

use super::linear::{Linear, extend, row_of};
use super::{Sample, Shot};
use crate::{BayerPattern, Channel};
use multiversion::multiversion;
use ndarray::ArrayView2;
use rayon::prelude::*;

/// Samples beyond either end of a row of one colour that the interpolation reaches.
const MARGIN: usize = 3;
/// Rows beyond the first and the last that it reaches.
const ROW_MARGIN: usize = 5;
/// Samples of one colour that are worked on at a time, in the nearest cache.
const BLOCK: usize = 64;

/// Linear light of a mosaic with margins: each row as its even columns, then its odd ones.
#[derive(Debug, Clone, Default)]
pub(super) struct Mosaic {
    light: Vec<f32>,
    /// Samples of half a row, margins included.
    half: usize,
    first_red: [usize; 2],
}

impl Mosaic {
    /// Take in the samples of a shot.
    pub fn fill<T: Sample>(&mut self, raw: &ArrayView2<'_, T>, pattern: BayerPattern, linear: &Linear) {
        let (rows, columns) = raw.dim();
        self.first_red = pattern.first_red();
        self.half = columns.div_ceil(2) + 2 * MARGIN;
        let (half, stride) = (self.half, 2 * self.half);
        self.light.resize((rows + 2 * ROW_MARGIN) * stride, 0.0);
        let inner = &mut self.light[ROW_MARGIN * stride..][..rows * stride];
        inner.par_chunks_mut(stride).enumerate().for_each(|(y, line)| {
            let (even, odd) = line.split_at_mut(half);
            let channels = [0, 1].map(|x| pattern.channel(y, x).index());
            let samples = [&mut even[MARGIN..], &mut odd[MARGIN..]];
            linear.row_of_two(channels, &row_of(raw, y), samples);
            extend(even, MARGIN, columns.div_ceil(2));
            extend(odd, MARGIN, columns / 2);
        });
        self.extend_rows(rows);
    }

    /// Rows above and below, mirrored at the first and the last row of the same colours as [`extend`] does.
    fn extend_rows(&mut self, rows: usize) {
        for i in 1..=ROW_MARGIN {
            let first = i % 2;
            let last_alike = rows - 1 - (rows - 1 + first) % 2;
            self.mirror_row(ROW_MARGIN - i, first, (2 * first + i).min(last_alike));
            let beyond = rows - 1 + i;
            let last = rows - 1 - i % 2;
            self.mirror_row(ROW_MARGIN + beyond, last, (2 * last).saturating_sub(beyond).max(beyond % 2));
        }
    }

    /// Line `to` of the store, from the row it is mirrored at and its mirror image.
    fn mirror_row(&mut self, to: usize, at: usize, image: usize) {
        let stride = 2 * self.half;
        let start = |row: usize| (row + ROW_MARGIN) * stride;
        for i in 0..stride {
            self.light[to * stride + i] = 2.0 * self.light[start(at) + i] - self.light[start(image) + i];
        }
    }

    /// Columns of one parity of the row `row_margin + offset` rows from the first.
    fn line(&self, y: usize, offset: isize, parity: usize) -> &[f32] {
        let row = (y + ROW_MARGIN).wrapping_add_signed(offset);
        &self.light[(2 * row + parity) * self.half..][..self.half]
    }

    /// R, G and B at every pixel of row `y`.
    pub fn row(&self, y: usize, [red, green, blue]: [&mut [f32]; 3]) {
        let [row, column] = self.first_red;
        for (out, row, column) in [(red, row, column), (blue, 1 - row, 1 - column)] {
            if y % 2 == row {
                own_row(self.line(y, 0, column), column, out);
            } else {
                let lines = [-5, -3, -1, 1, 3, 5].map(|offset| self.line(y, offset, column));
                row_between(lines, column, out);
            }
        }
        let column = (y + row + column + 1) % 2;
        let near = [-1, 1].map(|offset| self.line(y, offset, 1 - column));
        let alike = [-2, 2].map(|offset| self.line(y, offset, column));
        let far = [-3, 3].map(|offset| self.line(y, offset, 1 - column));
        green_row(self.line(y, 0, column), near, alike, far, column, green);
    }
}

/// R or B in a row that has samples of it, in every other column from `column` on.
#[multiversion(targets("x86_64+avx2"))]
fn own_row(line: &[f32], column: usize, out: &mut [f32]) {
    for (block, out) in out.chunks_mut(2 * BLOCK).enumerate() {
        spread(&line[block * BLOCK..], column, out);
    }
}

/// R or B in a row between rows that have samples of it.
#[multiversion(targets("x86_64+avx2"))]
fn row_between(lines: [&[f32]; 6], column: usize, out: &mut [f32]) {
    let mut line = [0.0; BLOCK + 2 * MARGIN];
    for (block, out) in out.chunks_mut(2 * BLOCK).enumerate() {
        let n = out.len().div_ceil(2) + 2 * MARGIN;
        half_way_each(lines.map(|l| &l[block * BLOCK..][..n]), &mut line[..n]);
        spread(&line, column, out);
    }
}

/// Samples of every other column to every column of a block.
#[inline(always)]
fn spread(line: &[f32], column: usize, out: &mut [f32]) {
    let n = out.len().div_ceil(2);
    let mut between = [0.0; BLOCK];
    let taps = std::array::from_fn(|i| &line[i + 1 - column..][..n]);
    half_way_each(taps, &mut between[..n]);
    interleave([&line[MARGIN..][..n], &between[..n]], column, out);
}

/// Lagrange's polynomial through six samples, half way between the middle two.
#[inline(always)]
fn half_way_each([a, b, c, d, e, f]: [&[f32]; 6], out: &mut [f32]) {
    let n = out.len();
    let (a, b, c, d, e, f) = (&a[..n], &b[..n], &c[..n], &d[..n], &e[..n], &f[..n]);
    for k in 0..n {
        out[k] =
            (150.0 / 256.0) * (c[k] + d[k]) - (25.0 / 256.0) * (b[k] + e[k]) + (3.0 / 256.0) * (a[k] + f[k]);
    }
}

/// Write samples, in every other column from `column` on, and what stands between them.
#[inline(always)]
fn interleave([own, between]: [&[f32]; 2], column: usize, out: &mut [f32]) {
    let [first, second] = if column == 0 { [own, between] } else { [between, own] };
    let mut pairs = out.chunks_exact_mut(2);
    for ((pair, first), second) in (&mut pairs).zip(first).zip(second) {
        (pair[0], pair[1]) = (*first, *second);
    }
    if let [last] = pairs.into_remainder() {
        *last = first[first.len() - 1];
    }
}

/// G in a row whose own samples stand in every other column from `column` on. `near`, `alike` and `far` are the rows one,
/// two and three above and below: the columns that have G.
#[multiversion(targets("x86_64+avx2"))]
fn green_row(
    here: &[f32],
    near: [&[f32]; 2],
    alike: [&[f32]; 2],
    far: [&[f32]; 2],
    column: usize,
    out: &mut [f32],
) {
    let mut between = [0.0; BLOCK];
    for (block, out) in out.chunks_mut(2 * BLOCK).enumerate() {
        let n = out.len().div_ceil(2);
        let start = block * BLOCK + MARGIN;
        // The samples to the left of the pixels between start here, those to the right one later.
        let left = start - column;
        let touching = [
            &here[left..left + n],
            &here[left + 1..left + 1 + n],
            &near[0][start..start + n],
            &near[1][start..start + n],
        ];
        let second = [
            &near[0][start - 1..start - 1 + n],
            &near[0][start + 1..start + 1 + n],
            &near[1][start - 1..start - 1 + n],
            &near[1][start + 1..start + 1 + n],
            &alike[0][left..left + n],
            &alike[0][left + 1..left + 1 + n],
            &alike[1][left..left + n],
            &alike[1][left + 1..left + 1 + n],
        ];
        let third = [
            &here[left - 1..left - 1 + n],
            &here[left + 2..left + 2 + n],
            &far[0][start..start + n],
            &far[1][start..start + n],
        ];
        let between = &mut between[..n];
        for k in 0..n {
            let [a, b, c, d] = touching.map(|tap| tap[k]);
            let [e, f, g, h, i, j, l, m] = second.map(|tap| tap[k]);
            let [o, p, q, r] = third.map(|tap| tap[k]);
            let second = (e + f) + (g + h) + ((i + j) + (l + m));
            between[k] = (81.0 / 256.0) * ((a + b) + (c + d)) - (9.0 / 256.0) * second
                + (1.0 / 256.0) * ((o + p) + (q + r));
        }
        interleave([&here[start..start + n], between], column, out);
    }
}

/// What saturated samples do to row `y`: which pixels take their main share from none, and which take it from
/// saturated samples of R and of B. The farther samples of the interpolation weigh a tenth at most.
pub(super) fn saturation_row<T: Sample>(
    shot: &Shot<'_, T>,
    y: usize,
    limit: f32,
    unsaturated: &mut [bool],
    glare: &mut [bool],
) {
    unsaturated.fill(true);
    glare.fill(false);
    let Some((raw, pattern)) = shot.mosaic() else { return };
    let mut touched = Vec::new();
    for row in y.saturating_sub(1)..(y + 2).min(raw.nrows()) {
        let samples = row_of(&raw, row);
        if samples.iter().fold(false, |found, s| found | (s.intensity() >= limit)) {
            touched.resize(samples.len(), [false; 3]);
            let saturated = samples.iter().enumerate().filter(|(_, s)| s.intensity() >= limit);
            for (x, _) in saturated {
                let channel = pattern.channel(row, x);
                // G goes along the diagonals of its chessboard: from above and below to the pixel itself alone.
                let reach = usize::from(channel != Channel::G || row == y);
                let end = (x + reach + 1).min(samples.len());
                touched[x.saturating_sub(reach)..end].iter_mut().for_each(|t| t[channel.index()] = true);
            }
        }
    }
    for ((unsaturated, glare), [red, green, blue]) in unsaturated.iter_mut().zip(glare).zip(touched) {
        *unsaturated = !(red || green || blue);
        *glare = red && blue;
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Conditioner, linearise};
    use super::*;
    use ndarray::{Array2, s};
    use std::f32::consts::{FRAC_PI_2, TAU};

    /// What a chip of this pattern delivers of three planes.
    fn sampled(planes: &[Array2<f32>; 3], pattern: BayerPattern) -> Array2<f32> {
        Array2::from_shape_fn(planes[0].dim(), |at| planes[pattern.channel(at.0, at.1).index()][at])
    }

    fn developed(planes: &[Array2<f32>; 3], pattern: BayerPattern) -> [Array2<f32>; 3] {
        let raw = sampled(planes, pattern);
        let shot = Shot::bayer(raw.view(), pattern, raw.view()).unwrap();
        let [red, green, blue, _] = linearise(&shot, &Conditioner::default()).unwrap();
        [red, green, blue]
    }

    fn rms(values: impl Iterator<Item = f32>) -> f32 {
        let (sum, count) = values.fold((0.0f64, 0), |(sum, n), v| (sum + f64::from(v).powi(2), n + 1));
        (sum / f64::from(count)).sqrt() as f32
    }

    #[test]
    fn a_ramp_comes_back_up_to_the_borders_in_every_pattern_and_size() {
        for pattern in BayerPattern::ALL {
            for size in [(8, 8), (9, 11), (16, 19), (17, 150), (9, 263)] {
                let ramp =
                    |a: f32, b: f32| Array2::from_shape_fn(size, |(y, x)| 0.3 + a * y as f32 + b * x as f32);
                let planes = [ramp(0.002, 0.001), ramp(-0.003, 0.002), ramp(0.001, -0.001)];
                for (got, expected) in developed(&planes, pattern).iter().zip(&planes) {
                    let worst = got.iter().zip(expected).fold(0.0f32, |w, (a, b)| w.max((a - b).abs()));
                    assert!(worst < 2e-6, "{pattern:?} {size:?}: {worst}");
                }
            }
            let grey = [0.2, 0.5, 0.7].map(|level| Array2::from_elem((2, 3), level));
            for (got, expected) in developed(&grey, pattern).iter().zip(&grey) {
                assert!(got.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-6), "{pattern:?}");
            }
        }
    }

    /// Two-step phase of R and B, amplitude of G, against the truth. The mean of neighbours makes errors of 0.018 rad at
    /// 20 px and 0.075 rad at 10 px.
    #[test]
    fn fringes_keep_phase_and_modulation() {
        let bounds = [(28.0, 2e-5, 3e-4), (20.0, 1.5e-4, 1e-3), (14.0, 1e-3, 4e-3), (10.0, 6e-3, 0.014)];
        for pattern in BayerPattern::ALL {
            for (period_px, phase_max, amplitude_max) in bounds {
                for tilt in [0.0f32, 0.6, 0.8, FRAC_PI_2] {
                    let phase = |y: usize, x: usize| {
                        TAU / period_px * (tilt.cos() * x as f32 + tilt.sin() * y as f32)
                    };
                    let wave = |shift: f32| {
                        Array2::from_shape_fn((64, 160), |(y, x)| 0.5 + 0.4 * (phase(y, x) + shift).cos())
                    };
                    let planes = [wave(0.0), wave(0.3), wave(FRAC_PI_2)];
                    let [red, green, blue] = developed(&planes, pattern);
                    let inner = s![8..-8, 8..-8];
                    let error = Array2::from_shape_fn((64, 160), |(y, x)| {
                        let found = -(blue[[y, x]] - 0.5).atan2(red[[y, x]] - 0.5);
                        (found - phase(y, x) + 40.0 * TAU + TAU / 2.0) % TAU - TAU / 2.0
                    });
                    let phase_rms = rms(error.slice(inner).iter().copied());
                    let change = (&green - &planes[1]) / 0.4;
                    let worst = change.slice(inner).iter().fold(0.0f32, |w, v| w.max(v.abs()));
                    let case = format!("{pattern:?} {period_px} px {tilt}: {phase_rms} rad, {worst}");
                    assert!(phase_rms < phase_max && worst < amplitude_max, "{case}");
                }
            }
        }
    }

    #[test]
    fn noise_is_never_amplified_inside() {
        let mut state = 7u32;
        let mut draw = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1 << 24) as f32 - 0.5
        };
        let planes = [(); 3].map(|()| Array2::from_shape_fn((200, 200), |_| draw()));
        let raw = rms(planes[0].iter().copied());
        for (plane, most) in developed(&planes, BayerPattern::Rggb).iter().zip([0.87, 0.86, 0.87]) {
            assert!(rms(plane.slice(s![6..-6, 6..-6]).iter().copied()) < most * raw);
        }
    }

    #[test]
    fn a_step_overshoots_by_less_than_a_sixth_and_only_near_by() {
        let step = Array2::from_shape_fn((40, 60), |(_, x)| if x < 30 { 0.1 } else { 0.9 });
        for plane in developed(&[step.clone(), step.clone(), step.clone()], BayerPattern::Gbrg) {
            for ((_, x), &v) in plane.indexed_iter() {
                assert!((-0.03..1.03).contains(&v), "{x}: {v}");
                assert!((24..36).contains(&x) || (v - step[[0, x]]).abs() < 1e-6, "{x}: {v}");
            }
        }
    }

    /// Dark level and response belong to raw samples: interpolation comes after.
    #[test]
    fn samples_are_made_linear_before_they_are_mixed() {
        let light = |shift: f32| {
            Array2::from_shape_fn((32, 96), |(y, x)| {
                0.5 + 0.4 * (TAU / 24.0 * (x as f32 + 0.2 * y as f32) + shift).cos()
            })
        };
        let planes = [light(0.0), light(0.7), light(FRAC_PI_2)];
        let bent = planes.clone().map(|plane| plane.mapv(|v| 0.04 + v.sqrt() * 0.9));
        let conditioner = Conditioner {
            dark: [0.04; 4],
            response: [crate::Response { exponent: 2.0, ..Default::default() }; 4],
            ..Conditioner::default()
        };
        let raw = sampled(&bent, BayerPattern::Bggr);
        let shot = Shot::bayer(raw.view(), BayerPattern::Bggr, raw.view()).unwrap();
        let found = linearise(&shot, &conditioner).unwrap();
        for (got, expected) in found.iter().zip(&planes) {
            let inner = s![6..-6, 6..-6];
            let difference = &got.slice(inner) - &expected.mapv(|v| 0.81 * v).slice(inner);
            assert!(difference.iter().all(|d| d.abs() < 2e-4));
        }
    }

    #[test]
    fn saturated_samples_mark_the_pixels_that_live_on_them() {
        let pattern = BayerPattern::Rggb;
        let marked = |at: (usize, usize)| {
            let mut raw = Array2::<u8>::from_elem((12, 12), 100);
            raw[at] = 255;
            let infrared = Array2::from_elem((12, 12), 100u8);
            let shot = Shot::bayer(raw.view(), pattern, infrared.view()).unwrap();
            let mut plan = Conditioner::default().plan().unwrap();
            plan.prepare(&shot);
            let (mut unsaturated, mut glare) = ([true; 12], [true; 12]);
            let mut found = Vec::new();
            for y in 0..12 {
                plan.saturation_row(&shot, y, &mut unsaturated, &mut glare);
                assert_eq!(glare, [false; 12]);
                found.extend((0..12).filter(|&x| !unsaturated[x]).map(|x| (y, x)));
            }
            found
        };
        let square: Vec<_> = (3..6).flat_map(|y| (5..8).map(move |x| (y, x))).collect();
        assert_eq!(marked((4, 6)), square);
        assert_eq!(marked((4, 7)), [(3, 7), (4, 6), (4, 7), (4, 8), (5, 7)]);
        assert_eq!(marked((0, 0)), [(0, 0), (0, 1), (1, 0), (1, 1)]);
    }
}
