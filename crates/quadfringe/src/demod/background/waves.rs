//! Half waves of a row about its middle and their extrema. Every sample is a bit: fringes cross too irregularly for a
//! processor to guess, and bits need no guessing.

use std::ops::Range;

/// Samples in a word of bits.
const WORD: usize = 64;
/// Samples compared at once when an extremum is looked for: mostly all of a half wave.
const BLOCK: usize = 8;
/// Added to samples, from `BLOCK - n` on, it leaves the first `n` of a block and buries the others.
const BURY: [f32; 2 * BLOCK] = {
    let mut bury = [0.0; 2 * BLOCK];
    let mut i = BLOCK;
    while i < 2 * BLOCK {
        bury[i] = f32::NEG_INFINITY;
        i += 1;
    }
    bury
};

/// Half waves of one row.
#[derive(Debug, Default)]
pub(super) struct Waves {
    /// The sample is above the middle.
    above: Vec<u64>,
    /// First samples of the half waves but the first.
    crossings: Vec<u32>,
}

impl Waves {
    /// Length of the buffers for a row of `count` samples.
    pub fn padded(count: usize) -> usize {
        count.next_multiple_of(WORD) + BLOCK
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
        self.crossings.clear();
        let mut before = u64::from(row[0] > middle[0]);
        for (index, (word, (row, middle))) in
            (self.above.iter_mut()).zip(row.chunks_exact(WORD).zip(middle.chunks_exact(WORD))).enumerate()
        {
            let above = compare(row, middle);
            let mut crossed = above ^ (above << 1 | before);
            while crossed != 0 {
                self.crossings.push((WORD * index) as u32 + crossed.trailing_zeros());
                crossed &= crossed - 1;
            }
            (*word, before) = (above, above >> (WORD - 1));
        }
    }

    /// Most half waves that [`Self::whole`] can give.
    #[inline(always)]
    pub fn count(&self) -> usize {
        self.crossings.len()
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

    /// First of the greatest (`upper`) or least samples of a half wave of a padded row.
    #[inline(always)]
    pub fn extremum(row: &[f32], wave: Range<usize>, upper: bool) -> usize {
        let sign = if upper { 1.0 } else { -1.0 };
        let (mut best, mut most) = (wave.start, f32::NEG_INFINITY);
        for start in wave.clone().step_by(BLOCK) {
            let samples: &[f32; BLOCK] = row[start..].first_chunk().expect("padded");
            let bury: &[f32; BLOCK] =
                BURY[BLOCK - (wave.end - start).min(BLOCK)..].first_chunk().expect("a block");
            let mut values = [0.0; BLOCK];
            for ((value, sample), bury) in values.iter_mut().zip(samples).zip(bury) {
                *value = sign * sample + bury;
            }
            let [a, b, c, d, e, f, g, h] = values;
            let here = larger(larger(larger(a, e), larger(b, f)), larger(larger(c, g), larger(d, h)));
            let mut same = 0u32;
            for (i, value) in values.iter().enumerate() {
                same |= u32::from(*value == here) << i;
            }
            let better = here > most;
            best = if better { start + same.trailing_zeros() as usize } else { best };
            most = if better { here } else { most };
        }
        best
    }
}

#[inline(always)]
fn larger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// Which of a word of samples are above the middle.
#[inline(always)]
fn compare(row: &[f32], middle: &[f32]) -> u64 {
    let row: &[f32; WORD] = row.first_chunk().expect("a word");
    let middle: &[f32; WORD] = middle.first_chunk().expect("a word");
    let half = |from: usize| {
        (from..from + WORD / 2).fold(0u32, |word, i| word | (u32::from(row[i] > middle[i]) << (i - from)))
    };
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
                waves.whole().map(|(wave, upper)| (wave.clone(), upper, Waves::extremum(&row, wave, upper)));
            assert!(expected.len() > 2, "{count}");
            assert_eq!(found.collect::<Vec<_>>(), expected, "{count}");
        }
    }
}
