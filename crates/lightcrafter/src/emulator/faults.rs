//! Faults on demand, and the quirks of the real chip.

use crate::error::{Error, Result};
use std::str::FromStr;

/// A fault in the next reply.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Fault {
    /// The command is refused and has no effect.
    Refuse,
    /// The command is executed and gets no reply.
    Silence,
    /// The reply stops in the middle of a report.
    Truncate,
    /// The reply carries another sequence number.
    WrongSequence,
    /// A reply to an earlier command comes before the reply.
    Stale,
    /// The device disappears from the bus instead of replying.
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

/// Quirks of the real chip. The defaults are what users report.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Quirks {
    /// After video mode the first start of a sequence is acknowledged and ignored.
    pub ignores_first_start: bool,
    /// Waking from standby is not acknowledged.
    pub silent_wake: bool,
    /// Number of commands after waking that get no reply either.
    pub silent_reads_after_waking: u32,
    /// Number of reads of a validation that still report busy.
    pub busy_polls: u32,
    /// Number of reads until a new mode or run state appears.
    pub lag_polls: u32,
    /// Number of redundant writes of the video mode, with a signal connected, that freeze the chip.
    pub redundant_modes_to_freeze: u32,
    /// Every validation reports a wrong pattern number.
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
