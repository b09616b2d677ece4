//! Moving mean over a window whose width need not be an integer.

use crate::parallel::Aligned;

/// Working memory of [`moving_mean`].
#[derive(Debug, Default)]
pub(super) struct Sums {
    now: Aligned<f32>,
    next: Aligned<f32>,
    window: Aligned<f32>,
}

/// Mean over `width` samples around each sample. A window that would extend beyond the row is shifted inwards.
///
/// Window sums are composed of sums over 1, 2, 4, ... samples. Every pass is a vector addition, and unlike in a running
/// sum, rounding errors do not accumulate along the row.
#[inline(always)]
pub(super) fn moving_mean(row: &[f32], width: f32, sums: &mut Sums, out: &mut [f32]) {
    let n = row.len();
    let width = width.clamp(1.0, n as f32);
    let reach = (width - 1.0) / 2.0;
    let side = reach as usize;
    // The samples at the two ends of the window have a partial weight.
    let part = reach - side as f32;
    let scale = 1.0 / width;
    let (first, last) = (end_mean(row.iter(), width), end_mean(row.iter().rev(), width));
    let begin = (side + 1).min(n / 2);
    let end = (n.saturating_sub(side + 1)).max(begin);
    out[..begin].fill(first);
    out[end..].fill(last);
    if end == begin || begin <= side {
        out[begin..end].fill(last);
        return;
    }
    let whole = &window_sums(row, 2 * side + 1, sums)[begin - side..];
    let (left, right) = (&row[begin - side - 1..], &row[begin + side + 1..]);
    let middle = &mut out[begin..end];
    for (((value, sum), l), r) in middle.iter_mut().zip(whole).zip(left).zip(right) {
        *value = (sum + part * (l + r)) * scale;
    }
}

/// Mean of the first `width` samples.
fn end_mean<'a>(row: impl Iterator<Item = &'a f32>, width: f32) -> f32 {
    let mut left = width;
    let mut sum = 0.0;
    for value in row {
        sum += value * left.min(1.0);
        left -= 1.0;
        if left <= 0.0 {
            break;
        }
    }
    sum / width
}

/// Sums of `count` (odd) samples, starting at each sample.
#[inline(always)]
fn window_sums<'a>(row: &'a [f32], count: usize, sums: &'a mut Sums) -> &'a [f32] {
    if count == 1 {
        return row;
    }
    let Sums { now, next, window } = sums;
    for buffer in [&mut *now, &mut *next, &mut *window] {
        buffer.resize(row.len());
    }
    add_shifted(row, row, 1, now);
    let (mut span, mut done) = (2, 1);
    loop {
        if count & span != 0 {
            if done == 1 {
                add_shifted(row, now, 1, window);
            } else {
                for (to, more) in window.iter_mut().zip(&now[done..]) {
                    *to += more;
                }
            }
            done += span;
        }
        if done == count {
            return window;
        }
        add_shifted(now, now, span, next);
        std::mem::swap(now, next);
        span *= 2;
    }
}

/// `out[x] = a[x] + b[x + shift]` wherever `b` has such a sample.
#[inline(always)]
fn add_shifted(a: &[f32], b: &[f32], shift: usize, out: &mut [f32]) {
    for ((to, a), b) in out.iter_mut().zip(a).zip(&b[shift..]) {
        *to = a + b;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Integral of the row as a step function, divided by the width.
    fn slow(row: &[f32], width: f64, x: usize) -> f64 {
        let n = row.len() as f64;
        let middle = (x as f64 + 0.5).clamp(width / 2.0, n - width / 2.0);
        let (from, to) = (middle - width / 2.0, middle + width / 2.0);
        let share = |i: usize| (to.min(i as f64 + 1.0) - from.max(i as f64)).max(0.0);
        row.iter().enumerate().map(|(i, v)| f64::from(*v) * share(i)).sum::<f64>() / width
    }

    #[test]
    fn any_width_is_the_integral_of_the_row() {
        let row: Vec<f32> = (0..97).map(|x| ((x * x * 7) % 31) as f32).collect();
        for width in [1.0f32, 1.7, 2.0, 3.0, 5.12, 25.3, 48.0, 60.5, 96.5, 97.0] {
            let mut out = vec![f32::NAN; row.len()];
            moving_mean(&row, width, &mut Sums::default(), &mut out);
            for (x, found) in out.iter().enumerate() {
                let expected = slow(&row, f64::from(width), x);
                assert!((f64::from(*found) - expected).abs() < 1e-4, "{width} {x}");
            }
        }
    }
}
