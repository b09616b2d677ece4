//! The driver and the emulator in one process: every method, and the quirks.
#![cfg(feature = "emulator")]

mod bench;
mod registers;

use bench::{Bench, colour_flash, colour_video};
use lightcrafter::command::*;
use lightcrafter::sequence::{Colour, Exposures, RED, Source, WORST_LOAD_US, channel, colour_channels};
use lightcrafter::{Error, Sequence};
use registers::every_register_returns;

#[test]
fn every_register_returns_the_value_written() {
    let mut bench = Bench::new();
    every_register_returns(&mut bench.projector);
}

#[test]
fn the_pattern_table_of_128_entries_crosses_in_several_reports() {
    let mut bench = Bench::new();
    bench.projector.write(&Mailbox::Patterns).unwrap();
    let empty = bench.projector.read::<PatternTable>().unwrap_err();
    assert!(matches!(empty, Error::Malformed { .. }) && empty.to_string().contains("bit depth"), "{empty}");
    let entries: Vec<LutEntry> =
        (0..128).map(|i| LutEntry { number: i % 24, ..channel(Colour::Green, 1, 7) }).collect();
    let projector = &mut bench.projector;
    projector.write(&LutControl { entries: 128, repeat: false, patterns: 128, images: 1 }).unwrap();
    projector.write(&Mailbox::Patterns).unwrap();
    projector.write(&MailboxOffset(0)).unwrap();
    projector.write(&PatternTable(entries.clone())).unwrap();
    assert_eq!(projector.read::<PatternTable>().unwrap().0, entries);
    projector.write(&Mailbox::Images).unwrap();
    projector.write(&LutControl { entries: 1, repeat: false, patterns: 1, images: 2 }).unwrap();
    projector.write(&ImageTable(vec![7, 9])).unwrap();
    assert_eq!(projector.read::<ImageTable>().unwrap().0, [7, 9]);
}

#[test]
fn status_versions_and_flash() {
    let mut bench = Bench::new();
    let status = bench.projector.status().unwrap();
    assert!(status.hardware.initialised && status.system.memory_passed && status.faults().is_empty());
    assert_eq!(
        (status.power, status.mode, status.run),
        (PowerMode::Normal, DisplayMode::Video, RunState::Stop)
    );
    assert!(status.signal.locked() && status.main.gamma);
    assert_eq!(bench.projector.versions().unwrap().api.major, 4);
    assert_eq!(bench.projector.firmware_tag().unwrap(), "QF-EMULATOR");
    assert_eq!(bench.projector.flash_image_count().unwrap(), 3);
    bench.projector.check_flash(3, Some("QF-EMULATOR")).unwrap();
    let few = bench.projector.check_flash(4, None).unwrap_err().to_string();
    assert!(few.contains("at least 4") && few.contains("got 3"), "{few}");
    let other = bench.projector.check_flash(1, Some("PLAY")).unwrap_err().to_string();
    assert!(other.contains("\"PLAY\"") && other.contains("QF-EMULATOR"), "{other}");
    assert!((bench.projector.measure_image_load_ms(0, 2).unwrap() - 100.0).abs() < 0.01);
    assert_eq!(bench.projector.place(), "emulator");
}

#[test]
fn faults_of_the_hardware_are_named() {
    let mut status = Bench::new().projector.status().unwrap();
    status.hardware = HardwareStatus { reset_overlap: true, forced_swap: true, ..HardwareStatus::default() };
    status.system.memory_passed = false;
    let faults = status.faults().join("\n");
    for word in ["did not initialise", "memory", "overlapped", "swap was forced"] {
        assert!(faults.contains(word), "{faults}");
    }
}

#[test]
fn a_colour_image_from_video_starts_although_the_first_start_is_ignored() {
    let mut bench = Bench::new();
    let validation = bench.projector.load(&colour_video()).unwrap();
    assert!(validation.warnings().is_empty());
    assert_eq!(bench.writes(0x1A24), 1, "stopped once");
    bench.projector.start().unwrap();
    assert!(bench.writes(0x1A24) >= 3, "the first start was ignored, the second was not");
    let status = bench.projector.status().unwrap();
    assert!(
        status.main.running && status.mode == DisplayMode::PatternSequence && status.run == RunState::Start
    );
    assert!(!status.signal.locked(), "patterns run: the signal reads as not locked");
    assert_eq!(bench.projector.read::<LedEnable>().unwrap(), LedEnable::SEQUENCER);
}

#[test]
fn a_start_resumes_after_a_pause_and_sends_the_tables_again_after_a_stop() {
    let mut bench = Bench::new();
    bench.projector.play(&colour_flash()).unwrap();
    bench.projector.pause().unwrap();
    assert_eq!(bench.projector.read::<RunState>().unwrap(), RunState::Pause);
    let tables = bench.writes(0x1A34);
    bench.projector.start().unwrap();
    assert_eq!(bench.writes(0x1A34), tables, "a pause keeps the tables");
    bench.projector.stop().unwrap();
    assert!(!bench.projector.status().unwrap().main.running);
    bench.projector.start().unwrap();
    assert_eq!(bench.writes(0x1A34), 2 * tables, "a stop loses them");
    assert!(bench.projector.status().unwrap().main.running);
}

#[test]
fn timing_changes_while_patterns_run_and_while_they_are_stopped() {
    let mut bench = Bench::new();
    let timing = Timing { exposure_us: 10_000, period_us: 12_000 };
    assert!(bench.projector.set_timing(timing).unwrap_err().to_string().contains("a sequence from load()"));
    bench.projector.load(&colour_flash()).unwrap();
    bench.projector.set_timing(timing).unwrap();
    assert_eq!(bench.projector.read::<RunState>().unwrap(), RunState::Stop);
    bench.projector.start().unwrap();
    bench.projector.set_timing(Timing { exposure_us: 9000, period_us: 9000 }).unwrap();
    assert_eq!(bench.projector.read::<RunState>().unwrap(), RunState::Start);
    assert_eq!(bench.projector.read::<Timing>().unwrap().exposure_us, 9000);
}

/// A sequence of this number of patterns, each with its image and its exposure.
fn one_image_each(patterns: u8) -> Sequence {
    let mut entries = vec![channel(Colour::Green, 8, RED); patterns.into()];
    entries[1..].iter_mut().for_each(|pattern| pattern.next_image = true);
    let timing = |i: u32| Timing { exposure_us: 250_000 + i, period_us: 250_000 + i };
    Sequence {
        source: Source::Flash { images: (0..patterns).map(|i| i % 3).collect(), load_us: WORST_LOAD_US },
        trigger_mode: TriggerMode::VariableInternal,
        patterns: entries,
        exposures: Exposures::Each((0..patterns.into()).map(timing).collect()),
        repeat: false,
    }
}

#[test]
fn an_exposure_for_each_pattern_and_many_images() {
    let mut bench = Bench::new();
    bench.projector.play(&one_image_each(70)).unwrap();
    assert_eq!(bench.writes(0x1A3E), 70);
    assert_eq!(bench.writes(0x1A34), 2, "64 images and 6");
    assert_eq!(bench.projector.read::<VariableControl>().unwrap().images, 70);
}

/// The firmware swaps the images of a message that has exactly two, so no message may have two.
#[test]
fn a_table_of_66_images_ends_in_more_than_two() {
    let mut bench = Bench::new();
    let exposures = Exposures::Each(vec![Timing { exposure_us: 250_000, period_us: 250_000 }; 66]);
    bench.projector.load(&Sequence { exposures, repeat: true, ..one_image_each(66) }).unwrap();
    let sent: Vec<u8> =
        bench.device().log().filter(|request| request.word == 0x1A34).flat_map(|r| r.data.clone()).collect();
    assert_eq!(sent, (0..66).map(|i| i % 3).collect::<Vec<u8>>());
}

#[test]
fn the_lock_is_checked_before_pattern_mode() {
    let mut bench = Bench::new();
    bench.device().video = false;
    let error = bench.projector.load(&colour_video()).unwrap_err();
    assert!(matches!(error, Error::NotLocked { .. }), "{error}");
    assert!(error.to_string().contains("912 x 1140"), "{error}");
    assert_eq!(bench.writes(0x1A1B), 0, "the mode is untouched");
    assert!(matches!(bench.projector.show_video(), Err(Error::NotLocked { .. })));
    bench.device().video = true;
    bench.projector.play(&colour_video()).unwrap();
    // While patterns run the signal reads as not locked; that must block neither video nor other patterns.
    bench.projector.show_video().unwrap();
    bench.projector.show_flash_image(0).unwrap();
    bench.projector.play(&colour_flash()).unwrap();
    bench.projector.play(&colour_video()).unwrap();
    assert_eq!(bench.projector.read::<InputSource>().unwrap(), InputSource::HDMI);
    assert!(bench.projector.status().unwrap().main.running);
}

#[test]
fn validations_name_every_fault_bit() {
    let mut bench = Bench::new();
    // The rules of the driver accept this sequence; the emulator finds black without time for it.
    let mut sequence = colour_flash();
    sequence.patterns[0].black_after = true;
    sequence.patterns[1].trigger = EntryTrigger::Rising;
    sequence.patterns[2].trigger = EntryTrigger::Falling;
    let validation = bench.projector.load(&sequence).unwrap();
    assert!(validation.trigger_overlap && validation.no_black_before_trigger && !validation.short_gap);
    assert_eq!(validation.warnings().len(), 2);
    // Bypass the rules of the driver to get a validation with errors.
    let mut bench = Bench::new();
    bench.projector.load(&colour_flash()).unwrap();
    bench.projector.write(&Timing { exposure_us: 300, period_us: 400 }).unwrap();
    bench.projector.write(&Validate).unwrap();
    let validation = loop {
        let validation: Validation = bench.projector.read().unwrap();
        if !validation.busy {
            break validation;
        }
    };
    assert!(validation.bad_timing && validation.short_gap && !validation.bad_number);
    assert_eq!(validation.errors(), ["exposure or period is out of range for the bit depth"]);
    assert!(matches!(bench.projector.write(&RunState::Start), Err(Error::Refused { .. })));
}

#[test]
fn a_sequence_that_breaks_a_rule_is_never_sent() {
    let mut bench = Bench::new();
    let error =
        bench.projector.load(&Sequence::from_flash(0, colour_channels(8), 5000)).unwrap_err().to_string();
    assert!(error.contains("8333") && error.contains("5000"), "{error}");
    assert_eq!(bench.device().transactions(), 0);
    let error =
        bench.projector.load(&Sequence::from_flash(3, colour_channels(8), 8333)).unwrap_err().to_string();
    assert!(error.contains("below 3") && error.contains("got 3"), "{error}");
    assert_eq!(bench.writes(0x1A1B) + bench.writes(0x1A24), 0);
}

#[test]
fn a_start_without_a_sequence_is_an_error() {
    let mut bench = Bench::new();
    assert!(bench.projector.start().unwrap_err().to_string().contains("a sequence from load()"));
    assert!(matches!(bench.projector.pause(), Err(Error::Refused { .. })));
    bench.projector.stop().unwrap();
}

#[test]
fn waking_is_not_acknowledged() {
    let mut bench = Bench::new();
    bench.projector.set_power(PowerMode::Standby).unwrap();
    assert!(bench.projector.status().unwrap().main.parked);
    bench.projector.play(&colour_flash()).unwrap();
    assert_eq!(bench.projector.status().unwrap().power, PowerMode::Normal);
    // Reads without a reply are not an error while the projector wakes.
    bench.projector.set_power(PowerMode::Standby).unwrap();
    bench.projector.read::<PowerMode>().unwrap();
    bench.device().quirks.silent_reads_after_waking = 4;
    bench.projector.set_power(PowerMode::Normal).unwrap();
    assert_eq!(bench.projector.status().unwrap().power, PowerMode::Normal);
    let writes = bench.writes(0x0200);
    bench.projector.set_power(PowerMode::Normal).unwrap();
    assert_eq!(bench.writes(0x0200), writes, "awake already");
}

#[test]
fn a_mode_is_not_set_twice_and_the_chip_does_not_freeze() {
    let mut bench = Bench::new();
    for _ in 0..10 {
        bench.projector.show_video().unwrap();
    }
    assert_eq!(bench.writes(0x1A1B), 0);
    assert!(!bench.projector.status().unwrap().main.gamma, "fringes need linear video");
    // The quirk: a program that sets the same mode repeatedly freezes the projector.
    for _ in 0..3 {
        let _ = bench.projector.write(&DisplayMode::Video);
    }
    assert!(matches!(bench.projector.versions(), Err(Error::Timeout { .. })));
    bench.device().power_cycle();
    bench.projector.versions().unwrap();
}

#[test]
fn the_input_changes_before_a_test_pattern_is_left() {
    let mut bench = Bench::new();
    let white = TestPatternColours { foreground: [1023; 3], background: [0; 3] };
    bench.projector.show_test_pattern(TestPattern::Checkerboard, white).unwrap();
    assert_eq!(bench.projector.read::<InputSource>().unwrap(), InputSource::TEST_PATTERN);
    bench.projector.play(&colour_flash()).unwrap();
    bench.projector.show_test_pattern(TestPattern::Solid, white).unwrap();
    bench.projector.show_flash_image(2).unwrap();
    assert_eq!(bench.projector.read::<FlashImage>().unwrap(), FlashImage(2));
    assert!(bench.projector.show_flash_image(3).is_err());
    assert!(bench.projector.start().is_err(), "video mode lost the tables");
}

#[test]
fn an_hdmi_signal_that_switches_the_board_to_video_is_an_error() {
    let mut bench = Bench::new();
    bench.projector.play(&colour_flash()).unwrap();
    bench.projector.pause().unwrap();
    bench.device().video_appears();
    let error = bench.projector.start().unwrap_err();
    assert!(matches!(error, Error::LeftPatterns { .. }) && error.to_string().contains("HDMI"), "{error}");
    bench.projector.play(&colour_flash()).unwrap();
    assert!(bench.projector.status().unwrap().main.running);
}
