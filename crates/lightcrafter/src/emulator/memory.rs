//! A transport to an emulator in the same process.

use super::Dlpc350;
use crate::error::{Error, Result};
use crate::packet::Report;
use crate::transport::Transport;
use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// A [`Transport`] to an emulator in the same process. Replies come at once or never, so no call waits.
#[derive(Debug)]
pub struct EmulatedTransport {
    device: Arc<Mutex<Dlpc350>>,
    incoming: VecDeque<Vec<u8>>,
    place: String,
}

impl EmulatedTransport {
    /// A transport to this emulator.
    pub fn new(device: Dlpc350) -> Self {
        Self::to(Arc::new(Mutex::new(device)), "emulator")
    }

    /// A transport to a shared emulator, with a name for messages.
    pub fn to(device: Arc<Mutex<Dlpc350>>, place: impl Into<String>) -> Self {
        Self { device, incoming: VecDeque::new(), place: place.into() }
    }

    /// The emulator, to inspect it and to inject faults.
    pub fn device(&self) -> Arc<Mutex<Dlpc350>> {
        Arc::clone(&self.device)
    }

    /// Use the emulator even if a test panicked while it held the lock.
    fn locked(&self) -> MutexGuard<'_, Dlpc350> {
        self.device.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Transport for EmulatedTransport {
    fn send(&mut self, report: &Report, _: Duration) -> Result<()> {
        let answers = {
            let mut device = self.locked();
            let answers = device.take(report);
            if !device.plugged() {
                return Err(Error::Disconnected { place: self.place.clone() });
            }
            answers
        };
        self.incoming.extend(answers);
        Ok(())
    }

    fn receive(&mut self, report: &mut Report, _: Duration) -> Result<usize> {
        if !self.locked().plugged() {
            return Err(Error::Disconnected { place: self.place.clone() });
        }
        let transfer = self.incoming.pop_front().unwrap_or_default();
        report[..transfer.len()].copy_from_slice(&transfer);
        Ok(transfer.len())
    }

    fn place(&self) -> &str {
        &self.place
    }
}
