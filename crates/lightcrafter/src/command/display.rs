//! The display path: mode, area, flips, gamma.

use super::Message;
use super::bytes::{Bytes, checked, choice, direction, from_u16s, in_range, switch};
use crate::error::Result;

choice! {
    /// What the mirrors show. Writing the present mode again can freeze the chip, so the driver skips such writes.
    DisplayMode, 0x1A1B, "display mode", both, {
        /// The input as video; the firmware mixes the colours.
        Video = 0,
        /// Bit planes in the order and timing of a pattern sequence.
        PatternSequence = 1,
    }
}

/// A part of an image.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Rectangle {
    /// First column.
    pub first_px: u16,
    /// First row.
    pub first_line: u16,
    /// Columns.
    pub width_px: u16,
    /// Rows.
    pub height_px: u16,
}

/// Which part of the input is shown, and where on the mirrors; video mode only. Inputs have up to 1280 columns (1280 x 800)
/// and up to 1140 rows (912 x 1140).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct DisplayArea {
    /// Part of the input.
    pub input: Rectangle,
    /// Place on the mirrors.
    pub display: Rectangle,
}

impl Message for DisplayArea {
    const WORD: u16 = 0x1000;
    const NAME: &'static str = "display area";

    fn encode(&self) -> Result<Vec<u8>> {
        let words = |r: &Rectangle| from_u16s(&[r.first_px, r.first_line, r.width_px, r.height_px]);
        in_range("input width in px", self.input.width_px.into(), 0, 1280)?;
        in_range("input height in px", self.input.height_px.into(), 0, 1140)?;
        Ok([words(&self.input), words(&self.display)].concat())
    }

    fn decode(data: &[u8]) -> Result<Self> {
        let mut bytes = Bytes::new(Self::NAME, data);
        let mut next = || {
            bytes.u16s().map(|[first_px, first_line, width_px, height_px]| Rectangle {
                first_px,
                first_line,
                width_px,
                height_px,
            })
        };
        checked(Self { input: next()?, display: next()? })
    }
}

direction!(DisplayArea, both);

switch! {
    /// Mirror the image along its long axis; in pattern mode this takes effect with the next image.
    LongAxisFlip, 0x1008, "long-axis flip", both
}

switch! {
    /// Mirror the image along its short axis; in pattern mode this takes effect with the next image.
    ShortAxisFlip, 0x1009, "short-axis flip", both
}

/// Gamma table of the video mode, enabled after power-on. Pattern mode is always linear.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Gamma {
    /// Whether the table is applied; without it video is linear light.
    pub enabled: bool,
    /// The table, 0 or 1.
    pub table: u8,
}

impl Gamma {
    /// Linear light, which fringes need.
    pub const LINEAR: Self = Self { enabled: false, table: 0 };
}

impl Message for Gamma {
    const WORD: u16 = 0x1A0E;
    const NAME: &'static str = "gamma";

    fn encode(&self) -> Result<Vec<u8>> {
        let table = in_range("gamma table", self.table.into(), 0, 1)? as u8;
        Ok(vec![u8::from(self.enabled) << 7 | table])
    }

    fn decode(data: &[u8]) -> Result<Self> {
        let byte = Bytes::new(Self::NAME, data).u8()?;
        Ok(Self { enabled: byte & 0x80 != 0, table: byte & 1 })
    }
}

direction!(Gamma, both);
