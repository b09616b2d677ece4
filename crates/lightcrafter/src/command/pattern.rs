//! Pattern mode: source, timing, tables, validation, run state.

use super::Message;
use super::bytes::{Bytes, bits, checked, choice, direction, in_range, number, switch};
use crate::error::Result;

choice! {
    /// Where patterns come from.
    PatternSource, 0x1A22, "pattern source", both, {
        /// Bit planes of the video input.
        Video = 0,
        /// Images in flash.
        Flash = 3,
    }
}

choice! {
    /// What starts a pattern.
    TriggerMode, 0x1A23, "trigger mode", both, {
        /// Vertical synchronisation of the video input.
        VideoSync = 0,
        /// The internal clock or trigger input 1, as each entry selects.
        Internal = 1,
        /// Input 1 alternates between the two patterns of a pair; input 2 advances to the next pair.
        Alternate = 2,
        /// As `Internal`, with an exposure for each entry.
        VariableInternal = 3,
        /// As `VideoSync`, with an exposure for each entry.
        VariableVideoSync = 4,
    }
}

/// Exposure and period of all patterns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Timing {
    /// Exposure of each pattern, us.
    pub exposure_us: u32,
    /// Time from one start to the next, us.
    pub period_us: u32,
}

impl Timing {
    pub(super) fn take(bytes: &mut Bytes<'_>) -> Result<Self> {
        Ok(Self { exposure_us: bytes.u32()?, period_us: bytes.u32()? })
    }
}

impl Message for Timing {
    const WORD: u16 = 0x1A29;
    const NAME: &'static str = "exposure and period";

    fn encode(&self) -> Result<Vec<u8>> {
        Ok([self.exposure_us.to_le_bytes(), self.period_us.to_le_bytes()].concat())
    }

    fn decode(data: &[u8]) -> Result<Self> {
        Self::take(&mut Bytes::new(Self::NAME, data))
    }
}

direction!(Timing, both);

/// How many entries of the tables are used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LutControl {
    /// Entries of the pattern table, 1 to 128.
    pub entries: u16,
    /// Whether the sequence repeats.
    pub repeat: bool,
    /// Patterns to show, 1 to 256. In a repeating sequence: patterns per pulse of trigger output 2.
    pub patterns: u16,
    /// Entries of the image table, 1 to 64; unused for video.
    pub images: u16,
}

impl Message for LutControl {
    const WORD: u16 = 0x1A31;
    const NAME: &'static str = "control of the pattern table";

    fn encode(&self) -> Result<Vec<u8>> {
        let entries = in_range("pattern entries", self.entries.into(), 1, 128)?;
        let patterns = in_range("patterns to show", self.patterns.into(), 1, 256)?;
        let images = in_range("image entries", self.images.into(), 1, 64)?;
        Ok(vec![(entries - 1) as u8, u8::from(self.repeat), (patterns - 1) as u8, (images - 1) as u8])
    }

    fn decode(data: &[u8]) -> Result<Self> {
        let mut bytes = Bytes::new(Self::NAME, data);
        let (entries, repeat, patterns, images) = (bytes.u8()?, bytes.u8()?, bytes.u8()?, bytes.u8()?);
        let count = |last: u8| u16::from(last) + 1;
        checked(Self {
            entries: count(entries),
            repeat: repeat & 1 != 0,
            patterns: count(patterns),
            images: count(images),
        })
    }
}

direction!(LutControl, both);

choice! {
    /// Table that the mailbox writes to.
    Mailbox, 0x1A33, "mailbox", write, {
        /// None: the mailbox is closed and the controller uses the new tables.
        Close = 0,
        /// Image indexes.
        Images = 1,
        /// Patterns.
        Patterns = 2,
        /// Patterns with individual exposures.
        Variable = 3,
    }
}

number! {
    /// Entry at which the next data of the mailbox start, 0 to 127.
    MailboxOffset, 0x1A32, "mailbox offset", write, u8 up to 127
}

switch! {
    /// Invert all patterns.
    InvertData, 0x1A30, "inversion of all patterns", both
}

/// Make the controller validate the sequence; read [`Validation`] for the result.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Validate;

impl Message for Validate {
    const WORD: u16 = 0x1A1A;
    const NAME: &'static str = "validation";

    fn encode(&self) -> Result<Vec<u8>> {
        Ok(vec![0])
    }

    fn decode(data: &[u8]) -> Result<Self> {
        Bytes::new(Self::NAME, data).u8().map(|_| Self)
    }
}

direction!(Validate, write);

bits! {
    /// Result of the validation of a sequence.
    Validation, 0x1A1A, "result of the validation", read, {
        /// Exposure or period is not allowed.
        bad_timing = 0,
        /// A pattern number is not allowed.
        bad_number = 1,
        /// Trigger output 1 stays high, or black overlaps the next pattern.
        trigger_overlap = 2,
        /// No black before a pattern that waits for an external trigger.
        no_black_before_trigger = 3,
        /// Period and exposure differ by less than 230 us.
        short_gap = 4,
        /// The validation is still running.
        busy = 7,
    }
}

impl Validation {
    /// Faults that prevent the sequence from running, in words.
    pub fn errors(&self) -> Vec<&'static str> {
        let faults = [
            (self.bad_timing, "exposure or period is out of range for the bit depth"),
            (self.bad_number, "a pattern number does not exist at its bit depth"),
        ];
        named(&faults)
    }

    /// Faults that do not prevent the sequence from running, in words.
    pub fn warnings(&self) -> Vec<&'static str> {
        let faults = [
            (self.trigger_overlap, "trigger output 1 stays high, or black overlaps the next pattern"),
            (self.no_black_before_trigger, "no black before a pattern that waits for an external trigger"),
            (self.short_gap, "less than 230 us between the end of an exposure and the next one"),
        ];
        named(&faults)
    }
}

fn named(faults: &[(bool, &'static str)]) -> Vec<&'static str> {
    faults.iter().filter(|(set, _)| *set).map(|(_, name)| *name).collect()
}

choice! {
    /// Run state of the sequence.
    RunState, 0x1A24, "run state", both, {
        /// Stopped. The tables must be sent again before the next start.
        Stop = 0,
        /// Paused: the current pattern stays on.
        Pause = 1,
        /// Running.
        Start = 2,
    }
}
