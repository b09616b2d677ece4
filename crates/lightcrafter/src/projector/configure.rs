//! Light, triggers and geometry.

use super::LightCrafter;
use crate::command::{
    BlueLedDelay, EdgeDelay, Gamma, GreenLedDelay, ImageLoadTime, InvertData, LedCurrent, LedEnable,
    LedPolarity, LongAxisFlip, MeasureImageLoad, RedLedDelay, ShortAxisFlip, TriggerIn1Delay, TriggerIn2Edge,
    TriggerOut1, TriggerOut2,
};
use crate::error::{Error, Result};
use crate::transport::Transport;
use std::thread::sleep;

/// A trigger output; delays are relative to the exposure.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct TriggerOut {
    /// Whether the output is inverted.
    pub inverted: bool,
    /// Delay of the rising edge, us, -20.05 to 2.787 (output 2: 7.29).
    pub rising_us: f64,
    /// Delay of the falling edge, us. Output 2 ignores it, because its pulse has a fixed length.
    pub falling_us: f64,
}

/// Settings of all triggers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Triggers {
    /// Output 1: high during each exposure.
    pub out_1: TriggerOut,
    /// Output 2: a pulse at the start of the sequence.
    pub out_2: TriggerOut,
    /// Delay from input 1 to the pattern, us, 0 to 56170.
    pub in_1_delay_us: f64,
    /// Active edge of input 2.
    pub in_2_edge: TriggerIn2Edge,
}

impl Default for Triggers {
    fn default() -> Self {
        let out = TriggerOut::default();
        Self { out_1: out, out_2: out, in_1_delay_us: 0.0, in_2_edge: TriggerIn2Edge::Rising }
    }
}

impl<T: Transport> LightCrafter<T> {
    /// Set the brightness of red, green and blue: 0 is off and 255 is full current, whichever
    /// polarity the register has. A drive above the limit of the [`Profile`](crate::Profile) is an error. The method reads
    /// the register back.
    pub fn set_led_drive(&mut self, drive: [u8; 3]) -> Result<()> {
        let raw = self.profile.raw_current(drive)?;
        self.require_normal_polarity()?;
        self.write(&LedCurrent { raw })?;
        let found = self.led_drive()?;
        if found == drive {
            return Ok(());
        }
        let name = format!("LED drive read back from {}", self.place());
        Err(Error::value(name, format!("{drive:?}"), format!("{found:?}")))
    }

    /// The brightness of red, green, blue, 0 to 255.
    pub fn led_drive(&mut self) -> Result<[u8; 3]> {
        let LedCurrent { raw } = self.read()?;
        Ok(self.profile.drive(raw))
    }

    /// With inverted polarity the same byte would mean the opposite current.
    fn require_normal_polarity(&mut self) -> Result<()> {
        match self.read()? {
            LedPolarity::Normal => Ok(()),
            LedPolarity::Inverted => {
                let name = format!("LED polarity of {}", self.place());
                Err(Error::value(name, "Normal, which the profile assumes", "Inverted"))
            }
        }
    }

    /// Select LEDs manually, or let the pattern table select them ([`LedEnable::SEQUENCER`]).
    pub fn set_leds(&mut self, leds: LedEnable) -> Result<()> {
        self.write(&leds)
    }

    /// Set the delays of switching red, green and blue on and off, us; pattern mode only.
    pub fn set_led_delays_us(&mut self, rising_us: [f64; 3], falling_us: [f64; 3]) -> Result<()> {
        let edges = |delays: [f64; 3]| -> Result<[EdgeDelay; 3]> {
            let [red, green, blue] = delays.map(EdgeDelay::from_us);
            Ok([red?, green?, blue?])
        };
        let (rising, falling) = (edges(rising_us)?, edges(falling_us)?);
        self.write(&RedLedDelay { rising: rising[0], falling: falling[0] })?;
        self.write(&GreenLedDelay { rising: rising[1], falling: falling[1] })?;
        self.write(&BlueLedDelay { rising: rising[2], falling: falling[2] })
    }

    /// Set all triggers. All values are checked before the first is sent.
    pub fn set_triggers(&mut self, triggers: &Triggers) -> Result<()> {
        let invert_byte = |out: TriggerOut| if out.inverted { self.profile.trigger_invert_byte } else { 0 };
        let edge = EdgeDelay::from_us;
        let (one, two) = (triggers.out_1, triggers.out_2);
        let (rising, falling) = (edge(one.rising_us)?, edge(one.falling_us)?);
        let out_1 = TriggerOut1 { invert_byte: invert_byte(one), rising, falling };
        let out_2 = TriggerOut2 { invert_byte: invert_byte(two), rising: edge(two.rising_us)? };
        let in_1 = TriggerIn1Delay::from_us(triggers.in_1_delay_us)?;
        self.write(&out_1)?;
        self.write(&out_2)?;
        self.write(&in_1)?;
        self.write(&triggers.in_2_edge)
    }

    /// Read all triggers; delays are multiples of the register steps.
    pub fn triggers(&mut self) -> Result<Triggers> {
        let (out_1, out_2) = (self.read::<TriggerOut1>()?, self.read::<TriggerOut2>()?);
        Ok(Triggers {
            out_1: TriggerOut {
                inverted: out_1.invert_byte != 0,
                rising_us: out_1.rising.us(),
                falling_us: out_1.falling.us(),
            },
            out_2: TriggerOut {
                inverted: out_2.invert_byte != 0,
                rising_us: out_2.rising.us(),
                ..TriggerOut::default()
            },
            in_1_delay_us: self.read::<TriggerIn1Delay>()?.us(),
            in_2_edge: self.read()?,
        })
    }

    /// Mirror the image along its axes; in pattern mode this takes effect with the next image.
    pub fn set_flips(&mut self, long_axis: bool, short_axis: bool) -> Result<()> {
        self.write(&LongAxisFlip(long_axis))?;
        self.write(&ShortAxisFlip(short_axis))
    }

    /// Whether the image is mirrored along the long and the short axis.
    pub fn flips(&mut self) -> Result<(bool, bool)> {
        let (LongAxisFlip(long), ShortAxisFlip(short)) = (self.read()?, self.read()?);
        Ok((long, short))
    }

    /// Set the gamma table of the video mode. Patterns are always linear.
    pub fn set_gamma(&mut self, gamma: Gamma) -> Result<()> {
        self.write(&gamma)
    }

    /// Invert all patterns: bright pixels become dark.
    pub fn set_inverted(&mut self, inverted: bool) -> Result<()> {
        self.write(&InvertData(inverted))
    }

    /// Measure how long `count` flash images take to load, starting with image `first`, in ms.
    pub fn measure_image_load_ms(&mut self, first: u8, count: u8) -> Result<f64> {
        self.write(&MeasureImageLoad { first, count })?;
        sleep(self.waits.validation);
        Ok(self.read::<ImageLoadTime>()?.milliseconds())
    }
}
