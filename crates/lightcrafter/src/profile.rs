//! Properties that differ between light engines; wrong ones can damage the LEDs.

use crate::error::{Error, Result};

/// The light engine behind the controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Profile {
    /// Whether the byte of the LED current is inverted, as on TI's board, where 0 is full current.
    pub current_inverted: bool,
    /// Highest allowed drive of red, green and blue, 0 to 255; with `None` no drive can be set.
    pub drive_limit: Option<[u8; 3]>,
    /// Byte that inverts a trigger output: TI's program sends 1, the programmer's guide says 2.
    pub trigger_invert_byte: u8,
}

impl Profile {
    /// Drive of TI's board after power-on: register bytes 0x97, 0x78, 0x7D, inverted.
    pub const POWER_ON_DRIVE: [u8; 3] = [104, 135, 130];

    /// The LightCrafter 4500 with the light engine of TI. Its limit is the drive after power-on. Power supply and
    /// cooling decide whether the LEDs can take more; if they can, state a higher limit in `drive_limit`.
    pub const EVM: Self =
        Self { current_inverted: true, drive_limit: Some(Self::POWER_ON_DRIVE), trigger_invert_byte: 1 };

    /// Another light engine, such as an infrared one. No drive can be set until you state its limit.
    pub const EXTERNAL: Self = Self { drive_limit: None, ..Self::EVM };

    /// Register bytes for a drive, where 0 is off and 255 is full current. A drive above the limit is an error.
    pub fn raw_current(&self, drive: [u8; 3]) -> Result<[u8; 3]> {
        let Some(limit) = self.drive_limit else {
            let expected = "a drive limit stated in the profile of this light engine";
            return Err(Error::value("LED drive", expected, "none"));
        };
        if drive.iter().zip(limit).any(|(drive, limit)| *drive > limit) {
            let expected = format!("at most {limit:?} (red, green, blue), the limit of this light engine");
            return Err(Error::value("LED drive", expected, format!("{drive:?}")));
        }
        Ok(drive.map(|value| self.converted(value)))
    }

    /// Drive for register bytes.
    pub fn drive(&self, raw: [u8; 3]) -> [u8; 3] {
        raw.map(|value| self.converted(value))
    }

    /// Register byte of a drive, or drive of a register byte: the conversion is the same both ways.
    fn converted(&self, value: u8) -> u8 {
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
