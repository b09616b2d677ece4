//! Replacement for usbfs: answers to the ioctls on a device node, over the socket of umockdev.
//!
//! Messages are three words of 64 bits. The program sends {1, request, argument}. This side may reply
//! {5, address, length} to read its memory and {6, address, length} with bytes to write it. The last reply is
//! {3, result, errno}.

use super::descriptors::control_answer;
use super::ioctl::*;
use super::node::{Holder, Node};
use super::socket;
use crate::packet::REPORT_BYTES;
use std::collections::VecDeque;
use std::io::{self, Read, Write};
use std::os::unix::net::UnixStream;
use std::sync::Arc;
use std::thread::sleep;
use std::time::Duration;

const URB_BYTES: usize = 56;
const CONTROL_URB: u8 = 2;
const COMMAND_OUT: u8 = 0x01;
const COMMAND_IN: u8 = 0x81;
const EXCEPT_DRIVER: u32 = 2;
/// A fake node always polls as ready; this pause keeps a waiting program from spinning.
const REST: Duration = Duration::from_micros(200);

/// A transfer that waits for data.
struct Pending {
    urb: u64,
    buffer: u64,
    length: usize,
    endpoint: u8,
}

/// A finished transfer.
struct Finished {
    urb: u64,
    status: i32,
    actual: usize,
}

/// One open file.
struct Connection<'a> {
    node: &'a Node,
    number: u64,
    stream: UnixStream,
    pending: Vec<Pending>,
    finished: VecDeque<Finished>,
}

/// Result of an ioctl: its value, or an errno.
type Answer = Result<i64, i32>;

/// Answer the ioctls on a device node until the process ends.
pub fn listen(node: &Arc<Node>) -> io::Result<()> {
    let served = Arc::clone(node);
    socket::listen(&node.socket, move |number, stream| serve(&served, number, stream))
}

/// Serve until the program closes the file, then release its interfaces, as usbfs does.
fn serve(node: &Node, number: u64, stream: UnixStream) {
    let mut connection = Connection { node, number, stream, pending: Vec::new(), finished: VecDeque::new() };
    while connection.answer_one().is_ok() {}
    for holder in &mut node.shared().holders {
        if *holder == Holder::Program(number) {
            *holder = Holder::Free;
        }
    }
}

impl Connection<'_> {
    fn answer_one(&mut self) -> io::Result<()> {
        let mut words = [0; 24];
        self.stream.read_exact(&mut words)?;
        let word = |i: usize| u64::from_le_bytes(std::array::from_fn(|byte| words[8 * i + byte]));
        if word(0) != IOCTL {
            eprintln!("testbed: umockdev sent the unknown message {}: its protocol has changed", word(0));
            return Err(io::ErrorKind::Unsupported.into());
        }
        let answer = self.ioctl(word(1) as u32, word(2))?;
        let (result, errno) = match answer {
            Ok(result) => (result, 0),
            Err(errno) => (-1, errno),
        };
        self.send([DONE, result as u64, errno as u64])
    }

    fn send(&mut self, words: [u64; 3]) -> io::Result<()> {
        self.stream.write_all(&words.map(u64::to_le_bytes).concat())
    }

    fn peek<const N: usize>(&mut self, address: u64) -> io::Result<[u8; N]> {
        let mut bytes = [0; N];
        self.send([READ_MEMORY, address, N as u64])?;
        self.stream.read_exact(&mut bytes)?;
        Ok(bytes)
    }

    fn poke(&mut self, address: u64, bytes: &[u8]) -> io::Result<()> {
        self.send([WRITE_MEMORY, address, bytes.len() as u64])?;
        self.stream.write_all(bytes)
    }

    fn ioctl(&mut self, request: u32, argument: u64) -> io::Result<Answer> {
        Ok(match request {
            CAPABILITIES => {
                self.poke(argument, &0x17_u32.to_le_bytes())?;
                Ok(0)
            }
            GET_DRIVER => self.get_driver(argument)?,
            DRIVER => self.driver(argument)?,
            DISCONNECT_CLAIM | CLAIM => self.claim(request, argument)?,
            RELEASE => self.release(argument)?,
            SET_CONFIGURATION => self.set_configuration(),
            SET_INTERFACE | CLEAR_HALT | RESET => Ok(0),
            SUBMIT_URB => self.submit(argument)?,
            DISCARD_URB => self.discard(argument),
            REAP_URB | REAP_URB_NOW => self.reap(argument)?,
            _ => Err(ENOTTY),
        })
    }

    fn interface(&mut self, address: u64) -> io::Result<usize> {
        Ok(u32::from_le_bytes(self.peek(address)?) as usize)
    }

    fn get_driver(&mut self, argument: u64) -> io::Result<Answer> {
        let interface = self.interface(argument)?;
        let holder = self.node.shared().holders.get(interface).copied();
        let name: &[u8] = match holder {
            Some(Holder::Kernel) => b"usbhid\0",
            Some(Holder::Program(_)) => b"usbfs\0",
            _ => return Ok(Err(ENODATA)),
        };
        self.poke(argument + 4, name)?;
        Ok(Ok(0))
    }

    /// Detach or attach the driver of the kernel.
    fn driver(&mut self, argument: u64) -> io::Result<Answer> {
        let bytes: [u8; 8] = self.peek(argument)?;
        let code = u32::from_le_bytes([bytes[4], bytes[5], bytes[6], bytes[7]]);
        let mut shared = self.node.shared();
        let Some(holder) = shared.holders.get_mut(usize::from(bytes[0])) else { return Ok(Err(EINVAL)) };
        Ok(match (code, *holder) {
            (DISCONNECT, Holder::Kernel) => {
                *holder = Holder::Free;
                Ok(0)
            }
            (DISCONNECT, Holder::Free) => Err(ENODATA),
            (CONNECT, Holder::Free) => {
                *holder = Holder::Kernel;
                Ok(1)
            }
            (DISCONNECT | CONNECT, _) => Err(EBUSY),
            _ => Err(ENOTTY),
        })
    }

    fn claim(&mut self, request: u32, argument: u64) -> io::Result<Answer> {
        let interface = self.interface(argument)?;
        let takes_over = request == DISCONNECT_CLAIM && {
            let flags: [u8; 4] = self.peek(argument + 4)?;
            u32::from_le_bytes(flags) & EXCEPT_DRIVER != 0
        };
        let mine = Holder::Program(self.number);
        let mut shared = self.node.shared();
        let Some(holder) = shared.holders.get_mut(interface) else { return Ok(Err(ENOENT)) };
        let free = *holder == Holder::Free || *holder == mine || (takes_over && *holder == Holder::Kernel);
        if free {
            *holder = mine;
        }
        Ok(if free { Ok(0) } else { Err(EBUSY) })
    }

    fn release(&mut self, argument: u64) -> io::Result<Answer> {
        let interface = self.interface(argument)?;
        let mine = Holder::Program(self.number);
        let mut shared = self.node.shared();
        let held = shared.holders.get_mut(interface).filter(|holder| **holder == mine);
        Ok(match held {
            Some(holder) => {
                *holder = Holder::Free;
                Ok(0)
            }
            None => Err(EINVAL),
        })
    }

    fn set_configuration(&self) -> Answer {
        let free = self.node.shared().holders.iter().all(|holder| *holder == Holder::Free);
        if free { Ok(0) } else { Err(EBUSY) }
    }

    fn submit(&mut self, urb: u64) -> io::Result<Answer> {
        if !self.node.model().plugged() {
            return Ok(Err(ENODEV));
        }
        let raw: [u8; URB_BYTES] = self.peek(urb)?;
        let (kind, endpoint) = (raw[0], raw[1]);
        let buffer = u64::from_le_bytes(std::array::from_fn(|i| raw[16 + i]));
        let length = u32::from_le_bytes(std::array::from_fn(|i| raw[24 + i])) as usize;
        let holds = self.node.shared().holders[0] == Holder::Program(self.number);
        match (kind, endpoint) {
            (CONTROL_URB, _) => self.control(urb, buffer)?,
            (_, COMMAND_OUT) if holds => self.command(urb, buffer, length)?,
            (_, COMMAND_IN) if holds => self.pending.push(Pending { urb, buffer, length, endpoint }),
            _ => return Ok(Err(EINVAL)),
        }
        Ok(Ok(0))
    }

    fn control(&mut self, urb: u64, buffer: u64) -> io::Result<()> {
        let setup: [u8; 8] = self.peek(buffer)?;
        let (status, actual) = match control_answer(&setup) {
            Some(answer) => {
                self.poke(buffer + 8, &answer)?;
                (0, answer.len())
            }
            None => (-EPIPE, 0),
        };
        self.finished.push_back(Finished { urb, status, actual });
        Ok(())
    }

    fn command(&mut self, urb: u64, buffer: u64, length: usize) -> io::Result<()> {
        if length != REPORT_BYTES {
            self.finished.push_back(Finished { urb, status: -EPIPE, actual: 0 });
            return Ok(());
        }
        let report = self.peek(buffer)?;
        let answers = self.node.model().take(&report);
        self.node.shared().incoming.extend(answers);
        self.node.reflect()?;
        self.finished.push_back(Finished { urb, status: 0, actual: length });
        Ok(())
    }

    fn discard(&mut self, urb: u64) -> Answer {
        let Some(at) = self.pending.iter().position(|pending| pending.urb == urb) else { return Err(EINVAL) };
        self.pending.remove(at);
        self.finished.push_back(Finished { urb, status: -ENOENT, actual: 0 });
        Ok(0)
    }

    fn reap(&mut self, argument: u64) -> io::Result<Answer> {
        self.deliver()?;
        let Some(Finished { urb, status, actual }) = self.finished.pop_front() else {
            if !self.node.model().plugged() {
                return Ok(Err(ENODEV));
            }
            sleep(REST);
            return Ok(Err(EAGAIN));
        };
        self.poke(urb + 4, &status.to_le_bytes())?;
        self.poke(urb + 28, &(actual as i32).to_le_bytes())?;
        self.poke(argument, &urb.to_le_bytes())?;
        Ok(Ok(0))
    }

    /// Give the incoming reports to waiting transfers. If the device is unplugged, all transfers end.
    fn deliver(&mut self) -> io::Result<()> {
        if !self.node.model().plugged() {
            let ended =
                self.pending.drain(..).map(|p| Finished { urb: p.urb, status: -ESHUTDOWN, actual: 0 });
            self.finished.extend(ended);
            return Ok(());
        }
        while let Some(at) = self.pending.iter().position(|pending| pending.endpoint == COMMAND_IN) {
            let Some(mut report) = self.node.shared().incoming.pop_front() else { break };
            let Pending { urb, buffer, length, .. } = self.pending.remove(at);
            report.truncate(length);
            self.poke(buffer, &report)?;
            self.finished.push_back(Finished { urb, status: 0, actual: report.len() });
        }
        Ok(())
    }
}
