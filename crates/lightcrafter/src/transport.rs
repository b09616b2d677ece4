//! The wire: what a driver asks of USB, so that an emulator can stand in for it.

use crate::error::Result;
use crate::packet::Report;
use std::time::Duration;

/// Sends and receives reports of one device. It belongs to one owner at a time, so that one transaction is in flight.
pub trait Transport: Send {
    /// Hand one report to the device, within `timeout`.
    fn send(&mut self, report: &Report, timeout: Duration) -> Result<()>;

    /// Wait for one report; returns how many bytes came, 0 when nothing did within `timeout`.
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
