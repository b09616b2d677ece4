//! Why a pixel has no data.

/// Why a pixel of a [`Decoded`](crate::Decoded) shot has no data. If several reasons apply, the first in this list counts.
///
/// ```
/// use quadfringe::Reason;
/// assert_eq!(Reason::Shadow as u8, 3);
/// assert_eq!(Reason::ALL[3].name(), "SHADOW");
/// ```
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(u8)]
#[non_exhaustive]
pub enum Reason {
    /// The pixel has data.
    #[default]
    Returned = 0,
    /// One of the two camera chips does not see it.
    NoImage = 1,
    /// A channel is saturated.
    Saturated = 2,
    /// Too little light for the least modulation: a shadow, or a dark surface.
    Shadow = 3,
    /// Light without fringes: ambient light, defocus, or a surface that scatters light inside.
    LowModulation = 4,
    /// At a step in depth, where the pixel sees two surfaces or the order of one side is wrong.
    Discontinuity = 5,
    /// The channels contradict one surface: light from elsewhere, gloss, motion, or a wrong response.
    Misfit = 6,
    /// Another fringe order explains the light nearly as well.
    DoubtfulOrder = 7,
    /// Part of a strip or piece of surface that is too small to be trusted.
    SmallPiece = 8,
    /// It moved too fast between the exposures of the channels.
    Moved = 9,
    /// Outside the projector image, or the rays do not meet.
    OutOfRange = 10,
}

impl Reason {
    /// All reasons, in the order of their numbers.
    pub const ALL: [Self; 11] = [
        Self::Returned,
        Self::NoImage,
        Self::Saturated,
        Self::Shadow,
        Self::LowModulation,
        Self::Discontinuity,
        Self::Misfit,
        Self::DoubtfulOrder,
        Self::SmallPiece,
        Self::Moved,
        Self::OutOfRange,
    ];

    /// Name in files and in Python.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Returned => "RETURNED",
            Self::NoImage => "NO_IMAGE",
            Self::Saturated => "SATURATED",
            Self::Shadow => "SHADOW",
            Self::LowModulation => "LOW_MODULATION",
            Self::Discontinuity => "DISCONTINUITY",
            Self::Misfit => "MISFIT",
            Self::DoubtfulOrder => "DOUBTFUL_ORDER",
            Self::SmallPiece => "SMALL_PIECE",
            Self::Moved => "MOVED",
            Self::OutOfRange => "OUT_OF_RANGE",
        }
    }

    /// The reason of a pixel without fringes. Light of less than the least modulation could not hold such fringes.
    #[inline(always)]
    pub(crate) fn without_fringes(light: f32, modulation_min: f32) -> Self {
        if light < modulation_min { Self::Shadow } else { Self::LowModulation }
    }
}

/// Marks the pixels that count as returned, but have lost their data because they are out of range.
pub(crate) fn mark_out_of_range<'a>(known: impl Iterator<Item = &'a f32>, reasons: &mut [Reason]) {
    for (reason, known) in reasons.iter_mut().zip(known) {
        let lost = known.is_nan() & (*reason == Reason::Returned);
        *reason = if lost { Reason::OutOfRange } else { *reason };
    }
}
