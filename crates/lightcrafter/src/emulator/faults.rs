//! What can go wrong with the model, on demand and by its nature.

use crate::error::{Error, Result};
use std::str::FromStr;

/// What the next reply suffers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Fault {
    /// The command is refused and has no effect.
    Refuse,
    /// The command is heard and never answered.
    Silence,
    /// The reply stops in the middle of a report.
    Truncate,
    /// The reply carries another sequence number.
    WrongSequence,
    /// A reply to an earlier command comes first.
    Stale,
    /// The device leaves the bus instead of answering.
    Unplug,
}

impl FromStr for Fault {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self> {
        Ok(match name {
            "refuse" => Self::Refuse,
            "silence" => Self::Silence,
            "truncate" => Self::Truncate,
            "wrong-sequence" => Self::WrongSequence,
            "stale" => Self::Stale,
            "unplug" => Self::Unplug,
            other => {
                let known = "refuse, silence, truncate, wrong-sequence, stale or unplug";
                return Err(Error::value("fault", known, other));
            }
        })
    }
}

/// Oddities of the real chip; in [`Dlpc350::default`](super::Dlpc350::default) they are as users report them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Quirks {
    /// After video mode the first start of a sequence is acknowledged and ignored.
    pub ignores_first_start: bool,
    /// Waking from standby is not acknowledged.
    pub silent_wake: bool,
    /// Commands after waking that are not answered either.
    pub silent_reads_after_waking: u32,
    /// Reads of the verdict that still say busy.
    pub busy_polls: u32,
    /// Reads after which a new mode or run state shows.
    pub lag_polls: u32,
    /// Video mode set again this often with a signal connected freezes the chip.
    pub redundant_modes_to_freeze: u32,
    /// Every sequence is judged to have a wrong pattern number.
    pub rejects: bool,
}

impl Default for Quirks {
    fn default() -> Self {
        Self {
            ignores_first_start: true,
            silent_wake: true,
            silent_reads_after_waking: 0,
            busy_polls: 3,
            lag_polls: 1,
            redundant_modes_to_freeze: 3,
            rejects: false,
        }
    }
}
