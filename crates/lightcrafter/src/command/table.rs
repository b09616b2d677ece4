//! Tables of pattern mode: patterns, images, and patterns with individual exposures.

use super::Message;
use super::bytes::{Bytes, checked, direction, in_range, number, values};
use super::pattern::Timing;
use crate::error::Result;

values! {
    /// What starts an entry of the pattern table.
    EntryTrigger {
        /// The internal clock.
        Internal = 0,
        /// The rising edge of an external signal, or the start of a video frame.
        Rising = 1,
        /// The falling edge of an external signal.
        Falling = 2,
        /// The end of the previous entry.
        Continue = 3,
    }
}

/// One pattern: its bit planes, its LEDs, and its transitions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LutEntry {
    /// What starts it.
    pub trigger: EntryTrigger,
    /// Number of the pattern among those of its bit depth, 0 to 63.
    pub number: u8,
    /// Bits per pixel, 1 to 8.
    pub bit_depth: u8,
    /// LEDs: bit 0 red, bit 1 green, bit 2 blue.
    pub leds: u8,
    /// Whether the pattern is inverted.
    pub invert: bool,
    /// Insert 230 us of black after the pattern.
    pub black_after: bool,
    /// Switch to the next image before this pattern.
    pub next_image: bool,
    /// Share the exposure of the previous entry; trigger output 1 stays high.
    pub shares_exposure: bool,
}

impl LutEntry {
    /// The 24 bits of the entry.
    fn to_word(self) -> Result<u32> {
        let number = in_range("pattern number", self.number.into(), 0, 63)?;
        let depth = in_range("bit depth", self.bit_depth.into(), 1, 8)?;
        let leds = in_range("LED selection", self.leds.into(), 0, 7)?;
        let flags =
            [(self.invert, 16), (self.black_after, 17), (self.next_image, 18), (self.shares_exposure, 19)];
        let flags = flags.iter().fold(0, |word, (set, bit)| word | u32::from(*set) << bit);
        Ok(self.trigger as u32 | number << 2 | depth << 8 | leds << 12 | flags)
    }

    fn from_word(word: u32) -> Result<Self> {
        let entry = Self {
            trigger: EntryTrigger::from_bits("trigger of a pattern", (word & 3) as u8)?,
            number: (word >> 2 & 63) as u8,
            bit_depth: (word >> 8 & 15) as u8,
            leds: (word >> 12 & 7) as u8,
            invert: word & 1 << 16 != 0,
            black_after: word & 1 << 17 != 0,
            next_image: word & 1 << 18 != 0,
            shares_exposure: word & 1 << 19 != 0,
        };
        entry.to_word()?;
        Ok(entry)
    }
}

/// Entries for the open mailbox [`Mailbox::Patterns`](super::Mailbox::Patterns), at most 128.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct PatternTable(pub Vec<LutEntry>);

impl Message for PatternTable {
    const WORD: u16 = 0x1A34;
    const NAME: &'static str = "pattern table";

    fn encode(&self) -> Result<Vec<u8>> {
        in_range("pattern entries", self.0.len() as u32, 1, 128)?;
        let words: Result<Vec<u32>> = self.0.iter().map(|entry| entry.to_word()).collect();
        Ok(words?.iter().flat_map(|word| word.to_le_bytes().into_iter().take(3)).collect())
    }

    fn decode(data: &[u8]) -> Result<Self> {
        let mut bytes = Bytes::new(Self::NAME, data);
        let entries: Result<Vec<_>> =
            (0..data.len() / 3).map(|_| bytes.u24().and_then(LutEntry::from_word)).collect();
        checked(Self(entries?))
    }
}

direction!(PatternTable, both);

/// Flash images for the open mailbox [`Mailbox::Images`](super::Mailbox::Images), at most 64. The firmware
/// expects a table of exactly two images in reverse order.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct ImageTable(pub Vec<u8>);

impl ImageTable {
    fn swapped_if_two(mut images: Vec<u8>) -> Vec<u8> {
        if images.len() == 2 {
            images.swap(0, 1);
        }
        images
    }
}

impl Message for ImageTable {
    const WORD: u16 = 0x1A34;
    const NAME: &'static str = "image table";

    fn encode(&self) -> Result<Vec<u8>> {
        in_range("image entries", self.0.len() as u32, 1, 64)?;
        Ok(Self::swapped_if_two(self.0.clone()))
    }

    fn decode(data: &[u8]) -> Result<Self> {
        checked(Self(Self::swapped_if_two(data.to_vec())))
    }
}

direction!(ImageTable, both);

number! {
    /// Index of the next [`VariableEntry`], 0 to 1823; send it before each entry.
    VariableOffset, 0x1A3F, "offset in the variable table", write, u16 up to 1823
}

/// A pattern with an individual exposure; needs firmware 3.0 or newer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct VariableEntry {
    /// The pattern.
    pub entry: LutEntry,
    /// Its exposure and period.
    pub timing: Timing,
}

impl Message for VariableEntry {
    const WORD: u16 = 0x1A3E;
    const NAME: &'static str = "entry of the variable table";

    fn encode(&self) -> Result<Vec<u8>> {
        Ok([self.entry.to_word()?.to_le_bytes().to_vec(), self.timing.encode()?].concat())
    }

    fn decode(data: &[u8]) -> Result<Self> {
        let mut bytes = Bytes::new(Self::NAME, data);
        let entry = LutEntry::from_word(bytes.u32()?)?;
        Ok(Self { entry, timing: Timing::take(&mut bytes)? })
    }
}

direction!(VariableEntry, write);

/// How many entries of the variable table are used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct VariableControl {
    /// Entries of the table, 1 to 1824.
    pub entries: u16,
    /// Patterns to show, 1 to 1824.
    pub patterns: u16,
    /// Entries of the image table, 1 to 256.
    pub images: u16,
    /// Whether the sequence repeats.
    pub repeat: bool,
}

impl Message for VariableControl {
    const WORD: u16 = 0x1A40;
    const NAME: &'static str = "control of the variable table";

    fn encode(&self) -> Result<Vec<u8>> {
        let entries = in_range("variable entries", self.entries.into(), 1, 1824)? as u16;
        let patterns = in_range("patterns to show", self.patterns.into(), 1, 1824)? as u16;
        let images = in_range("image entries", self.images.into(), 1, 256)?;
        let mut data = [(entries - 1).to_le_bytes(), (patterns - 1).to_le_bytes()].concat();
        data.extend([(images - 1) as u8, u8::from(self.repeat)]);
        Ok(data)
    }

    fn decode(data: &[u8]) -> Result<Self> {
        let mut bytes = Bytes::new(Self::NAME, data);
        let (entries, patterns, images, repeat) = (bytes.u16()?, bytes.u16()?, bytes.u8()?, bytes.u8()?);
        checked(Self {
            entries: entries.saturating_add(1),
            patterns: patterns.saturating_add(1),
            images: u16::from(images) + 1,
            repeat: repeat & 1 != 0,
        })
    }
}

direction!(VariableControl, both);
