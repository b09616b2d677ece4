//! The HDMI route: a borderless window of exactly 912 x 1140 pixels on the output that feeds a projector.
//!
//! Scaling destroys a pattern. Therefore an output that has another size, or is scaled, rotated or transformed, is an
//! error that names the reason. [`PatternWindow::show`] checks the size again and returns once the display has
//! the image. Pixels are copied without colour management or OpenGL.
//!
//! A process can have one event loop of the window system. The first call starts a thread for it, which serves all
//! windows. Another program may still draw over the window.

mod events;
mod scaling;

use crate::error::{Error, Result};
use crate::sequence::{HEIGHT_PX, WIDTH_PX};
use events::{Order, ask};
use std::fmt;

/// Bytes of an image: rows of pixels of red, green, blue.
pub const IMAGE_BYTES: usize = 3 * WIDTH_PX * HEIGHT_PX;

/// An output of the computer, with a display or a projector behind it.
#[derive(Debug, Clone, PartialEq)]
pub struct Output {
    /// Its name as `xrandr` shows it, such as HDMI-1.
    pub name: String,
    /// Its top-left corner on the desktop (x, y), px.
    pub position_px: (i32, i32),
    /// Its size on the desktop (width, height), px.
    pub size_px: (u32, u32),
    /// Its frame rate, Hz.
    pub frame_rate_hz: Option<f64>,
    /// Why its pixels differ from those of the desktop; `None` if they are the same.
    pub scaling: Option<String>,
}

impl Output {
    /// Why the output cannot show a pattern; `None` if it can.
    pub fn unfit(&self) -> Option<String> {
        let (width, height) = self.size_px;
        if (width as usize, height as usize) != (WIDTH_PX, HEIGHT_PX) {
            return Some(format!(
                "{width} x {height} pixels, not {WIDTH_PX} x {HEIGHT_PX}: set its mode, unscaled"
            ));
        }
        self.scaling.clone()
    }
}

impl fmt::Display for Output {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (width, height) = self.size_px;
        write!(f, "{} ({width} x {height} pixels", self.name)?;
        if let Some(scaling) = &self.scaling {
            write!(f, ", {scaling}")?;
        }
        write!(f, ")")
    }
}

/// All active outputs.
pub fn outputs() -> Result<Vec<Output>> {
    ask(Order::Outputs)
}

/// Choose the output of this name or, without a name, the only suitable one.
fn choose(outputs: &[Output], name: Option<&str>) -> Result<usize> {
    let names: Vec<String> = outputs.iter().map(Output::to_string).collect();
    let present = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
    let refused = |wanted: &str, reason: String| {
        Err(Error::Output { wanted: wanted.to_owned(), reason, present: present.clone() })
    };
    let Some(name) = name else {
        let fit: Vec<usize> = (0..outputs.len()).filter(|i| outputs[*i].unfit().is_none()).collect();
        return match fit.as_slice() {
            [only] => Ok(*only),
            [] => refused(
                "for the projector",
                format!("no active output is {WIDTH_PX} x {HEIGHT_PX} and unscaled"),
            ),
            _ => refused("for the projector", "several are suitable, so choose one by its name".to_owned()),
        };
    };
    match outputs.iter().position(|output| output.name == name) {
        None => refused(name, "no such output is active".to_owned()),
        Some(i) => match outputs[i].unfit() {
            None => Ok(i),
            Some(reason) => refused(name, reason),
        },
    }
}

/// A window that covers one output; closed when dropped.
#[derive(Debug)]
pub struct PatternWindow {
    number: u64,
    output: Output,
}

impl PatternWindow {
    /// Cover the output of this name with black; without a name, the only suitable one.
    pub fn open(output: Option<&str>) -> Result<Self> {
        let name = output.map(str::to_owned);
        let (number, output) = ask(|reply| Order::Open { name, reply })?;
        let mut window = Self { number, output };
        window.show(&vec![0; IMAGE_BYTES])?;
        Ok(window)
    }

    /// The covered output.
    pub fn output(&self) -> &Output {
        &self.output
    }

    /// Show 912 x 1140 pixels of red, green, blue, row by row, until the next call.
    pub fn show(&mut self, image: &[u8]) -> Result<()> {
        if image.len() != IMAGE_BYTES {
            let expected =
                format!("{IMAGE_BYTES} bytes, {WIDTH_PX} x {HEIGHT_PX} pixels of red, green, blue");
            return Err(Error::value("image for the window", expected, image.len()));
        }
        let pixels =
            image.chunks_exact(3).map(|rgb| u32::from_be_bytes([0, rgb[0], rgb[1], rgb[2]])).collect();
        ask(|reply| Order::Show { number: self.number, pixels, reply })
    }
}

impl Drop for PatternWindow {
    fn drop(&mut self) {
        // If the display is gone, the window is already closed.
        let _ = ask(|reply| Order::Close { number: self.number, reply });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn output(name: &str, size_px: (u32, u32), scaling: Option<&str>) -> Output {
        let scaling = scaling.map(str::to_owned);
        Output { name: name.into(), position_px: (0, 0), size_px, frame_rate_hz: Some(60.0), scaling }
    }

    #[test]
    fn an_output_is_chosen_by_name_or_as_the_only_suitable_one() {
        let desk = output("DP-1", (1920, 1080), None);
        let (one, two) = (output("HDMI-1", (912, 1140), None), output("HDMI-2", (912, 1140), None));
        let scaled = output("HDMI-3", (912, 1140), Some("transformed"));
        assert_eq!(choose(&[desk.clone(), one.clone()], None).unwrap(), 1);
        assert_eq!(choose(&[one.clone(), two.clone()], Some("HDMI-2")).unwrap(), 1);
        let refused = |outputs: &[Output], name| choose(outputs, name).unwrap_err().to_string();
        assert!(refused(&[one.clone(), two], None).contains("several are suitable"));
        assert!(refused(&[desk.clone(), scaled.clone()], None).contains("no active output is 912 x 1140"));
        assert!(refused(&[scaled], Some("HDMI-3")).contains("transformed"));
        assert!(
            refused(std::slice::from_ref(&desk), Some("DP-1")).contains("1920 x 1080 pixels, not 912 x 1140")
        );
        assert!(refused(&[desk], Some("HDMI-1")).contains("DP-1 (1920 x 1080 pixels)"));
        assert!(refused(&[], None).contains("outputs: none"));
    }
}
