//! Status, versions and power.

use super::Message;
use super::Writable;
use super::bytes::{Bytes, bits, direction, number, switch};
use crate::error::{Error, Result};
use crate::packet::Access;

bits! {
    /// State of the hardware.
    HardwareStatus, 0x1A0A, "hardware status", read, {
        /// Initialisation succeeded.
        initialised = 0,
        /// The reset controller of the mirrors overlapped two operations.
        reset_overlap = 2,
        /// A forced buffer swap: patterns were shown faster than they could be loaded.
        forced_swap = 3,
        /// The sequencer aborted.
        sequencer_abort = 6,
        /// The sequencer reports an error.
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
    /// State of the display.
    MainStatus, 0x1A0C, "main status", read, {
        /// The mirrors are parked, so no image is shown.
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
    /// The programming interface of the firmware.
    pub api: Version,
    /// The configuration of the firmware.
    pub software: Version,
    /// The sequences of the firmware.
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

/// Tag that the firmware image was given when it was built, at most 32 ASCII characters.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct FirmwareTag(pub String);

impl Message for FirmwareTag {
    const WORD: u16 = 0x1AFF;
    const NAME: &'static str = "firmware tag";

    fn encode(&self) -> Result<Vec<u8>> {
        let printable = self.0.bytes().all(|byte| byte.is_ascii() && byte != 0);
        if self.0.len() > 32 || !printable {
            return Err(Error::value(Self::NAME, "at most 32 ASCII characters", format!("{:?}", self.0)));
        }
        let mut data = self.0.clone().into_bytes();
        data.resize(32, 0);
        Ok(data)
    }

    fn decode(data: &[u8]) -> Result<Self> {
        let text = data.split(|byte| *byte == 0).next().unwrap_or_default();
        let printable = text.len() <= 32 && text.is_ascii() && !data.is_empty();
        let expected = "at most 32 ASCII characters";
        if !printable {
            return Err(Error::malformed(Self::NAME, expected, format!("{text:02x?}")));
        }
        Ok(Self(text.iter().copied().map(char::from).collect()))
    }
}

direction!(FirmwareTag, read);

number! {
    /// Number of 24-bit images in flash.
    FlashImageCount, 0x1A42, "number of images in flash", read, u8 up to 255
}

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

    /// Any value except 0 in the two lowest bits means standby.
    fn decode(data: &[u8]) -> Result<Self> {
        let asleep = Bytes::new(Self::NAME, data).u8()? & 3 != 0;
        Ok(if asleep { Self::Standby } else { Self::Normal })
    }
}

direction!(PowerMode, both);

/// Restart the firmware. The device does not acknowledge and disappears from the bus for some seconds.
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
    /// Park the mirrors for transport or storage.
    DmdPark, 0x0609, "mirror parking", write
}

switch! {
    /// Keep the image and ignore new ones.
    DisplayFreeze, 0x100A, "display freeze", both
}
