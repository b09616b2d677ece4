//! A LightCrafter 4500, with one method for each task.

mod configure;
mod play;

pub use configure::{TriggerOut, Triggers};

use crate::command::{
    DisplayMode, FirmwareTag, FlashImageCount, HardwareStatus, InputSource, MainStatus, PowerMode, Readable,
    RunState, SoftwareReset, SystemStatus, Versions, VideoSignal, Writable,
};
use crate::error::{Error, Result};
use crate::link::Link;
use crate::profile::Profile;
use crate::sequence::Sequence;
use crate::transport::Transport;
use std::thread::sleep;
use std::time::{Duration, Instant};

/// Time limits and intervals of all waits. The README lists the default limits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Waits {
    /// Limit for a reply. The driver repeats a read without a reply once.
    pub reply: Duration,
    /// Interval between two reads of a state that is about to change.
    pub poll: Duration,
    /// Limit for a change of mode or run state, and for a validation.
    pub change: Duration,
    /// Interval between starting a validation and reading its result.
    pub validation: Duration,
    /// Interval between waking and the first read, during which the controller may not reply.
    pub wake: Duration,
    /// Limit for waking and going to sleep.
    pub power: Duration,
    /// Limit for the video input to lock.
    pub lock: Duration,
}

impl Default for Waits {
    fn default() -> Self {
        let ms = Duration::from_millis;
        Self {
            reply: ms(2000),
            poll: ms(100),
            change: ms(10_000),
            validation: ms(100),
            wake: ms(2000),
            power: ms(10_000),
            lock: ms(5000),
        }
    }
}

/// Complete state of a projector.
#[derive(Debug, Clone, PartialEq)]
pub struct Status {
    /// The hardware.
    pub hardware: HardwareStatus,
    /// The self-test.
    pub system: SystemStatus,
    /// The display.
    pub main: MainStatus,
    /// Awake or asleep.
    pub power: PowerMode,
    /// Video or patterns.
    pub mode: DisplayMode,
    /// Whether patterns run.
    pub run: RunState,
    /// The input of the video mode.
    pub input: InputSource,
    /// The video signal. It reads as not locked while patterns run, which is normal.
    pub signal: VideoSignal,
}

impl Status {
    /// Faults of the hardware, in words; empty if there are none.
    pub fn faults(&self) -> Vec<&'static str> {
        let HardwareStatus { initialised, reset_overlap, forced_swap, sequencer_abort, sequencer_error } =
            self.hardware;
        let faults = [
            (!initialised, "the controller did not initialise: switch its power off and on"),
            (!self.system.memory_passed, "the internal memory failed its test: switch the power off and on"),
            (reset_overlap, "two mirror operations overlapped"),
            (forced_swap, "a buffer swap was forced: patterns are shown faster than images load"),
            (sequencer_abort, "the sequencer aborted: load the sequence again"),
            (sequencer_error, "the sequencer reports an error: load the sequence again"),
        ];
        faults.iter().filter(|(set, _)| *set).map(|(_, name)| *name).collect()
    }
}

/// One projector. Every transaction takes `&mut self`, so only one is in flight. There is no global state: several
/// projectors can be used at the same time from several threads.
#[derive(Debug)]
pub struct LightCrafter<T> {
    link: Link<T>,
    profile: Profile,
    waits: Waits,
    loaded: Option<Sequence>,
}

impl<T: Transport> LightCrafter<T> {
    /// Create a projector on a transport, with TI's light engine and the default waits. This sends no command.
    pub fn new(transport: T) -> Self {
        let waits = Waits::default();
        Self { link: Link::new(transport, waits.reply), profile: Profile::EVM, waits, loaded: None }
    }

    /// Replace the light engine.
    pub fn with_profile(mut self, profile: Profile) -> Self {
        self.profile = profile;
        self
    }

    /// Replace the waits.
    pub fn with_waits(mut self, waits: Waits) -> Self {
        self.link.set_reply_timeout(waits.reply);
        self.waits = waits;
        self
    }

    /// Bus and port path.
    pub fn place(&self) -> String {
        self.link.place()
    }

    /// The light engine.
    pub fn profile(&self) -> Profile {
        self.profile
    }

    /// Return the transport. This sends no command, so the projector keeps its image.
    pub fn into_transport(self) -> T {
        self.link.into_transport()
    }

    /// Read any register, for functions that have no method here.
    pub fn read<M: Readable>(&mut self) -> Result<M> {
        self.link.read()
    }

    /// Write any register, for functions that have no method here.
    pub fn write<M: Writable>(&mut self, message: &M) -> Result<()> {
        self.link.write(message)
    }

    /// Read the complete state.
    pub fn status(&mut self) -> Result<Status> {
        Ok(Status {
            hardware: self.read()?,
            system: self.read()?,
            main: self.read()?,
            power: self.read()?,
            mode: self.read()?,
            run: self.read()?,
            input: self.read()?,
            signal: self.read()?,
        })
    }

    /// Versions of the firmware and its parts.
    pub fn versions(&mut self) -> Result<Versions> {
        self.read()
    }

    /// Tag that the firmware image was given when it was built.
    pub fn firmware_tag(&mut self) -> Result<String> {
        self.read().map(|FirmwareTag(tag)| tag)
    }

    /// Number of 24-bit images in flash.
    pub fn flash_image_count(&mut self) -> Result<u8> {
        self.read().map(|FlashImageCount(count)| count)
    }

    /// Check that flash holds at least this number of images and that the firmware has this tag. The error names the
    /// difference.
    pub fn check_flash(&mut self, images: u8, tag: Option<&str>) -> Result<()> {
        let present = self.flash_image_count()?;
        if present < images {
            let name = format!("images in the flash of the projector at {}", self.place());
            let expected = format!("at least {images}; write them with TI's program");
            return Err(Error::value(name, expected, present));
        }
        let Some(wanted) = tag else { return Ok(()) };
        let found = self.firmware_tag()?;
        if found == wanted {
            return Ok(());
        }
        let name = format!("firmware tag of the projector at {}", self.place());
        Err(Error::value(name, format!("{wanted:?}"), format!("{found:?}")))
    }

    /// Wake the projector or put it to sleep, and wait until it reports the new state. It may not acknowledge waking.
    pub fn set_power(&mut self, power: PowerMode) -> Result<()> {
        if self.read::<PowerMode>()? == power {
            return Ok(());
        }
        match self.write(&power) {
            Err(Error::Timeout { .. } | Error::Refused { .. }) if power == PowerMode::Normal => {}
            other => other?,
        }
        self.loaded = None;
        sleep(self.waits.wake);
        self.wait_for_power(power)
    }

    /// Read the power mode until it is `power`. A controller that wakes up may not reply yet.
    fn wait_for_power(&mut self, power: PowerMode) -> Result<()> {
        let deadline = Instant::now() + self.waits.power;
        loop {
            let answer = self.read::<PowerMode>();
            let late = Instant::now() >= deadline;
            match answer {
                Ok(actual) if actual == power => return Ok(()),
                Ok(actual) if late => return Err(self.stuck(&power, &actual, self.waits.power)),
                Ok(_) => {}
                Err(Error::Timeout { .. } | Error::Refused { .. }) if !late => {}
                Err(error) => return Err(error),
            }
            sleep(self.waits.poll);
        }
    }

    /// Restart the firmware. The device disappears from the bus, so this consumes `self`; open it again after 5 to 10 s.
    pub fn reset(mut self) -> Result<()> {
        self.write(&SoftwareReset)
    }

    /// The video signal at the input.
    pub fn video_signal(&mut self) -> Result<VideoSignal> {
        self.read()
    }

    /// Wait until the video input is locked. The error describes the signal.
    pub fn wait_for_lock(&mut self) -> Result<VideoSignal> {
        let Waits { poll, lock, .. } = self.waits;
        let signal = self.repeat(poll, lock, Self::video_signal, VideoSignal::locked)?;
        if signal.locked() {
            return Ok(signal);
        }
        Err(Error::NotLocked { place: self.place(), signal: signal.to_string() })
    }

    /// Repeat a step at this interval until its result is final or the time limit is reached. Returns the last result.
    fn repeat<S>(
        &mut self,
        interval: Duration,
        limit: Duration,
        step: impl Fn(&mut Self) -> Result<S>,
        is_final: impl Fn(&S) -> bool,
    ) -> Result<S> {
        let deadline = Instant::now() + limit;
        loop {
            let state = step(self)?;
            if is_final(&state) || Instant::now() >= deadline {
                return Ok(state);
            }
            sleep(interval);
        }
    }

    fn stuck(&self, asked: &dyn std::fmt::Debug, actual: &dyn std::fmt::Debug, bound: Duration) -> Error {
        let waited_ms = bound.as_millis() as u64;
        let (asked, actual) = (format!("{asked:?}"), format!("{actual:?}"));
        Error::Stuck { place: self.place(), asked, actual, waited_ms }
    }
}
