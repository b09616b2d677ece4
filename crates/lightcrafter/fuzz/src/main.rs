//! Random bytes as data of every message, as reports and commands to the emulator, and as replies to the driver.
#![no_main]

use libfuzzer_sys::fuzz_target;
use lightcrafter::command::*;
use lightcrafter::emulator::Dlpc350;
use lightcrafter::packet::{Access, Assembler, REPORT_BYTES, Reply, Report, Request};
use lightcrafter::{LightCrafter, Result, Transport, Waits, for_each_message};
use std::time::Duration;

/// A device that replies with the given bytes.
struct Babble<'a>(std::slice::Chunks<'a, u8>);

impl Transport for Babble<'_> {
    fn send(&mut self, _: &Report, _: Duration) -> Result<()> {
        Ok(())
    }

    fn receive(&mut self, report: &mut Report, _: Duration) -> Result<usize> {
        let chunk = self.0.next().unwrap_or_default();
        report[..chunk.len()].copy_from_slice(chunk);
        Ok(chunk.len())
    }

    fn place(&self) -> &str {
        "fuzz"
    }
}

fn reports(data: &[u8]) -> impl Iterator<Item = Report> + '_ {
    data.chunks(REPORT_BYTES).map(|chunk| std::array::from_fn(|i| chunk.get(i).copied().unwrap_or(0)))
}

/// Length, word, direction, data: commands that reach the registers more often than raw reports do.
fn commands(mut data: &[u8]) -> impl Iterator<Item = Request> + '_ {
    std::iter::from_fn(move || {
        let [length, low, high, flags, rest @ ..] = data else { return None };
        let (payload, rest) = rest.split_at(usize::from(*length).min(rest.len()));
        data = rest;
        let access = if flags & 1 == 0 { Access::Write } else { Access::Read };
        let word = u16::from_le_bytes([*low, *high]);
        Some(Request { access, sequence: *flags, word, data: payload.to_vec() })
    })
}

fn decode_all(data: &[u8]) {
    macro_rules! visit {
        ($name:ident, $direction:ident) => {
            if let Ok(message) = $name::decode(data) {
                let encoded = message.encode().expect("what was decoded can be encoded");
                assert_eq!($name::decode(&encoded).expect("and decoded again"), message);
            }
        };
    }
    for_each_message!(visit);
}

fn drive(data: &[u8]) {
    let ms = Duration::from_millis;
    let waits = Waits {
        reply: ms(1),
        poll: ms(0),
        change: ms(0),
        validation: ms(0),
        wake: ms(0),
        power: ms(0),
        lock: ms(0),
    };
    let mut projector = LightCrafter::new(Babble(data.chunks(REPORT_BYTES))).with_waits(waits);
    let _ = projector.status();
    let _ = projector.versions();
    let _ = projector.firmware_tag();
}

fuzz_target!(|data: &[u8]| {
    let Some((way, data)) = data.split_first() else { return };
    match way % 4 {
        0 => decode_all(data),
        1 => {
            let mut device = Dlpc350::default();
            for report in reports(data) {
                assert!(device.take(&report).iter().all(|transfer| transfer.len() <= REPORT_BYTES));
            }
        }
        2 => {
            let mut device = Dlpc350::default();
            for request in commands(data) {
                for report in request.to_reports().expect("at most 255 bytes of data") {
                    device.take(&report);
                }
            }
        }
        _ => {
            let mut assembler = Assembler::default();
            for report in reports(data) {
                if let Ok(Some(message)) = assembler.push(&report) {
                    let _ = Reply::from_message(&message);
                }
            }
            drive(data);
        }
    }
});
