//! Faults on demand, states that are never reached, and several projectors at once.
#![cfg(feature = "emulator")]

mod bench;

use bench::{Bench, colour_flash};
use lightcrafter::command::*;
use lightcrafter::emulator::Fault;
use lightcrafter::sequence::Exposures;
use lightcrafter::{Error, LightCrafter, Profile};
use std::sync::Arc;

#[test]
fn old_firmware_has_no_individual_exposures() {
    let mut sequence = colour_flash();
    sequence.trigger_mode = TriggerMode::VariableInternal;
    sequence.exposures = Exposures::Each(vec![Timing { exposure_us: 9000, period_us: 9000 }; 3]);
    let mut bench = Bench::new();
    bench.device().set_version(2, 0, 0);
    let error = bench.projector.load(&sequence).unwrap_err().to_string();
    assert!(error.contains("3.0 or newer") && error.contains("2.0.0"), "{error}");
}

#[test]
fn each_fault_gives_its_error_and_the_next_command_works() {
    type Check = fn(&Error) -> bool;
    let cases: [(Fault, usize, Check); 5] = [
        (Fault::Refuse, 1, |error| matches!(error, Error::Refused { .. })),
        (Fault::Silence, 2, |error| matches!(error, Error::Timeout { waited_ms: 2000, .. })),
        (Fault::Truncate, 2, |error| matches!(error, Error::Malformed { .. })),
        (Fault::WrongSequence, 2, |error| matches!(error, Error::Sequence { .. })),
        (Fault::Unplug, 1, |error| matches!(error, Error::Disconnected { .. })),
    ];
    for (fault, times, expected) in cases {
        let mut bench = Bench::new();
        bench.projector.versions().unwrap();
        bench.device().inject(fault, times);
        let error = bench.projector.versions().unwrap_err();
        assert!(expected(&error), "{fault:?}: {error}");
        assert!(error.to_string().contains("emulator"), "{error}");
        if fault == Fault::Unplug {
            assert!(matches!(bench.projector.versions(), Err(Error::Disconnected { .. })));
            bench.device().power_cycle();
        }
        assert_eq!(bench.projector.firmware_tag().unwrap(), "QF-EMULATOR", "after {fault:?}");
    }
}

#[test]
fn a_read_is_repeated_once_and_a_write_is_not() {
    let mut bench = Bench::new();
    for fault in [Fault::Silence, Fault::Truncate, Fault::WrongSequence] {
        bench.device().inject(fault, 1);
        bench.projector.versions().unwrap();
        bench.device().inject(fault, 1);
        assert!(bench.projector.write(&DisplayFreeze(true)).is_err());
        bench.projector.versions().unwrap();
    }
    assert_eq!(bench.writes(0x100A), 3);
    bench.device().inject(Fault::Stale, 20);
    for _ in 0..20 {
        assert_eq!(bench.projector.versions().unwrap().application.major, 4);
    }
}

#[test]
fn a_state_that_is_never_reached_is_an_error() {
    let mut bench = Bench::impatient();
    bench.device().quirks.lag_polls = u32::MAX;
    let error = bench.projector.load(&colour_flash()).unwrap_err();
    assert!(matches!(error, Error::Stuck { waited_ms: 40, .. }), "{error}");
    let mut bench = Bench::impatient();
    bench.device().quirks.busy_polls = u32::MAX;
    let error = bench.projector.load(&colour_flash()).unwrap_err();
    assert!(matches!(error, Error::Stuck { .. }) && error.to_string().contains("busy: true"), "{error}");
    let mut bench = Bench::impatient();
    bench.projector.set_power(PowerMode::Standby).unwrap();
    bench.device().quirks.silent_reads_after_waking = u32::MAX;
    let error = bench.projector.set_power(PowerMode::Normal).unwrap_err();
    assert!(matches!(error, Error::Timeout { .. }), "{error}");
}

#[test]
fn the_error_of_a_rejected_sequence_names_the_reason() {
    let mut bench = Bench::new();
    bench.device().quirks.rejects = true;
    let error = bench.projector.load(&colour_flash()).unwrap_err();
    assert!(matches!(error, Error::Rejected { .. }), "{error}");
    assert!(error.to_string().contains("a pattern number does not exist"), "{error}");
}

#[test]
fn a_reset_takes_the_device_off_the_bus() {
    let bench = Bench::new();
    let device = Arc::clone(&bench.device);
    let sent = bench.projector.reset();
    assert!(matches!(sent, Ok(()) | Err(Error::Disconnected { .. })), "{sent:?}");
    assert!(!device.lock().unwrap().plugged());
}

#[test]
fn a_transport_can_be_taken_back_and_boxed() {
    let bench = Bench::new();
    assert_eq!(bench.projector.profile(), Profile::EVM);
    let boxed: Box<dyn lightcrafter::Transport> = Box::new(bench.projector.into_transport());
    let mut projector = LightCrafter::new(boxed);
    assert_eq!(projector.versions().unwrap().application.to_string(), "4.4.0");
    assert_eq!(projector.place(), "emulator");
}

#[test]
fn two_projectors_from_two_threads() {
    let work = |drive: u8| {
        move || {
            let mut bench = Bench::new();
            for i in 0..200 {
                bench.projector.set_led_drive([drive, i % 100, 0]).unwrap();
                assert_eq!(bench.projector.led_drive().unwrap(), [drive, i % 100, 0]);
            }
        }
    };
    let threads = [10, 20].map(|drive| std::thread::spawn(work(drive)));
    for thread in threads {
        thread.join().unwrap();
    }
}
