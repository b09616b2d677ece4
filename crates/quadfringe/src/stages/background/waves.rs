//! Extrema of the half waves of a row about its middle. Every sample is a bit: fringes cross too irregularly for a
//! processor to guess, and bits need no guessing.

use std::ops::Range;

/// Samples in a word of bits.
const WORD: usize = 64;
/// Longest half waves that [`Waves::extrema`] can leave out: half a word on each side of a word is looked at.
const SHORTEST_MAX: usize = WORD / 2 - 1;

/// Half waves of one row.
#[derive(Debug, Default)]
pub(super) struct Waves {
    /// The sample is above the middle.
    above: Vec<u64>,
    /// The row turns at the sample: downwards where it is above the middle, upwards where it is below.
    turns: Vec<u64>,
    /// From the first crossing to the last one: half waves cut by an end of the row lie outside.
    whole: Range<usize>,
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

    /// Samples at the extrema of the half waves longer than `shortest`, with 1 for maxima and -1 for minima, which take
    /// turns: of two on one side, with a half wave between them that was noise, the further one counts.
    #[inline(always)]
    pub fn extrema(&self, row: &[f32], shortest: usize, out: &mut Vec<(u32, f32)>) {
        let shortest = shortest.min(SHORTEST_MAX);
        let turns: u32 = self.turns.iter().map(|word| word.count_ones()).sum();
        // One more, for the last one that does not count.
        out.resize(turns as usize + 1, (0, 0.0));
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
                // Written in any case, where it counts or behind all that do: no branch to guess.
                out[found - usize::from(again & !lower)] = (at as u32, sign);
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

/// Ones for the samples of a word, which begins with sample `first`, that lie in a range.
#[inline(always)]
fn ones_within(range: &Range<usize>, first: usize) -> u64 {
    let from = |place: usize| u64::MAX.checked_shl(place.saturating_sub(first) as u32).unwrap_or(0);
    from(range.start) & !from(range.end)
}

/// Which of a word of samples are above others: vectors make a byte of each comparison, and a multiplication gathers the
/// last bits of eight bytes in the first one from above. Put together bit by bit, a compiler takes the vectors apart.
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
    fn slow(row: &[f32], middle: &[f32], shortest: usize) -> Vec<(u32, f32)> {
        let above = |i: usize| row[i] > middle[i];
        let crossings: Vec<usize> = (1..row.len()).filter(|&i| above(i) != above(i - 1)).collect();
        let mut found: Vec<(u32, f32)> = Vec::new();
        for wave in crossings.windows(2).filter(|wave| wave[1] - wave[0] > shortest) {
            let sign = if above(wave[0]) { 1.0 } else { -1.0 };
            for i in wave[0]..wave[1] {
                let (before, here, after) = (sign * row[i - 1], sign * row[i], sign * row[i + 1]);
                if !(before < here && here >= after) {
                    continue;
                }
                match found.last() {
                    Some(&(at, other)) if other == sign => {
                        if here > sign * row[at as usize] {
                            *found.last_mut().unwrap() = (i as u32, sign);
                        }
                    }
                    _ => found.push((i as u32, sign)),
                }
            }
        }
        found
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
    fn short_runs_are_left_out_across_words() {
        // A run of three over the border of two words, one of two inside.
        let words = [1 << 63, 0b11 | 0b11 << 20, 0];
        assert_eq!(in_long_runs(words, 1), words[1]);
        assert_eq!(in_long_runs(words, 2), 0b11);
        assert_eq!(in_long_runs(words, 3), 0);
    }

    #[test]
    fn a_row_without_crossings_has_no_half_waves() {
        let (mut row, mut middle) = (vec![1.0; Waves::padded(100)], vec![0.0; Waves::padded(100)]);
        let (mut waves, mut found) = (Waves::default(), vec![(0, 0.0)]);
        waves.find(&mut row, &mut middle, 100);
        waves.extrema(&row, 0, &mut found);
        assert!(found.is_empty());
    }
}
