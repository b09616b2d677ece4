//! Values of the channels that are handled in pairs.

/// A value for each of R and B, which are in quadrature.
#[derive(Debug, Default)]
pub(super) struct Quadrature<T> {
    pub red: T,
    pub blue: T,
}

impl<T> Quadrature<T> {
    #[inline(always)]
    pub(super) fn both_mut(&mut self) -> [&mut T; 2] {
        [&mut self.red, &mut self.blue]
    }
}

/// A value for each of G and IR, which share a Fourier transform.
#[derive(Debug, Default)]
pub(in crate::published) struct FourierPair<T> {
    pub green: T,
    pub infrared: T,
}

impl<T> FourierPair<T> {
    #[inline(always)]
    pub(super) fn both_mut(&mut self) -> [&mut T; 2] {
        [&mut self.green, &mut self.infrared]
    }
}
