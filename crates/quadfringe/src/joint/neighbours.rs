//! Sums, means and minima over a pixel and its neighbours. Pixels at the border are repeated beyond it.

use multiversion::multiversion;

/// Numbers of the rows above, at and below row `y`.
pub(super) fn around(y: usize, height: usize) -> [usize; 3] {
    [y.saturating_sub(1), y, (y + 1).min(height - 1)]
}

/// Mean over a pixel and its eight neighbours with the weights [1 2 1] / 4 in both directions.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
pub(super) fn binomial(rows: [&[f32]; 3], width: usize, spare: &mut Vec<f32>, out: &mut [f32]) {
    spare.resize(width + 2, 0.0);
    let [a, b, c] = rows.map(|row| &row[..width]);
    let middle = &mut spare[1..=width];
    for x in 0..width {
        middle[x] = 0.25 * (a[x] + 2.0 * b[x] + c[x]);
    }
    (spare[0], spare[width + 1]) = (spare[1], spare[width]);
    let [left, middle, right] = [0, 1, 2].map(|k| &spare[k..k + width]);
    for (x, out) in out[..width].iter_mut().enumerate() {
        *out = 0.25 * (left[x] + 2.0 * middle[x] + right[x]);
    }
}

/// Sum over a pixel and its eight neighbours.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
pub(super) fn sum_of_nine(rows: [&[f32]; 3], width: usize, spare: &mut Vec<f32>, out: &mut [f32]) {
    spare.resize(width + 2, 0.0);
    let [a, b, c] = rows.map(|row| &row[..width]);
    let middle = &mut spare[1..=width];
    for x in 0..width {
        middle[x] = a[x] + b[x] + c[x];
    }
    (spare[0], spare[width + 1]) = (spare[1], spare[width]);
    let [left, middle, right] = [0, 1, 2].map(|k| &spare[k..k + width]);
    for (x, out) in out[..width].iter_mut().enumerate() {
        *out = left[x] + middle[x] + right[x];
    }
}

/// 1 where a pixel and its eight neighbours are all above `limit`, 0 elsewhere and in the padding.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
pub(super) fn least_of_nine(
    rows: [&[f32]; 3],
    width: usize,
    limit: f32,
    spare: &mut Vec<f32>,
    out: &mut [f32],
) {
    let least = |a: f32, b: f32| if a < b { a } else { b };
    spare.resize(width + 2, 0.0);
    let [a, b, c] = rows.map(|row| &row[..width]);
    let middle = &mut spare[1..=width];
    for x in 0..width {
        middle[x] = least(least(a[x], b[x]), c[x]);
    }
    (spare[0], spare[width + 1]) = (spare[1], spare[width]);
    let [left, middle, right] = [0, 1, 2].map(|k| &spare[k..k + width]);
    let (out, padding) = out.split_at_mut(width);
    padding.fill(0.0);
    for (x, out) in out.iter_mut().enumerate() {
        *out = if least(least(left[x], middle[x]), right[x]) > limit { 1.0 } else { 0.0 };
    }
}

/// 1 where a pixel and its four neighbours in row and column are all above `limit`, 0 elsewhere and in the padding.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
pub(super) fn least_of_five(rows: [&[f32]; 3], width: usize, limit: f32, out: &mut [f32]) {
    let least = |a: f32, b: f32| if a < b { a } else { b };
    let [above, middle, below] = rows.map(|row| &row[..width]);
    let (out, padding) = out.split_at_mut(width);
    padding.fill(0.0);
    for x in 0..width {
        out[x] = least(least(above[x], below[x]), middle[x]);
    }
    for x in 0..width {
        let sides = least(middle[x.saturating_sub(1)], middle[(x + 1).min(width - 1)]);
        out[x] = if least(out[x], sides) > limit { 1.0 } else { 0.0 };
    }
}
