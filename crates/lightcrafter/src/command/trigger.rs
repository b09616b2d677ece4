//! Triggers in and out, and their delays.

use super::Message;
use super::bytes::{Bytes, checked, choice, direction, in_range};
use crate::error::{Error, Result};

/// Time of an edge relative to the start of an exposure: one byte, 107.2 ns per step, 0xBB is 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct EdgeDelay(pub u8);

impl EdgeDelay {
    /// No delay: at the start of the exposure.
    pub const NONE: Self = Self(0xBB);
    const STEP_US: f64 = 0.1072;

    /// The step nearest to a delay in us, -20.05 to 7.29. A negative delay puts the edge before the exposure.
    pub fn from_us(delay_us: f64) -> Result<Self> {
        let step = (delay_us / Self::STEP_US).round() + f64::from(Self::NONE.0);
        if (0.0..=255.0).contains(&step) {
            return Ok(Self(step as u8));
        }
        Err(Error::value("edge delay in us", "-20.05 to 7.29", delay_us))
    }

    /// The delay in us.
    pub fn us(self) -> f64 {
        (f64::from(self.0) - f64::from(Self::NONE.0)) * Self::STEP_US
    }
}

impl Default for EdgeDelay {
    fn default() -> Self {
        Self::NONE
    }
}

/// Trigger output 1: high during each exposure. Sources disagree about the bit that inverts it (see
/// [`Profile`](crate::Profile)), so this struct holds the raw byte; check it with an oscilloscope.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct TriggerOut1 {
    /// Byte with the invert bit; 0 gives a high level during the exposure.
    pub invert_byte: u8,
    /// Rising edge, with a delay of at most 2.787 us.
    pub rising: EdgeDelay,
    /// Falling edge, with a delay of at most 2.787 us.
    pub falling: EdgeDelay,
}

/// Highest step that output 1 accepts.
const OUT_1_LAST_STEP: u32 = 0xD5;

impl Message for TriggerOut1 {
    const WORD: u16 = 0x1A1D;
    const NAME: &'static str = "trigger output 1";

    fn encode(&self) -> Result<Vec<u8>> {
        for edge in [self.rising, self.falling] {
            in_range("step of an edge of trigger output 1", edge.0.into(), 0, OUT_1_LAST_STEP)?;
        }
        Ok(vec![invert_byte(self.invert_byte)?, self.rising.0, self.falling.0])
    }

    fn decode(data: &[u8]) -> Result<Self> {
        let mut bytes = Bytes::new(Self::NAME, data);
        let (invert_byte, rising, falling) =
            (bytes.u8()? & 3, EdgeDelay(bytes.u8()?), EdgeDelay(bytes.u8()?));
        checked(Self { invert_byte, rising, falling })
    }
}

direction!(TriggerOut1, both);

fn invert_byte(byte: u8) -> Result<u8> {
    Ok(in_range("invert byte of a trigger output", byte.into(), 0, 3)? as u8)
}

/// Trigger output 2: a pulse of fixed length at the start of the pattern sequence.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct TriggerOut2 {
    /// Byte with the invert bit, as in [`TriggerOut1`].
    pub invert_byte: u8,
    /// Rising edge.
    pub rising: EdgeDelay,
}

impl Message for TriggerOut2 {
    const WORD: u16 = 0x1A1E;
    const NAME: &'static str = "trigger output 2";

    fn encode(&self) -> Result<Vec<u8>> {
        Ok(vec![invert_byte(self.invert_byte)?, self.rising.0])
    }

    fn decode(data: &[u8]) -> Result<Self> {
        let mut bytes = Bytes::new(Self::NAME, data);
        Ok(Self { invert_byte: bytes.u8()? & 3, rising: EdgeDelay(bytes.u8()?) })
    }
}

direction!(TriggerOut2, both);

/// Delay of trigger input 1, in steps of 107.136 ns.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub struct TriggerIn1Delay {
    /// Steps, 19 bits.
    pub steps: u32,
}

impl TriggerIn1Delay {
    const STEP_US: f64 = 0.107_136;
    const LAST: u32 = (1 << 19) - 1;

    /// The step nearest to a delay in us, 0 to 56170.
    pub fn from_us(delay_us: f64) -> Result<Self> {
        let steps = (delay_us / Self::STEP_US).round();
        if (0.0..=f64::from(Self::LAST)).contains(&steps) {
            return Ok(Self { steps: steps as u32 });
        }
        Err(Error::value("delay of trigger input 1 in us", "0 to 56170", delay_us))
    }

    /// The delay in us.
    pub fn us(&self) -> f64 {
        f64::from(self.steps) * Self::STEP_US
    }
}

impl Message for TriggerIn1Delay {
    const WORD: u16 = 0x1A35;
    const NAME: &'static str = "delay of trigger input 1";

    fn encode(&self) -> Result<Vec<u8>> {
        let steps = in_range("delay of trigger input 1 in steps", self.steps, 0, Self::LAST)?;
        Ok(steps.to_le_bytes().to_vec())
    }

    fn decode(data: &[u8]) -> Result<Self> {
        Ok(Self { steps: Bytes::new(Self::NAME, data).u32()? & Self::LAST })
    }
}

direction!(TriggerIn1Delay, both);

choice! {
    /// Active edge of trigger input 2 in the alternating trigger mode.
    TriggerIn2Edge, 0x1A36, "edge of trigger input 2", both, {
        /// Low to high.
        Rising = 0,
        /// High to low.
        Falling = 1,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn delays_are_steps_of_the_documented_size() {
        assert_eq!(EdgeDelay::from_us(0.0).unwrap(), EdgeDelay(0xBB));
        assert_eq!(EdgeDelay::from_us(-20.05).unwrap(), EdgeDelay(0));
        assert_eq!(EdgeDelay::from_us(7.29).unwrap(), EdgeDelay(0xFF));
        assert!((EdgeDelay(0xD5).us() - 2.787).abs() < 0.001);
        assert!(EdgeDelay::from_us(7.4).is_err() && EdgeDelay::from_us(f64::NAN).is_err());
        assert_eq!(TriggerIn1Delay::from_us(28_084.95).unwrap().steps, 262_143);
        assert!((TriggerIn1Delay { steps: 262_143 }.us() - 28_084.95).abs() < 0.06);
        assert!(TriggerIn1Delay::from_us(60_000.0).is_err() && TriggerIn1Delay::from_us(-1.0).is_err());
    }

    #[test]
    fn a_late_edge_of_output_1_is_refused_and_not_cut() {
        let late = TriggerOut1 { invert_byte: 0, rising: EdgeDelay(0xD6), falling: EdgeDelay::NONE };
        assert!(late.encode().unwrap_err().to_string().contains("0 to 213, got 214"));
        let edge = TriggerOut2 { invert_byte: 4, rising: EdgeDelay(0xFF) };
        assert!(edge.encode().is_err());
    }
}
