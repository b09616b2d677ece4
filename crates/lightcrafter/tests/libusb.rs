//! The driver over the real libusb: two projectors with equal vendor, product and serial number in a umockdev testbed.
//!
//! `under_umockdev` builds the testbed and runs the other tests, which are ignored outside of it, in a separate process,
//! because the testbed replaces all of `/sys`.
#![cfg(all(feature = "usb", feature = "testbed", target_os = "linux"))]

use lightcrafter::command::*;
use lightcrafter::sequence::{Colour, Exposures, RED, Source, WORST_LOAD_US, channel, colour_channels};
use lightcrafter::testbed::{Control, Testbed};
use lightcrafter::usb::{PortPath, Selector, UsbTransport, list};
use lightcrafter::{Error, LightCrafter, Sequence, Waits, for_each_message};
use std::thread;
use std::time::{Duration, Instant};

mod registers;

type Projector = LightCrafter<UsbTransport>;

/// Time that a loaded machine may need in addition to the waits of the driver.
const SLACK: Duration = Duration::from_secs(3);

fn at(port: &str) -> Selector {
    Selector::Port(port.parse::<PortPath>().unwrap())
}

fn open(port: &str) -> Projector {
    LightCrafter::open(&at(port)).unwrap()
}

/// With a short limit for replies, for faults that end in a timeout.
fn impatient(port: &str) -> (Projector, Duration) {
    let reply = Duration::from_millis(300);
    (open(port).with_waits(Waits { reply, ..Waits::default() }), reply)
}

fn order(port: &str, order: &str) -> String {
    Control::connect().unwrap().order(port, order).unwrap()
}

#[test]
fn under_umockdev() {
    let testbed = Testbed::new(&[1, 2]).unwrap();
    let this = std::env::current_exe().unwrap();
    let mut command = testbed.command(this.to_str().unwrap()).unwrap();
    let status = command.args(["--ignored", "--test-threads=1", "--nocapture"]).status().unwrap();
    assert!(status.success(), "{status}");
    for (place, count) in testbed.transactions() {
        assert!(count >= 5000, "{count} commands at {place}");
    }
}

#[test]
#[ignore = "run by under_umockdev"]
fn equal_serial_numbers_are_distinguished_by_port() {
    let found = list().unwrap();
    let ports: Vec<String> = found.iter().map(|device| device.port.to_string()).collect();
    assert_eq!(ports, ["1-1", "1-2"]);
    assert!(found.iter().all(|device| device.serial.as_deref() == Some("LCR2")), "{found:?}");
    for (port, tag) in [("1-1", "QF-EMULATOR-1-1"), ("1-2", "QF-EMULATOR-1-2")] {
        let mut projector = open(port);
        assert_eq!(projector.firmware_tag().unwrap(), tag);
        assert_eq!(projector.place(), port);
    }
    for ambiguous in [Selector::Only, Selector::Serial("LCR2".into())] {
        let error = LightCrafter::open(&ambiguous).unwrap_err();
        assert!(matches!(error, Error::Ambiguous { .. }), "{error}");
        assert!(error.to_string().contains("1-1") && error.to_string().contains("1-2"), "{error}");
    }
    for absent in [at("1-9"), Selector::Serial("LCR3".into())] {
        let error = LightCrafter::open(&absent).unwrap_err();
        assert!(matches!(error, Error::NotFound { .. }), "{error}");
        assert!(error.to_string().contains("port 1-1"), "{error}");
    }
    order("1-2", "unplug");
    assert_eq!(list().unwrap().len(), 1);
    assert_eq!(LightCrafter::open(&Selector::Only).unwrap().place(), "1-1");
    order("1-2", "plug");
}

#[test]
#[ignore = "run by under_umockdev"]
fn a_projector_has_one_owner() {
    let mut owner = open("1-1");
    let error = LightCrafter::open(&at("1-1")).unwrap_err();
    assert!(matches!(error, Error::Busy { .. }), "{error}");
    assert_eq!(list().unwrap().len(), 2, "listing needs no claim");
    owner.versions().unwrap();
    drop(owner);
    open("1-1").versions().unwrap();
}

#[test]
#[ignore = "run by under_umockdev"]
fn without_permission_the_rule_is_named() {
    order("1-2", "deny");
    let found = list().unwrap();
    assert_eq!(found[1].serial, None);
    let error = LightCrafter::open(&at("1-2")).unwrap_err();
    assert!(matches!(error, Error::AccessDenied { .. }), "{error}");
    assert!(error.to_string().contains("ATTR{idProduct}==\"6401\""), "{error}");
    open("1-1").versions().unwrap();
    order("1-2", "allow");
    open("1-2").versions().unwrap();
}

#[test]
#[ignore = "run by under_umockdev"]
fn an_unplug_in_the_middle_is_an_error_at_once() {
    let mut projector = open("1-2");
    projector.versions().unwrap();
    order("1-2", "fault unplug 1");
    let start = Instant::now();
    let error = projector.load(&Sequence::from_flash(0, colour_channels(8), 8333)).unwrap_err();
    assert!(matches!(error, Error::Disconnected { .. }), "{error}");
    assert!(start.elapsed() < Waits::default().reply, "no wait reached its limit");
    assert!(matches!(projector.versions(), Err(Error::Disconnected { .. })));
    assert!(matches!(LightCrafter::open(&at("1-2")), Err(Error::NotFound { .. })));
    drop(projector);
    order("1-2", "plug");
    open("1-2").versions().unwrap();
}

#[test]
#[ignore = "run by under_umockdev"]
fn each_fault_gives_its_error_within_its_time_limit() {
    type Check = fn(&Error) -> bool;
    let cases: [(&str, u32, Check); 4] = [
        ("refuse", 0, |error| matches!(error, Error::Refused { .. })),
        ("silence", 2, |error| matches!(error, Error::Timeout { .. })),
        ("truncate", 0, |error| matches!(error, Error::Malformed { .. })),
        ("wrong-sequence", 2, |error| matches!(error, Error::Sequence { .. })),
    ];
    let (mut projector, reply) = impatient("1-1");
    for (fault, waits, expected) in cases {
        // The driver repeats a read once, so a read fails only with two faults.
        let times = if fault == "refuse" { 1 } else { 2 };
        order("1-1", &format!("fault {fault} {times}"));
        let start = Instant::now();
        let error = projector.versions().unwrap_err();
        let took = start.elapsed();
        assert!(expected(&error), "{fault}: {error}");
        assert!(took >= reply * waits && took < reply * waits + SLACK, "{fault}: {took:?}");
        assert_eq!(projector.firmware_tag().unwrap(), "QF-EMULATOR-1-1", "after {fault}");
    }
    order("1-1", "fault stale 5");
    for _ in 0..5 {
        assert_eq!(projector.versions().unwrap().application.major, 4);
    }
}

#[test]
#[ignore = "run by under_umockdev"]
fn replies_left_by_one_owner_are_discarded_by_the_next() {
    let (mut projector, _) = impatient("1-1");
    order("1-1", "fault stale 1");
    projector.write(&DisplayFreeze(false)).unwrap();
    order("1-1", "fault wrong-sequence 1");
    assert!(projector.write(&DisplayFreeze(false)).is_err());
    drop(projector);
    assert_eq!(open("1-1").firmware_tag().unwrap(), "QF-EMULATOR-1-1");
}

/// Every command of the guide once. A register that can be read and written must return the value written.
#[test]
#[ignore = "run by under_umockdev"]
fn every_command_crosses_libusb() {
    let mut projector = open("1-1");
    macro_rules! visit {
        ($name:ident, read) => {
            projector.read::<$name>().unwrap();
        };
        (ImageTable, both) => {};
        (PatternTable, both) => {};
        ($name:ident, both) => {
            let value = projector.read::<$name>().unwrap();
            if $name::WORD != FlashImage::WORD {
                projector.write(&value).unwrap_or_else(|error| panic!("{value:?}: {error}"));
                assert_eq!(projector.read::<$name>().unwrap(), value);
            }
        };
        (SoftwareReset, write) => {};
        ($name:ident, write) => {};
    }
    registers::every_register_returns(&mut projector);
    order("1-1", "plug");
    // Writing video mode again can freeze the chip, so this test runs in pattern mode.
    projector.write(&DisplayMode::PatternSequence).unwrap();
    let arrived = |_| projector.read::<DisplayMode>().unwrap() == DisplayMode::PatternSequence;
    assert!((0..100).any(arrived), "pattern mode");
    for_each_message!(visit);
    projector.write(&Mailbox::Patterns).unwrap();
    projector.write(&MailboxOffset(0)).unwrap();
    let patterns = PatternTable(vec![channel(Colour::Blue, 8, RED)]);
    projector.write(&patterns).unwrap();
    assert_eq!(projector.read::<PatternTable>().unwrap(), patterns);
    projector.write(&Mailbox::Images).unwrap();
    projector.write(&ImageTable(vec![2])).unwrap();
    assert_eq!(projector.read::<ImageTable>().unwrap(), ImageTable(vec![2]));
    projector.write(&DmdPark(false)).unwrap();
    projector.write(&MeasureImageLoad { first: 0, count: 1 }).unwrap();
    projector.write(&Validate).unwrap();
    projector.write(&Mailbox::Variable).unwrap();
    projector.write(&VariableOffset(1823)).unwrap();
    let timing = Timing { exposure_us: 10_000, period_us: 10_000 };
    projector.write(&VariableEntry { entry: channel(Colour::Red, 8, RED), timing }).unwrap();
    projector.write(&MailboxOffset(127)).unwrap();
    projector.write(&Mailbox::Close).unwrap();
    projector.write(&DisplayMode::Video).unwrap();
    projector.write(&FlashImage(1)).unwrap();
    assert_eq!(projector.read::<FlashImage>().unwrap(), FlashImage(1));
    projector.reset().unwrap();
    assert_eq!(list().unwrap().len(), 1, "a reset takes the device off the bus");
    order("1-1", "plug");
}

#[test]
#[ignore = "run by under_umockdev"]
fn sequences_from_video_and_flash_run_on_both() {
    let mut visible = open("1-1");
    let mut infrared = open("1-2");
    visible.play(&Sequence::from_video(colour_channels(7), 60.0, 5555)).unwrap();
    infrared.play(&Sequence::from_flash(2, vec![channel(Colour::Green, 8, RED)], 16_667)).unwrap();
    for projector in [&mut visible, &mut infrared] {
        assert!(projector.status().unwrap().main.running);
        projector.pause().unwrap();
        projector.start().unwrap();
        projector.stop().unwrap();
        assert!(!projector.status().unwrap().main.running);
    }
    // 60 patterns of three bytes, and 64 images: tables of several reports.
    let mut patterns: Vec<LutEntry> =
        (0..60).map(|i| channel([Colour::Green, Colour::Red][i % 2], 8, RED)).collect();
    patterns.iter_mut().skip(2).step_by(2).for_each(|pattern| pattern.next_image = true);
    let images = (0..30).map(|i| i % 3).collect();
    let sequence = Sequence {
        source: Source::Flash { images, load_us: WORST_LOAD_US },
        exposures: Exposures::Fixed(Timing { exposure_us: 110_000, period_us: 110_000 }),
        ..Sequence::from_flash(0, patterns, 110_000)
    };
    infrared.play(&sequence).unwrap();
    infrared.write(&Mailbox::Close).unwrap_err();
    infrared.stop().unwrap();
}

/// 10,000 transactions on two devices from two threads.
#[test]
#[ignore = "run by under_umockdev"]
fn hammering_from_two_threads() {
    const EACH: usize = 5000;
    let hammer = |port: &'static str, drive: u8| {
        move || {
            let mut projector = open(port);
            for i in 0..EACH / 2 {
                let raw = [drive, i as u8, (i >> 8) as u8];
                projector.write(&LedCurrent { raw }).unwrap();
                assert_eq!(projector.read::<LedCurrent>().unwrap().raw, raw);
            }
        }
    };
    for thread in [thread::spawn(hammer("1-1", 1)), thread::spawn(hammer("1-2", 2))] {
        thread.join().unwrap();
    }
}
