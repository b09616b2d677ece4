//! An emulated projector with its driver, and the sequences that the tests load.
#![allow(dead_code, reason = "each test file uses a part of it")]

use lightcrafter::emulator::{Dlpc350, EmulatedTransport};
use lightcrafter::packet::{Access, Request};
use lightcrafter::sequence::{colour_channels, exposure_in_frame_us};
use lightcrafter::{LightCrafter, Profile, Sequence, Waits};
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::Duration;

pub type Projector = LightCrafter<EmulatedTransport>;

pub struct Bench {
    pub projector: Projector,
    pub device: Arc<Mutex<Dlpc350>>,
}

impl Bench {
    pub fn new() -> Self {
        Self::with(Profile::EVM)
    }

    pub fn with(profile: Profile) -> Self {
        // Limits that a loaded machine does not reach. In memory a missing reply is noticed at once.
        let ms = Duration::from_millis;
        let waits = Waits { poll: ms(1), validation: ms(0), wake: ms(0), lock: ms(20), ..Waits::default() };
        let transport = EmulatedTransport::new(Dlpc350::default());
        let device = transport.device();
        Self { projector: LightCrafter::new(transport).with_waits(waits).with_profile(profile), device }
    }

    /// With short limits, for states that are never reached.
    pub fn impatient() -> Self {
        let Self { projector, device } = Self::new();
        let short = Duration::from_millis(40);
        let poll = Duration::from_millis(1);
        let waits = Waits { poll, change: short, wake: poll, power: short, ..Waits::default() };
        Self { projector: projector.with_waits(waits), device }
    }

    pub fn device(&self) -> MutexGuard<'_, Dlpc350> {
        self.device.lock().unwrap()
    }

    /// Number of writes to a register.
    pub fn writes(&self, word: u16) -> usize {
        let written = |request: &&Request| request.word == word && request.access != Access::Read;
        self.device().log().filter(written).count()
    }
}

pub fn colour_video() -> Sequence {
    Sequence::from_video(colour_channels(7), 60.0, exposure_in_frame_us(3, 7, 60.0).unwrap())
}

pub fn colour_flash() -> Sequence {
    Sequence::from_flash(1, colour_channels(8), 8333)
}
