//! Half waves of a row about its middle and their extrema. Every sample is a bit: fringes cross too irregularly for a
//! processor to guess, and bits need no guessing.

use std::ops::Range;

/// Samples in a word of bits.
const WORD: usize = 64;

/// Half waves of one row.
#[derive(Debug, Default)]
pub(super) struct Waves {
    /// The sample is above the middle.
    above: Vec<u64>,
    /// The sample lies further out than the one before, and the one after does not lie further out still.
    turns: Vec<u64>,
    /// First samples of the half waves but the first.
    crossings: Vec<u32>,
}

impl Waves {
    /// Length of the buffers for a row of `count` samples.
    pub fn padded(count: usize) -> usize {
        count.next_multiple_of(WORD) + 1
    }

    /// Split the first `count` samples of a row where they cross the middle. Both buffers are padded.
    #[inline(always)]
    pub fn find(&mut self, row: &mut [f32], middle: &mut [f32], count: usize) {
        for buffer in [&mut *row, &mut *middle] {
            let last = buffer[count - 1];
            buffer[count..].fill(last);
        }
        let words = count.div_ceil(WORD);
        self.above.resize(words, 0);
        self.turns.resize(words, 0);
        self.crossings.clear();
        let (mut above_before, mut outward_before) = (u64::from(row[0] > middle[0]), 0);
        for index in 0..words {
            let (above, outward) = compare(&row[WORD * index..], &middle[WORD * index..]);
            self.above[index] = above;
            self.turns[index] = (outward << 1 | outward_before) & !outward;
            let mut crossed = above ^ (above << 1 | above_before);
            while crossed != 0 {
                self.crossings.push((WORD * index) as u32 + crossed.trailing_zeros());
                crossed &= crossed - 1;
            }
            (above_before, outward_before) = (above >> (WORD - 1), outward >> (WORD - 1));
        }
    }

    /// Half waves from one crossing to the next, and whether they lie above the middle.
    #[inline(always)]
    pub fn whole(&self) -> impl Iterator<Item = (Range<usize>, bool)> {
        let first = self.crossings.first().map_or(0, |&at| at as usize);
        let mut upper = (self.above[first / WORD] >> (first % WORD)) & 1 == 0;
        self.crossings.windows(2).map(move |pair| {
            upper = !upper;
            (pair[0] as usize..pair[1] as usize, upper)
        })
    }

    /// First of the greatest (`upper`) or least samples of a half wave: an end of it, or where it turns back.
    #[inline(always)]
    pub fn extremum(&self, row: &[f32], wave: Range<usize>, upper: bool) -> usize {
        let sign = if upper { 1.0 } else { -1.0 };
        let (mut best, mut most) = (wave.start, sign * row[wave.start]);
        let mut consider = |at: usize| {
            let value = sign * row[at];
            let better = value > most;
            best = if better { at } else { best };
            most = if better { value } else { most };
        };
        let last = wave.end - 1;
        for start in (wave.start + 1..last).step_by(WORD) {
            let mut turns = self.turns_from(start) & low_bits(last - start);
            while turns != 0 {
                consider(start + turns.trailing_zeros() as usize);
                turns &= turns - 1;
            }
        }
        consider(last);
        best
    }

    /// The bits of `turns` from a sample on.
    #[inline(always)]
    fn turns_from(&self, at: usize) -> u64 {
        let (index, shift) = (at / WORD, at % WORD);
        let next = self.turns.get(index + 1).copied().unwrap_or(0);
        (self.turns[index] >> shift) | (next << 1 << (WORD - 1 - shift))
    }
}

/// As many ones as asked for, from 1 to a whole word.
#[inline(always)]
fn low_bits(count: usize) -> u64 {
    u64::MAX >> (WORD - count.min(WORD))
}

/// For a word of samples: above the middle, and further out than this is the next.
#[inline(always)]
fn compare(row: &[f32], middle: &[f32]) -> (u64, u64) {
    let row: &[f32; WORD + 1] = row.first_chunk().expect("padded");
    let middle: &[f32; WORD] = middle.first_chunk().expect("padded");
    let above = |i: usize| row[i] > middle[i];
    let outward = |i: usize| (row[i + 1] - row[i]) * (row[i] - middle[i]) > 0.0;
    (word(above), word(outward))
}

/// The answers for a word of samples.
#[inline(always)]
fn word(is_set: impl Fn(usize) -> bool) -> u64 {
    let half = |from: usize| (0..WORD / 2).fold(0u32, |word, i| word | (u32::from(is_set(from + i)) << i));
    u64::from(half(0)) | (u64::from(half(WORD / 2)) << (WORD / 2))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Half waves and their extrema, sample by sample.
    fn slow(row: &[f32], middle: &[f32]) -> Vec<(Range<usize>, bool, usize)> {
        let above = |i: usize| row[i] > middle[i];
        let crossings: Vec<usize> = (1..row.len()).filter(|&i| above(i) != above(i - 1)).collect();
        let half_wave = |pair: &[usize]| {
            let (wave, upper) = (pair[0]..pair[1], above(pair[0]));
            let better = |best: usize, i: usize| if upper { row[i] > row[best] } else { row[i] < row[best] };
            let extremum = wave.clone().fold(pair[0], |best, i| if better(best, i) { i } else { best });
            (wave, upper, extremum)
        };
        crossings.windows(2).map(half_wave).collect()
    }

    #[test]
    fn bits_find_what_a_look_at_every_sample_finds() {
        // Plateaus, half waves longer than a word, rows that end anywhere in a word.
        for (count, period, coarse) in
            [(64, 5.0, 3.0), (130, 17.3, 9.0), (511, 11.1, 2.0), (700, 290.0, 40.0)]
        {
            let at = |i: usize| {
                let noise = ((i * i * 31 + 7 * i) % 23) as f32 / 23.0;
                ((std::f32::consts::TAU * i as f32 / period).sin() * coarse + noise).round() / coarse
            };
            let mut row: Vec<f32> = (0..count).map(at).collect();
            let mut middle: Vec<f32> = (0..count).map(|i| 0.1 + 1e-4 * i as f32).collect();
            let expected = slow(&row, &middle);
            row.resize(Waves::padded(count), f32::NAN);
            middle.resize(Waves::padded(count), f32::NAN);
            let mut waves = Waves::default();
            waves.find(&mut row, &mut middle, count);
            let found =
                waves.whole().map(|(wave, upper)| (wave.clone(), upper, waves.extremum(&row, wave, upper)));
            assert!(expected.len() > 2, "{count}");
            assert_eq!(found.collect::<Vec<_>>(), expected, "{count}");
        }
    }
}
