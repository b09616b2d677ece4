//! The HDMI route: a borderless window that covers the output that feeds a projector.
//!
//! The window has exactly the native pixels of the projector: 912 x 1140 for a LightCrafter 4500, which
//! [`PatternWindow::open`] expects, or the size given to [`PatternWindow::open_sized`] for any other projector.
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

/// Columns and rows of a LightCrafter 4500.
pub const SIZE_PX: (u32, u32) = (WIDTH_PX as u32, HEIGHT_PX as u32);

/// Bytes of an image for a LightCrafter 4500: rows of pixels of red, green, blue.
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
    /// Why the output cannot show a pattern of a LightCrafter 4500; `None` if it can.
    pub fn unfit(&self) -> Option<String> {
        self.unfit_for(SIZE_PX)
    }

    /// Why the output cannot show an image of this size (width, height) one to one; `None` if it can.
    pub fn unfit_for(&self, size_px: (u32, u32)) -> Option<String> {
        let (width, height) = self.size_px;
        if self.size_px != size_px {
            let wanted = format!("{} x {}", size_px.0, size_px.1);
            return Some(format!("{width} x {height} pixels, not {wanted}: set its mode, unscaled"));
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

/// Choose the output of this name or, without a name, the only one that suits an image of this size.
fn choose(outputs: &[Output], name: Option<&str>, size_px: (u32, u32)) -> Result<usize> {
    let names: Vec<String> = outputs.iter().map(Output::to_string).collect();
    let present = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
    let refused = |wanted: &str, reason: String| {
        Err(Error::Output { wanted: wanted.to_owned(), reason, present: present.clone() })
    };
    let Some(name) = name else {
        let fit: Vec<usize> =
            (0..outputs.len()).filter(|i| outputs[*i].unfit_for(size_px).is_none()).collect();
        return match fit.as_slice() {
            [only] => Ok(*only),
            [] => refused(
                "for the projector",
                format!("no active output is {} x {} and unscaled", size_px.0, size_px.1),
            ),
            _ => refused("for the projector", "several are suitable, so choose one by its name".to_owned()),
        };
    };
    match outputs.iter().position(|output| output.name == name) {
        None => refused(name, "no such output is active".to_owned()),
        Some(i) => match outputs[i].unfit_for(size_px) {
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
    size_px: (u32, u32),
}

impl PatternWindow {
    /// Cover the output of this name, which feeds a LightCrafter 4500, with black; without a name, the only suitable one.
    pub fn open(output: Option<&str>) -> Result<Self> {
        Self::open_sized(output, SIZE_PX)
    }

    /// Cover the output of this name, which has this size (width, height), with black; without a name, the only one.
    pub fn open_sized(output: Option<&str>, size_px: (u32, u32)) -> Result<Self> {
        let name = output.map(str::to_owned);
        let (number, output) = ask(|reply| Order::Open { name, size_px, reply })?;
        let mut window = Self { number, output, size_px };
        window.show(&vec![0; window.image_bytes()])?;
        Ok(window)
    }

    /// Columns and rows of the images that it shows.
    pub fn size_px(&self) -> (u32, u32) {
        self.size_px
    }

    fn image_bytes(&self) -> usize {
        3 * self.size_px.0 as usize * self.size_px.1 as usize
    }

    /// The covered output.
    pub fn output(&self) -> &Output {
        &self.output
    }

    /// Show pixels of red, green, blue, row by row, as many as the window has, until the next call.
    pub fn show(&mut self, image: &[u8]) -> Result<()> {
        let bytes = self.image_bytes();
        if image.len() != bytes {
            let (width, height) = self.size_px;
            let expected = format!("{bytes} bytes, {width} x {height} pixels of red, green, blue");
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
        assert_eq!(choose(&[desk.clone(), one.clone()], None, SIZE_PX).unwrap(), 1);
        assert_eq!(choose(&[one.clone(), two.clone()], Some("HDMI-2"), SIZE_PX).unwrap(), 1);
        assert_eq!(choose(&[one.clone(), desk.clone()], None, (1920, 1080)).unwrap(), 1);
        let refused = |outputs: &[Output], name| choose(outputs, name, SIZE_PX).unwrap_err().to_string();
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
