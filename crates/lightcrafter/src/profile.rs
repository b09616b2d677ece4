//! What differs from one light engine to another, and is dangerous to get wrong.

use crate::error::{Error, Result};

/// The light engine behind the controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Profile {
    /// Whether the byte of the LED current is inverted (0 is full current), as on TI's board with normal polarity.
    pub current_inverted: bool,
    /// The highest drive of red, green, blue, 0 to 255; without one, no drive can be set.
    pub drive_limit: Option<[u8; 3]>,
    /// The byte that inverts a trigger output: 1 as TI's own program sends it, 2 as the guide has it.
    pub trigger_invert_byte: u8,
}

impl Profile {
    /// TI's board after power-on: register bytes 0x97, 0x78, 0x7D, inverted.
    pub const POWER_ON_DRIVE: [u8; 3] = [104, 135, 130];

    /// The LightCrafter 4500 with TI's own light engine. Drives up to those after power-on are allowed: how much the
    /// LEDs bear beyond depends on power supply and cooling, so state it in `drive_limit`.
    pub const EVM: Self =
        Self { current_inverted: true, drive_limit: Some(Self::POWER_ON_DRIVE), trigger_invert_byte: 1 };

    /// Another light engine, such as an infrared one: no drive can be set until its limit is stated.
    pub const EXTERNAL: Self = Self { drive_limit: None, ..Self::EVM };

    /// The register bytes of a drive, where 0 is off and 255 full current; an error beyond the limit.
    pub fn raw_current(&self, drive: [u8; 3]) -> Result<[u8; 3]> {
        let Some(limit) = self.drive_limit else {
            let expected = "a drive limit stated in the profile of this light engine";
            return Err(Error::value("LED drive", expected, "none"));
        };
        if drive.iter().zip(limit).any(|(drive, limit)| *drive > limit) {
            let expected = format!("at most {limit:?} (red, green, blue), the limit of this light engine");
            return Err(Error::value("LED drive", expected, format!("{drive:?}")));
        }
        Ok(drive.map(|value| self.exchanged(value)))
    }

    /// The drive of register bytes.
    pub fn drive(&self, raw: [u8; 3]) -> [u8; 3] {
        raw.map(|value| self.exchanged(value))
    }

    fn exchanged(&self, value: u8) -> u8 {
        if self.current_inverted { 255 - value } else { value }
    }
}

impl Default for Profile {
    fn default() -> Self {
        Self::EVM
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_power_on_registers_are_the_default_limit() {
        assert_eq!(Profile::EVM.drive([0x97, 0x78, 0x7D]), Profile::POWER_ON_DRIVE);
        assert_eq!(Profile::EVM.raw_current(Profile::POWER_ON_DRIVE).unwrap(), [0x97, 0x78, 0x7D]);
        assert_eq!(Profile::EVM.raw_current([0; 3]).unwrap(), [255; 3]);
    }

    #[test]
    fn more_than_the_limit_is_refused_with_the_limit() {
        let error = Profile::EVM.raw_current([0, 136, 0]).unwrap_err().to_string();
        assert!(error.contains("[104, 135, 130]") && error.contains("[0, 136, 0]"), "{error}");
        assert!(
            Profile::EXTERNAL.raw_current([0; 3]).unwrap_err().to_string().contains("stated in the profile")
        );
        let straight = Profile { current_inverted: false, drive_limit: Some([9; 3]), ..Profile::EVM };
        assert_eq!(straight.raw_current([9, 0, 1]).unwrap(), [9, 0, 1]);
    }
}
