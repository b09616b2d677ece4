//! Modes, and a sequence from its rules to its first pattern.

use super::LightCrafter;
use crate::command::{
    DisplayMode, FlashImage, Gamma, ImageTable, InputPort, InputSource, LedEnable, Mailbox, MailboxOffset,
    PatternSource, PatternTable, PowerMode, RunState, TestPattern, TestPatternColours, Timing, Validate,
    Validation, VariableEntry, VariableOffset, Versions,
};
use crate::error::{Error, Result};
use crate::sequence::{Exposures, Sequence, Source};
use crate::transport::Transport;
use std::thread::sleep;
use std::time::{Duration, Instant};

impl<T: Transport> LightCrafter<T> {
    /// Show the video input as it is, in linear light; an error when it does not lock.
    pub fn show_video(&mut self) -> Result<()> {
        self.set_power(PowerMode::Normal)?;
        self.enter(DisplayMode::Video)?;
        self.select_input(InputSource::HDMI)?;
        self.write(&Gamma::LINEAR)?;
        self.wait_for_lock().map(|_| ())
    }

    /// Show a picture of the generator, in video mode.
    pub fn show_test_pattern(&mut self, pattern: TestPattern, colours: TestPatternColours) -> Result<()> {
        self.set_power(PowerMode::Normal)?;
        self.enter(DisplayMode::Video)?;
        self.write(&colours)?;
        self.write(&pattern)?;
        self.select_input(InputSource::TEST_PATTERN)
    }

    /// Show an image of flash as a still picture, in video mode and linear light.
    pub fn show_flash_image(&mut self, image: u8) -> Result<()> {
        self.set_power(PowerMode::Normal)?;
        self.check_images(&[image])?;
        self.enter(DisplayMode::Video)?;
        self.select_input(InputSource::FLASH)?;
        self.write(&Gamma::LINEAR)?;
        self.write(&FlashImage(image))
    }

    /// Choose the input of the video mode, unless it is chosen already.
    pub fn select_input(&mut self, input: InputSource) -> Result<()> {
        if self.read::<InputSource>()? == input { Ok(()) } else { self.write(&input) }
    }

    /// Change the mode, unless it is the present one: a redundant write can freeze the chip, and so can leaving the
    /// generator of test patterns by the mode.
    fn enter(&mut self, mode: DisplayMode) -> Result<()> {
        if self.read::<DisplayMode>()? == mode {
            return Ok(());
        }
        if self.read::<InputSource>()?.port == InputPort::TestPattern {
            self.write(&InputSource::HDMI)?;
        }
        if mode == DisplayMode::Video {
            self.stop()?;
            // Delays of the LEDs belong to patterns alone.
            self.set_led_delays_us([0.0; 3], [0.0; 3])?;
        }
        self.loaded = None;
        self.write(&mode)?;
        self.wait_for(mode, self.waits.change)
    }

    /// Send a sequence to the projector and have it judged; it is not started. Warnings are in the verdict, and what
    /// must not run is an error that names every fault.
    pub fn load(&mut self, sequence: &Sequence) -> Result<Validation> {
        sequence.check()?;
        self.set_power(PowerMode::Normal)?;
        self.check_against_device(sequence)?;
        self.stop()?;
        self.enter_pattern_mode(sequence)?;
        let verdict = self.send(sequence)?;
        self.loaded = Some(sequence.clone());
        Ok(verdict)
    }

    fn check_against_device(&mut self, sequence: &Sequence) -> Result<()> {
        if sequence.variable() {
            let Versions { application, .. } = self.versions()?;
            if application.major < 3 {
                let expected = "3.0 or newer for an exposure of each pattern";
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
        Err(Error::value(name, format!("below {present}, the number of images there"), last))
    }

    /// In pattern mode the signal reads as not locked, so the lock is asked for before.
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
        // In chunks, because a table holds 64 entries in one message; never of two, which the firmware exchanges.
        let size = if images.len() % 64 == 2 { 63 } else { 64 };
        for (i, chunk) in images.chunks(size).enumerate() {
            self.write(&VariableOffset((size * i) as u16))?;
            self.write(&ImageTable(chunk.to_vec()))?;
        }
        self.write(&Mailbox::Close)
    }

    /// Ask for the verdict on the tables that were sent.
    fn validate(&mut self) -> Result<Validation> {
        self.write(&Validate)?;
        sleep(self.waits.verdict);
        let deadline = Instant::now() + self.waits.change;
        let mut verdict = self.read::<Validation>()?;
        while verdict.busy {
            if Instant::now() >= deadline {
                return Err(self.stuck(&Validate, &verdict, self.waits.change));
            }
            sleep(self.waits.poll / 4);
            verdict = self.read()?;
        }
        let errors = verdict.errors();
        if errors.is_empty() {
            return Ok(verdict);
        }
        let faults = [errors, verdict.warnings()].concat().join("; ");
        Err(Error::Rejected { place: self.place(), faults })
    }

    /// Start the loaded sequence, or go on after a pause. The firmware loses its tables when stopped, and ignores the
    /// first start after video mode: both are made good here.
    pub fn start(&mut self) -> Result<()> {
        if self.read::<RunState>()? == RunState::Stop {
            let Some(sequence) = self.loaded.clone() else {
                let expected = "a sequence from load(), or one that pauses";
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

    /// Run, and see that patterns are shown: the board goes to video by itself when HDMI data appear.
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

    /// Load and start.
    pub fn play(&mut self, sequence: &Sequence) -> Result<Validation> {
        let verdict = self.load(sequence)?;
        self.begin()?;
        Ok(verdict)
    }

    /// Hold the current pattern.
    pub fn pause(&mut self) -> Result<()> {
        self.run(RunState::Pause)
    }

    /// Stop the patterns, and wait until nothing runs.
    pub fn stop(&mut self) -> Result<()> {
        self.run(RunState::Stop)?;
        if let Some(Sequence { source: Source::Video { frame_rate_hz }, .. }) = &self.loaded {
            // Two frames, as the input is buffered twice.
            sleep(Duration::from_secs_f64(2.0 / frame_rate_hz));
        }
        Ok(())
    }

    /// Change exposure and period of the loaded sequence; it is started again when it ran.
    pub fn set_timing(&mut self, timing: Timing) -> Result<Validation> {
        let Some(mut sequence) = self.loaded.clone() else {
            let name = format!("timing of {}", self.place());
            return Err(Error::value(name, "a sequence from load()", "none"));
        };
        let running = self.read::<RunState>()? == RunState::Start;
        sequence.exposures = Exposures::Fixed(timing);
        if running { self.play(&sequence) } else { self.load(&sequence) }
    }

    /// Ask for a run state until it is reached, and ask again every time.
    fn run(&mut self, state: RunState) -> Result<()> {
        let deadline = Instant::now() + self.waits.change;
        loop {
            self.write(&state)?;
            let actual = self.read::<RunState>()?;
            if actual == state {
                return Ok(());
            }
            if Instant::now() >= deadline {
                return Err(self.stuck(&state, &actual, self.waits.change));
            }
            sleep(self.waits.poll);
        }
    }
}
