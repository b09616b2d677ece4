//! The video signal at the input.

use super::Message;
use super::bytes::{Bytes, direction, from_u16s};
use crate::error::Result;

/// The video signal at the input. Rates are raw firmware values, whose units are not documented.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct VideoSignal {
    /// Detection state in the two lowest bits; 2 is locked.
    pub state: u8,
    /// Columns of the source.
    pub width_px: u16,
    /// Rows of the source.
    pub height_px: u16,
    /// Polarity of the horizontal synchronisation.
    pub hsync_polarity: u8,
    /// Polarity of the vertical synchronisation.
    pub vsync_polarity: u8,
    /// Pixel clock, raw.
    pub pixel_clock: u32,
    /// Line rate, raw.
    pub line_rate: u16,
    /// Frame rate, raw.
    pub frame_rate: u16,
    /// Columns, including blanking.
    pub total_px: u16,
    /// Lines, including blanking.
    pub total_lines: u16,
    /// Active columns.
    pub active_px: u16,
    /// Active lines.
    pub active_lines: u16,
    /// First active column.
    pub first_px: u16,
    /// First active line.
    pub first_line: u16,
}

impl VideoSignal {
    /// Whether the controller is locked to the source.
    pub fn locked(&self) -> bool {
        self.state & 3 == 2
    }
}

impl std::fmt::Display for VideoSignal {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let state = if self.locked() { "locked" } else { "no stable signal" };
        write!(f, "{state}, {} x {} pixels", self.active_px, self.active_lines)
    }
}

impl Message for VideoSignal {
    const WORD: u16 = 0x071C;
    const NAME: &'static str = "video signal";

    fn encode(&self) -> Result<Vec<u8>> {
        let mut data = vec![self.state];
        data.extend(from_u16s(&[self.width_px, self.height_px]));
        data.extend([0, self.hsync_polarity, self.vsync_polarity]);
        data.extend(self.pixel_clock.to_le_bytes());
        let (total, active) = ([self.total_px, self.total_lines], [self.active_px, self.active_lines]);
        let (rates, first) = ([self.line_rate, self.frame_rate], [self.first_px, self.first_line]);
        data.extend(from_u16s(&[rates, total, active, first].concat()));
        Ok(data)
    }

    fn decode(data: &[u8]) -> Result<Self> {
        let mut bytes = Bytes::new(Self::NAME, data);
        let state = bytes.u8()?;
        let [width_px, height_px] = bytes.u16s()?;
        let [_reserved, hsync_polarity, vsync_polarity] = [bytes.u8()?, bytes.u8()?, bytes.u8()?];
        let pixel_clock = bytes.u32()?;
        let [line_rate, frame_rate, total_px, total_lines, active_px, active_lines, first_px, first_line] =
            bytes.u16s()?;
        Ok(Self {
            state,
            width_px,
            height_px,
            hsync_polarity,
            vsync_polarity,
            pixel_clock,
            line_rate,
            frame_rate,
            total_px,
            total_lines,
            active_px,
            active_lines,
            first_px,
            first_line,
        })
    }
}

direction!(VideoSignal, read);
