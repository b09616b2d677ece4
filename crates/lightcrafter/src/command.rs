//! One struct per message of the controller: command word, name and encoding.
//!
//! Registers that can be read and written have one type for both; where reading and writing differ there are two types
//! with the same word. Encoding a value outside the range of its register is an error; no value is truncated.

mod bytes;
mod display;
mod input;
mod led;
mod pattern;
mod picture;
mod signal;
mod status;
mod table;
mod trigger;

pub use display::{DisplayArea, DisplayMode, Gamma, LongAxisFlip, Rectangle, ShortAxisFlip};
pub use input::{
    ChannelOrder, ChannelSwap, FpdLink, InputPort, InputSource, ParallelWidth, PixelFormat, PortClock,
    SwapPort,
};
pub use led::{BlueLedDelay, GreenLedDelay, LedCurrent, LedEnable, LedPolarity, RedLedDelay};
pub use pattern::{
    InvertData, LutControl, Mailbox, MailboxOffset, PatternSource, RunState, Timing, TriggerMode, Validate,
    Validation,
};
pub use picture::{Curtain, FlashImage, ImageLoadTime, MeasureImageLoad, TestPattern, TestPatternColours};
pub use signal::VideoSignal;
pub use status::{
    DisplayFreeze, DmdPark, FirmwareTag, FlashImageCount, HardwareStatus, MainStatus, PowerMode,
    SoftwareReset, SystemStatus, Version, Versions,
};
pub use table::{
    EntryTrigger, ImageTable, LutEntry, PatternTable, VariableControl, VariableEntry, VariableOffset,
};
pub use trigger::{EdgeDelay, TriggerIn1Delay, TriggerIn2Edge, TriggerOut1, TriggerOut2};

use crate::error::Result;
use crate::packet::Access;

/// A message of the controller.
pub trait Message: Sized {
    /// Command word, CMD2 in the high byte and CMD3 in the low one.
    const WORD: u16;
    /// Name of the message in errors.
    const NAME: &'static str;

    /// Encode the data bytes. A field outside its range is an error.
    fn encode(&self) -> Result<Vec<u8>>;

    /// Decode the data bytes. Too few bytes are an error, and so is a byte without a meaning.
    fn decode(data: &[u8]) -> Result<Self>;
}

/// A message that can be read from the device.
pub trait Readable: Message {}

/// A message that can be written to the device.
pub trait Writable: Message {
    /// Whether the device acknowledges the message. It does not if the message resets it.
    const ACCESS: Access = Access::Write;
}

/// Call the macro `visit` once for each message of [`command`](crate::command), as `visit!(Type, read)`,
/// `visit!(Type, write)` or `visit!(Type, both)`. The types of the messages must be in scope.
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
