// The example of the README opens real devices.
#![cfg_attr(feature = "usb", doc = include_str!("../README.md"))]
#![cfg_attr(not(feature = "usb"), doc = "Driver for the TI LightCrafter 4500, without its USB backend.")]
//!
//! # Map
//! | | |
//! |---|---|
//! | [`error`] | what can go wrong |
//! | [`packet`] | framing: messages as reports of 64 bytes |
//! | [`command`] | one struct per message |
//! | [`transport`] | the USB link, real or emulated |
//! | [`sequence`] | pattern sequences and their rules |
//! | [`profile`] | the light engine: current limits and polarities |
//! | [`projector`] | a projector, with one method for each task |
//! | [`flash`] | images for the flash, to be written by TI's program |
//! | `usb` | real devices (feature `usb`) |
//! | `window` | HDMI: a window on the output that feeds a projector (feature `window`, Linux) |
//! | `emulator` | a DLPC350 in memory (feature `emulator`) |
//! | `testbed` | that emulator behind the real libusb (feature `testbed`, Linux) |

pub mod command;
pub mod error;
pub mod flash;
pub mod packet;
pub mod profile;
pub mod projector;
pub mod sequence;
pub mod transport;

mod link;

#[cfg(feature = "emulator")]
pub mod emulator;
#[cfg(all(feature = "testbed", target_os = "linux"))]
pub mod testbed;
#[cfg(feature = "usb")]
pub mod usb;
#[cfg(all(feature = "window", target_os = "linux"))]
pub mod window;

pub use error::{Error, Result};
pub use profile::Profile;
pub use projector::{LightCrafter, Status, TriggerOut, Triggers, Waits};
pub use sequence::Sequence;
pub use transport::Transport;
