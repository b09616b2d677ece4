//! Mailbox, pattern tables and the validator.

use super::Quirks;
use super::registers::Registers;
use crate::sequence::{MIN_GAP_US, depth_limits};

const PATTERNS: usize = 128;
const VARIABLE: usize = 1824;
const IMAGES: usize = 256;
const CLOSED: u8 = 0;
const IMAGE_BOX: u8 = 1;
const PATTERN_BOX: u8 = 2;
const VARIABLE_BOX: u8 = 3;

/// One entry of either table, with its exposure and period.
struct Line {
    word: u32,
    exposure_us: u32,
    period_us: u32,
}

#[derive(Debug, Clone)]
pub struct Tables {
    patterns: Vec<u8>,
    variable: Vec<[u8; 12]>,
    images: Vec<u8>,
    result: u8,
    busy: u32,
    validated: bool,
    written: bool,
}

impl Default for Tables {
    fn default() -> Self {
        Self {
            patterns: vec![0; 3 * PATTERNS],
            variable: vec![[0; 12]; VARIABLE],
            images: vec![0; IMAGES],
            result: 0,
            busy: 0,
            validated: false,
            written: false,
        }
    }
}

impl Tables {
    /// Video mode clears the tables.
    pub fn lose(&mut self) {
        *self = Self::default();
    }

    /// After a run the tables must be sent again.
    pub fn lose_after_run(&mut self, ran: bool) {
        if ran {
            self.lose();
        }
    }

    /// A change of the tables invalidates the last validation.
    pub fn changed(&mut self) {
        self.validated = false;
    }

    pub fn playable(&self) -> bool {
        self.validated && self.written && self.result & 3 == 0
    }

    /// Result of the last validation; the first reads report that it is still running.
    pub fn result(&mut self) -> u8 {
        if self.busy > 0 {
            self.busy -= 1;
            return 0x80;
        }
        self.result
    }

    pub fn read(&self, registers: &Registers) -> Option<Vec<u8>> {
        let control = registers.bytes(0x1A31);
        match registers.byte(0x1A33) {
            PATTERN_BOX => Some(self.patterns[..3 * (usize::from(control[0]) + 1)].to_vec()),
            IMAGE_BOX => Some(in_wire_order(&self.images[..usize::from(control[3]) + 1])),
            _ => None,
        }
    }

    pub fn write(&mut self, registers: &Registers, data: &[u8]) -> Option<()> {
        let offset = usize::from(registers.byte(0x1A32));
        match registers.byte(0x1A33) {
            PATTERN_BOX if data.len().is_multiple_of(3) => {
                self.patterns.get_mut(3 * offset..3 * offset + data.len())?.copy_from_slice(data);
                self.written = true;
            }
            IMAGE_BOX => {
                let at = if registers.byte(0x1A23) >= 3 { variable_offset(registers) } else { offset };
                self.images.get_mut(at..at + data.len())?.copy_from_slice(&in_wire_order(data));
            }
            _ => return None,
        }
        self.validated = false;
        Some(())
    }

    pub fn write_variable(&mut self, registers: &Registers, data: &[u8]) -> Option<()> {
        if registers.byte(0x1A33) != VARIABLE_BOX {
            return None;
        }
        *self.variable.get_mut(variable_offset(registers))? = data.try_into().ok()?;
        self.validated = false;
        self.written = true;
        Some(())
    }

    /// Validate the tables. An open mailbox counts as a wrong pattern number.
    pub fn validate(&mut self, registers: &Registers, quirks: &Quirks) {
        let lines = self.lines(registers);
        let flash = registers.byte(0x1A22) == 3;
        let unfit = registers.byte(0x1A33) != CLOSED || quirks.rejects;
        let faults = lines.iter().enumerate().map(|(i, line)| {
            let before = i.checked_sub(1).map(|i| lines[i].word);
            faults_of(line) | if flash { darkness(line.word, before) } else { 0 }
        });
        self.result = faults.fold(u8::from(unfit) << 1, |all, faults| all | faults);
        self.busy = quirks.busy_polls;
        self.validated = true;
    }

    fn lines(&self, registers: &Registers) -> Vec<Line> {
        let number = |bytes: &[u8]| bytes.iter().rev().fold(0, |word, byte| word << 8 | u32::from(*byte));
        if registers.byte(0x1A23) < 3 {
            let count = usize::from(registers.byte(0x1A31)) + 1;
            let timing = registers.bytes(0x1A29);
            let (exposure_us, period_us) = (number(&timing[..4]), number(&timing[4..]));
            let words = self.patterns.chunks(3).take(count).map(number);
            return words.map(|word| Line { word, exposure_us, period_us }).collect();
        }
        let count = number(&registers.bytes(0x1A40)[..2]) as usize + 1;
        let line = |entry: &[u8; 12]| Line {
            word: number(&entry[..4]),
            exposure_us: number(&entry[4..8]),
            period_us: number(&entry[8..]),
        };
        self.variable.iter().take(count).map(line).collect()
    }
}

/// The firmware swaps the two entries of a table of two images.
fn in_wire_order(images: &[u8]) -> Vec<u8> {
    match images {
        [first, second] => vec![*second, *first],
        other => other.to_vec(),
    }
}

fn variable_offset(registers: &Registers) -> usize {
    let bytes = registers.bytes(0x1A3F);
    usize::from(bytes[0]) | usize::from(bytes[1]) << 8
}

/// Faults of one entry: bits 0, 1 and 4 of the result, and bit 2 if inserted black has no time.
fn faults_of(line: &Line) -> u8 {
    let (depth, number) = ((line.word >> 8 & 15) as u8, (line.word >> 2 & 63) as u8);
    let Ok(limits) = depth_limits(depth) else { return 3 };
    let shared = line.word & 1 << 19 != 0;
    let too_short = !shared && line.exposure_us < limits.min_exposure_us;
    let no_such_number = number > limits.last_number && number != 63;
    let gap = line.period_us.checked_sub(line.exposure_us);
    let short_gap = gap.is_some_and(|gap| gap != 0 && gap < MIN_GAP_US);
    let black = line.word & 1 << 17 != 0;
    let no_time_for_black = black && gap.is_none_or(|gap| gap < MIN_GAP_US);
    u8::from(too_short || gap.is_none())
        | u8::from(no_such_number) << 1
        | u8::from(no_time_for_black) << 2
        | u8::from(short_gap) << 4
}

/// Bit 3 of the result: a pattern with an external trigger has no black before it.
fn darkness(word: u32, before: Option<u32>) -> u8 {
    let external = matches!(word & 3, 1 | 2);
    let black_before = before.is_none_or(|before| before & 1 << 17 != 0);
    u8::from(external && !black_before) << 3
}
