//! Mean over a window whose width need not be whole.

/// Working memory of [`moving_mean`].
#[derive(Debug, Default, Clone)]
pub(super) struct Sums {
    now: Vec<f32>,
    next: Vec<f32>,
    window: Vec<f32>,
}

/// Mean over `width` samples around each; a window that would leave the row is moved back inside.
///
/// Window sums are put together from sums over 1, 2, 4, ... samples: every pass is a plain vector addition, and unlike
/// in a running sum no rounding is carried along the row.
#[inline(always)]
pub(super) fn moving_mean(row: &[f32], width: f32, sums: &mut Sums, out: &mut [f32]) {
    let n = row.len();
    let width = width.clamp(1.0, n as f32);
    let reach = (width - 1.0) / 2.0;
    let side = reach as usize;
    // Samples at both ends of the window count in part.
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
    window_sums(row, 2 * side + 1, sums);
    let (left, right) = (&row[begin - side - 1..], &row[begin + side + 1..]);
    let whole = &sums.window[begin - side..];
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

/// `sums.window[x]` = sum of `count` (odd) samples from x on.
#[inline(always)]
fn window_sums(row: &[f32], count: usize, sums: &mut Sums) {
    let Sums { now, next, window } = sums;
    let n = row.len();
    for buffer in [&mut *now, &mut *next, &mut *window] {
        buffer.resize(n, 0.0);
    }
    now.copy_from_slice(row);
    window.copy_from_slice(row);
    let mut done = 1;
    let mut span = 1;
    while 2 * span <= count {
        for ((to, a), b) in next.iter_mut().zip(&*now).zip(&now[span..]) {
            *to = a + b;
        }
        std::mem::swap(now, next);
        span *= 2;
        if count & span != 0 {
            for (to, more) in window.iter_mut().zip(&now[done..]) {
                *to += more;
            }
            done += span;
        }
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
