//! What is left when doubtful pixels go: seams of the absolute phase, and islands too small to be trusted.

use rayon::prelude::*;
use std::f32::consts::PI;

/// Marks every lit pixel whose absolute phase (rad, row-major) differs by half a turn or more from that of a lit
/// neighbour - there one of the two has the wrong order, or sees two surfaces at once - and the pixels around it.
pub(super) fn mark_seams(phase: &[f32], lit: impl Fn(usize) -> bool, width: usize, seams: &mut Vec<bool>) {
    seams.clear();
    seams.resize(phase.len(), false);
    for i in 0..phase.len() {
        let beside = [(i % width > 0).then(|| i - 1), i.checked_sub(width)];
        for other in beside.into_iter().flatten() {
            if !joined(phase[i], phase[other]) && lit(i) && lit(other) {
                mark_around(seams, width, i);
                mark_around(seams, width, other);
            }
        }
    }
}

fn mark_around(seams: &mut [bool], width: usize, i: usize) {
    let (x, y) = (i % width, i / width);
    for row in y.saturating_sub(1)..=(y + 1).min(seams.len() / width - 1) {
        for column in x.saturating_sub(1)..=(x + 1).min(width - 1) {
            seams[row * width + column] = true;
        }
    }
}

/// Sets to NaN every pixel that has fewer than `least` others like it in the 5 x 5 pixels around: slivers beside edges,
/// where two surfaces share a pixel.
pub(super) fn remove_slivers(phase: &mut [f32], width: usize, least: u8, memory: &mut Vec<u8>) {
    let height = phase.len() / width;
    memory.clear();
    memory.resize(phase.len(), 0);
    memory.par_chunks_mut(width).zip(phase.par_chunks(width)).for_each(|(counts, row)| {
        for x in 0..width {
            let near = &row[x.saturating_sub(2)..(x + 3).min(width)];
            counts[x] = near.iter().map(|v| u8::from(!v.is_nan())).sum();
        }
    });
    phase.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
        let near = y.saturating_sub(2)..(y + 3).min(height);
        // What the border of the image cuts off counts as present.
        let missing = 5 * (5 - near.len()) as u8;
        for (x, value) in row.iter_mut().enumerate() {
            let cut = (2usize.saturating_sub(x) + (x + 3).saturating_sub(width)) * near.len();
            let count: u8 = near.clone().map(|r| memory[r * width + x]).sum();
            if count + missing + (cut as u8) < least {
                *value = f32::NAN;
            }
        }
    });
}

/// Sets to NaN every connected region of fewer than `least` pixels; neighbours more than half a turn apart are not
/// connected.
pub(super) fn remove_islands(phase: &mut [f32], width: usize, least: usize, memory: &mut Vec<u32>) {
    memory.clear();
    memory.extend(0..phase.len() as u32);
    for i in 0..phase.len() {
        if phase[i].is_nan() {
            continue;
        }
        if i % width > 0 && joined(phase[i], phase[i - 1]) {
            unite(memory, i, i - 1);
        }
        if i >= width && joined(phase[i], phase[i - width]) {
            unite(memory, i, i - width);
        }
    }
    let roots: Vec<u32> = (0..phase.len()).map(|i| root(memory, i) as u32).collect();
    memory.fill(0);
    roots.iter().for_each(|&r| memory[r as usize] += 1);
    for (value, r) in phase.iter_mut().zip(roots) {
        if (memory[r as usize] as usize) < least {
            *value = f32::NAN;
        }
    }
}

/// Neighbours on one surface; NaN joins nothing.
fn joined(a: f32, b: f32) -> bool {
    (a - b).abs() < PI
}

fn root(parents: &mut [u32], mut i: usize) -> usize {
    while parents[i] as usize != i {
        let next = parents[i] as usize;
        parents[i] = parents[next];
        i = next;
    }
    i
}

fn unite(parents: &mut [u32], a: usize, b: usize) {
    let (a, b) = (root(parents, a), root(parents, b));
    let (low, high) = (a.min(b), a.max(b));
    parents[high] = low as u32;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seams_are_marked_on_both_sides() {
        let phase: Vec<f32> = (0..20 * 20).map(|i| if i % 20 < 15 { 10.0 } else { 30.0 }).collect();
        let mut seams = Vec::new();
        mark_seams(&phase, |_| true, 20, &mut seams);
        let row: Vec<usize> = (0..20).filter(|x| seams[7 * 20 + x]).collect();
        assert_eq!(row, [13, 14, 15, 16]);
        mark_seams(&phase, |i| i % 20 < 15, 20, &mut seams);
        assert!(!seams.contains(&true), "the dark has no seams");
    }

    #[test]
    fn islands_go_and_surfaces_stay() {
        let width = 20;
        let mut phase = vec![10.0f32; 20 * 20];
        phase[5 * width + 5] = 20.0;
        for y in 0..20 {
            (15..20).for_each(|x| phase[y * width + x] = 30.0);
        }
        remove_islands(&mut phase, width, 10, &mut Vec::new());
        assert!(phase[5 * width + 5].is_nan());
        assert_eq!((phase[2 * width + 3], phase[2 * width + 17]), (10.0, 30.0));
        remove_islands(&mut phase, width, 101, &mut Vec::new());
        assert!(phase[2 * width + 17].is_nan() && phase[2 * width + 3] == 10.0);
    }
}
