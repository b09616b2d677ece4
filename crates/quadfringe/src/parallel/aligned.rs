//! Working memory aligned to cache lines. A vector that lies across two cache lines takes two accesses.

use std::ops::{Deref, DerefMut};

/// Bytes of a cache line, and of the widest vectors.
const LINE: usize = 64;

/// Extra elements to allocate, because [`first_of_line`] skips up to this many.
pub(crate) const fn spare<T>() -> usize {
    LINE / size_of::<T>()
}

/// Index of the first element of `memory` that lies at the start of a cache line.
pub(crate) fn first_of_line<T>(memory: &[T]) -> usize {
    memory.as_ptr().align_offset(LINE).min(spare::<T>())
}

/// An aligned row that keeps its address and its content until it must grow.
#[derive(Debug, Default)]
pub(crate) struct Aligned<T> {
    memory: Vec<T>,
    start: usize,
    count: usize,
}

impl<T: Copy + Default> Aligned<T> {
    /// A row of zeros.
    pub fn new(count: usize) -> Self {
        let mut row = Self::default();
        row.resize(count);
        row
    }

    /// Changes the length. If the row must grow, all elements become zero.
    #[inline(always)]
    pub fn resize(&mut self, count: usize) {
        if self.start + count > self.memory.len() {
            self.memory = vec![T::default(); count + spare::<T>()];
            self.start = first_of_line(&self.memory);
        }
        self.count = count;
    }
}

impl<T> Deref for Aligned<T> {
    type Target = [T];

    #[inline(always)]
    fn deref(&self) -> &[T] {
        &self.memory[self.start..self.start + self.count]
    }
}

impl<T> DerefMut for Aligned<T> {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut [T] {
        &mut self.memory[self.start..self.start + self.count]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_begin_with_a_cache_line_and_keep_their_numbers() {
        for count in [1, 7, 1024] {
            let mut row = Aligned::<f32>::new(count);
            assert_eq!(row.as_ptr() as usize % LINE, 0);
            row.fill(3.0);
            row.resize(count / 2);
            row.resize(count);
            assert_eq!(&*row, vec![3.0; count]);
            row.resize(2 * count + 100);
            assert_eq!(row.as_ptr() as usize % LINE, 0);
            assert_eq!(row.len(), 2 * count + 100);
        }
    }
}
