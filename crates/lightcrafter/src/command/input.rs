//! The video input: source, colour coding, port clock, channel order.

use super::Message;
use super::bytes::{Bytes, choice, direction, in_range, values};
use crate::error::Result;

values! {
    /// Where the image of the video mode comes from.
    InputPort {
        /// The parallel port, which on the LightCrafter 4500 is HDMI.
        Parallel = 0,
        /// The generator of test patterns.
        TestPattern = 1,
        /// An image in flash.
        Flash = 2,
        /// The FPD-link connector.
        FpdLink = 3,
    }
}

values! {
    /// Bits per pixel on the parallel port.
    ParallelWidth {
        /// 30 bit.
        Bits30 = 0,
        /// 24 bit: HDMI on the LightCrafter 4500.
        Bits24 = 1,
        /// 20 bit.
        Bits20 = 2,
        /// 16 bit.
        Bits16 = 3,
        /// 10 bit.
        Bits10 = 4,
        /// 8 bit.
        Bits8 = 5,
    }
}

/// The input and its width.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct InputSource {
    /// The input.
    pub port: InputPort,
    /// Bits per pixel, used by the parallel port only.
    pub width: ParallelWidth,
}

impl InputSource {
    /// HDMI as the LightCrafter 4500 wires it.
    pub const HDMI: Self = Self { port: InputPort::Parallel, width: ParallelWidth::Bits24 };
    /// The generator of test patterns.
    pub const TEST_PATTERN: Self = Self { port: InputPort::TestPattern, width: ParallelWidth::Bits24 };
    /// An image in flash.
    pub const FLASH: Self = Self { port: InputPort::Flash, width: ParallelWidth::Bits24 };
}

impl Message for InputSource {
    const WORD: u16 = 0x1A00;
    const NAME: &'static str = "input source";

    fn encode(&self) -> Result<Vec<u8>> {
        Ok(vec![self.port as u8 | (self.width as u8) << 3])
    }

    fn decode(data: &[u8]) -> Result<Self> {
        let byte = Bytes::new(Self::NAME, data).u8()?;
        let port = InputPort::from_bits("port of the input source", byte & 7)?;
        let width = ParallelWidth::from_bits("width of the input source", byte >> 3 & 7)?;
        Ok(Self { port, width })
    }
}

direction!(InputSource, both);

choice! {
    /// Colour coding of the input.
    PixelFormat, 0x1A02, "pixel format", both, {
        /// RGB, full resolution: HDMI from a computer.
        Rgb444 = 0,
        /// Luma and chroma, full resolution.
        YCrCb444 = 1,
        /// Luma and chroma, with half the resolution in chroma.
        YCrCb422 = 2,
    }
}

choice! {
    /// Clock that samples the parallel port.
    PortClock, 0x1A03, "port clock", both, {
        /// Clock A.
        A = 0,
        /// Clock B.
        B = 1,
        /// Clock C.
        C = 2,
    }
}

values! {
    /// Port whose channels are swapped.
    SwapPort {
        /// The parallel port.
        Parallel = 0,
        /// The FPD-link connector.
        FpdLink = 1,
    }
}

values! {
    /// Order of the data channels A (green), B (red), C (blue).
    ChannelOrder {
        /// A, B, C: no swap.
        Abc = 0,
        /// C, A, B.
        Cab = 1,
        /// B, C, A.
        Bca = 2,
        /// A, C, B.
        Acb = 3,
        /// B, A, C: HDMI of the LightCrafter 4500.
        Bac = 4,
        /// C, B, A.
        Cba = 5,
    }
}

/// Swap of the data channels of one port.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct ChannelSwap {
    /// The port.
    pub port: SwapPort,
    /// The order.
    pub order: ChannelOrder,
}

impl Message for ChannelSwap {
    const WORD: u16 = 0x1A37;
    const NAME: &'static str = "channel swap";

    fn encode(&self) -> Result<Vec<u8>> {
        Ok(vec![(self.port as u8) << 7 | self.order as u8])
    }

    fn decode(data: &[u8]) -> Result<Self> {
        let byte = Bytes::new(Self::NAME, data).u8()?;
        let port = SwapPort::from_bits("port of the channel swap", byte >> 7)?;
        let order = ChannelOrder::from_bits("order of the channel swap", byte & 7)?;
        Ok(Self { port, order })
    }
}

direction!(ChannelSwap, both);

/// Reception of the FPD-link.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct FpdLink {
    /// Mapping of the bits, 0 to 3.
    pub map_mode: u8,
    /// Whether the pixel polarity is swapped.
    pub polarity_swapped: bool,
    /// Field signal, 0 to 7.
    pub field: u8,
}

impl Message for FpdLink {
    const WORD: u16 = 0x1A04;
    const NAME: &'static str = "FPD-link mode";

    fn encode(&self) -> Result<Vec<u8>> {
        let map_mode = in_range("FPD-link map mode", self.map_mode.into(), 0, 3)? as u8;
        let field = in_range("FPD-link field", self.field.into(), 0, 7)? as u8;
        Ok(vec![map_mode << 6 | u8::from(self.polarity_swapped) << 3 | field])
    }

    fn decode(data: &[u8]) -> Result<Self> {
        let byte = Bytes::new(Self::NAME, data).u8()?;
        Ok(Self { map_mode: byte >> 6, polarity_swapped: byte & 8 != 0, field: byte & 7 })
    }
}

direction!(FpdLink, both);
