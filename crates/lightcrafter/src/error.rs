//! Errors of the driver; the doc comment of a variant is the message that the user reads.

use displaydoc::Display;

/// Result of every fallible call of this crate.
pub type Result<T> = std::result::Result<T, Error>;

/// The udev rule that lets every user of the machine open a LightCrafter 4500 on Linux.
pub const UDEV_RULE: &str =
    r#"SUBSYSTEM=="usb", ATTR{idVendor}=="0451", ATTR{idProduct}=="6401", MODE="0666", TAG+="uaccess""#;

/// Where the rule of [`UDEV_RULE`] belongs.
pub const UDEV_FILE: &str = "/etc/udev/rules.d/70-lightcrafter4500.rules";

/// An error that says what was expected, what happened, and what to do.
#[derive(Debug, Clone, PartialEq, Eq, Display)]
#[non_exhaustive]
pub enum Error {
    /// no LightCrafter 4500 at {wanted}; connected: {present}; check the power and the USB cable
    NotFound {
        /// The requested device.
        wanted: String,
        /// The connected devices.
        present: String,
    },
    /// {wanted} matches more than one LightCrafter 4500: {present}; all units may carry the same serial number, so choose one by its port, such as 1-2
    Ambiguous {
        /// The requested device.
        wanted: String,
        /// The matching devices.
        present: String,
    },
    /// no permission to open the LightCrafter 4500 at {place}; as root, write the line {rule} into {file}, run `udevadm control --reload && udevadm trigger`, and plug the projector in again
    AccessDenied {
        /// Bus and port path.
        place: String,
        /// Line of the udev rule.
        rule: &'static str,
        /// File that the line belongs to.
        file: &'static str,
    },
    /// the LightCrafter 4500 at {place} is in use by another program; close the one that may have it open: TI's LightCrafter GUI, another driver, or a second copy of this program
    Busy {
        /// Bus and port path.
        place: String,
    },
    /// the LightCrafter 4500 at {place} was disconnected; check the cable and the power, then open it again
    Disconnected {
        /// Bus and port path.
        place: String,
    },
    /// the LightCrafter 4500 at {place} did not answer within {waited_ms} ms while {doing}; try again; if it stays silent, switch its power off and on
    Timeout {
        /// Bus and port path.
        place: String,
        /// The operation that failed, such as `reading the versions`.
        doing: String,
        /// Time waited, ms.
        waited_ms: u64,
    },
    /// USB failed at {place} while {doing}: {reason}; plug the projector in again, and pass USB (/dev/bus/usb) into a container or virtual machine
    Usb {
        /// Bus and port path.
        place: String,
        /// The operation that failed, such as `reading the versions`.
        doing: String,
        /// Error text of libusb.
        reason: String,
    },
    /// the LightCrafter 4500 at {place} refused the command for {doing}: its firmware does not know the command, or does not allow it in the current state
    Refused {
        /// Bus and port path.
        place: String,
        /// The operation that failed, such as `reading the versions`.
        doing: String,
    },
    /// the reply of {place} while {doing} has sequence number {actual}, expected {expected}, and no other reply came in time; close any other program that talks to this projector
    Sequence {
        /// Bus and port path.
        place: String,
        /// The operation that failed, such as `reading the versions`.
        doing: String,
        /// Number of the request.
        expected: u8,
        /// Number of the reply.
        actual: u8,
    },
    /// malformed {what}: expected {expected}, got {actual}; try again; if this repeats, switch the power of the projector off and on
    Malformed {
        /// The malformed message.
        what: String,
        /// The expected form.
        expected: String,
        /// The actual value.
        actual: String,
    },
    /// {name}: expected {expected}, got {actual}
    Value {
        /// The parameter, with its unit.
        name: String,
        /// The expected range or form.
        expected: String,
        /// The actual value.
        actual: String,
    },
    /// the projector at {place} does not accept this pattern sequence: {faults}
    Rejected {
        /// Bus and port path.
        place: String,
        /// Every fault that the validator reports, by name.
        faults: String,
    },
    /// the video input of the projector at {place} is not locked: {signal}; connect and enable the HDMI output at 912 x 1140, without scaling, then load the pattern sequence again
    NotLocked {
        /// Bus and port path.
        place: String,
        /// State of the input signal.
        signal: String,
    },
    /// the projector at {place} was still in the state {actual} {waited_ms} ms after the command {asked}; if this repeats, switch its power off and on
    Stuck {
        /// Bus and port path.
        place: String,
        /// The commanded state.
        asked: String,
        /// The state that the projector reports.
        actual: String,
        /// Time waited, ms.
        waited_ms: u64,
    },
    /// the projector at {place} switched to video by itself, as it does when an HDMI signal appears; connect and enable the HDMI output first, then load and start the patterns again
    LeftPatterns {
        /// Bus and port path.
        place: String,
    },
    /// output {wanted}: {reason}; outputs: {present}
    Output {
        /// The requested output.
        wanted: String,
        /// Why it cannot show a pattern.
        reason: String,
        /// The outputs that exist.
        present: String,
    },
    /// cannot show a window: {reason}; run in a graphical session, with DISPLAY or WAYLAND_DISPLAY set
    NoDisplay {
        /// Error text of the window system.
        reason: String,
    },
}

impl std::error::Error for Error {}

impl Error {
    /// A parameter outside its range.
    pub(crate) fn value(
        name: impl Into<String>,
        expected: impl Into<String>,
        actual: impl std::fmt::Display,
    ) -> Self {
        Self::Value { name: name.into(), expected: expected.into(), actual: actual.to_string() }
    }

    /// Bytes that form no valid message.
    pub(crate) fn malformed(
        what: impl Into<String>,
        expected: impl Into<String>,
        actual: impl std::fmt::Display,
    ) -> Self {
        Self::Malformed { what: what.into(), expected: expected.into(), actual: actual.to_string() }
    }

    /// Whether bytes of an old reply may still be in flight after this error.
    pub(crate) fn leaves_residue(&self) -> bool {
        matches!(
            self,
            Self::Timeout { .. } | Self::Malformed { .. } | Self::Sequence { .. } | Self::Usb { .. }
        )
    }
}
