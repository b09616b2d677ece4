//! Sums, means and minima over a pixel and its neighbours. Pixels at the border are repeated beyond it.

use multiversion::multiversion;

/// Numbers of the rows above, at and below row `y`.
pub(super) fn around(y: usize, height: usize) -> [usize; 3] {
    [y.saturating_sub(1), y, (y + 1).min(height - 1)]
}

/// Joins a pixel with its eight neighbours: the three pixels of each column, then the three columns.
#[inline(always)]
fn nine(
    rows: [&[f32]; 3],
    width: usize,
    spare: &mut Vec<f32>,
    join: impl Fn(f32, f32, f32) -> f32,
    mut write: impl FnMut(usize, f32),
) {
    spare.resize(width + 2, 0.0);
    let [a, b, c] = rows.map(|row| &row[..width]);
    let middle = &mut spare[1..=width];
    for x in 0..width {
        middle[x] = join(a[x], b[x], c[x]);
    }
    (spare[0], spare[width + 1]) = (spare[1], spare[width]);
    let [left, middle, right] = [0, 1, 2].map(|k| &spare[k..k + width]);
    for x in 0..width {
        write(x, join(left[x], middle[x], right[x]));
    }
}

/// Mean over a pixel and its eight neighbours with the weights [1 2 1] / 4 in both directions.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
pub(super) fn binomial(rows: [&[f32]; 3], width: usize, spare: &mut Vec<f32>, out: &mut [f32]) {
    let out = &mut out[..width];
    nine(rows, width, spare, |a, b, c| 0.25 * (a + 2.0 * b + c), |x, mean| out[x] = mean);
}

/// Sum over a pixel and its eight neighbours.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
pub(super) fn sum_of_nine(rows: [&[f32]; 3], width: usize, spare: &mut Vec<f32>, out: &mut [f32]) {
    let out = &mut out[..width];
    nine(rows, width, spare, |a, b, c| a + b + c, |x, sum| out[x] = sum);
}

/// Least value of a pixel and its eight neighbours.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
pub(super) fn least_of_nine(rows: [&[f32]; 3], width: usize, spare: &mut Vec<f32>, out: &mut [f32]) {
    let least = |a: f32, b: f32| if a < b { a } else { b };
    let out = &mut out[..width];
    nine(rows, width, spare, |a, b, c| least(least(a, b), c), |x, value| out[x] = value);
}
