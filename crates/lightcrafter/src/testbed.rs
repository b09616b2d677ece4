//! The emulator behind the real libusb: a umockdev testbed with projectors in chosen ports (Linux).
//!
//! The preload library of umockdev shows a program fake `/sys` and `/dev` folders and sends each ioctl on a device node to
//! a socket, where this module answers like usbfs. libusb and everything above it run unmodified. Programs find the
//! control socket of the testbed through the environment variable [`CONTROL`] and inject faults with [`Control`].
//!
//! The protocol between the preload library and the socket is internal to umockdev. This module uses that of version
//! 0.17, and [`Testbed::command`] refuses any other version.

mod control;
mod descriptors;
mod ioctl;
mod node;
mod socket;
mod usbfs;

pub use control::{CONTROL, Control};

use crate::emulator::Dlpc350;
use node::Node;
use std::io;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Arc;

const PRELOAD: &str = "libumockdev-preload.so.0";
const KNOWN_VERSION: &str = "0.17.";

/// Emulated projectors on a fake bus. Dropping it removes the bus.
#[derive(Debug)]
pub struct Testbed {
    root: PathBuf,
    nodes: Vec<Arc<Node>>,
}

impl Testbed {
    /// Create bus 1 with one projector in each of these ports, all with the same serial number.
    pub fn new(ports: &[u8]) -> io::Result<Self> {
        let root = std::env::temp_dir().join(format!("lightcrafter-testbed-{}", std::process::id()));
        let _ = std::fs::remove_dir_all(&root);
        std::fs::create_dir_all(root.join("sys/bus/usb/devices"))?;
        std::fs::create_dir_all(root.join("sys/class"))?;
        symlink("../bus/usb", root.join("sys/class/usb_device"))?;
        let mut nodes = Vec::new();
        for (i, port) in ports.iter().enumerate() {
            let model = Dlpc350::new(&format!("QF-EMULATOR-1-{port}"), 3);
            let node = Arc::new(Node::new(&root, 1, 5 + i as u8, *port, model)?);
            usbfs::listen(&node)?;
            nodes.push(node);
        }
        control::listen(&root.join("control"), nodes.clone())?;
        Ok(Self { root, nodes })
    }

    /// Folder that holds the `/sys` and `/dev` of the program.
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// Prepare a command that runs in the testbed. A missing umockdev, or one of an unknown version, is an error.
    pub fn command(&self, program: &str) -> io::Result<Command> {
        check_umockdev()?;
        let mut command = Command::new(program);
        command.env("UMOCKDEV_DIR", &self.root).env("LD_PRELOAD", PRELOAD);
        command.env(CONTROL, self.root.join("control"));
        Ok(command)
    }

    /// Number of requests that each projector received.
    pub fn transactions(&self) -> Vec<(String, u64)> {
        self.nodes.iter().map(|node| (node.place.clone(), node.model().transactions())).collect()
    }
}

impl Drop for Testbed {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.root);
    }
}

fn check_umockdev() -> io::Result<()> {
    let output = Command::new("umockdev-run").arg("--version").output().map_err(|error| {
        io::Error::new(error.kind(), "umockdev is not installed: apt-get install umockdev")
    })?;
    let version = String::from_utf8_lossy(&output.stdout).trim().to_owned();
    if version.starts_with(KNOWN_VERSION) {
        return Ok(());
    }
    let message =
        format!("the ioctl protocol of umockdev {version} is unknown: install version {KNOWN_VERSION}x");
    Err(io::Error::new(io::ErrorKind::Unsupported, message))
}
