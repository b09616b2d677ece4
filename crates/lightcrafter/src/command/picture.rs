//! Images that the controller provides: test patterns, flash images, the curtain.

use super::Message;
use super::bytes::{Bytes, checked, choice, direction, from_u16s, in_range, number};
use crate::error::Result;

choice! {
    /// Image of the test pattern generator.
    TestPattern, 0x1203, "test pattern", both, {
        /// One colour.
        Solid = 0,
        /// Ramp from left to right.
        HorizontalRamp = 1,
        /// Ramp from top to bottom.
        VerticalRamp = 2,
        /// Horizontal lines.
        HorizontalLines = 3,
        /// Diagonal lines.
        DiagonalLines = 4,
        /// Vertical lines.
        VerticalLines = 5,
        /// A grid.
        Grid = 6,
        /// A checkerboard.
        Checkerboard = 7,
        /// Ramps of red, green and blue.
        RgbRamp = 8,
        /// Bars of colours.
        ColourBars = 9,
        /// Bars in steps.
        StepBars = 10,
    }
}

/// The two colours of test patterns: red, green, blue, each from 0 to 1023.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct TestPatternColours {
    /// Lines, squares, and the bright end of ramps.
    pub foreground: [u16; 3],
    /// The areas between them.
    pub background: [u16; 3],
}

impl Message for TestPatternColours {
    const WORD: u16 = 0x1204;
    const NAME: &'static str = "test pattern colours";

    fn encode(&self) -> Result<Vec<u8>> {
        Ok([colour_bytes(self.foreground)?, colour_bytes(self.background)?].concat())
    }

    fn decode(data: &[u8]) -> Result<Self> {
        let mut bytes = Bytes::new(Self::NAME, data);
        checked(Self { foreground: bytes.u16s()?, background: bytes.u16s()? })
    }
}

direction!(TestPatternColours, both);

fn colour_bytes(colour: [u16; 3]) -> Result<Vec<u8>> {
    for value in colour {
        in_range("colour of 10 bit", value.into(), 0, 1023)?;
    }
    Ok(from_u16s(&colour))
}

number! {
    /// Show the flash image of this number (video mode with the input from flash).
    FlashImage, 0x1A39, "flash image", both, u8 up to 255
}

/// Measure how long flash images take to load; read [`ImageLoadTime`] for the result.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct MeasureImageLoad {
    /// First image.
    pub first: u8,
    /// Number of images.
    pub count: u8,
}

impl Message for MeasureImageLoad {
    const WORD: u16 = 0x1A3A;
    const NAME: &'static str = "measurement of image loading";

    fn encode(&self) -> Result<Vec<u8>> {
        Ok(vec![self.first, self.count])
    }

    fn decode(data: &[u8]) -> Result<Self> {
        let mut bytes = Bytes::new(Self::NAME, data);
        Ok(Self { first: bytes.u8()?, count: bytes.u8()? })
    }
}

direction!(MeasureImageLoad, write);

/// Result of [`MeasureImageLoad`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ImageLoadTime {
    /// Ticks of 18.667 MHz.
    pub ticks: u32,
}

impl ImageLoadTime {
    /// Time in ms.
    pub fn milliseconds(&self) -> f64 {
        f64::from(self.ticks) / 18667.0
    }
}

impl Message for ImageLoadTime {
    const WORD: u16 = 0x1A3A;
    const NAME: &'static str = "image load time";

    fn encode(&self) -> Result<Vec<u8>> {
        Ok(self.ticks.to_le_bytes().to_vec())
    }

    fn decode(data: &[u8]) -> Result<Self> {
        Ok(Self { ticks: Bytes::new(Self::NAME, data).u32()? })
    }
}

direction!(ImageLoadTime, read);

/// Colour around the image: red, green, blue, each from 0 to 1023.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Curtain(pub [u16; 3]);

impl Message for Curtain {
    const WORD: u16 = 0x1100;
    const NAME: &'static str = "curtain colour";

    fn encode(&self) -> Result<Vec<u8>> {
        colour_bytes(self.0)
    }

    fn decode(data: &[u8]) -> Result<Self> {
        checked(Self(Bytes::new(Self::NAME, data).u16s()?))
    }
}

direction!(Curtain, both);
