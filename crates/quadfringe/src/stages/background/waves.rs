//! Extrema of the half waves of a row about its moving mean. Samples are compared as bits, because fringes cross the mean
//! too irregularly for branch prediction.

use std::ops::Range;

/// Samples in a word of bits.
const WORD: usize = 64;
/// Longest half waves that [`Waves::extrema`] can skip: it examines half a word on each side of a word.
const SHORTEST_MAX: usize = WORD / 2 - 1;

/// An extremum of a row.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Extremum {
    /// Index of the sample.
    pub sample: u32,
    /// 1 for a maximum, -1 for a minimum.
    pub sign: f32,
}

/// Half waves of one row.
#[derive(Debug, Default)]
pub(super) struct Waves {
    /// The sample is above the moving mean.
    above: Vec<u64>,
    /// The sample is a local maximum above the moving mean or a local minimum below it.
    turns: Vec<u64>,
    /// From the first crossing to the last one, without the half waves that an end of the row cuts.
    whole: Range<usize>,
}

impl Waves {
    /// Length of the buffers for a row of `count` samples.
    pub fn padded(count: usize) -> usize {
        count.next_multiple_of(WORD) + 1
    }

    /// Split the first `count` samples of a row where they cross the moving mean. Both buffers are padded.
    #[inline(always)]
    pub fn find(&mut self, row: &mut [f32], middle: &mut [f32], count: usize) {
        for buffer in [&mut *row, &mut *middle] {
            let last = buffer[count - 1];
            buffer[count..].fill(last);
        }
        let words = count.div_ceil(WORD);
        self.above.resize(words, 0);
        self.turns.resize(words, 0);
        self.whole = 0..0;
        let (mut before, mut rising, mut falling) = (u64::from(row[0] > middle[0]), 0, 0);
        for index in 0..words {
            let (here, next) = (&row[WORD * index..], &row[WORD * index + 1..]);
            let above = compare(here, &middle[WORD * index..]);
            let (up, down) = (compare(next, here), compare(here, next));
            let tops = (up << 1 | rising) & !up;
            let bottoms = (down << 1 | falling) & !down;
            let crossed = above ^ (above << 1 | before);
            if crossed != 0 {
                if self.whole.end == 0 {
                    self.whole.start = WORD * index + crossed.trailing_zeros() as usize;
                }
                self.whole.end = WORD * index + crossed.ilog2() as usize;
            }
            (self.above[index], self.turns[index]) = (above, tops & above | bottoms & !above);
            (before, rising, falling) = (above >> (WORD - 1), up >> (WORD - 1), down >> (WORD - 1));
        }
    }

    /// Extrema of the half waves longer than `shortest` samples. Maxima and minima alternate: if a short half wave between
    /// two extrema of one sign was skipped as noise, the more extreme one is kept.
    #[inline(always)]
    pub fn extrema(&self, row: &[f32], shortest: usize, out: &mut Vec<Extremum>) {
        let shortest = shortest.min(SHORTEST_MAX);
        let turns: u32 = self.turns.iter().map(|word| word.count_ones()).sum();
        // One more, for a last write that does not count.
        out.resize(turns as usize + 1, Extremum::default());
        let (mut found, mut highest, mut last_side) = (0, 0.0, u64::MAX);
        for (index, (&above, &turns)) in self.above.iter().zip(&self.turns).enumerate() {
            let before = self.above[index.saturating_sub(1)];
            let after = *self.above.get(index + 1).unwrap_or(&0);
            let long = above & in_long_runs([before, above, after], shortest)
                | !above & in_long_runs([!before, !above, !after], shortest);
            let mut left = turns & long & ones_within(&self.whole, WORD * index);
            while left != 0 {
                let bit = left.trailing_zeros();
                left &= left - 1;
                let (at, side) = (WORD * index + bit as usize, above >> bit & 1);
                let sign = side as i32 as f32 * 2.0 - 1.0;
                let height = sign * row[at];
                let again = side == last_side;
                let lower = again & (height <= highest);
                // Always written, either in place or behind the last valid entry, to avoid a branch.
                out[found - usize::from(again & !lower)] = Extremum { sample: at as u32, sign };
                found += usize::from(!again);
                highest = if lower { highest } else { height };
                last_side = side;
            }
        }
        out.truncate(found);
    }
}

/// Ones of the middle word in runs of more than `shortest` ones.
#[inline(always)]
fn in_long_runs([before, word, after]: [u64; 3], shortest: usize) -> u64 {
    const HALF: usize = WORD / 2;
    let bits = u128::from(before >> HALF) | u128::from(word) << HALF | u128::from(after) << (WORD + HALF);
    let begins = (1..=shortest).fold(bits, |begins, shift| begins & bits >> shift);
    let runs = (1..=shortest).fold(begins, |runs, shift| runs | begins << shift);
    (runs >> HALF) as u64
}

/// Ones for the samples of a word that lie in a range. The word begins with sample `first`.
#[inline(always)]
fn ones_within(range: &Range<usize>, first: usize) -> u64 {
    let from = |place: usize| u64::MAX.checked_shl(place.saturating_sub(first) as u32).unwrap_or(0);
    from(range.start) & !from(range.end)
}

/// A bit for each sample of a word that is above the other one. Vectors turn each comparison into a byte, and a
/// multiplication gathers the lowest bits of eight bytes in one byte; composing the word bit by bit would not vectorise.
#[inline(always)]
fn compare(row: &[f32], others: &[f32]) -> u64 {
    const GATHER: u64 = 0x0102_0408_1020_4080;
    let mut bytes = [0u8; WORD];
    for ((byte, row), others) in bytes.iter_mut().zip(&row[..WORD]).zip(&others[..WORD]) {
        *byte = u8::from(row > others);
    }
    let mut word = 0;
    for (place, eight) in bytes.as_chunks().0.iter().enumerate() {
        word |= (u64::from_le_bytes(*eight).wrapping_mul(GATHER) >> 56) << (8 * place);
    }
    word
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Extrema of the half waves longer than `shortest`, sample by sample.
    fn slow(row: &[f32], middle: &[f32], shortest: usize) -> Vec<Extremum> {
        let above = |i: usize| row[i] > middle[i];
        let crossings: Vec<usize> = (1..row.len()).filter(|&i| above(i) != above(i - 1)).collect();
        let mut found: Vec<Extremum> = Vec::new();
        for wave in crossings.windows(2).filter(|wave| wave[1] - wave[0] > shortest) {
            let sign = if above(wave[0]) { 1.0 } else { -1.0 };
            for i in wave[0]..wave[1] {
                let (before, here, after) = (sign * row[i - 1], sign * row[i], sign * row[i + 1]);
                if !(before < here && here >= after) {
                    continue;
                }
                let extremum = Extremum { sample: i as u32, sign };
                match found.last_mut() {
                    Some(last) if last.sign == sign => {
                        if here > sign * row[last.sample as usize] {
                            *last = extremum;
                        }
                    }
                    _ => found.push(extremum),
                }
            }
        }
        found
    }

    #[test]
    fn bits_find_the_extrema_that_a_loop_over_samples_finds() {
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
            let expected = [0, 1, 2, 3].map(|shortest| slow(&row, &middle, shortest));
            row.resize(Waves::padded(count), f32::NAN);
            middle.resize(Waves::padded(count), f32::NAN);
            let mut waves = Waves::default();
            waves.find(&mut row, &mut middle, count);
            for (shortest, expected) in expected.iter().enumerate() {
                let mut found = Vec::new();
                waves.extrema(&row, shortest, &mut found);
                assert!(expected.len() > 2 || shortest == 3, "{count}");
                assert_eq!(&found, expected, "{count} {shortest}");
            }
        }
    }

    #[test]
    fn short_runs_are_skipped_across_words() {
        // A run of three over the border of two words, one of two inside.
        let words = [1 << 63, 0b11 | 0b11 << 20, 0];
        assert_eq!(in_long_runs(words, 1), words[1]);
        assert_eq!(in_long_runs(words, 2), 0b11);
        assert_eq!(in_long_runs(words, 3), 0);
    }

    #[test]
    fn a_row_without_crossings_has_no_half_waves() {
        let (mut row, mut middle) = (vec![1.0; Waves::padded(100)], vec![0.0; Waves::padded(100)]);
        let (mut waves, mut found) = (Waves::default(), vec![Extremum::default()]);
        waves.find(&mut row, &mut middle, 100);
        waves.extrema(&row, 0, &mut found);
        assert!(found.is_empty());
    }
}
