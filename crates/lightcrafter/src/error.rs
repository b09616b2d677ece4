//! Everything that can go wrong; the doc comment of a variant is the message that the user reads.

use displaydoc::Display;

/// Result of every fallible call of this crate.
pub type Result<T> = std::result::Result<T, Error>;

/// The udev rule that lets every user of the machine open a LightCrafter 4500 on Linux.
pub const UDEV_RULE: &str =
    r#"SUBSYSTEM=="usb", ATTR{idVendor}=="0451", ATTR{idProduct}=="6401", MODE="0666", TAG+="uaccess""#;

/// Where the rule of [`UDEV_RULE`] belongs.
pub const UDEV_FILE: &str = "/etc/udev/rules.d/70-lightcrafter4500.rules";

/// What was expected, what came, and what to do.
#[derive(Debug, Clone, PartialEq, Eq, Display)]
#[non_exhaustive]
pub enum Error {
    /// no LightCrafter 4500 at {wanted}; connected: {present}; check the power and the USB cable
    NotFound {
        /// The device asked for.
        wanted: String,
        /// The devices that are there.
        present: String,
    },
    /// more than one LightCrafter 4500 is meant by {wanted}: {present}; all units may carry the same serial number, so choose one by its port, such as 1-2
    Ambiguous {
        /// The device asked for.
        wanted: String,
        /// The devices that match.
        present: String,
    },
    /// no permission to open the LightCrafter 4500 at {place}; as root, write the line {rule} into {file}, run `udevadm control --reload && udevadm trigger`, and plug the projector in again
    AccessDenied {
        /// Bus and port path.
        place: String,
        /// The line of the rule.
        rule: &'static str,
        /// The file it belongs to.
        file: &'static str,
    },
    /// the LightCrafter 4500 at {place} is held by another program; close what may have it open: TI's LightCrafter GUI, another driver, or another process of this one
    Busy {
        /// Bus and port path.
        place: String,
    },
    /// the LightCrafter 4500 at {place} has left the bus; check the cable and the power, then open it again
    Disconnected {
        /// Bus and port path.
        place: String,
    },
    /// the LightCrafter 4500 at {place} did not answer within {waited_ms} ms while {doing}; try again, and switch its power off and on when it stays silent
    Timeout {
        /// Bus and port path.
        place: String,
        /// What was asked of it.
        doing: String,
        /// How long was waited.
        waited_ms: u64,
    },
    /// USB failed at {place} while {doing}: {reason}; plug the projector in again, and pass USB (/dev/bus/usb) into a container or virtual machine
    Usb {
        /// Bus and port path.
        place: String,
        /// What was asked of it.
        doing: String,
        /// The word of libusb.
        reason: String,
    },
    /// the LightCrafter 4500 at {place} refused {doing}: the command is unknown to its firmware, or not allowed in its present state
    Refused {
        /// Bus and port path.
        place: String,
        /// What was asked of it.
        doing: String,
    },
    /// the reply to {doing} from {place} carries sequence number {actual}, expected {expected}, and no other came in time; does another program talk to this projector?
    Sequence {
        /// Bus and port path.
        place: String,
        /// What was asked of it.
        doing: String,
        /// The number sent.
        expected: u8,
        /// The number received.
        actual: u8,
    },
    /// malformed {what}: expected {expected}, got {actual}; try again, and switch the power of the projector off and on when it repeats
    Malformed {
        /// The message at fault.
        what: String,
        /// The form asked for.
        expected: String,
        /// What came.
        actual: String,
    },
    /// {name}: expected {expected}, got {actual}
    Value {
        /// The parameter at fault, with its unit.
        name: String,
        /// The range or form asked for.
        expected: String,
        /// What came.
        actual: String,
    },
    /// the projector at {place} does not accept this pattern sequence: {faults}
    Rejected {
        /// Bus and port path.
        place: String,
        /// Every fault bit of the validator, by name.
        faults: String,
    },
    /// the video input of the projector at {place} is not locked: {signal}; connect and enable the HDMI output at 912 x 1140, without scaling, before the pattern sequence
    NotLocked {
        /// Bus and port path.
        place: String,
        /// What the projector sees.
        signal: String,
    },
    /// the projector at {place} stays in the state {actual} after being told {asked}, {waited_ms} ms long; switch its power off and on when this repeats
    Stuck {
        /// Bus and port path.
        place: String,
        /// The state asked for.
        asked: String,
        /// The state it is in.
        actual: String,
        /// How long was waited.
        waited_ms: u64,
    },
    /// the projector at {place} went to video by itself, as it does when HDMI data appear; connect and enable the HDMI output first, then load and start the patterns again
    LeftPatterns {
        /// Bus and port path.
        place: String,
    },
    /// output {wanted}: {reason}; outputs: {present}
    Output {
        /// The output asked for.
        wanted: String,
        /// Why it cannot carry a pattern.
        reason: String,
        /// The outputs that are there.
        present: String,
    },
    /// no window can be shown: {reason}; run in a graphical session, with DISPLAY or WAYLAND_DISPLAY set
    NoDisplay {
        /// The word of the window system.
        reason: String,
    },
}

impl std::error::Error for Error {}

impl Error {
    /// A parameter outside its range, named with what was expected and what came.
    pub(crate) fn value(
        name: impl Into<String>,
        expected: impl Into<String>,
        actual: impl std::fmt::Display,
    ) -> Self {
        Self::Value { name: name.into(), expected: expected.into(), actual: actual.to_string() }
    }

    /// Bytes that are no message.
    pub(crate) fn malformed(
        what: impl Into<String>,
        expected: impl Into<String>,
        actual: impl std::fmt::Display,
    ) -> Self {
        Self::Malformed { what: what.into(), expected: expected.into(), actual: actual.to_string() }
    }

    /// Whether what went wrong may have left bytes of an old reply on the way.
    pub(crate) fn leaves_residue(&self) -> bool {
        matches!(
            self,
            Self::Timeout { .. } | Self::Malformed { .. } | Self::Sequence { .. } | Self::Usb { .. }
        )
    }
}
