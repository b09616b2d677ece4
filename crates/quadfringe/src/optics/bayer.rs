//! Bayer patterns: the colour filters of a chip that measures one colour at each pixel.

use crate::encoding::Channel;
use crate::error::{Error, Limit, Result};

/// Colours of the first two pixels of the first row and of the second row of a Bayer chip, row by row.
///
/// ```
/// use quadfringe::{BayerPattern, Channel};
/// let pattern = BayerPattern::from_name("grbg")?;
/// assert_eq!(pattern.channel(0, 1), Channel::R);
/// assert_eq!(pattern.channel(1, 0), Channel::B);
/// # Ok::<(), quadfringe::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum BayerPattern {
    /// R G over G B.
    Rggb,
    /// G R over B G.
    Grbg,
    /// G B over R G.
    Gbrg,
    /// B G over G R.
    Bggr,
}

impl BayerPattern {
    /// All four patterns.
    pub const ALL: [Self; 4] = [Self::Rggb, Self::Grbg, Self::Gbrg, Self::Bggr];

    /// Parse a name: rggb, grbg, gbrg or bggr.
    ///
    /// # Errors
    /// [`Error::Value`] for any other name; it lists the four valid names.
    pub fn from_name(name: &str) -> Result<Self> {
        let found = Self::ALL.into_iter().find(|pattern| pattern.name() == name);
        let known = Limit::OneOf(&["rggb", "grbg", "gbrg", "bggr"]);
        found.ok_or_else(|| Error::value("Bayer pattern", known, format!("{name:?}")))
    }

    /// Name of the pattern: four letters in the order of the pixels.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Rggb => "rggb",
            Self::Grbg => "grbg",
            Self::Gbrg => "gbrg",
            Self::Bggr => "bggr",
        }
    }

    /// Colour of a pixel: R, G or B.
    #[must_use]
    pub const fn channel(self, row: usize, column: usize) -> Channel {
        let [red_row, red_column] = self.first_red();
        match ((row + red_row) % 2, (column + red_column) % 2) {
            (0, 0) => Channel::R,
            (1, 1) => Channel::B,
            _ => Channel::G,
        }
    }

    /// Row and column, 0 or 1, of the first pixel of R.
    #[must_use]
    pub(crate) const fn first_red(self) -> [usize; 2] {
        match self {
            Self::Rggb => [0, 0],
            Self::Grbg => [0, 1],
            Self::Gbrg => [1, 0],
            Self::Bggr => [1, 1],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_name_spells_the_first_four_pixels() {
        for pattern in BayerPattern::ALL {
            let pixels = [(0, 0), (0, 1), (1, 0), (1, 1)];
            let spelled: String = pixels.iter().map(|&(y, x)| pattern.channel(y + 4, x + 2).name()).collect();
            assert_eq!(spelled.to_lowercase(), pattern.name());
            assert_eq!(BayerPattern::from_name(pattern.name()), Ok(pattern));
        }
        let error = BayerPattern::from_name("rgbg").unwrap_err().to_string();
        assert!(error.contains("rggb, grbg, gbrg or bggr") && error.contains("rgbg"), "{error}");
    }
}
