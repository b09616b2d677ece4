//! In place of `lightcrafter::usb` in a build without the feature `usb`: no projector is found, and the error says why.

use lightcrafter::packet::Report;
use lightcrafter::{Error, Result, Transport};
use std::convert::Infallible;
use std::fmt;
use std::str::FromStr;
use std::time::Duration;

/// Bus and port path, which nothing reads here.
pub struct PortPath(String);

impl fmt::Display for PortPath {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

impl FromStr for PortPath {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        Ok(Self(text.to_owned()))
    }
}

/// Which projector to open.
pub enum Selector {
    Only,
    Port(PortPath),
    Serial(String),
}

/// A projector on the bus; there is none.
pub struct Found {
    pub port: PortPath,
    pub address: u8,
    pub serial: Option<String>,
}

pub fn list() -> Result<Vec<Found>> {
    Err(absent("any port".to_owned()))
}

/// A link that nobody can open.
pub struct UsbTransport(Infallible);

impl UsbTransport {
    pub fn open(selector: &Selector) -> Result<Self> {
        Err(absent(match selector {
            Selector::Only => "any port".to_owned(),
            Selector::Port(port) => format!("port {port}"),
            Selector::Serial(serial) => format!("any port with serial number {serial:?}"),
        }))
    }
}

impl Transport for UsbTransport {
    fn send(&mut self, _report: &Report, _timeout: Duration) -> Result<()> {
        match self.0 {}
    }

    fn receive(&mut self, _report: &mut Report, _timeout: Duration) -> Result<usize> {
        match self.0 {}
    }

    fn place(&self) -> &str {
        match self.0 {}
    }
}

fn absent(wanted: String) -> Error {
    Error::NotFound { wanted, present: "unknown, because this build of quadfringe has no USB".to_owned() }
}
