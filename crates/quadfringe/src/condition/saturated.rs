//! Which channels of a pixel are saturated.

use std::ops::BitOrAssign;

/// The saturated channels of a pixel.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Saturated(u8);

impl Saturated {
    /// From a mark for each of R, G, B, IR.
    #[inline(always)]
    pub fn new(channels: [bool; 4]) -> Self {
        Self((0..4).fold(0, |bits, c| bits | u8::from(channels[c]) << c))
    }

    /// Whether the channel in place `c` is saturated.
    #[inline(always)]
    pub fn has(self, c: usize) -> bool {
        self.0 >> c & 1 == 1
    }

    /// Number of saturated channels.
    #[inline(always)]
    pub fn count(self) -> u32 {
        self.0.count_ones()
    }

    /// The same with B in the place of IR, and nothing in that of B.
    #[must_use]
    #[inline(always)]
    pub fn blue_as_infrared(self) -> Self {
        Self(self.0 & 0b0011 | (self.0 & 0b0100) << 1)
    }
}

impl BitOrAssign for Saturated {
    #[inline(always)]
    fn bitor_assign(&mut self, other: Self) {
        self.0 |= other.0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn channels_are_told_apart() {
        let mut both = Saturated::new([true, false, false, false]);
        both |= Saturated::new([false, false, true, false]);
        assert_eq!([0, 1, 2, 3].map(|c| both.has(c)), [true, false, true, false]);
        assert_eq!([0, 1, 2, 3].map(|c| both.blue_as_infrared().has(c)), [true, false, false, true]);
        assert_eq!((both.count(), Saturated::default().count()), (2, 0));
    }
}
