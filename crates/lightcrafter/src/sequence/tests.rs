use super::*;

fn refused(sequence: &Sequence, words: &[&str]) {
    let error = sequence.check().unwrap_err().to_string();
    for word in words {
        assert!(error.contains(word), "{error} lacks {word}");
    }
}

fn colour_video() -> Sequence {
    let exposure_us = exposure_in_frame_us(3, 7, 60.0).unwrap();
    Sequence::from_video(colour_channels(7), 60.0, exposure_us)
}

#[test]
fn limits_are_those_of_the_guide() {
    let exposures = [235, 700, 1570, 1700, 2000, 2500, 4500, 8333];
    let numbers = [24, 11, 7, 5, 3, 3, 2, 2];
    for depth in 1..=8_u8 {
        let limits = depth_limits(depth).unwrap();
        let i = usize::from(depth - 1);
        assert_eq!((limits.min_exposure_us, limits.last_number), (exposures[i], numbers[i]));
        let last_plane = first_plane(depth, limits.last_number.min(23)).unwrap() + depth - 1;
        assert!(last_plane <= 23, "{depth} bit ends at plane {last_plane}");
        assert!(first_plane(depth, limits.last_number + 1).is_err());
    }
    assert!(depth_limits(0).is_err() && depth_limits(9).is_err());
    assert_eq!([0, 1, 2, 3].map(|n| first_plane(5, n).unwrap()), [1, 7, 13, 19]);
    assert_eq!([0, 1, 2].map(|n| first_plane(7, n).unwrap()), [1, 9, 17]);
}

#[test]
fn a_colour_image_fits_into_a_frame_with_7_bits_and_not_with_8() {
    let sequence = colour_video();
    sequence.check().unwrap();
    assert_eq!(sequence.timing(0).exposure_us, 5555);
    assert_eq!(sequence.patterns.iter().map(|p| p.leds).collect::<Vec<_>>(), [GREEN, RED, BLUE]);
    let error = exposure_in_frame_us(3, 8, 60.0).unwrap_err().to_string();
    assert!(error.contains("at least 8333") && error.contains("5555"), "{error}");
    assert_eq!(exposure_in_frame_us(2, 8, 60.0).unwrap(), 8333);
    for rate_hz in [0.0, -60.0, f64::NAN, 241.0] {
        assert!(exposure_in_frame_us(3, 7, rate_hz).unwrap_err().to_string().contains("1 to 240"));
    }
    refused(&Sequence::from_video(colour_channels(7), 60.0, 5600), &["at most 16666", "16800"]);
}

#[test]
fn rules_of_exposure_and_period() {
    let grey = vec![channel(Colour::Green, 8, RED)];
    let timed = |exposure_us, period_us| Sequence {
        exposures: Exposures::Fixed(Timing { exposure_us, period_us }),
        ..Sequence::from_flash(0, grey.clone(), 8333)
    };
    timed(8333, 8333).check().unwrap();
    timed(8333, 8563).check().unwrap();
    timed(MAX_EXPOSURE_US, MAX_EXPOSURE_US).check().unwrap();
    refused(&timed(8332, 8332), &["exposure of pattern 0", "8333 to 200000000", "8332"]);
    refused(&timed(8333, 8562), &["8333, or at least 8563", "8562"]);
    refused(&timed(8333, 100), &["period of pattern 0"]);
    refused(&timed(MAX_EXPOSURE_US + 1, MAX_EXPOSURE_US + 1), &["200000001"]);
}

#[test]
fn patterns_that_share_an_exposure_divide_it() {
    let mut patterns = colour_channels(8);
    patterns[1].shares_exposure = true;
    patterns[2].shares_exposure = true;
    Sequence::from_flash(0, patterns.clone(), 25_000).check().unwrap();
    refused(&Sequence::from_flash(0, patterns.clone(), 24_998), &["shared by 3 patterns", "24999"]);
    patterns[1].black_after = true;
    refused(
        &Sequence::from_flash(0, patterns, 25_000),
        &["pattern 1", "black after it or a shared exposure", "got both"],
    );
}

#[test]
fn first_pattern_numbers_and_leds() {
    let mut sequence = Sequence::from_flash(3, colour_channels(8), 8333);
    sequence.check().unwrap();
    sequence.patterns[2].number = 3;
    refused(&sequence, &["number of pattern 2 at 8 bit", "0 to 2", "got 3"]);
    sequence.patterns[2].number = 2;
    sequence.patterns[1].leds = 8;
    refused(&sequence, &["LED selection of pattern 1"]);
    sequence.patterns[1].leds = 1;
    sequence.patterns[0].trigger = EntryTrigger::Continue;
    refused(&sequence, &["a trigger that starts the sequence"]);
    sequence.patterns.clear();
    refused(&sequence, &["1 to 128", "got 0"]);
    sequence.patterns = vec![channel(Colour::Green, 8, RED); 129];
    refused(&sequence, &["1 to 128", "got 129"]);
}

#[test]
fn trigger_modes_go_with_source_and_exposures() {
    let mut sequence = colour_video();
    sequence.trigger_mode = TriggerMode::Internal;
    refused(&sequence, &["VideoSync", "Internal"]);
    let mut variable = Sequence::from_flash(0, colour_channels(8), 8333);
    variable.exposures = Exposures::Each(vec![Timing { exposure_us: 9000, period_us: 9000 }; 3]);
    refused(&variable, &["VariableInternal"]);
    variable.trigger_mode = TriggerMode::VariableInternal;
    variable.check().unwrap();
    variable.exposures = Exposures::Each(vec![Timing { exposure_us: 9000, period_us: 9000 }; 2]);
    refused(&variable, &["3, one for each pattern", "got 2"]);
}

#[test]
fn video_patterns_wait_for_the_frame_or_follow() {
    let mut sequence = colour_video();
    sequence.patterns[1].trigger = EntryTrigger::Internal;
    refused(&sequence, &["trigger of pattern 1 from video", "Internal"]);
    let mut sequence = colour_video();
    sequence.exposures = Exposures::Fixed(Timing { exposure_us: 5000, period_us: 5300 });
    refused(&sequence, &["5000, the exposure", "5300"]);
    let mut sequence = colour_video();
    sequence.source = Source::Video { frame_rate_hz: 0.0 };
    refused(&sequence, &["frame rate in Hz"]);
}

#[test]
fn flash_images_are_counted_and_given_time_to_load() {
    let mut sequence = Sequence::from_flash(0, vec![channel(Colour::Green, 8, RED); 3], 100_000);
    sequence.patterns[1].next_image = true;
    refused(&sequence, &["2: one", "got 1"]);
    sequence.source = Source::Flash { images: vec![0, 1], load_us: WORST_LOAD_US };
    sequence.check().unwrap();
    sequence.patterns[2].next_image = true;
    sequence.source = Source::Flash { images: vec![0, 1, 2], load_us: WORST_LOAD_US };
    refused(&sequence, &["before pattern 1", "more than 200000", "got 100000"]);
    sequence.source = Source::Flash { images: vec![0, 1, 2], load_us: 90_000 };
    sequence.check().unwrap();
}
