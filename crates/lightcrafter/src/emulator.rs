//! A DLPC350 in memory: registers, mailbox, validator, busy states, quirks of the real chip, and faults on demand.
//!
//! Its registers follow the programmer's guide byte by byte and share only the framing with
//! [`command`](crate::command), so a wrong encoding in the driver shows up as a difference. It receives and sends reports
//! of 64 bytes: in memory through [`EmulatedTransport`], behind the real libusb through the `testbed` feature.
//!
//! ```
//! use lightcrafter::emulator::{Dlpc350, EmulatedTransport, Fault};
//! use lightcrafter::{Error, LightCrafter};
//!
//! let transport = EmulatedTransport::new(Dlpc350::default());
//! let device = transport.device();
//! let mut projector = LightCrafter::new(transport);
//! assert_eq!(projector.versions()?.application.to_string(), "4.4.0");
//!
//! device.lock().unwrap().inject(Fault::Refuse, 1);
//! assert!(matches!(projector.versions(), Err(Error::Refused { .. })));
//! assert!(projector.versions().is_ok(), "the next command works");
//! # Ok::<(), Error>(())
//! ```

mod faults;
mod memory;
mod registers;
mod tables;

pub use faults::{Fault, Quirks};
pub use memory::EmulatedTransport;

use crate::packet::{Access, Assembler, REPORT_BYTES, Reply, Report, Request};
use registers::Registers;
use std::collections::VecDeque;
use tables::Tables;

/// Number of recent requests that are kept for tests.
const LOG: usize = 4096;

/// An emulated controller.
#[derive(Debug)]
pub struct Dlpc350 {
    pub(crate) registers: Registers,
    pub(crate) tables: Tables,
    /// Deviations of the real chip from its guide.
    pub quirks: Quirks,
    /// Whether a video signal of 912 x 1140 is connected.
    pub video: bool,
    plugged: bool,
    frozen: bool,
    redundant_modes: u32,
    start_pending: bool,
    silent_left: u32,
    assembler: Assembler,
    faults: VecDeque<Fault>,
    log: VecDeque<Request>,
    transactions: u64,
}

impl Default for Dlpc350 {
    /// Firmware 4.4.0 after power-on, with three images in flash and a signal at the video input.
    fn default() -> Self {
        Self::new("QF-EMULATOR", 3)
    }
}

impl Dlpc350 {
    /// Firmware with this tag, cut to 32 characters, and this many images in flash.
    pub fn new(tag: &str, images: u8) -> Self {
        Self {
            registers: Registers::new(tag, images),
            tables: Tables::default(),
            quirks: Quirks::default(),
            video: true,
            plugged: true,
            frozen: false,
            redundant_modes: 0,
            start_pending: false,
            silent_left: 0,
            assembler: Assembler::default(),
            faults: VecDeque::new(),
            log: VecDeque::new(),
            transactions: 0,
        }
    }

    /// Apply a fault to the next `times` replies; faults queue up.
    pub fn inject(&mut self, fault: Fault, times: usize) {
        self.faults.extend(std::iter::repeat_n(fault, times));
    }

    /// Whether the device is on the bus.
    pub fn plugged(&self) -> bool {
        self.plugged
    }

    /// Unplug the device.
    pub fn unplug(&mut self) {
        self.plugged = false;
    }

    /// Switch power off and on. The registers have their values after power-on, no fault is left, and the device is
    /// plugged in.
    pub fn power_cycle(&mut self) {
        let registers = Registers::new(&self.registers.tag(), self.registers.image_count());
        let (quirks, video, transactions) = (self.quirks, self.video, self.transactions);
        let fresh = Self { registers, quirks, video, transactions, ..Self::new("", 0) };
        *self = fresh;
    }

    /// Set the version of the firmware.
    pub fn set_version(&mut self, major: u8, minor: u8, patch: u16) {
        let [low, high] = patch.to_le_bytes();
        self.registers.force(0x0205, &[low, high, minor, major].repeat(4));
    }

    /// An HDMI signal appears: the board switches to video by itself.
    pub fn video_appears(&mut self) {
        self.video = true;
        self.registers.force(0x1A1B, &[0]);
        self.tables.lose();
    }

    /// The most recent requests, oldest first.
    pub fn log(&self) -> impl Iterator<Item = &Request> {
        self.log.iter()
    }

    /// Number of requests since the emulator was created.
    pub fn transactions(&self) -> u64 {
        self.transactions
    }

    /// Take one report. Returns the transfers that the device sends in reply.
    pub fn take(&mut self, report: &Report) -> Vec<Vec<u8>> {
        if !self.plugged || self.frozen {
            return Vec::new();
        }
        let Ok(Some(message)) = self.assembler.push(report) else { return Vec::new() };
        let Ok(request) = Request::from_message(&message) else { return Vec::new() };
        self.remember(&request);
        let fault =
            if request.access == Access::WriteUnacknowledged { None } else { self.faults.pop_front() };
        if fault == Some(Fault::Unplug) {
            self.plugged = false;
            return Vec::new();
        }
        let waking = self.quirks.silent_wake && self.asleep();
        let outcome = if fault == Some(Fault::Refuse) { None } else { self.execute(&request) };
        let unheard = waking && request.word == 0x0200 && !self.asleep();
        if self.frozen || self.silent(unheard) || request.access == Access::WriteUnacknowledged {
            return Vec::new();
        }
        answers(&request, outcome, fault)
    }

    /// Whether this request gets no reply. The device does not acknowledge waking, nor some commands after it.
    fn silent(&mut self, unheard: bool) -> bool {
        if unheard {
            self.silent_left = self.quirks.silent_reads_after_waking;
            return true;
        }
        let silent = self.silent_left > 0;
        self.silent_left -= u32::from(silent);
        silent
    }

    fn remember(&mut self, request: &Request) {
        self.transactions += 1;
        if self.log.len() == LOG {
            self.log.pop_front();
        }
        self.log.push_back(request.clone());
    }

    fn asleep(&self) -> bool {
        self.registers.byte(0x0200) & 3 != 0
    }

    /// Data of the reply; `None` if the device refuses.
    fn execute(&mut self, request: &Request) -> Option<Vec<u8>> {
        match request.access {
            Access::Read => self.read(request.word),
            _ => self.write(request.word, &request.data).map(|()| echo(request)),
        }
    }

    fn read(&mut self, word: u16) -> Option<Vec<u8>> {
        match word {
            0x1A0C => Some(vec![self.main_status()]),
            0x071C => Some(registers::video_signal(self.video, self.registers.byte(0x1A1B) == 0)),
            0x1A34 => self.tables.read(&self.registers),
            0x1A1A => Some(vec![self.tables.result()]),
            _ => self.registers.read(word),
        }
    }

    fn main_status(&self) -> u8 {
        let running = self.registers.byte(0x1A24) == 2;
        let gamma = self.registers.byte(0x1A0E) & 0x80 != 0;
        u8::from(self.asleep())
            | u8::from(running) << 1
            | (self.registers.byte(0x100A) & 1) << 2
            | u8::from(gamma) << 3
    }

    fn write(&mut self, word: u16, data: &[u8]) -> Option<()> {
        if registers::needs_stop(word) && self.registers.byte(0x1A24) == 2 {
            return None;
        }
        match word {
            0x0802 => {
                self.plugged = false;
                Some(())
            }
            0x1A1B => self.set_mode(data),
            0x1A24 => self.set_run_state(data),
            0x1A1A if data.len() == 1 => {
                self.tables.validate(&self.registers, &self.quirks);
                Some(())
            }
            0x1A34 => self.tables.write(&self.registers, data),
            0x1A3E => self.tables.write_variable(&self.registers, data),
            0x1A39 if self.registers.byte(0x1A1B) != 0 => None,
            0x1A39 if data.first().is_some_and(|image| *image >= self.registers.image_count()) => None,
            0x1A31 | 0x1A40 | 0x1A29 | 0x1A22 | 0x1A23 => {
                self.registers.write(word, data)?;
                self.tables.changed();
                Some(())
            }
            _ => self.registers.write(word, data),
        }
    }

    fn set_mode(&mut self, data: &[u8]) -> Option<()> {
        let before = self.registers.byte(0x1A1B);
        self.registers.write_late(0x1A1B, data, self.quirks.lag_polls)?;
        if data[0] == 0 {
            self.tables.lose();
            self.registers.force(0x1A24, &[0]);
        }
        if before == data[0] {
            let risky = before == 0 && self.video;
            self.redundant_modes += u32::from(risky);
            self.frozen |= risky && self.redundant_modes >= self.quirks.redundant_modes_to_freeze;
        } else {
            self.start_pending |= data[0] == 1;
            self.frozen |= self.registers.byte(0x1A00) & 7 == 1;
        }
        Some(())
    }

    fn set_run_state(&mut self, data: &[u8]) -> Option<()> {
        let present = self.registers.byte(0x1A24);
        match data {
            [0] => self.tables.lose_after_run(present != 0),
            [1] if present == 0 => return None,
            [1] => {}
            [2] if present != 0 => {}
            [2] if self.registers.byte(0x1A1B) != 1 || !self.tables.playable() => return None,
            [2] if self.quirks.ignores_first_start && self.start_pending => {
                self.start_pending = false;
                return Some(());
            }
            [2] => {}
            _ => return None,
        }
        self.registers.write_late(0x1A24, data, self.quirks.lag_polls)
    }
}

/// The transfers of a reply, with the fault applied.
fn answers(request: &Request, outcome: Option<Vec<u8>>, fault: Option<Fault>) -> Vec<Vec<u8>> {
    let wrong = fault == Some(Fault::WrongSequence);
    let sequence = if wrong { request.sequence.wrapping_add(17) } else { request.sequence };
    let reply = Reply {
        read: request.access == Access::Read,
        refused: outcome.is_none(),
        sequence,
        data: outcome.unwrap_or_else(|| if request.access == Access::Read { vec![] } else { echo(request) }),
    };
    let mut transfers: Vec<Vec<u8>> = reply.to_reports().iter().map(|report| report.to_vec()).collect();
    match fault {
        Some(Fault::Silence) => transfers.clear(),
        Some(Fault::Truncate) => transfers.last_mut().into_iter().for_each(|last| last.truncate(20)),
        Some(Fault::Stale) => {
            let old = Reply { sequence: request.sequence.wrapping_sub(1), ..reply };
            transfers.insert(0, old.to_reports()[0].to_vec());
        }
        _ => {}
    }
    debug_assert!(transfers.iter().all(|transfer| transfer.len() <= REPORT_BYTES));
    transfers
}

fn echo(request: &Request) -> Vec<u8> {
    request.word.to_le_bytes().to_vec()
}
