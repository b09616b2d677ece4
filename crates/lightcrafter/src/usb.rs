//! Real devices, through libusb.
//!
//! All units may carry the same serial number (`LCR2`), so a projector is identified by bus and port path, such as `1-2`
//! or `3-1.4`: the socket that its cable is plugged into. On Linux the HID driver of the kernel holds both interfaces. This driver
//! detaches it from interface 0 only and attaches it again at the end. It never sets the configuration or resets the device.

use crate::error::{Error, Result, UDEV_FILE, UDEV_RULE};
use crate::packet::Report;
use crate::projector::LightCrafter;
use crate::transport::Transport;
use rusb::{Context, Device, DeviceHandle, UsbContext};
use std::fmt;
use std::str::FromStr;
use std::time::Duration;

/// Vendor of the device: Texas Instruments.
pub const VENDOR: u16 = 0x0451;
/// The DLPC350.
pub const PRODUCT: u16 = 0x6401;
const INTERFACE: u8 = 0;
const OUT: u8 = 0x01;
const IN: u8 = 0x81;
const STRINGS_TIMEOUT: Duration = Duration::from_millis(1000);
/// libusb counts in ms, and 0 means "no timeout".
const LEAST_TIMEOUT: Duration = Duration::from_millis(1);

/// Bus and port path of the socket that the cable is plugged into.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct PortPath {
    /// Number of the bus.
    pub bus: u8,
    /// Ports from the root of the bus to the device.
    pub ports: Vec<u8>,
}

impl fmt::Display for PortPath {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ports: Vec<String> = self.ports.iter().map(u8::to_string).collect();
        write!(f, "{}-{}", self.bus, ports.join("."))
    }
}

impl FromStr for PortPath {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let parse = || {
            let (bus, ports) = text.split_once('-')?;
            let ports: Option<Vec<u8>> = ports.split('.').map(|port| port.parse().ok()).collect();
            Some(Self { bus: bus.parse().ok()?, ports: ports? })
        };
        parse().ok_or_else(|| {
            Error::value("port", "bus and port path such as 1-2 or 3-1.4", format!("{text:?}"))
        })
    }
}

/// Which projector to open.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum Selector {
    /// The only connected one.
    #[default]
    Only,
    /// The one in this socket.
    Port(PortPath),
    /// The one with this serial number.
    Serial(String),
}

impl fmt::Display for Selector {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Only => write!(f, "any port"),
            Self::Port(port) => write!(f, "port {port}"),
            Self::Serial(serial) => write!(f, "any port with serial number {serial:?}"),
        }
    }
}

impl Selector {
    fn selects(&self, found: &Found) -> bool {
        match self {
            Self::Only => true,
            Self::Port(port) => *port == found.port,
            Self::Serial(serial) => found.serial.as_ref() == Some(serial),
        }
    }
}

/// A projector on the bus.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Found {
    /// Where it is plugged in.
    pub port: PortPath,
    /// Its address on the bus, which changes each time it is plugged in.
    pub address: u8,
    /// Its serial number, or `None` if this user has no permission to open it.
    pub serial: Option<String>,
}

impl fmt::Display for Found {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.serial {
            Some(serial) => write!(f, "port {} (serial number {serial:?})", self.port),
            None => write!(f, "port {} (serial number not readable)", self.port),
        }
    }
}

/// All connected projectors in the order of their ports. Only reading the serial numbers needs permission.
pub fn list() -> Result<Vec<Found>> {
    Ok(devices()?.into_iter().map(|(found, _)| found).collect())
}

fn devices() -> Result<Vec<(Found, Device<Context>)>> {
    let failed = |error| from_libusb(error, "this computer", "listing its devices");
    let context = Context::new().map_err(failed)?;
    let mut present = Vec::new();
    for device in context.devices().map_err(failed)?.iter() {
        let Ok(descriptor) = device.device_descriptor() else { continue };
        if (descriptor.vendor_id(), descriptor.product_id()) != (VENDOR, PRODUCT) {
            continue;
        }
        let ports = device.port_numbers().unwrap_or_default();
        let port = PortPath { bus: device.bus_number(), ports };
        let found = Found { port, address: device.address(), serial: serial(&device) };
        present.push((found, device));
    }
    present.sort_by(|(a, _), (b, _)| a.port.cmp(&b.port));
    Ok(present)
}

fn serial(device: &Device<Context>) -> Option<String> {
    let handle = device.open().ok()?;
    let language = *handle.read_languages(STRINGS_TIMEOUT).ok()?.first()?;
    let descriptor = device.device_descriptor().ok()?;
    handle.read_serial_number_string(language, &descriptor, STRINGS_TIMEOUT).ok()
}

/// The command interface of one device, released when dropped.
#[derive(Debug)]
pub struct UsbTransport {
    handle: DeviceHandle<Context>,
    place: String,
}

impl UsbTransport {
    /// Open the selected projector. An ambiguous selection is an error that lists the candidates.
    pub fn open(selector: &Selector) -> Result<Self> {
        let mut devices = devices()?;
        let listed = |devices: &[(Found, Device<Context>)]| {
            let names: Vec<String> = devices.iter().map(|(found, _)| found.to_string()).collect();
            if names.is_empty() { "none".to_owned() } else { names.join(", ") }
        };
        let present = listed(&devices);
        devices.retain(|(found, _)| selector.selects(found));
        match devices.as_slice() {
            [(found, device)] => Self::claim(device, found.port.to_string()),
            [] => Err(Error::NotFound { wanted: selector.to_string(), present }),
            several => Err(Error::Ambiguous { wanted: selector.to_string(), present: listed(several) }),
        }
    }

    fn claim(device: &Device<Context>, place: String) -> Result<Self> {
        let failed = |error| from_libusb(error, &place, "opening the device");
        let handle = device.open().map_err(failed)?;
        match handle.set_auto_detach_kernel_driver(true) {
            Ok(()) | Err(rusb::Error::NotSupported) => {}
            Err(error) => return Err(failed(error)),
        }
        handle.claim_interface(INTERFACE).map_err(failed)?;
        Ok(Self { handle, place })
    }
}

impl Transport for UsbTransport {
    fn send(&mut self, report: &Report, timeout: Duration) -> Result<()> {
        let doing = "sending a report";
        let timeout = timeout.max(LEAST_TIMEOUT);
        match self.handle.write_interrupt(OUT, report, timeout) {
            Ok(count) if count == report.len() => Ok(()),
            Ok(count) => {
                let reason = format!("{count} of {} bytes were sent", report.len());
                Err(Error::Usb { place: self.place.clone(), doing: doing.into(), reason })
            }
            Err(rusb::Error::Timeout) => {
                let waited_ms = timeout.as_millis() as u64;
                Err(Error::Timeout { place: self.place.clone(), doing: doing.into(), waited_ms })
            }
            Err(error) => Err(from_libusb(error, &self.place, doing)),
        }
    }

    fn receive(&mut self, report: &mut Report, timeout: Duration) -> Result<usize> {
        match self.handle.read_interrupt(IN, report, timeout.max(LEAST_TIMEOUT)) {
            Ok(count) => Ok(count),
            Err(rusb::Error::Timeout) => Ok(0),
            Err(error) => Err(from_libusb(error, &self.place, "receiving a report")),
        }
    }

    fn place(&self) -> &str {
        &self.place
    }
}

impl LightCrafter<UsbTransport> {
    /// Open a real projector. Opening sends no command, so the projector keeps its image.
    pub fn open(selector: &Selector) -> Result<Self> {
        UsbTransport::open(selector).map(Self::new)
    }
}

fn from_libusb(error: rusb::Error, place: &str, doing: &str) -> Error {
    let place = place.to_owned();
    match error {
        rusb::Error::Access => Error::AccessDenied { place, rule: UDEV_RULE, file: UDEV_FILE },
        rusb::Error::Busy => Error::Busy { place },
        rusb::Error::NoDevice | rusb::Error::NotFound => Error::Disconnected { place },
        other => Error::Usb { place, doing: doing.to_owned(), reason: other.to_string() },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ports_are_written_as_linux_writes_them() {
        for text in ["1-2", "3-1.4", "12-1.2.3.4"] {
            assert_eq!(text.parse::<PortPath>().unwrap().to_string(), text);
        }
        for text in ["", "1", "1-", "-2", "1-2.", "1-300", "LCR2"] {
            assert!(text.parse::<PortPath>().unwrap_err().to_string().contains("such as 1-2"), "{text}");
        }
    }

    #[test]
    fn errors_of_libusb_become_those_of_the_driver() {
        let of = |error| from_libusb(error, "1-2", "opening the device");
        assert!(of(rusb::Error::Access).to_string().contains("idVendor"));
        assert!(of(rusb::Error::Busy).to_string().contains("TI's LightCrafter GUI"));
        assert!(matches!(of(rusb::Error::NoDevice), Error::Disconnected { .. }));
        assert!(of(rusb::Error::Pipe).to_string().contains("opening the device"));
    }
}
