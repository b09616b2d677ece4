//! The USB link as a trait, so that an emulator can replace the device.

use crate::error::Result;
use crate::packet::Report;
use std::time::Duration;

/// Sends and receives the reports of one device. Its methods take `&mut self`, so only one transaction is in flight.
pub trait Transport: Send {
    /// Send one report to the device within `timeout`.
    fn send(&mut self, report: &Report, timeout: Duration) -> Result<()>;

    /// Wait for one report. Returns the number of bytes received, 0 if none arrived within `timeout`.
    fn receive(&mut self, report: &mut Report, timeout: Duration) -> Result<usize>;

    /// Bus and port path of the device, for messages.
    fn place(&self) -> &str;
}

impl<T: Transport + ?Sized> Transport for Box<T> {
    fn send(&mut self, report: &Report, timeout: Duration) -> Result<()> {
        (**self).send(report, timeout)
    }

    fn receive(&mut self, report: &mut Report, timeout: Duration) -> Result<usize> {
        (**self).receive(report, timeout)
    }

    fn place(&self) -> &str {
        (**self).place()
    }
}
