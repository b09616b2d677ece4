//! Status, versions and power.

use super::Message;
use super::Writable;
use super::bytes::{Bytes, bits, direction, from_u16s, switch};
use crate::error::{Error, Result};
use crate::packet::Access;

bits! {
    /// What the hardware reports of itself.
    HardwareStatus, 0x1A0A, "hardware status", read, {
        /// Initialisation succeeded.
        initialised = 0,
        /// The reset controller of the mirrors overlapped two operations.
        reset_overlap = 2,
        /// A buffer was swapped by force: patterns came faster than they could be loaded.
        forced_swap = 3,
        /// The sequencer gave up.
        sequencer_abort = 6,
        /// The sequencer found an error.
        sequencer_error = 7,
    }
}

bits! {
    /// The self-test of the controller.
    SystemStatus, 0x1A0B, "system status", read, {
        /// Internal memory passed its test.
        memory_passed = 0,
    }
}

bits! {
    /// What the display does at the moment.
    MainStatus, 0x1A0C, "main status", read, {
        /// The mirrors are parked: nothing is shown.
        parked = 0,
        /// The sequencer runs.
        running = 1,
        /// The frame buffer is frozen.
        frozen = 2,
        /// The de-gamma of the video mode is on.
        gamma = 3,
    }
}

/// A version number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub struct Version {
    /// First number.
    pub major: u8,
    /// Second number.
    pub minor: u8,
    /// Third number.
    pub patch: u16,
}

impl Version {
    fn from_word(word: u32) -> Self {
        Self { major: (word >> 24) as u8, minor: (word >> 16) as u8, patch: word as u16 }
    }

    fn to_word(self) -> u32 {
        u32::from(self.major) << 24 | u32::from(self.minor) << 16 | u32::from(self.patch)
    }
}

impl std::fmt::Display for Version {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}.{}.{}", self.major, self.minor, self.patch)
    }
}

/// Versions of the firmware and its parts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Versions {
    /// The firmware itself.
    pub application: Version,
    /// Its programming interface.
    pub api: Version,
    /// Its configuration.
    pub software: Version,
    /// Its sequences.
    pub sequencer: Version,
}

impl Message for Versions {
    const WORD: u16 = 0x0205;
    const NAME: &'static str = "versions";

    fn encode(&self) -> Result<Vec<u8>> {
        let versions = [self.application, self.api, self.software, self.sequencer];
        Ok(versions.iter().flat_map(|version| version.to_word().to_le_bytes()).collect())
    }

    fn decode(data: &[u8]) -> Result<Self> {
        let mut bytes = Bytes::new(Self::NAME, data);
        let mut next = || bytes.u32().map(Version::from_word);
        Ok(Self { application: next()?, api: next()?, software: next()?, sequencer: next()? })
    }
}

direction!(Versions, read);

/// The name that the maker of a firmware image gave it, at most 32 characters of ASCII.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct FirmwareTag(pub String);

impl Message for FirmwareTag {
    const WORD: u16 = 0x1AFF;
    const NAME: &'static str = "firmware tag";

    fn encode(&self) -> Result<Vec<u8>> {
        let printable = self.0.bytes().all(|byte| byte.is_ascii() && byte != 0);
        if self.0.len() > 32 || !printable {
            return Err(Error::value(Self::NAME, "at most 32 characters of ASCII", format!("{:?}", self.0)));
        }
        let mut data = self.0.clone().into_bytes();
        data.resize(32, 0);
        Ok(data)
    }

    fn decode(data: &[u8]) -> Result<Self> {
        let text = data.split(|byte| *byte == 0).next().unwrap_or_default();
        let printable = text.len() <= 32 && text.is_ascii() && !data.is_empty();
        let expected = "at most 32 characters of ASCII";
        if !printable {
            return Err(Error::malformed(Self::NAME, expected, format!("{text:02x?}")));
        }
        Ok(Self(text.iter().copied().map(char::from).collect()))
    }
}

direction!(FirmwareTag, read);

/// How many images of 24 bit are in flash.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct FlashImageCount(pub u8);

impl Message for FlashImageCount {
    const WORD: u16 = 0x1A42;
    const NAME: &'static str = "number of images in flash";

    fn encode(&self) -> Result<Vec<u8>> {
        Ok(vec![self.0])
    }

    fn decode(data: &[u8]) -> Result<Self> {
        Ok(Self(Bytes::new(Self::NAME, data).u8()?))
    }
}

direction!(FlashImageCount, read);

/// Power of the controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum PowerMode {
    /// Awake.
    Normal,
    /// Asleep: no light, mirrors parked.
    Standby,
}

impl Message for PowerMode {
    const WORD: u16 = 0x0200;
    const NAME: &'static str = "power mode";

    fn encode(&self) -> Result<Vec<u8>> {
        Ok(vec![u8::from(*self == Self::Standby)])
    }

    /// Anything in the two lowest bits means standby.
    fn decode(data: &[u8]) -> Result<Self> {
        let asleep = Bytes::new(Self::NAME, data).u8()? & 3 != 0;
        Ok(if asleep { Self::Standby } else { Self::Normal })
    }
}

direction!(PowerMode, both);

/// Start the firmware again; the device leaves the bus for some seconds and does not acknowledge.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SoftwareReset;

impl Message for SoftwareReset {
    const WORD: u16 = 0x0802;
    const NAME: &'static str = "software reset";

    fn encode(&self) -> Result<Vec<u8>> {
        Ok(Vec::new())
    }

    fn decode(_: &[u8]) -> Result<Self> {
        Ok(Self)
    }
}

impl Writable for SoftwareReset {
    const ACCESS: Access = Access::WriteUnacknowledged;
}

switch! {
    /// Park the mirrors, for transport and long rests.
    DmdPark, 0x0609, "mirror parking", write
}

switch! {
    /// Hold the image that is shown, whatever arrives.
    DisplayFreeze, 0x100A, "display freeze", both
}

/// The video signal that the controller sees. Rates are as the firmware gives them; their units are not documented.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct VideoSignal {
    /// State of the detection in the two lowest bits: 2 is locked.
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
    /// Columns, blanking included.
    pub total_px: u16,
    /// Lines, blanking included.
    pub total_lines: u16,
    /// Columns with image.
    pub active_px: u16,
    /// Lines with image.
    pub active_lines: u16,
    /// First column with image.
    pub first_px: u16,
    /// First line with image.
    pub first_line: u16,
}

impl VideoSignal {
    /// Whether the controller follows the source.
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
