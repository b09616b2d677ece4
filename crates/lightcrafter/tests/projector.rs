//! The driver and the emulator in one process: verbs, quirks and faults.
#![cfg(feature = "emulator")]

mod registers;

use lightcrafter::command::*;
use lightcrafter::emulator::{Dlpc350, EmulatedTransport, Fault};
use lightcrafter::packet::Request;
use lightcrafter::sequence::{
    Colour, Exposures, RED, Source, WORST_LOAD_US, channel, colour_channels, exposure_in_frame_us,
};
use lightcrafter::{Error, LightCrafter, Profile, Sequence, TriggerOut, Triggers, Waits};
use registers::every_register_returns;
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::Duration;

type Projector = LightCrafter<EmulatedTransport>;

struct Bench {
    projector: Projector,
    device: Arc<Mutex<Dlpc350>>,
}

impl Bench {
    fn new() -> Self {
        Self::with(Profile::EVM)
    }

    fn with(profile: Profile) -> Self {
        // Bounds that a loaded machine does not reach; silence costs no time in memory.
        let ms = Duration::from_millis;
        let waits = Waits { poll: ms(1), verdict: ms(0), wake: ms(0), lock: ms(20), ..Waits::default() };
        let transport = EmulatedTransport::new(Dlpc350::default());
        let device = transport.device();
        Self { projector: LightCrafter::new(transport).with_waits(waits).with_profile(profile), device }
    }

    /// For states that never come.
    fn impatient() -> Self {
        let Self { projector, device } = Self::new();
        let short = Duration::from_millis(40);
        let poll = Duration::from_millis(1);
        let waits = Waits { poll, change: short, wake: poll, power: short, ..Waits::default() };
        Self { projector: projector.with_waits(waits), device }
    }

    fn device(&self) -> MutexGuard<'_, Dlpc350> {
        self.device.lock().unwrap()
    }

    /// How often a register was written.
    fn writes(&self, word: u16) -> usize {
        let written =
            |request: &&Request| request.word == word && request.access != lightcrafter::packet::Access::Read;
        self.device().log().filter(written).count()
    }
}

fn colour_video() -> Sequence {
    Sequence::from_video(colour_channels(7), 60.0, exposure_in_frame_us(3, 7, 60.0).unwrap())
}

fn colour_flash() -> Sequence {
    Sequence::from_flash(1, colour_channels(8), 8333)
}

#[test]
fn every_register_takes_what_is_written_and_gives_it_back() {
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
    for word in ["did not initialise", "memory", "overlapped", "swapped by force"] {
        assert!(faults.contains(word), "{faults}");
    }
}

#[test]
fn a_colour_image_from_video_is_started_though_the_first_start_is_ignored() {
    let mut bench = Bench::new();
    let verdict = bench.projector.load(&colour_video()).unwrap();
    assert!(verdict.warnings().is_empty());
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
fn pause_goes_on_and_stop_sends_the_tables_again() {
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
fn timing_changes_while_it_runs_and_while_it_rests() {
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

#[test]
fn an_exposure_for_each_pattern_and_many_images() {
    let mut bench = Bench::new();
    let mut patterns = vec![channel(Colour::Green, 8, RED); 70];
    patterns[1..].iter_mut().for_each(|pattern| pattern.next_image = true);
    let sequence = Sequence {
        source: Source::Flash { images: (0..70).map(|i| i % 3).collect(), load_us: WORST_LOAD_US },
        trigger_mode: TriggerMode::VariableInternal,
        patterns,
        exposures: Exposures::Each(
            (0..70).map(|i| Timing { exposure_us: 250_000 + i, period_us: 250_000 + i }).collect(),
        ),
        repeat: false,
    };
    bench.projector.play(&sequence).unwrap();
    assert_eq!(bench.writes(0x1A3E), 70);
    assert_eq!(bench.writes(0x1A34), 2, "64 images and 6");
    assert_eq!(bench.projector.read::<VariableControl>().unwrap().images, 70);
}

/// A message of two images is exchanged by the firmware, so that the last chunk must not be one.
#[test]
fn a_table_of_66_images_ends_in_more_than_two() {
    let mut bench = Bench::new();
    let mut patterns = vec![channel(Colour::Green, 8, RED); 66];
    patterns[1..].iter_mut().for_each(|pattern| pattern.next_image = true);
    let sequence = Sequence {
        source: Source::Flash { images: (0..66).map(|i| i % 3).collect(), load_us: WORST_LOAD_US },
        trigger_mode: TriggerMode::VariableInternal,
        patterns,
        exposures: Exposures::Each(vec![Timing { exposure_us: 250_000, period_us: 250_000 }; 66]),
        repeat: true,
    };
    bench.projector.load(&sequence).unwrap();
    let sent: Vec<u8> =
        bench.device().log().filter(|request| request.word == 0x1A34).flat_map(|r| r.data.clone()).collect();
    assert_eq!(sent, (0..66).map(|i| i % 3).collect::<Vec<u8>>());
}

#[test]
fn the_lock_is_asked_for_before_pattern_mode() {
    let mut bench = Bench::new();
    bench.device().video = false;
    let error = bench.projector.load(&colour_video()).unwrap_err();
    assert!(matches!(error, Error::NotLocked { .. }), "{error}");
    assert!(error.to_string().contains("912 x 1140"), "{error}");
    assert_eq!(bench.writes(0x1A1B), 0, "the mode is untouched");
    assert!(matches!(bench.projector.show_video(), Err(Error::NotLocked { .. })));
    bench.device().video = true;
    bench.projector.play(&colour_video()).unwrap();
    // While patterns run the signal reads as not locked; neither video nor other patterns are kept back by that.
    bench.projector.show_video().unwrap();
    bench.projector.show_flash_image(0).unwrap();
    bench.projector.play(&colour_flash()).unwrap();
    bench.projector.play(&colour_video()).unwrap();
    assert_eq!(bench.projector.read::<InputSource>().unwrap(), InputSource::HDMI);
    assert!(bench.projector.status().unwrap().main.running);
}

#[test]
fn verdicts_name_every_fault_bit() {
    let mut bench = Bench::new();
    // What the rules of the driver let through and the model finds: black without time for it.
    let mut sequence = colour_flash();
    sequence.patterns[0].black_after = true;
    sequence.patterns[1].trigger = EntryTrigger::Rising;
    sequence.patterns[2].trigger = EntryTrigger::Falling;
    let verdict = bench.projector.load(&sequence).unwrap();
    assert!(verdict.trigger_overlap && verdict.no_black_before_trigger && !verdict.short_gap);
    assert_eq!(verdict.warnings().len(), 2);
    // Behind the back of the rules: a verdict with errors.
    let mut bench = Bench::new();
    bench.projector.load(&colour_flash()).unwrap();
    bench.projector.write(&Timing { exposure_us: 300, period_us: 400 }).unwrap();
    bench.projector.write(&Validate).unwrap();
    let verdict = loop {
        let verdict: Validation = bench.projector.read().unwrap();
        if !verdict.busy {
            break verdict;
        }
    };
    assert!(verdict.bad_timing && verdict.short_gap && !verdict.bad_number);
    assert_eq!(verdict.errors(), ["exposure or period is out of range for the bit depth"]);
    assert!(matches!(bench.projector.write(&RunState::Start), Err(Error::Refused { .. })));
}

#[test]
fn what_the_rules_forbid_is_never_sent() {
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
fn starting_nothing_is_an_error() {
    let mut bench = Bench::new();
    assert!(bench.projector.start().unwrap_err().to_string().contains("a sequence from load()"));
    assert!(matches!(bench.projector.pause(), Err(Error::Refused { .. })));
    bench.projector.stop().unwrap();
}

#[test]
fn waking_goes_without_acknowledgement() {
    let mut bench = Bench::new();
    bench.projector.set_power(PowerMode::Standby).unwrap();
    assert!(bench.projector.status().unwrap().main.parked);
    bench.projector.play(&colour_flash()).unwrap();
    assert_eq!(bench.projector.status().unwrap().power, PowerMode::Normal);
    // Looks that find it still silent are no fault.
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
    // The quirk itself: a program that sets the mode again and again loses the projector.
    for _ in 0..3 {
        let _ = bench.projector.write(&DisplayMode::Video);
    }
    assert!(matches!(bench.projector.versions(), Err(Error::Timeout { .. })));
    bench.device().power_cycle();
    bench.projector.versions().unwrap();
}

#[test]
fn test_patterns_are_left_by_their_source_first() {
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
fn hdmi_data_take_the_board_to_video_and_it_is_said() {
    let mut bench = Bench::new();
    bench.projector.play(&colour_flash()).unwrap();
    bench.projector.pause().unwrap();
    bench.device().video_appears();
    let error = bench.projector.start().unwrap_err();
    assert!(matches!(error, Error::LeftPatterns { .. }) && error.to_string().contains("HDMI"), "{error}");
    bench.projector.play(&colour_flash()).unwrap();
    assert!(bench.projector.status().unwrap().main.running);
}

#[test]
fn the_drive_of_the_leds_is_what_the_user_means() {
    let mut bench = Bench::new();
    assert_eq!(bench.projector.led_drive().unwrap(), Profile::POWER_ON_DRIVE);
    bench.projector.set_led_drive([0, 50, 130]).unwrap();
    assert_eq!(bench.projector.read::<LedCurrent>().unwrap().raw, [255, 205, 125]);
    assert_eq!(bench.projector.led_drive().unwrap(), [0, 50, 130]);
    let sent = bench.writes(0x0B01);
    assert!(bench.projector.set_led_drive([105, 0, 0]).is_err());
    assert_eq!(bench.writes(0x0B01), sent);
    bench.projector.write(&LedPolarity::Inverted).unwrap();
    assert!(bench.projector.set_led_drive([1, 1, 1]).unwrap_err().to_string().contains("Normal"));
    assert_eq!(bench.writes(0x0B01), sent);
    let mut infrared = Bench::with(Profile::EXTERNAL);
    assert!(
        infrared.projector.set_led_drive([0; 3]).unwrap_err().to_string().contains("stated in the profile")
    );
}

#[test]
fn light_triggers_and_geometry_are_set_in_physical_units() {
    let mut bench = Bench::new();
    let triggers = Triggers {
        out_1: TriggerOut { inverted: true, rising_us: -1.072, falling_us: 2.144 },
        out_2: TriggerOut { inverted: false, rising_us: 5.36, falling_us: 0.0 },
        in_1_delay_us: 1071.36,
        in_2_edge: TriggerIn2Edge::Falling,
    };
    bench.projector.set_triggers(&triggers).unwrap();
    let found = bench.projector.triggers().unwrap();
    assert!((found.out_1.rising_us + 1.072).abs() < 1e-9 && (found.out_2.rising_us - 5.36).abs() < 1e-9);
    assert!((found.in_1_delay_us - 1071.36).abs() < 1e-6 && found.out_1.inverted && !found.out_2.inverted);
    let late = Triggers { out_1: TriggerOut { falling_us: 3.0, ..triggers.out_1 }, ..triggers };
    assert!(bench.projector.set_triggers(&late).is_err());
    bench.projector.set_leds(LedEnable { red: true, ..LedEnable::default() }).unwrap();
    bench.projector.set_led_delays_us([0.0, 1.072, -1.072], [0.0; 3]).unwrap();
    assert_eq!(bench.projector.read::<GreenLedDelay>().unwrap().rising, EdgeDelay(0xC5));
    assert!(bench.projector.set_led_delays_us([9.0, 0.0, 0.0], [0.0; 3]).is_err());
    bench.projector.set_flips(true, false).unwrap();
    assert_eq!(bench.projector.flips().unwrap(), (true, false));
    bench.projector.set_gamma(Gamma { enabled: true, table: 1 }).unwrap();
    bench.projector.set_inverted(true).unwrap();
    assert_eq!(bench.projector.read::<InvertData>().unwrap(), InvertData(true));
}

#[test]
fn old_firmware_cannot_have_an_exposure_each() {
    let mut sequence = colour_flash();
    sequence.trigger_mode = TriggerMode::VariableInternal;
    sequence.exposures = Exposures::Each(vec![Timing { exposure_us: 9000, period_us: 9000 }; 3]);
    let mut bench = Bench::new();
    bench.device().set_version(2, 0, 0);
    let error = bench.projector.load(&sequence).unwrap_err().to_string();
    assert!(error.contains("3.0 or newer") && error.contains("2.0.0"), "{error}");
}

/// Each fault ends in its own error, and the next command works.
#[test]
fn faults_have_their_own_errors_and_leave_nothing_behind() {
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
fn a_read_is_asked_once_more_and_a_write_is_not() {
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
fn a_state_that_never_comes_ends_in_an_error() {
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
fn a_rejected_sequence_says_why() {
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
fn a_transport_comes_back_and_may_be_boxed() {
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
