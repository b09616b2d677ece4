//! Every message keeps its meaning when it is decoded and encoded again, and no bytes make driver or emulator panic.
#![cfg(feature = "emulator")]

use lightcrafter::command::*;
use lightcrafter::emulator::{Dlpc350, EmulatedTransport, Fault};
use lightcrafter::packet::{Access, DATA_BYTES, REPORT_BYTES, Request};
use lightcrafter::{LightCrafter, for_each_message};
use proptest::prelude::*;
use std::collections::BTreeSet;
use std::fmt::Debug;

/// Decode; when that succeeds, encode and decode again. Returns whether it succeeded.
fn survives<M: Message + PartialEq + Debug>(data: &[u8]) -> bool {
    let Ok(message) = M::decode(data) else { return false };
    let encoded = message.encode().unwrap_or_else(|error| panic!("{message:?}: {error}"));
    assert!(encoded.len() <= DATA_BYTES);
    assert_eq!(M::decode(&encoded).unwrap(), message);
    true
}

/// Mostly small values, because fields of 16 bit have narrow ranges.
fn byte() -> impl Strategy<Value = u8> {
    prop_oneof![3 => 0_u8..4, 1 => any::<u8>()]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn every_message_survives_encoding(data in prop::collection::vec(byte(), 0..=DATA_BYTES)) {
        macro_rules! visit { ($name:ident, $direction:ident) => { survives::<$name>(&data); }; }
        for_each_message!(visit);
    }

    #[test]
    fn the_emulator_survives_any_reports(reports in prop::collection::vec(any::<[u8; 64]>(), 1..40)) {
        let mut device = Dlpc350::default();
        for report in &reports {
            for transfer in device.take(report) {
                prop_assert!(transfer.len() <= REPORT_BYTES);
            }
        }
    }

    #[test]
    fn the_emulator_survives_any_commands(
        commands in prop::collection::vec((0_usize..60, prop::collection::vec(any::<u8>(), 0..200), any::<bool>()), 1..60),
    ) {
        let words: Vec<u16> = words().into_iter().collect();
        let mut device = Dlpc350::default();
        for (i, data, read) in commands {
            let access = if read { Access::Read } else { Access::Write };
            let word = words.get(i).copied().unwrap_or(0x7777);
            let request = Request { access, sequence: 1, word, data };
            for report in request.to_reports().unwrap() {
                device.take(&report);
            }
        }
    }
}

/// Random bytes rarely form the small values of some messages. Here every message is decoded at least once.
#[test]
fn every_message_is_decoded_from_some_bytes() {
    macro_rules! visit {
        ($name:ident, $direction:ident) => {
            let reached = (0..=255_u8).filter(|byte| {
                let mut data = vec![0; 64];
                data[0] = *byte;
                let whole = survives::<$name>(&data) | survives::<$name>(&data[..1]);
                data[1] = 1;
                whole | survives::<$name>(&data) | survives::<$name>(&[0, 1, *byte])
            });
            assert!(reached.count() > 0, "{}", $name::NAME);
        };
    }
    for_each_message!(visit);
    assert!(survives::<PatternTable>(&[0x01, 0x27, 0x04, 0x07, 0x17, 0x00]));
    assert!(survives::<VariableEntry>(&[0x60, 0x11, 0x03, 0, 0xEB, 0, 0, 0, 0xD1, 1, 0, 0]));
}

#[test]
fn too_few_bytes_are_named() {
    macro_rules! visit {
        ($name:ident, read) => {
            let error = $name::decode(&[]).unwrap_err().to_string();
            assert!(error.contains($name::NAME), "{error}");
        };
        ($name:ident, $direction:ident) => {};
    }
    for_each_message!(visit);
}

fn words() -> BTreeSet<u16> {
    let mut words = BTreeSet::new();
    macro_rules! visit {
        ($name:ident, $direction:ident) => {
            words.insert($name::WORD);
        };
    }
    for_each_message!(visit);
    words
}

#[test]
fn every_command_of_the_guide_has_a_message() {
    // The commands of tables A3 to A6.
    let guide: BTreeSet<u16> = [
        0x1A0A, 0x1A0B, 0x1A0C, 0x0205, 0x1AFF, 0x1A42, 0x0200, 0x0802, 0x0609, 0x100A, 0x071C, 0x1A1B,
        0x1A00, 0x1A02, 0x1A03, 0x1A37, 0x1A04, 0x1000, 0x1203, 0x1204, 0x1A39, 0x1A3A, 0x1008, 0x1009,
        0x1A0E, 0x1100, 0x1A07, 0x0B01, 0x1A05, 0x1A1F, 0x1A20, 0x1A21, 0x1A22, 0x1A23, 0x1A29, 0x1A31,
        0x1A33, 0x1A32, 0x1A34, 0x1A3F, 0x1A3E, 0x1A40, 0x1A30, 0x1A1A, 0x1A24, 0x1A1D, 0x1A1E, 0x1A35,
        0x1A36,
    ]
    .into();
    assert_eq!(words(), guide);
}

#[test]
fn faults_are_named() {
    for name in ["refuse", "silence", "truncate", "wrong-sequence", "stale", "unplug"] {
        assert!(name.parse::<Fault>().is_ok(), "{name}");
    }
    assert!("fire".parse::<Fault>().unwrap_err().to_string().contains("wrong-sequence"));
}

#[test]
fn the_driver_can_read_every_reply_of_the_emulator() {
    let mut projector = LightCrafter::new(EmulatedTransport::new(Dlpc350::default()));
    projector.write(&Mailbox::Patterns).unwrap();
    macro_rules! visit {
        ($name:ident, write) => {};
        (PatternTable, both) => {};
        (ImageTable, both) => {};
        ($name:ident, $direction:ident) => {
            if let Err(error) = projector.read::<$name>() {
                panic!("{}: {error}", $name::NAME);
            }
        };
    }
    for_each_message!(visit);
}
