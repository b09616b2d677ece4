//! usbfs as a process sees it: ioctls on a device node, answered over umockdev's socket.
//!
//! Messages are three words of 64 bits. The program asks {1, request, argument}; we may answer {5, address, length} to
//! read its memory and {6, address, length} with bytes to write it, and end with {3, result, errno}.

use super::descriptors::control_answer;
use super::node::{Holder, Node};
use crate::packet::REPORT_BYTES;
use std::collections::VecDeque;
use std::io::{self, Read, Write};
use std::os::unix::net::UnixStream;
use std::thread::sleep;
use std::time::Duration;

const IOCTL: u64 = 1;
const DONE: u64 = 3;
const READ_MEMORY: u64 = 5;
const WRITE_MEMORY: u64 = 6;

// Directions as Linux numbers them in ioctls.
const NONE: u32 = 0;
const WRITE: u32 = 1;
const READ: u32 = 2;

/// The number of a usbfs ioctl, as Linux composes it.
const fn ioctl(direction: u32, number: u32, size: u32) -> u32 {
    direction << 30 | size << 16 | 0x55 << 8 | number
}

const SET_INTERFACE: u32 = ioctl(READ, 4, 8);
const SET_CONFIGURATION: u32 = ioctl(READ, 5, 4);
const GET_DRIVER: u32 = ioctl(WRITE, 8, 260);
const SUBMIT_URB: u32 = ioctl(READ, 10, 56);
const DISCARD_URB: u32 = ioctl(NONE, 11, 0);
const REAP_URB: u32 = ioctl(WRITE, 12, 8);
const REAP_URB_NOW: u32 = ioctl(WRITE, 13, 8);
const CLAIM: u32 = ioctl(READ, 15, 4);
const RELEASE: u32 = ioctl(READ, 16, 4);
const DRIVER: u32 = ioctl(WRITE | READ, 18, 16);
const RESET: u32 = ioctl(NONE, 20, 0);
const CLEAR_HALT: u32 = ioctl(READ, 21, 4);
const DISCONNECT: u32 = ioctl(NONE, 22, 0);
const CONNECT: u32 = ioctl(NONE, 23, 0);
const CAPABILITIES: u32 = ioctl(READ, 26, 4);
const DISCONNECT_CLAIM: u32 = ioctl(READ, 27, 264);

const ENOENT: i32 = 2;
const EAGAIN: i32 = 11;
const EBUSY: i32 = 16;
const ENODEV: i32 = 19;
const EINVAL: i32 = 22;
const ENOTTY: i32 = 25;
const EPIPE: i32 = 32;
const ENODATA: i32 = 61;
const ESHUTDOWN: i32 = 108;

const URB_BYTES: usize = 56;
const CONTROL_URB: u8 = 2;
const COMMAND_OUT: u8 = 0x01;
const COMMAND_IN: u8 = 0x81;
const EXCEPT_DRIVER: u32 = 2;
/// A fake node always polls as ready: a short rest keeps a waiting program from spinning.
const REST: Duration = Duration::from_micros(200);

/// A transfer that waits for data.
struct Pending {
    urb: u64,
    buffer: u64,
    length: usize,
    endpoint: u8,
}

/// A transfer that is over.
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

/// Answer until the program closes the file; then its claims are dropped, as usbfs does.
pub fn serve(node: &Node, number: u64, stream: UnixStream) {
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
            eprintln!("testbed: message {} of umockdev is not known; its protocol has changed", word(0));
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

    /// Give reports to the transfers that wait for them; after an unplug all of them end.
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
