//! The HDMI route: a borderless window of exactly 912 x 1140 pixels on the output that feeds a projector.
//!
//! A pattern is worth nothing when a desktop scales it. So an output of another size, or one that is scaled, rotated or
//! transformed, is refused with what it is; and [`PatternWindow::show`] returns when the picture has been handed to the
//! display, whose size is compared once more. Pixels are copied, without colour management or OpenGL.
//!
//! The event loop of the window system exists once in a process and lives in a thread of its own, which is started by
//! the first call and serves all windows. Another program may still draw over the window.

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
    /// Its name, as `xrandr` has it: HDMI-1.
    pub name: String,
    /// Its corner on the desktop, pixels.
    pub position_px: (i32, i32),
    /// Its size on the desktop, pixels.
    pub size_px: (u32, u32),
    /// Its frame rate.
    pub frame_rate_hz: Option<f64>,
    /// Why its pixels are not those of the desktop; none when they are.
    pub scaling: Option<String>,
}

impl Output {
    /// Why it cannot carry a pattern; none when it can.
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

/// All outputs that are on.
pub fn outputs() -> Result<Vec<Output>> {
    ask(Order::Outputs)
}

/// The output of this name, or the only one that is fit; an error when there is none.
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
            [] => refused("for the projector", format!("none of {WIDTH_PX} x {HEIGHT_PX}, unscaled, is on")),
            _ => refused("for the projector", "several are fit, so choose one by its name".to_owned()),
        };
    };
    match outputs.iter().position(|output| output.name == name) {
        None => refused(name, "no such output is on".to_owned()),
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
    /// Cover the output of this name with black; without a name, the only one of the right size.
    pub fn open(output: Option<&str>) -> Result<Self> {
        let name = output.map(str::to_owned);
        let (number, output) = ask(|reply| Order::Open { name, reply })?;
        let mut window = Self { number, output };
        window.show(&vec![0; IMAGE_BYTES])?;
        Ok(window)
    }

    /// The output that it covers.
    pub fn output(&self) -> &Output {
        &self.output
    }

    /// Show 912 x 1140 pixels of red, green, blue, row by row, until told otherwise.
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
        // A display that is gone has closed the window already.
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
    fn an_output_is_chosen_by_name_or_because_it_is_the_only_fit_one() {
        let desk = output("DP-1", (1920, 1080), None);
        let (one, two) = (output("HDMI-1", (912, 1140), None), output("HDMI-2", (912, 1140), None));
        let scaled = output("HDMI-3", (912, 1140), Some("transformed"));
        assert_eq!(choose(&[desk.clone(), one.clone()], None).unwrap(), 1);
        assert_eq!(choose(&[one.clone(), two.clone()], Some("HDMI-2")).unwrap(), 1);
        let refused = |outputs: &[Output], name| choose(outputs, name).unwrap_err().to_string();
        assert!(refused(&[one.clone(), two], None).contains("several are fit"));
        assert!(refused(&[desk.clone(), scaled.clone()], None).contains("none of 912 x 1140"));
        assert!(refused(&[scaled], Some("HDMI-3")).contains("transformed"));
        assert!(
            refused(std::slice::from_ref(&desk), Some("DP-1")).contains("1920 x 1080 pixels, not 912 x 1140")
        );
        assert!(refused(&[desk], Some("HDMI-1")).contains("DP-1 (1920 x 1080 pixels)"));
        assert!(refused(&[], None).contains("outputs: none"));
    }
}
