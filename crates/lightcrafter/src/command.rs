//! One struct per message of the controller, with its word, its name and its bytes.
//!
//! Registers that can be read and written have one type for both; where the two differ there are two types with the
//! same word. What is outside the range of a register is an error when encoded, and never truncated.

mod bytes;
mod display;
mod led;
mod pattern;
mod picture;
mod status;
mod table;
mod trigger;

pub use display::{
    ChannelOrder, ChannelSwap, DisplayArea, DisplayMode, FpdLink, Gamma, InputPort, InputSource,
    LongAxisFlip, ParallelWidth, PixelFormat, PortClock, Rectangle, ShortAxisFlip, SwapPort,
};
pub use led::{BlueLedDelay, GreenLedDelay, LedCurrent, LedEnable, LedPolarity, RedLedDelay};
pub use pattern::{
    InvertData, LutControl, Mailbox, MailboxOffset, PatternSource, RunState, Timing, TriggerMode, Validate,
    Validation,
};
pub use picture::{Curtain, FlashImage, ImageLoadTime, MeasureImageLoad, TestPattern, TestPatternColours};
pub use status::{
    DisplayFreeze, DmdPark, FirmwareTag, FlashImageCount, HardwareStatus, MainStatus, PowerMode,
    SoftwareReset, SystemStatus, Version, Versions, VideoSignal,
};
pub use table::{
    EntryTrigger, ImageTable, LutEntry, PatternTable, VariableControl, VariableEntry, VariableOffset,
};
pub use trigger::{EdgeDelay, TriggerIn1Delay, TriggerIn2Edge, TriggerOut1, TriggerOut2};

use crate::error::Result;
use crate::packet::Access;

/// A message: its word, its name in errors, its bytes.
pub trait Message: Sized {
    /// Command word, CMD2 in the high byte and CMD3 in the low one.
    const WORD: u16;
    /// What it is, in the words of a user.
    const NAME: &'static str;

    /// The data bytes; an error when a field is outside its range.
    fn encode(&self) -> Result<Vec<u8>>;

    /// The message of these data bytes; an error when there are too few or one of them has no meaning.
    fn decode(data: &[u8]) -> Result<Self>;
}

/// A message that the device gives when asked.
pub trait Readable: Message {}

/// A message that the device takes.
pub trait Writable: Message {
    /// Acknowledged, unless the device leaves the bus upon it.
    const ACCESS: Access = Access::Write;
}

/// Call a macro with every message of [`command`](crate::command), whose names must be in scope: `$visit!(Type, read)`,
/// `(Type, write)` or `(Type, both)`.
#[macro_export]
macro_rules! for_each_message {
    ($visit:ident) => {
        $visit!(HardwareStatus, read);
        $visit!(SystemStatus, read);
        $visit!(MainStatus, read);
        $visit!(Versions, read);
        $visit!(FirmwareTag, read);
        $visit!(FlashImageCount, read);
        $visit!(PowerMode, both);
        $visit!(SoftwareReset, write);
        $visit!(DmdPark, write);
        $visit!(DisplayFreeze, both);
        $visit!(VideoSignal, read);
        $visit!(DisplayMode, both);
        $visit!(InputSource, both);
        $visit!(PixelFormat, both);
        $visit!(PortClock, both);
        $visit!(ChannelSwap, both);
        $visit!(FpdLink, both);
        $visit!(DisplayArea, both);
        $visit!(TestPattern, both);
        $visit!(TestPatternColours, both);
        $visit!(FlashImage, both);
        $visit!(MeasureImageLoad, write);
        $visit!(ImageLoadTime, read);
        $visit!(LongAxisFlip, both);
        $visit!(ShortAxisFlip, both);
        $visit!(Gamma, both);
        $visit!(Curtain, both);
        $visit!(LedEnable, both);
        $visit!(LedCurrent, both);
        $visit!(LedPolarity, both);
        $visit!(RedLedDelay, both);
        $visit!(GreenLedDelay, both);
        $visit!(BlueLedDelay, both);
        $visit!(PatternSource, both);
        $visit!(TriggerMode, both);
        $visit!(Timing, both);
        $visit!(LutControl, both);
        $visit!(Mailbox, write);
        $visit!(MailboxOffset, write);
        $visit!(PatternTable, both);
        $visit!(ImageTable, both);
        $visit!(VariableOffset, write);
        $visit!(VariableEntry, write);
        $visit!(VariableControl, both);
        $visit!(InvertData, both);
        $visit!(Validate, write);
        $visit!(Validation, read);
        $visit!(RunState, both);
        $visit!(TriggerOut1, both);
        $visit!(TriggerOut2, both);
        $visit!(TriggerIn1Delay, both);
        $visit!(TriggerIn2Edge, both);
    };
}
