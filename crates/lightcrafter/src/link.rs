//! Transactions, one at a time: send a numbered request and wait for the reply with the same number.

use crate::command::{Readable, Writable};
use crate::error::{Error, Result};
use crate::packet::{Access, Assembler, REPORT_BYTES, Reply, Request};
use crate::transport::Transport;
use std::time::{Duration, Instant};

/// Largest number of stale reports that are discarded before the command that follows an error.
const DRAIN_REPORTS: usize = 16;
const DRAIN_WAIT: Duration = Duration::from_millis(20);

/// A transport with the state that distinguishes a reply from a stale one.
#[derive(Debug)]
pub struct Link<T> {
    transport: T,
    reply_timeout: Duration,
    sequence: u8,
    /// Whether replies to earlier commands may still arrive.
    residue: bool,
}

impl<T: Transport> Link<T> {
    /// The first command discards replies that the previous program did not fetch.
    pub fn new(transport: T, reply_timeout: Duration) -> Self {
        Self { transport, reply_timeout, sequence: 0, residue: true }
    }

    pub fn place(&self) -> String {
        self.transport.place().to_owned()
    }

    pub fn set_reply_timeout(&mut self, timeout: Duration) {
        self.reply_timeout = timeout;
    }

    pub fn into_transport(self) -> T {
        self.transport
    }

    /// Read a register. A read without a valid reply is repeated once.
    pub fn read<M: Readable>(&mut self) -> Result<M> {
        let first = self.transact(Access::Read, M::WORD, M::NAME, Vec::new());
        let data = match first {
            Err(error) if error.leaves_residue() => self.transact(Access::Read, M::WORD, M::NAME, Vec::new()),
            other => other,
        }?;
        // The firmware also refuses with an empty reply.
        if data.is_empty() {
            return Err(self.refused(&doing(Access::Read, M::NAME)));
        }
        M::decode(&data).map_err(|error| at(self.transport.place(), error, &doing(Access::Read, M::NAME)))
    }

    /// Write a register. A write is never repeated, because the device may have executed the first one.
    pub fn write<M: Writable>(&mut self, message: &M) -> Result<()> {
        self.transact(M::ACCESS, M::WORD, M::NAME, message.encode()?).map(|_| ())
    }

    fn transact(&mut self, access: Access, word: u16, name: &str, data: Vec<u8>) -> Result<Vec<u8>> {
        self.drain()?;
        self.sequence = self.sequence.wrapping_add(1);
        let request = Request { access, sequence: self.sequence, word, data };
        let doing = doing(access, name);
        let reply =
            self.exchange(&request, &doing).map_err(|error| at(self.transport.place(), error, &doing));
        self.residue = reply.as_ref().is_err_and(Error::leaves_residue);
        reply
    }

    fn exchange(&mut self, request: &Request, doing: &str) -> Result<Vec<u8>> {
        for report in request.to_reports()? {
            self.transport.send(&report, self.reply_timeout)?;
        }
        if request.access == Access::WriteUnacknowledged {
            return Ok(Vec::new());
        }
        let reply = self.reply(request, doing)?;
        if reply.refused {
            return Err(self.refused(doing));
        }
        let echo = request.word.to_le_bytes();
        if reply.read != (request.access == Access::Read) || (!reply.read && reply.data != echo) {
            let expected = format!("one for {:#06x}", request.word);
            return Err(Error::malformed("reply", expected, format!("{reply:02x?}")));
        }
        Ok(reply.data)
    }

    /// Wait for the reply with the number of the request; discard stale replies.
    fn reply(&mut self, request: &Request, doing: &str) -> Result<Reply> {
        let deadline = Instant::now() + self.reply_timeout;
        let mut assembler = Assembler::default();
        let mut stale = None;
        loop {
            let remaining = deadline.saturating_duration_since(Instant::now());
            let mut report = [0; REPORT_BYTES];
            let count =
                if remaining.is_zero() { 0 } else { self.transport.receive(&mut report, remaining)? };
            if count == 0 {
                return Err(self.no_reply(request, doing, stale));
            }
            if count != REPORT_BYTES {
                return Err(Error::malformed("reply", format!("a report of {REPORT_BYTES} bytes"), count));
            }
            let Some(message) = assembler.push(&report)? else { continue };
            let reply = Reply::from_message(&message)?;
            if reply.sequence == request.sequence {
                return Ok(reply);
            }
            stale = Some(reply.sequence);
        }
    }

    fn no_reply(&self, request: &Request, doing: &str, stale: Option<u8>) -> Error {
        let (place, doing) = (self.place(), doing.to_owned());
        match stale {
            Some(actual) => Error::Sequence { place, doing, expected: request.sequence, actual },
            None => Error::Timeout { place, doing, waited_ms: self.reply_timeout.as_millis() as u64 },
        }
    }

    fn refused(&self, doing: &str) -> Error {
        Error::Refused { place: self.place(), doing: doing.to_owned() }
    }

    /// Discard replies to earlier commands.
    fn drain(&mut self) -> Result<()> {
        let mut report = [0; REPORT_BYTES];
        for _ in 0..DRAIN_REPORTS {
            if !self.residue {
                break;
            }
            self.residue = self.transport.receive(&mut report, DRAIN_WAIT)? > 0;
        }
        self.residue = false;
        Ok(())
    }
}

fn doing(access: Access, name: &str) -> String {
    let verb = if access == Access::Read { "reading" } else { "setting" };
    format!("{verb} the {name}")
}

/// Add the projector and the operation to an error. A value out of range in a reply is a malformed reply.
fn at(place: &str, error: Error, doing: &str) -> Error {
    let doing = doing.to_owned();
    match error {
        Error::Timeout { place, waited_ms, .. } => Error::Timeout { place, doing, waited_ms },
        Error::Usb { place, reason, .. } => Error::Usb { place, doing, reason },
        Error::Malformed { what: field, expected, actual }
        | Error::Value { name: field, expected, actual } => {
            Error::Malformed { what: format!("reply of {place} while {doing} ({field})"), expected, actual }
        }
        other => other,
    }
}
