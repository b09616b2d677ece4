//! Framing: a message of up to 512 bytes as reports of 64 bytes, both ways.
//!
//! | byte | field |
//! |---|---|
//! | 0 | flags: bit 7 read, bit 6 reply wanted, bit 5 error |
//! | 1 | sequence number, echoed by the device |
//! | 2, 3 | payload length, little-endian, without these four bytes |
//! | 4, 5 | command word, little-endian; in a read reply the data start here |
//! | 6.. | data, padded with zeros |
//!
//! Only the first report has a header; the data continue in the following ones.

use crate::error::{Error, Result};

/// Bytes of a report.
pub const REPORT_BYTES: usize = 64;
/// Bytes of the longest message, header included.
pub const MESSAGE_BYTES: usize = 512;
/// One HID report, without a report number.
pub type Report = [u8; REPORT_BYTES];

const HEADER_BYTES: usize = 4;
const WORD_BYTES: usize = 2;
/// Bytes of data that a command can carry.
pub const DATA_BYTES: usize = MESSAGE_BYTES - HEADER_BYTES - WORD_BYTES;
const READ: u8 = 0x80;
const REPLY: u8 = 0x40;
const ERROR: u8 = 0x20;

/// Kind of a request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Access {
    /// Read: the device replies with data.
    Read,
    /// Write: the device acknowledges.
    Write,
    /// Write without acknowledgement, for commands after which the device disappears from the bus.
    WriteUnacknowledged,
}

/// A message from the host to the device.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Request {
    /// Read or write.
    pub access: Access,
    /// Number that the reply must carry.
    pub sequence: u8,
    /// Command word.
    pub word: u16,
    /// Parameters.
    pub data: Vec<u8>,
}

impl Request {
    /// Split into reports. Data longer than [`DATA_BYTES`] are an error.
    pub fn to_reports(&self) -> Result<Vec<Report>> {
        if self.data.len() > DATA_BYTES {
            let expected = format!("at most {DATA_BYTES} bytes of data");
            return Err(Error::malformed(format!("command {:#06x}", self.word), expected, self.data.len()));
        }
        let flags = match self.access {
            Access::Read => READ | REPLY,
            Access::Write => REPLY,
            Access::WriteUnacknowledged => 0,
        };
        let mut body = self.word.to_le_bytes().to_vec();
        body.extend_from_slice(&self.data);
        Ok(reports(flags, self.sequence, &body))
    }

    /// Read a request from the bytes of a message, as the device does.
    pub fn from_message(message: &[u8]) -> Result<Self> {
        let (flags, sequence, body) = parts(message, "request")?;
        let [low, high, data @ ..] = body else {
            return Err(Error::malformed("request", "a command word of two bytes", format!("{body:02x?}")));
        };
        let access = match (flags & READ != 0, flags & REPLY != 0) {
            (true, _) => Access::Read,
            (false, true) => Access::Write,
            (false, false) => Access::WriteUnacknowledged,
        };
        Ok(Self { access, sequence, word: u16::from_le_bytes([*low, *high]), data: data.to_vec() })
    }
}

/// A message from the device to the host.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Reply {
    /// Whether this is the reply to a read.
    pub read: bool,
    /// Whether the device refused the request.
    pub refused: bool,
    /// Number of the request.
    pub sequence: u8,
    /// Data of a read, or the command word that a write echoes.
    pub data: Vec<u8>,
}

impl Reply {
    /// Split into reports.
    pub fn to_reports(&self) -> Vec<Report> {
        let read = if self.read { READ } else { 0 };
        let error = if self.refused { ERROR } else { 0 };
        reports(REPLY | read | error, self.sequence, &self.data)
    }

    /// Read a reply from the bytes of a message.
    pub fn from_message(message: &[u8]) -> Result<Self> {
        let (flags, sequence, body) = parts(message, "reply")?;
        let read = flags & READ != 0;
        // The length field of an acknowledgement is not documented; the echo is always in bytes 4 and 5.
        let data = if read { body } else { &message[HEADER_BYTES..HEADER_BYTES + WORD_BYTES] };
        Ok(Self { read, refused: flags & ERROR != 0, sequence, data: data.to_vec() })
    }
}

fn reports(flags: u8, sequence: u8, body: &[u8]) -> Vec<Report> {
    let length = (body.len() as u16).to_le_bytes();
    let mut message = vec![flags, sequence, length[0], length[1]];
    message.extend_from_slice(body);
    let padded = |chunk: &[u8]| {
        let mut report = [0; REPORT_BYTES];
        report[..chunk.len()].copy_from_slice(chunk);
        report
    };
    message.chunks(REPORT_BYTES).map(padded).collect()
}

fn parts<'a>(message: &'a [u8], what: &str) -> Result<(u8, u8, &'a [u8])> {
    if message.len() < HEADER_BYTES + WORD_BYTES {
        let expected = format!("at least {} bytes", HEADER_BYTES + WORD_BYTES);
        return Err(Error::malformed(what, expected, message.len()));
    }
    let end = HEADER_BYTES + payload_length(message);
    let body = message.get(HEADER_BYTES..end);
    let body = body.ok_or_else(|| Error::malformed(what, format!("{end} bytes"), message.len()))?;
    Ok((message[0], message[1], body))
}

fn payload_length(header: &[u8]) -> usize {
    usize::from(u16::from_le_bytes([header[2], header[3]]))
}

/// Assembles a message from its reports.
#[derive(Debug, Clone, Default)]
pub struct Assembler {
    bytes: Vec<u8>,
}

impl Assembler {
    /// Add one report. Returns the message with its padding when it is complete. A header that announces more than
    /// [`MESSAGE_BYTES`] is an error; the next report then starts a new message.
    pub fn push(&mut self, report: &Report) -> Result<Option<Vec<u8>>> {
        self.bytes.extend_from_slice(report);
        let wanted = HEADER_BYTES + payload_length(&self.bytes);
        if wanted > MESSAGE_BYTES {
            self.bytes.clear();
            return Err(Error::malformed("message", format!("at most {MESSAGE_BYTES} bytes"), wanted));
        }
        Ok((self.bytes.len() >= wanted).then(|| std::mem::take(&mut self.bytes)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn assembled(reports: &[Report]) -> Vec<u8> {
        let mut assembler = Assembler::default();
        let (last, before) = reports.split_last().unwrap();
        for report in before {
            assert_eq!(assembler.push(report).unwrap(), None);
        }
        assembler.push(last).unwrap().expect("complete after the last report")
    }

    #[test]
    fn every_length_survives_both_ways() {
        for length in 0..=DATA_BYTES {
            let data: Vec<u8> = (0..length).map(|i| (i * 7 + 1) as u8).collect();
            let request = Request { access: Access::Write, sequence: 9, word: 0x1A34, data: data.clone() };
            let reports = request.to_reports().unwrap();
            assert_eq!(reports.len(), (length + 6).div_ceil(REPORT_BYTES));
            assert_eq!(Request::from_message(&assembled(&reports)).unwrap(), request);
            let reply = Reply { read: true, refused: false, sequence: 200, data };
            assert_eq!(Reply::from_message(&assembled(&reply.to_reports())).unwrap(), reply);
        }
    }

    #[test]
    fn too_long_is_refused_on_both_sides() {
        let request = Request { access: Access::Write, sequence: 0, word: 1, data: vec![0; DATA_BYTES + 1] };
        assert!(request.to_reports().unwrap_err().to_string().contains("at most 506 bytes"));
        let mut report = [0; REPORT_BYTES];
        report[2..4].copy_from_slice(&509_u16.to_le_bytes());
        let mut assembler = Assembler::default();
        assert!(assembler.push(&report).is_err());
        assert_eq!(assembler.push(&[0; REPORT_BYTES]).unwrap(), Some(vec![0; REPORT_BYTES]));
    }

    #[test]
    fn an_acknowledgement_of_any_stated_length_has_its_echo() {
        for length in 0..=2 {
            let mut message = vec![0x40, 3, length, 0, 0x1B, 0x1A];
            message.resize(REPORT_BYTES, 0);
            assert_eq!(Reply::from_message(&message).unwrap().data, [0x1B, 0x1A]);
        }
    }

    #[test]
    fn a_message_without_a_command_word_is_refused() {
        assert!(Request::from_message(&[0x40, 0, 1, 0, 5, 0]).is_err());
        assert!(Request::from_message(&[0x40, 0]).is_err());
        assert!(Reply::from_message(&[0xC0, 0, 9, 0, 5, 0]).is_err());
    }
}
