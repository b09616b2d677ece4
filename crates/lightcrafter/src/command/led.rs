//! Registers of the light sources. To set a brightness, use
//! [`LightCrafter::set_led_drive`](crate::LightCrafter::set_led_drive).

use super::Message;
use super::bytes::{Bytes, bits, choice, direction};
use super::trigger::EdgeDelay;
use crate::error::Result;

bits! {
    /// Which LEDs are on. After power-on the sequencer selects them from the pattern table.
    LedEnable, 0x1A07, "LED selection", both, {
        /// Red, in manual selection.
        red = 0,
        /// Green, in manual selection.
        green = 1,
        /// Blue, in manual selection.
        blue = 2,
        /// The sequencer selects the LEDs and ignores the other bits.
        sequencer = 3,
    }
}

impl LedEnable {
    /// The sequencer selects the LEDs: the state after power-on.
    pub const SEQUENCER: Self = Self { red: false, green: false, blue: false, sequencer: true };
}

/// The current registers. On the LightCrafter 4500 they are inverted: 0 is full current, 255 is off.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LedCurrent {
    /// Register bytes of red, green, blue.
    pub raw: [u8; 3],
}

impl Message for LedCurrent {
    const WORD: u16 = 0x0B01;
    const NAME: &'static str = "LED current";

    fn encode(&self) -> Result<Vec<u8>> {
        Ok(self.raw.to_vec())
    }

    fn decode(data: &[u8]) -> Result<Self> {
        let mut bytes = Bytes::new(Self::NAME, data);
        Ok(Self { raw: [bytes.u8()?, bytes.u8()?, bytes.u8()?] })
    }
}

direction!(LedCurrent, both);

choice! {
    /// Polarity of the signals that set the LED currents; set it before the LEDs get power.
    LedPolarity, 0x1A05, "LED polarity", both, {
        /// Polarity of the LightCrafter 4500: the byte of the current is inverted.
        Normal = 0,
        /// The opposite polarity.
        Inverted = 1,
    }
}

/// Delays of both edges of one LED. They apply in pattern mode; set both to zero in video mode.
macro_rules! led_delay {
    ($name:ident, $word:literal, $colour:literal) => {
        #[doc = concat!("Delays of the ", $colour, " LED. They apply in pattern mode only.")]
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
        pub struct $name {
            /// Delay of the rising edge (on).
            pub rising: EdgeDelay,
            /// Delay of the falling edge (off).
            pub falling: EdgeDelay,
        }

        impl Message for $name {
            const WORD: u16 = $word;
            const NAME: &'static str = concat!("delay of the ", $colour, " LED");

            fn encode(&self) -> Result<Vec<u8>> {
                Ok(vec![self.rising.0, self.falling.0])
            }

            fn decode(data: &[u8]) -> Result<Self> {
                let mut bytes = Bytes::new(Self::NAME, data);
                Ok(Self { rising: EdgeDelay(bytes.u8()?), falling: EdgeDelay(bytes.u8()?) })
            }
        }

        direction!($name, both);
    };
}

led_delay!(RedLedDelay, 0x1A1F, "red");
led_delay!(GreenLedDelay, 0x1A20, "green");
led_delay!(BlueLedDelay, 0x1A21, "blue");
