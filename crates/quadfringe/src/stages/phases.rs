//! The three phases that four channels measure.

/// One value for each phase of the four-channel encoding: R and B together, G, IR.
///
/// ```
/// use quadfringe::stages::Phases;
/// let turns = Phases { quadrature: 0.25, green: 0.5, infrared: 0.75 };
/// let radians = turns.map(|turns| turns * std::f64::consts::TAU);
/// assert_eq!(radians.green, std::f64::consts::PI);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Phases<T> {
    /// The phase of R and B, which are a quarter period apart: the first fringe number.
    pub quadrature: T,
    /// The phase of G: the second fringe number.
    pub green: T,
    /// The phase of IR: the third fringe number.
    pub infrared: T,
}

impl<T> Phases<T> {
    /// From an array in the order of the fringe numbers: R and B, G, IR.
    #[inline(always)]
    pub fn from_array([quadrature, green, infrared]: [T; 3]) -> Self {
        Self { quadrature, green, infrared }
    }

    /// Applies a function to each phase.
    #[inline(always)]
    pub fn map<U>(self, mut f: impl FnMut(T) -> U) -> Phases<U> {
        Phases { quadrature: f(self.quadrature), green: f(self.green), infrared: f(self.infrared) }
    }

    /// Borrows each phase.
    #[inline(always)]
    pub const fn as_ref(&self) -> Phases<&T> {
        Phases { quadrature: &self.quadrature, green: &self.green, infrared: &self.infrared }
    }
}
