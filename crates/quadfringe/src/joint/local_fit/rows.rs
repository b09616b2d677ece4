//! Loops of the fit over one row of pixels or of cells.

use super::normal::Normal;
use crate::joint::cells::RowMaps;
use crate::joint::model::weights;
use crate::joint::params::local_fit::{CONTRAST_MIN, SPREAD_MIN};
use crate::joint::params::phase::ALBEDO_MIN;
use crate::parallel::angle::atan2;
use crate::parallel::lanes::{LANES, Lanes, add, lanes, lanes_mut, put, take};
use multiversion::multiversion;

/// Working rows of one task of the fit.
#[derive(Debug, Default)]
pub(super) struct Rows {
    pub maps: RowMaps,
    pub cos: Vec<f32>,
    pub sin: Vec<f32>,
    pub albedo: [Vec<f32>; 3],
    pub smooth: Vec<f32>,
    pub albedo_smooth: Vec<f32>,
    /// What a carrier is fitted to.
    pub signal: Vec<f32>,
    /// The light that this was divided by.
    pub total: Vec<f32>,
}

/// Sums of one cell, of the weight `w` times products of `c = cos Phi`, `s = sin Phi` and the intensities `I`. With an albedo, those
/// with `I` are multiplied by it, and those without by its square.
pub(super) mod sum {
    pub use crate::joint::local_fit::normal::wave_sum::{C, CC, CS, S, W};
    /// `I`, `I c` and `I s` of R, then of G, B and IR.
    pub const LIGHT: usize = crate::joint::local_fit::normal::wave_sum::COUNT;
    pub const COUNT: usize = LIGHT + 3 * 4;
}

/// Offset and amplitude of R and B along a row.
#[derive(Clone, Copy)]
pub(super) struct RedBlueRows<'a> {
    pub red_offset: &'a [f32],
    pub red_amplitude: &'a [f32],
    pub blue_offset: &'a [f32],
    pub blue_amplitude: &'a [f32],
}

/// Coefficients of `a + p cos Phi + q sin Phi` of one channel along a row.
#[derive(Clone, Copy)]
pub(super) struct ChannelRows<'a> {
    pub a: &'a [f32],
    pub p: &'a [f32],
    pub q: &'a [f32],
}

/// What decides the modulation of the pixels of a row, and whether there is enough of it.
pub(super) struct StrengthRows<'a> {
    /// Least amplitude of the channels.
    pub weakest: &'a [f32],
    /// Mean amplitude of R and B; that of R if there is no B.
    pub mean: &'a [f32],
    /// 1 where light of the projector falls.
    pub lit: &'a [f32],
    pub albedo: &'a [f32],
}

/// Maps of the fit on the cells. Of R and B: offset and amplitude, four maps in a row; then of all channels the coefficients of
/// `a + p cos + q sin`; then the least amplitude of all channels and the mean amplitude of R and B.
pub(super) mod map {
    pub const A_R: usize = 0;
    pub const A_B: usize = 2;
    pub const P_R: usize = 4;
    pub const P_B: usize = 6;
    pub const A_G: usize = 8;
    pub const A_IR: usize = 11;
    pub const B_G: usize = 14;
    pub const B_IR: usize = 15;
    pub const WEAKEST: usize = 16;
    pub const MODULATION: usize = 17;
    pub const COUNT: usize = 18;
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
pub(super) fn add_squares(usable: &[f32], light: [&[f32]; 4], sums: &mut [[Lanes; 5]]) {
    let rows = [lanes(usable), lanes(light[0]), lanes(light[2])];
    for (i, sums) in sums.iter_mut().enumerate() {
        let [w, red, blue] = take(&rows, i);
        let mut terms = [w; 5];
        for x in 0..LANES {
            let (r, b) = (w[x] * red[x], w[x] * blue[x]);
            (terms[1][x], terms[2][x]) = (r, r * red[x]);
            (terms[3][x], terms[4][x]) = (b, b * blue[x]);
        }
        add(sums, &terms);
    }
}

/// Unit phasor of R and B: (R / rho - a) / b times rho b_r b_b, as only the direction counts.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
pub(super) fn two_step(
    rows: &RedBlueRows,
    albedo: Option<&[f32]>,
    light: [&[f32]; 4],
    cos: &mut [f32],
    sin: &mut [f32],
) {
    let maps = [rows.red_offset, rows.red_amplitude, rows.blue_offset, rows.blue_amplitude].map(lanes);
    let light = [lanes(light[0]), lanes(light[2])];
    let mut out = [lanes_mut(cos), lanes_mut(sin)];
    for i in 0..out[0].len() {
        let albedo = albedo.map_or([1.0; LANES], |albedo| lanes(albedo)[i]);
        let ([a_r, b_r, a_b, b_b], [red, blue]) = (take(&maps, i), take(&light, i));
        let mut phasor = [[0.0; LANES]; 2];
        for x in 0..LANES {
            let real = (red[x] - albedo[x] * a_r[x]) * b_b[x];
            let imaginary = (albedo[x] * a_b[x] - blue[x]) * b_r[x];
            let length = (real * real + imaginary * imaginary).sqrt();
            let inverse = 1.0 / if length > 1e-12 { length } else { 1e-12 };
            (phasor[0][x], phasor[1][x]) = (real * inverse, imaginary * inverse);
        }
        put(&mut out, i, &phasor);
    }
}

/// Turns a phasor by the beat `p - i q` of a fit against it, to length 1.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
pub(super) fn turn(beat: [&[f32]; 2], cos: &mut [f32], sin: &mut [f32]) {
    let (beat, mut phasor) = (beat.map(lanes), [lanes_mut(cos), lanes_mut(sin)]);
    for i in 0..phasor[0].len() {
        let ([p, q], [cos, sin]) = (take(&beat, i), [phasor[0][i], phasor[1][i]]);
        let mut turned = [[0.0; LANES]; 2];
        for x in 0..LANES {
            let (real, imaginary) = (p[x] * cos[x] + q[x] * sin[x], p[x] * sin[x] - q[x] * cos[x]);
            let length = (real * real + imaginary * imaginary).sqrt();
            let inverse = 1.0 / if length > 1e-12 { length } else { 1e-12 };
            (turned[0][x], turned[1][x]) = (real * inverse, imaginary * inverse);
        }
        put(&mut phasor, i, &turned);
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
pub(super) fn add_products(
    usable: &[f32],
    phasor: [&[f32]; 2],
    albedo: Option<&[f32]>,
    light: [&[f32]; 4],
    sums: &mut [[Lanes; sum::COUNT]],
) {
    let (rows, light) = ([lanes(usable), lanes(phasor[0]), lanes(phasor[1])], light.map(lanes));
    for (i, sums) in sums.iter_mut().enumerate() {
        let albedo = albedo.map_or([1.0; LANES], |albedo| lanes(albedo)[i]);
        let ([w, cos, sin], light) = (take(&rows, i), take(&light, i));
        let mut terms = [w; sum::COUNT];
        for x in 0..LANES {
            let w = w[x] * albedo[x];
            let (c, s) = (w * cos[x], w * sin[x]);
            terms[sum::W][x] = w * albedo[x];
            (terms[sum::C][x], terms[sum::S][x]) = (c * albedo[x], s * albedo[x]);
            (terms[sum::CC][x], terms[sum::CS][x]) = (c * albedo[x] * cos[x], c * albedo[x] * sin[x]);
            for k in 0..4 {
                let (seen, first) = (light[k][x], sum::LIGHT + 3 * k);
                terms[first][x] = w * seen;
                terms[first + 1][x] = c * seen;
                terms[first + 2][x] = s * seen;
            }
        }
        add(sums, &terms);
    }
}

/// Everything that follows from the sums of a row of cells, cell by cell. `ratios` are the fringe numbers over the first, 0 for a
/// channel that is absent.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
pub(super) fn solve_row(sums: [&[f32]; sum::COUNT], ratios: [f32; 4], out: &mut [f32]) {
    let columns = sums[0].len();
    let mut maps = out.chunks_exact_mut(columns);
    let mut maps: [&mut [f32]; map::COUNT] =
        std::array::from_fn(|_| maps.next().expect("a line for each map"));
    for i in 0..columns {
        let CellSolution { channels: [r, g, b, ir], spread } = solve_cell(sums, i);
        let strength = |[a, _, _, b]: [f32; 4]| if b > CONTRAST_MIN * a { b } else { 0.0 };
        let seen = if spread > SPREAD_MIN * sums[sum::W][i] { 1.0 } else { 0.0 };
        let [_, _, by_b, by_ir] = weights(ratios);
        let optional = |weight: f32, amplitude: f32| if weight > 0.0 { amplitude } else { f32::INFINITY };
        let weakest = strength(r).min(g[3]).min(optional(by_b, strength(b))).min(optional(by_ir, ir[3]));
        let mean = if by_b > 0.0 { 0.5 * (r[3] + b[3]) } else { r[3] };
        let pairs = [
            [r[0], r[3]],
            [b[0], b[3]],
            [r[1], r[2]],
            [b[1], b[2]],
            [g[0], g[1]],
            [g[2], ir[0]],
            [ir[1], ir[2]],
            [g[3], ir[3]],
            [seen * weakest, mean],
        ];
        for (map, value) in maps.iter_mut().zip(pairs.as_flattened()) {
            map[i] = *value;
        }
    }
}

/// Solution of the normal equations of one cell.
struct CellSolution {
    /// `a, p, q` and `b` of R, G, B, IR.
    channels: [[f32; 4]; 4],
    /// Smaller eigenvalue of the sums of `w cos^2`, `w cos sin`, `w sin^2`: small where the cell sees a small part of a fringe.
    spread: f32,
}

/// Solve the normal equations of cell `i` for the four channels.
#[inline(always)]
fn solve_cell(sums: [&[f32]; sum::COUNT], i: usize) -> CellSolution {
    let [w, wc, ws, wcc, wcs] = [sum::W, sum::C, sum::S, sum::CC, sum::CS].map(|k| sums[k][i]);
    let half = 0.5 * w;
    let skew = wcc - half;
    let spread = half - (skew * skew + wcs * wcs).sqrt();
    let normal = Normal::new([w, wc, ws, wcc, wcs]);
    let mut channels = [[0.0f32; 4]; 4];
    for (k, fit) in channels.iter_mut().enumerate() {
        let [a, p, q] = normal.solve([0, 1, 2].map(|m| sums[sum::LIGHT + 3 * k + m][i]));
        *fit = [a, p, q, (p * p + q * q).sqrt()];
    }
    CellSolution { channels, spread }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
pub(super) fn relative_albedo(
    model: [ChannelRows; 4],
    phasor: [&[f32]; 2],
    light: [&[f32]; 4],
    out: &mut [f32],
) {
    let (model, phasor, light) =
        (model.map(|rows| [rows.a, rows.p, rows.q].map(lanes)), phasor.map(lanes), light.map(lanes));
    for (i, out) in lanes_mut(out).iter_mut().enumerate() {
        let Products { with_light, squared } = products(&model, take(&phasor, i), take(&light, i), i);
        for x in 0..LANES {
            let albedo = with_light[x] / squared[x];
            out[x] = if albedo > ALBEDO_MIN { albedo } else { ALBEDO_MIN };
        }
    }
}

/// Sums over the channels for a vector of pixels.
pub(super) struct Products {
    /// The model times the light.
    pub with_light: Lanes,
    /// The model times itself.
    pub squared: Lanes,
}

/// The products of the model of the light, which is not negative.
#[inline(always)]
pub(super) fn products(
    model: &[[&[Lanes]; 3]; 4],
    [cos, sin]: [Lanes; 2],
    light: [Lanes; 4],
    i: usize,
) -> Products {
    let mut sums = Products { with_light: [0.0; LANES], squared: [1e-9; LANES] };
    for c in 0..4 {
        let [a, p, q] = take(&model[c], i);
        for x in 0..LANES {
            let model = a[x] + p[x] * cos[x] + q[x] * sin[x];
            let model = if model > 0.0 { model } else { 0.0 };
            sums.with_light[x] += model * light[c][x];
            sums.squared[x] += model * model;
        }
    }
    sums
}

/// Phase of the phasor, and modulation where it is at least `least`.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
pub(super) fn finish_row(
    phasor: [&[f32]; 2],
    strength: &StrengthRows,
    least: f32,
    phase: &mut [f32],
    modulation: &mut [f32],
) {
    let StrengthRows { weakest, mean, lit, albedo } = strength;
    let rows = [phasor[0], phasor[1], weakest, mean, lit, albedo].map(lanes);
    let mut out = [lanes_mut(phase), lanes_mut(modulation)];
    for i in 0..out[0].len() {
        let [cos, sin, weakest, mean, lit, albedo] = take(&rows, i);
        let mut found = [[0.0; LANES]; 2];
        for x in 0..LANES {
            found[0][x] = atan2(sin[x], cos[x]);
            let enough = lit[x] * albedo[x] * weakest[x] >= least;
            found[1][x] = if enough { albedo[x] * mean[x] } else { 0.0 };
        }
        put(&mut out, i, &found);
    }
}
