//! How devices are reached: libusb, and the window system of Linux; or replacements that say that they are missing.

#[cfg(target_os = "linux")]
pub use lightcrafter::window as screen;
#[cfg(not(target_os = "linux"))]
#[path = "no_screen.rs"]
pub mod screen;

#[cfg(feature = "usb")]
pub use lightcrafter::usb;
#[cfg(not(feature = "usb"))]
#[path = "no_usb.rs"]
pub mod usb;

use pyo3::prelude::*;

/// The udev file and the line in it that give users permission.
#[pyfunction]
pub fn udev_rule() -> (&'static str, &'static str) {
    (lightcrafter::error::UDEV_FILE, lightcrafter::error::UDEV_RULE)
}
