//! Loops over one row of pixels or of cells.

use crate::parallel::lanes::{LANES, Lanes};
use multiversion::multiversion;

/// Sums of `step` pixels of every `count`th vector from number `k` on.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
pub(super) fn fold(step: usize, k: usize, vectors: &[Lanes], count: usize, line: &mut [f32]) {
    match step {
        1 => fold_by::<1>(k, vectors, count, line),
        2 => fold_by::<2>(k, vectors, count, line),
        4 => fold_by::<4>(k, vectors, count, line),
        8 => fold_by::<8>(k, vectors, count, line),
        _ => fold_by::<16>(k, vectors, count, line),
    }
}

#[inline(always)]
fn fold_by<const S: usize>(k: usize, vectors: &[Lanes], count: usize, line: &mut [f32]) {
    for (vector, cells) in vectors[k..].iter().step_by(count).zip(line.chunks_exact_mut(LANES / S)) {
        for (cell, pixels) in cells.iter_mut().zip(vector.as_chunks::<S>().0) {
            // By halves: a sum one after the other would wait for each.
            let mut sums = *pixels;
            let mut half = S / 2;
            while half > 0 {
                for x in 0..half {
                    sums[x] += sums[x + half];
                }
                half /= 2;
            }
            *cell = sums[0];
        }
    }
}

/// Linear interpolation between centres of cells `step` pixels wide, up to 16; `mix` has one cell more on each side.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
pub(in crate::joint) fn spread(step: usize, mix: &[f32], out: &mut [f32]) {
    match step {
        1 => out.copy_from_slice(&mix[1..=out.len()]),
        2 => spread_by::<2>(mix, out),
        4 => spread_by::<4>(mix, out),
        8 => spread_by::<8>(mix, out),
        _ => spread_by::<16>(mix, out),
    }
}

#[inline(always)]
fn spread_by<const S: usize>(mix: &[f32], out: &mut [f32]) {
    // The pixels from the centre of a cell to that of the next; the first half lies before the image.
    let part: [f32; S] = std::array::from_fn(|x| (x as f32 + 0.5) / S as f32);
    let between = |left: usize| -> [f32; S] {
        let (from, way) = (mix[left], mix[left + 1] - mix[left]);
        part.map(|part| from + way * part)
    };
    let (first, rest) = out.split_at_mut(S / 2);
    first.copy_from_slice(&between(0)[S / 2..]);
    let (whole, last) = rest.as_chunks_mut::<S>();
    let cells = whole.len();
    for (i, pixels) in whole.iter_mut().enumerate() {
        *pixels = between(i + 1);
        // A cell that fills vectors is one; otherwise the compiler makes vectors of cells and takes them apart again.
        if S >= 8 {
            std::hint::black_box(());
        }
    }
    last.copy_from_slice(&between(cells + 1)[..S / 2]);
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
pub(in crate::joint) fn blend(above: &[f32], below: &[f32], weight: f32, out: &mut [f32]) {
    for ((out, a), b) in out.iter_mut().zip(above).zip(below) {
        *out = a + (b - a) * weight;
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
pub(super) fn add_scaled(weight: f32, from: &[f32], to: &mut [f32]) {
    to.iter_mut().zip(from).for_each(|(t, f)| *t += weight * f);
}

/// `line` averaged by `kernel`, with zeros beyond its ends.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
pub(super) fn smooth_line(kernel: &[f32], line: &mut [f32], spare: &mut Vec<f32>) {
    let (length, reach) = (line.len(), kernel.len() / 2);
    spare.clear();
    spare.resize(reach, 0.0);
    spare.extend_from_slice(line);
    spare.resize(length.next_multiple_of(LANES) + kernel.len(), 0.0);
    let smooth = |from: usize| {
        let mut sum = [0.0; LANES];
        for (weight, part) in kernel.iter().zip(spare[from..].windows(LANES)) {
            for x in 0..LANES {
                sum[x] += weight * part[x];
            }
        }
        sum
    };
    let (whole, rest) = line.as_chunks_mut();
    for (i, out) in whole.iter_mut().enumerate() {
        *out = smooth(i * LANES);
    }
    let smoothed = smooth(length - rest.len());
    rest.copy_from_slice(&smoothed[..rest.len()]);
}

/// A Gaussian cut at three sigma; one tap for a sigma of 0.
pub(in crate::joint) fn kernel(sigma: f32) -> Vec<f32> {
    if sigma <= 0.0 {
        return vec![1.0];
    }
    let reach = (3.0 * sigma).ceil().max(1.0) as i32;
    let weights = (-reach..=reach).map(|k| (-0.5 * (k as f32 / sigma).powi(2)).exp());
    let weights: Vec<f32> = weights.collect();
    let sum: f32 = weights.iter().sum();
    weights.into_iter().map(|w| w / sum).collect()
}
