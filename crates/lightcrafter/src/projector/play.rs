//! Display modes, and loading, starting and stopping of pattern sequences.

use super::{LightCrafter, Waits};
use crate::command::{
    DisplayMode, FlashImage, Gamma, ImageTable, InputPort, InputSource, LedEnable, Mailbox, MailboxOffset,
    PatternSource, PatternTable, PowerMode, RunState, TestPattern, TestPatternColours, Timing, Validate,
    Validation, VariableEntry, VariableOffset, Versions,
};
use crate::error::{Error, Result};
use crate::sequence::{Exposures, Sequence, Source};
use crate::transport::Transport;
use std::fmt::Debug;
use std::thread::sleep;
use std::time::Duration;

impl<T: Transport> LightCrafter<T> {
    /// Show the video input in linear light. An input that does not lock is an error.
    pub fn show_video(&mut self) -> Result<()> {
        self.set_power(PowerMode::Normal)?;
        self.enter(DisplayMode::Video)?;
        self.select_input(InputSource::HDMI)?;
        self.write(&Gamma::LINEAR)?;
        self.wait_for_lock().map(|_| ())
    }

    /// Show an image of the test pattern generator in video mode.
    pub fn show_test_pattern(&mut self, pattern: TestPattern, colours: TestPatternColours) -> Result<()> {
        self.set_power(PowerMode::Normal)?;
        self.enter(DisplayMode::Video)?;
        self.write(&colours)?;
        self.write(&pattern)?;
        self.select_input(InputSource::TEST_PATTERN)
    }

    /// Show a flash image as a still picture, in video mode and linear light.
    pub fn show_flash_image(&mut self, image: u8) -> Result<()> {
        self.set_power(PowerMode::Normal)?;
        self.check_images(&[image])?;
        self.enter(DisplayMode::Video)?;
        self.select_input(InputSource::FLASH)?;
        self.write(&Gamma::LINEAR)?;
        self.write(&FlashImage(image))
    }

    /// Select the input of the video mode, unless it is the selected one.
    pub fn select_input(&mut self, input: InputSource) -> Result<()> {
        if self.read::<InputSource>()? == input { Ok(()) } else { self.write(&input) }
    }

    /// Change the mode, unless it is the current one: a redundant write can freeze the chip. Changing the mode while the
    /// test pattern generator is the input can freeze it too, so the input changes first.
    fn enter(&mut self, mode: DisplayMode) -> Result<()> {
        if self.read::<DisplayMode>()? == mode {
            return Ok(());
        }
        if self.read::<InputSource>()?.port == InputPort::TestPattern {
            self.write(&InputSource::HDMI)?;
        }
        if mode == DisplayMode::Video {
            self.stop()?;
            // LED delays apply to pattern mode only.
            self.set_led_delays_us([0.0; 3], [0.0; 3])?;
        }
        self.loaded = None;
        self.write(&mode)?;
        self.reach(mode, Self::read)
    }

    /// Send a sequence to the projector and validate it without starting it. The result contains warnings. A sequence
    /// that cannot run is an error that names every fault.
    pub fn load(&mut self, sequence: &Sequence) -> Result<Validation> {
        sequence.check()?;
        self.set_power(PowerMode::Normal)?;
        self.check_against_device(sequence)?;
        self.stop()?;
        self.enter_pattern_mode(sequence)?;
        let validation = self.send(sequence)?;
        self.loaded = Some(sequence.clone());
        Ok(validation)
    }

    fn check_against_device(&mut self, sequence: &Sequence) -> Result<()> {
        if sequence.variable() {
            let Versions { application, .. } = self.versions()?;
            if application.major < 3 {
                let expected = "3.0 or newer for individual exposures";
                return Err(Error::value("firmware", expected, application));
            }
        }
        match &sequence.source {
            Source::Flash { images, .. } => self.check_images(images),
            Source::Video { .. } => Ok(()),
        }
    }

    fn check_images(&mut self, images: &[u8]) -> Result<()> {
        let last = images.iter().max().copied().unwrap_or(0);
        let present = self.flash_image_count()?;
        if last < present {
            return Ok(());
        }
        let name = format!("flash image of the projector at {}", self.place());
        Err(Error::value(name, format!("below {present}, the number of images in its flash"), last))
    }

    /// Wait for the lock of the video input first: in pattern mode the signal always reads as not locked.
    fn enter_pattern_mode(&mut self, sequence: &Sequence) -> Result<()> {
        if sequence.from_the_video_input() {
            self.select_input(InputSource::HDMI)?;
            if self.read::<DisplayMode>()? == DisplayMode::Video {
                self.wait_for_lock()?;
            }
        }
        self.enter(DisplayMode::PatternSequence)
    }

    fn send(&mut self, sequence: &Sequence) -> Result<Validation> {
        let video = sequence.from_the_video_input();
        self.write(if video { &PatternSource::Video } else { &PatternSource::Flash })?;
        self.write(&LedEnable::SEQUENCER)?;
        self.write(&sequence.trigger_mode)?;
        match &sequence.exposures {
            Exposures::Fixed(timing) => self.send_fixed(sequence, *timing)?,
            Exposures::Each(timings) => self.send_each(sequence, timings)?,
        }
        self.validate()
    }

    fn send_fixed(&mut self, sequence: &Sequence, timing: Timing) -> Result<()> {
        self.write(&sequence.lut_control())?;
        self.write(&timing)?;
        self.write(&Mailbox::Patterns)?;
        self.write(&MailboxOffset(0))?;
        self.write(&PatternTable(sequence.patterns.clone()))?;
        self.write(&Mailbox::Close)?;
        let Source::Flash { images, .. } = &sequence.source else { return Ok(()) };
        self.write(&Mailbox::Images)?;
        self.write(&MailboxOffset(0))?;
        self.write(&ImageTable(images.clone()))?;
        self.write(&Mailbox::Close)
    }

    fn send_each(&mut self, sequence: &Sequence, timings: &[Timing]) -> Result<()> {
        self.write(&sequence.variable_control())?;
        self.write(&Mailbox::Variable)?;
        for (i, (entry, timing)) in sequence.patterns.iter().zip(timings).enumerate() {
            self.write(&VariableOffset(i as u16))?;
            self.write(&VariableEntry { entry: *entry, timing: *timing })?;
        }
        self.write(&Mailbox::Close)?;
        let Source::Flash { images, .. } = &sequence.source else { return Ok(()) };
        self.write(&Mailbox::Images)?;
        // One message holds 64 entries. No chunk may have exactly two, because the firmware would swap them.
        let size = if images.len() % 64 == 2 { 63 } else { 64 };
        for (i, chunk) in images.chunks(size).enumerate() {
            self.write(&VariableOffset((size * i) as u16))?;
            self.write(&ImageTable(chunk.to_vec()))?;
        }
        self.write(&Mailbox::Close)
    }

    /// Validate the tables on the projector.
    fn validate(&mut self) -> Result<Validation> {
        self.write(&Validate)?;
        sleep(self.waits.validation);
        let Waits { poll, change, .. } = self.waits;
        let validation =
            self.repeat(poll / 4, change, Self::read::<Validation>, |validation| !validation.busy)?;
        if validation.busy {
            return Err(self.stuck(&Validate, &validation, change));
        }
        let errors = validation.errors();
        if errors.is_empty() {
            return Ok(validation);
        }
        let faults = [errors, validation.warnings()].concat().join("; ");
        Err(Error::Rejected { place: self.place(), faults })
    }

    /// Start the loaded sequence or resume it after a pause. The firmware loses its tables at a stop and ignores the
    /// first start after video mode; this method sends the tables again and repeats the start.
    pub fn start(&mut self) -> Result<()> {
        if self.read::<RunState>()? == RunState::Stop {
            let Some(sequence) = self.loaded.clone() else {
                let expected = "a sequence from load(), or a paused one";
                return Err(Error::value(
                    format!("start of {}", self.place()),
                    expected,
                    "a stopped projector",
                ));
            };
            self.enter_pattern_mode(&sequence)?;
            self.send(&sequence)?;
        }
        self.begin()
    }

    /// Start, and check that the board is still in pattern mode, which it leaves when an HDMI signal appears.
    fn begin(&mut self) -> Result<()> {
        self.run(RunState::Start)?;
        match self.read::<DisplayMode>()? {
            DisplayMode::PatternSequence => Ok(()),
            DisplayMode::Video => {
                self.loaded = None;
                Err(Error::LeftPatterns { place: self.place() })
            }
        }
    }

    /// Load a sequence and start it.
    pub fn play(&mut self, sequence: &Sequence) -> Result<Validation> {
        let validation = self.load(sequence)?;
        self.begin()?;
        Ok(validation)
    }

    /// Pause at the current pattern.
    pub fn pause(&mut self) -> Result<()> {
        self.run(RunState::Pause)
    }

    /// Stop the patterns and wait until the sequencer has stopped.
    pub fn stop(&mut self) -> Result<()> {
        self.run(RunState::Stop)?;
        if let Some(Sequence { source: Source::Video { frame_rate_hz }, .. }) = &self.loaded {
            // Wait two frames, because the input is double-buffered.
            sleep(Duration::from_secs_f64(2.0 / frame_rate_hz));
        }
        Ok(())
    }

    /// Change exposure and period of the loaded sequence; a running sequence is restarted.
    pub fn set_timing(&mut self, timing: Timing) -> Result<Validation> {
        let Some(mut sequence) = self.loaded.clone() else {
            let name = format!("timing of {}", self.place());
            return Err(Error::value(name, "a sequence from load()", "none"));
        };
        let running = self.read::<RunState>()? == RunState::Start;
        sequence.exposures = Exposures::Fixed(timing);
        if running { self.play(&sequence) } else { self.load(&sequence) }
    }

    /// Write a run state repeatedly until the projector reports it.
    fn run(&mut self, state: RunState) -> Result<()> {
        self.reach(state, |projector| {
            projector.write(&state)?;
            projector.read()
        })
    }

    /// Repeat a step until it reads this state.
    fn reach<M: PartialEq + Debug>(
        &mut self,
        wanted: M,
        step: impl Fn(&mut Self) -> Result<M>,
    ) -> Result<()> {
        let Waits { poll, change, .. } = self.waits;
        let actual = self.repeat(poll, change, step, |actual| *actual == wanted)?;
        if actual == wanted { Ok(()) } else { Err(self.stuck(&wanted, &actual, change)) }
    }
}
