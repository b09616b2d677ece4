//! Types of the intensities that a camera delivers.

use crate::{Error, Result};
use ndarray::ArrayView2;

mod sealed {
    use super::{Known, Of};

    pub trait Sealed: Sized + 'static {
        /// The value with its type of intensities as a variant.
        fn known<F: Of>(value: F::Type<Self>) -> Known<F>;
    }

    macro_rules! sealed {
        ($($sample:ty => $variant:ident),*) => {$(
            impl Sealed for $sample {
                fn known<F: Of>(value: F::Type<Self>) -> Known<F> {
                    Known::$variant(value)
                }
            }
        )*};
    }
    sealed!(u8 => U8, u16 => U16, f32 => F32);
}

/// What exists for each type of intensities, such as a shot.
pub trait Of {
    /// That of the intensities `T`.
    type Type<T: 'static>;
}

/// That of one of the types. What takes this in place of a type parameter is compiled once, in this crate, and not again in every
/// crate that uses it.
pub enum Known<F: Of> {
    U8(F::Type<u8>),
    U16(F::Type<u16>),
    F32(F::Type<f32>),
}

/// An intensity: `u8`, `u16` or `f32`.
pub trait Sample: sealed::Sealed + Copy + Send + Sync + 'static {
    /// Number of levels of a look-up table; 0 for types without one.
    const LEVELS: usize;
    /// Default intensity of white.
    const FULL_SCALE: f32;

    /// Index into the look-up table, if the type has one.
    fn level(self) -> Option<usize>;

    /// The intensity as a number.
    fn intensity(self) -> f32;

    /// The greatest magnitude that an intensity of the image has, or can have.
    ///
    /// # Errors
    /// [`Error::NotFinite`] for NaN and infinity, with the number of such values and the position of the first.
    fn greatest(_plane: &ArrayView2<'_, Self>, _channel: &str) -> Result<f32> {
        Ok(Self::FULL_SCALE)
    }
}

impl Sample for u8 {
    const LEVELS: usize = 1 << 8;
    const FULL_SCALE: f32 = 255.0;

    #[inline]
    fn level(self) -> Option<usize> {
        Some(self as usize)
    }

    #[inline]
    fn intensity(self) -> f32 {
        f32::from(self)
    }
}

impl Sample for u16 {
    const LEVELS: usize = 1 << 16;
    const FULL_SCALE: f32 = 65535.0;

    #[inline]
    fn level(self) -> Option<usize> {
        Some(self as usize)
    }

    #[inline]
    fn intensity(self) -> f32 {
        f32::from(self)
    }
}

impl Sample for f32 {
    const LEVELS: usize = 0;
    const FULL_SCALE: f32 = 1.0;

    #[inline]
    fn level(self) -> Option<usize> {
        None
    }

    #[inline]
    fn intensity(self) -> f32 {
        self
    }

    fn greatest(plane: &ArrayView2<'_, Self>, channel: &str) -> Result<f32> {
        // Bits of positive numbers have the order of the numbers, and those of infinity and NaN are the greatest.
        let bits = plane.fold(0, |greatest: u32, value| greatest.max(value.abs().to_bits()));
        let greatest = Self::from_bits(bits);
        if greatest.is_finite() {
            return Ok(greatest);
        }
        let mut bad = plane.indexed_iter().filter(|(_, v)| !v.is_finite()).map(|(at, _)| at);
        let (row, column) = bad.next().unwrap_or_default();
        Err(Error::NotFinite { what: format!("{channel} image").into(), count: 1 + bad.count(), row, column })
    }
}
