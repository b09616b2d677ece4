//! In place of `lightcrafter::window` on other systems than Linux: there are no outputs, and every call says so.

use lightcrafter::sequence::{HEIGHT_PX, WIDTH_PX};
use lightcrafter::{Error, Result};

/// Columns and rows of a LightCrafter 4500.
pub const SIZE_PX: (u32, u32) = (WIDTH_PX as u32, HEIGHT_PX as u32);

/// An output; there is none.
pub struct Output {
    pub name: String,
    pub size_px: (u32, u32),
    pub frame_rate_hz: Option<f64>,
}

impl Output {
    pub fn unfit_for(&self, _size_px: (u32, u32)) -> Option<String> {
        Some("windows are shown on Linux only".to_owned())
    }
}

/// A window; there is none.
pub struct PatternWindow {
    output: Output,
}

impl PatternWindow {
    pub fn open_sized(_output: Option<&str>, _size_px: (u32, u32)) -> Result<Self> {
        Err(absent())
    }

    pub fn output(&self) -> &Output {
        &self.output
    }

    pub fn show(&mut self, _image: &[u8]) -> Result<()> {
        Err(absent())
    }
}

pub fn outputs() -> Result<Vec<Output>> {
    Err(absent())
}

fn absent() -> Error {
    Error::NoDisplay { reason: "quadfringe shows windows on Linux only".to_owned() }
}
