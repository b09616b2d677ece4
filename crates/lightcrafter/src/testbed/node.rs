//! One device in the testbed: its folder in `/sys`, its node in `/dev`, and the holders of its interfaces.

use super::descriptors;
use crate::emulator::Dlpc350;
use std::collections::VecDeque;
use std::fs;
use std::io;
use std::os::unix::fs::{PermissionsExt, symlink};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// A file that nobody can open for writing, not even root: it replaces the device node when access is denied.
const FORBIDDEN: &str = "/sys/kernel/uevent_seqnum";
/// umockdev treats a file with the sticky bit as a device node.
const DEVICE_MODE: u32 = 0o1666;

/// Holder of an interface.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Holder {
    /// Nobody.
    Free,
    /// The HID driver of the kernel.
    Kernel,
    /// A program, through this connection.
    Program(u64),
}

/// State that all connections to a device share.
#[derive(Debug)]
pub struct Shared {
    pub holders: [Holder; 2],
    /// Reports for the next reader.
    pub incoming: VecDeque<Vec<u8>>,
}

#[derive(Debug)]
pub struct Node {
    pub place: String,
    /// Path of the socket that umockdev sends the ioctls on the device node to.
    pub socket: PathBuf,
    model: Mutex<Dlpc350>,
    shared: Mutex<Shared>,
    link: PathBuf,
    target: PathBuf,
    device: PathBuf,
}

impl Node {
    /// Write the files of a device on this bus.
    pub fn new(root: &Path, bus: u8, address: u8, port: u8, model: Dlpc350) -> io::Result<Self> {
        let place = format!("{bus}-{port}");
        let parent = format!("devices/pci0000:00/0000:00:14.0/usb{bus}/{place}");
        let device = format!("dev/bus/usb/{bus:03}/{address:03}");
        let node = Self {
            socket: root.join("ioctl").join(&device),
            link: root.join(format!("sys/bus/usb/devices/{place}")),
            target: PathBuf::from(format!("../../../{parent}")),
            device: root.join(device),
            place,
            model: Mutex::new(model),
            shared: Mutex::new(Shared { holders: [Holder::Kernel; 2], incoming: VecDeque::new() }),
        };
        write_sysfs(&root.join("sys").join(parent), bus, address)?;
        fs::create_dir_all(node.device.parent().unwrap_or(root))?;
        node.allow()?;
        node.reflect()?;
        fs::create_dir_all(node.socket.parent().unwrap_or(root))?;
        Ok(node)
    }

    pub fn model(&self) -> MutexGuard<'_, Dlpc350> {
        self.model.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub fn shared(&self) -> MutexGuard<'_, Shared> {
        self.shared.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Add the device to the bus or remove it, to match the emulator.
    pub fn reflect(&self) -> io::Result<()> {
        let plugged = self.model().plugged();
        match (plugged, self.link.is_symlink()) {
            (true, false) => symlink(&self.target, &self.link),
            (false, true) => fs::remove_file(&self.link),
            _ => Ok(()),
        }
    }

    /// Let every user open the device.
    pub fn allow(&self) -> io::Result<()> {
        let _ = fs::remove_file(&self.device);
        fs::write(&self.device, descriptors::stored())?;
        fs::set_permissions(&self.device, fs::Permissions::from_mode(DEVICE_MODE))
    }

    /// Let nobody open the device.
    pub fn deny(&self) -> io::Result<()> {
        fs::remove_file(&self.device)?;
        symlink(FORBIDDEN, &self.device)
    }
}

fn write_sysfs(folder: &Path, bus: u8, address: u8) -> io::Result<()> {
    fs::create_dir_all(folder)?;
    let (bus, address) = (bus.to_string(), address.to_string());
    let attributes = [
        ("busnum", bus.as_str()),
        ("devnum", &address),
        ("speed", "12"),
        ("bConfigurationValue", "1"),
        ("idVendor", "0451"),
        ("idProduct", "6401"),
        ("serial", "LCR2"),
    ];
    for (name, value) in attributes {
        fs::write(folder.join(name), format!("{value}\n"))?;
    }
    fs::write(folder.join("descriptors"), descriptors::stored())?;
    let name = format!("bus/usb/{bus:0>3}/{address:0>3}");
    let properties = format!(
        "DEVTYPE=usb_device\nBUSNUM={bus:0>3}\nDEVNUM={address:0>3}\nDEVNAME={name}\nPRODUCT=451/6401/0\n"
    );
    fs::write(folder.join("uevent"), properties)?;
    symlink("../../../../../bus/usb", folder.join("subsystem"))
}
