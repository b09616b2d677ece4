//! Conversion of raw intensities to linear light, channel by channel, with look-up tables for integer types.

use super::{Conditioner, Response, Sample};
use std::borrow::Cow;

use ndarray::ArrayView2;

/// Dark level and responses of the four channels, prepared for one type of sample and one full scale.
#[derive(Debug, Clone)]
pub(super) struct Linear {
    dark: [f32; 4],
    response: [Response; 4],
    /// Applied here only if there is no crosstalk. Otherwise crosstalk must be removed first, and [`super::unmix`]
    /// applies the response.
    projector_response: [Response; 4],
    full_scale: f32,
    tables: [Vec<f32>; 4],
    tables_for: Option<TableKey>,
}

/// The values, other than the calibration, on which the look-up tables depend.
#[derive(Debug, Clone, Copy, PartialEq)]
struct TableKey {
    /// Number of levels of the type of sample; 0 for a type without tables.
    levels: usize,
    full_scale: f32,
}

impl Linear {
    pub fn new(conditioner: &Conditioner, mixed: bool) -> Self {
        Self {
            dark: conditioner.dark,
            response: conditioner.response,
            projector_response: if mixed { Default::default() } else { conditioner.projector_response },
            full_scale: 1.0,
            tables: std::array::from_fn(|_| Vec::new()),
            tables_for: None,
        }
    }

    /// Fills the look-up tables if the type or the full scale has changed since the last shot.
    pub fn prepare<T: Sample>(&mut self, full_scale: f32) {
        let key = TableKey { levels: T::LEVELS, full_scale };
        if self.tables_for == Some(key) {
            return;
        }
        self.full_scale = full_scale;
        for c in 0..4 {
            let linear = |level: usize| self.linear(c, level as f32 * (1.0 / full_scale));
            self.tables[c] = (0..T::LEVELS).map(linear).collect();
        }
        self.tables_for = Some(key);
    }

    fn linear(&self, c: usize, fraction: f32) -> f32 {
        self.projector_response[c].linear(self.response[c].linear(fraction - self.dark[c]))
    }

    /// Converts a row of channel `c`.
    #[inline(always)]
    pub fn row<T: Sample>(&self, c: usize, row: &[T], out: &mut [f32]) {
        let (table, scale) = (&self.tables[c][..T::LEVELS], 1.0 / self.full_scale);
        let pixels = out.iter_mut().zip(row);
        if self.is_plain(c) {
            let dark = self.dark[c];
            for (value, raw) in pixels {
                *value = raw.intensity() * scale - dark;
            }
            return;
        }
        for (value, &raw) in pixels {
            *value = self.value(c, table, raw);
        }
    }

    /// Converts a row in which two channels alternate: the first in even columns, the second in odd ones.
    #[inline(always)]
    pub fn row_of_two<T: Sample>(&self, channels: [usize; 2], row: &[T], [even, odd]: [&mut [f32]; 2]) {
        let (pairs, last) = row.as_chunks::<2>();
        if let [last] = last {
            even[row.len() / 2] = self.value(channels[0], &self.tables[channels[0]][..T::LEVELS], *last);
        }
        let pixels = even.iter_mut().zip(odd).zip(pairs);
        if channels.iter().all(|&c| self.is_plain(c)) {
            let (scale, [a, b]) = (1.0 / self.full_scale, channels.map(|c| self.dark[c]));
            for ((even, odd), pair) in pixels {
                *even = pair[0].intensity() * scale - a;
                *odd = pair[1].intensity() * scale - b;
            }
            return;
        }
        let [a, b] = channels.map(|c| (c, &self.tables[c][..T::LEVELS]));
        for ((even, odd), pair) in pixels {
            *even = self.value(a.0, a.1, pair[0]);
            *odd = self.value(b.0, b.1, pair[1]);
        }
    }

    /// Whether arithmetic without a table is enough. It vectorises, and a table does not.
    #[inline(always)]
    fn is_plain(&self, c: usize) -> bool {
        [self.response[c], self.projector_response[c]] == [Response::default(); 2]
    }

    #[inline]
    fn value<T: Sample>(&self, c: usize, table: &[f32], raw: T) -> f32 {
        match raw.level() {
            Some(level) => table[level],
            None => self.linear(c, raw.intensity() * (1.0 / self.full_scale)),
        }
    }
}

/// Row `y` as a contiguous slice, so that loops need no strides.
#[inline]
pub(super) fn row_of<'r, T: Sample>(plane: &'r ArrayView2<'_, T>, y: usize) -> Cow<'r, [T]> {
    let row = plane.row(y);
    match row.to_slice() {
        Some(row) => Cow::Borrowed(row),
        None => Cow::Owned(row.to_vec()),
    }
}

/// Extends the `count` samples that follow the first `margin` entries by `margin` samples on both sides. The samples are
/// reflected at the end sample in position and in value, which keeps the slope.
pub(super) fn extend(line: &mut [f32], margin: usize, count: usize) {
    let (first, last) = (margin, margin + count - 1);
    for i in 1..=margin {
        line[first - i] = 2.0 * line[first] - line[(first + i).min(last)];
    }
    for i in 1..=margin {
        line[last + i] = 2.0 * line[last] - line[last.saturating_sub(i).max(first)];
    }
}
