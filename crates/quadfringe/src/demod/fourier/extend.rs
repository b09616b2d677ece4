//! Fringes beyond the ends of a row, so that the transform, for which a row is a ring, sees no jump.

/// Write into `tail` fringes that go on from the end of `row` and pass over, through `fade` (0 to 1), into fringes that
/// lead up to its beginning.
///
/// Fringes are even about an extremum. The row is mirrored at the extremum nearest to its end, so value, slope and
/// phase go on; mirrored at the end itself, the phase would jump.
#[inline(always)]
pub(super) fn extend(row: &[f32], period_px: f32, fade: &[f32], tail: &mut [f32]) {
    let n = row.len();
    let quarter = ((period_px / 4.0) as usize).clamp(1, n / 8);
    let after = mirror(quarter, |i| row[n - 1 - i]);
    let before = mirror(quarter, |i| row[i]);
    let count = tail.len();
    for (k, (value, weight)) in tail.iter_mut().zip(fade).enumerate() {
        let end = row[(n - 2).saturating_sub(after + k)];
        let begin = row[(before + count - k).min(n - 1)];
        *value = end + weight * (begin - end);
    }
}

/// Twice the distance of an extremum from the end of a row, of which `at(0)` is the last sample; half a fringe is looked
/// through, from a quarter on.
#[inline(always)]
fn mirror(quarter: usize, at: impl Fn(usize) -> f32) -> usize {
    let mismatch = |twice: usize| -> f32 {
        let miss = |i: usize| at(i) - at(twice - i);
        (0..quarter).map(|i| miss(i) * miss(i)).sum()
    };
    let (mut best, mut least) = (2 * quarter, f32::INFINITY);
    for twice in 2 * quarter..6 * quarter + 2 {
        let found = mismatch(twice);
        (best, least) = if found < least { (twice, found) } else { (best, least) };
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts::TAU;

    #[test]
    fn fringes_go_on_in_phase_at_both_ends() {
        for start in [0.0f32, 1.0, 2.0, 4.0] {
            let at = |x: f32| (TAU * x / 25.3 + start).cos();
            let row: Vec<f32> = (0..400).map(|x| at(x as f32)).collect();
            let fade: Vec<f32> = (0..60).map(|k| if k < 30 { 0.0 } else { 1.0 }).collect();
            let mut tail = [0.0; 60];
            extend(&row, 25.3, &fade, &mut tail);
            for k in 0..30 {
                // An extremum is found to a quarter of a pixel, so the mirrored row is off by half a pixel at most.
                assert!((tail[k] - at(400.0 + k as f32)).abs() < 0.13, "{start} {k}");
                assert!((tail[59 - k] - at(-1.0 - k as f32)).abs() < 0.13, "{start} {k}");
            }
        }
    }
}
