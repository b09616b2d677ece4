//! The golden packets: the driver composes and reads each packet exactly as the protocol prescribes.

use lightcrafter::command::*;
use lightcrafter::packet::{Access, Assembler, REPORT_BYTES, Reply, Request};
use lightcrafter::sequence::{Colour, channel};
use std::collections::BTreeMap;

/// Bytes of the packets of one direction, by meaning.
fn golden(direction: &str) -> BTreeMap<String, Vec<u8>> {
    let mut packets = BTreeMap::new();
    for line in include_str!("golden.txt").lines().filter(|line| line.starts_with(direction)) {
        let words: Vec<&str> = line.split_whitespace().skip(1).collect();
        let byte = |word: &&str| (word.len() == 2).then(|| u8::from_str_radix(word, 16).ok()).flatten();
        let bytes: Vec<u8> = words.iter().map_while(byte).collect();
        let meaning = words[bytes.len()..].join(" ");
        assert!(packets.insert(meaning, bytes).is_none(), "two packets of one meaning: {line}");
    }
    packets
}

fn composed(access: Access, sequence: u8, word: u16, data: Vec<u8>) -> Vec<u8> {
    let reports = Request { access, sequence, word, data }.to_reports().unwrap();
    assert_eq!(reports.len(), 1);
    let length = 4 + usize::from(reports[0][2]);
    assert!(reports[0][length..].iter().all(|byte| *byte == 0), "padding is zero");
    reports[0][..length].to_vec()
}

fn read<M: Readable>() -> Vec<u8> {
    composed(Access::Read, 1, M::WORD, Vec::new())
}

fn write<M: Writable>(message: M) -> Vec<u8> {
    composed(M::ACCESS, 1, M::WORD, message.encode().unwrap())
}

fn entry(trigger: EntryTrigger, number: u8, bit_depth: u8, leds: u8) -> LutEntry {
    LutEntry { trigger, number, ..channel(Colour::Green, bit_depth, leds) }
}

fn sent() -> Vec<(&'static str, Vec<u8>)> {
    let (colour, none) = (EdgeDelay::NONE, EdgeDelay::NONE);
    let first = LutEntry { next_image: true, ..entry(EntryTrigger::Rising, 0, 7, 2) };
    let follow = |number, led| entry(EntryTrigger::Continue, number, 7, led);
    let white = LutEntry { invert: true, black_after: true, ..entry(EntryTrigger::Internal, 24, 1, 1) };
    let area = Rectangle { first_px: 1, first_line: 2, width_px: 912, height_px: 1140 };
    let on = EdgeDelay::from_us;
    let swap = |port, order| ChannelSwap { port, order };
    vec![
        ("read hardware status", read::<HardwareStatus>()),
        ("read system status", read::<SystemStatus>()),
        ("read main status", read::<MainStatus>()),
        ("read versions", read::<Versions>()),
        ("read firmware tag", read::<FirmwareTag>()),
        ("read number of images in flash", read::<FlashImageCount>()),
        ("go to standby", write(PowerMode::Standby)),
        ("software reset, without acknowledgement", write(SoftwareReset)),
        ("park the mirrors", write(DmdPark(true))),
        ("freeze the display", write(DisplayFreeze(true))),
        (
            "enter pattern mode",
            composed(Access::Write, 2, 0x1A1B, DisplayMode::PatternSequence.encode().unwrap()),
        ),
        ("input: HDMI, 24 bit", write(InputSource::HDMI)),
        ("input: flash", write(InputSource::FLASH)),
        ("pixel format YCrCb 4:2:2", write(PixelFormat::YCrCb422)),
        ("port clock B", write(PortClock::B)),
        ("channels BAC on the parallel port", write(swap(SwapPort::Parallel, ChannelOrder::Bac))),
        ("channels ABC on the FPD-link", write(swap(SwapPort::FpdLink, ChannelOrder::Abc))),
        (
            "FPD-link: map 2, polarity swapped, field 3",
            write(FpdLink { map_mode: 2, polarity_swapped: true, field: 3 }),
        ),
        (
            "display area: 912 x 1140 from column 1, line 2",
            write(DisplayArea { input: area, display: Rectangle { first_px: 0, first_line: 0, ..area } }),
        ),
        ("test pattern checkerboard", write(TestPattern::Checkerboard)),
        (
            "test pattern colours: full red on half blue",
            write(TestPatternColours { foreground: [1023, 0, 0], background: [0, 0, 512] }),
        ),
        ("show flash image 2", write(FlashImage(2))),
        ("measure loading of images 1 and 2", write(MeasureImageLoad { first: 1, count: 2 })),
        ("flip the long axis", write(LongAxisFlip(true))),
        ("flip the short axis", write(ShortAxisFlip(true))),
        ("linear video", write(Gamma::LINEAR)),
        ("curtain colour 1, 2, 768", write(Curtain([1, 2, 768]))),
        ("the sequencer chooses the LEDs", write(LedEnable::SEQUENCER)),
        (
            "LED current after power-on: drive 104, 135, 130, inverted",
            write(LedCurrent { raw: lightcrafter::Profile::EVM.raw_current([104, 135, 130]).unwrap() }),
        ),
        ("LED polarity inverted", write(LedPolarity::Inverted)),
        ("red LED: off 107.2 ns late", write(RedLedDelay { rising: colour, falling: on(0.1072).unwrap() })),
        ("green LED: on 20.05 us early", write(GreenLedDelay { rising: on(-20.05).unwrap(), falling: none })),
        ("blue LED: off 7.29 us late", write(BlueLedDelay { rising: none, falling: on(7.29).unwrap() })),
        ("patterns from flash", write(PatternSource::Flash)),
        ("trigger mode internal", write(TriggerMode::Internal)),
        ("exposure 8333 us, period 8563 us", write(Timing { exposure_us: 8333, period_us: 8563 })),
        ("three entries, repeated", write(LutControl { entries: 3, repeat: true, patterns: 3, images: 1 })),
        ("open the mailbox for patterns", write(Mailbox::Patterns)),
        ("mailbox offset 0", write(MailboxOffset(0))),
        (
            "pattern table: G, R, B of 7 bit, the first with VSYNC and next image",
            write(PatternTable(vec![first, follow(1, 1), follow(2, 4)])),
        ),
        ("image table 3, 5, exchanged on the wire", write(ImageTable(vec![3, 5]))),
        ("variable offset 1823", write(VariableOffset(1823))),
        (
            "variable entry: 1 bit white, 235 us of 465 us",
            write(VariableEntry { entry: white, timing: Timing { exposure_us: 235, period_us: 465 } }),
        ),
        (
            "variable table: 1824 entries, 3 patterns, 256 images, repeated",
            write(VariableControl { entries: 1824, patterns: 3, images: 256, repeat: true }),
        ),
        ("invert all patterns", write(InvertData(true))),
        ("validate", write(Validate)),
        ("start", write(RunState::Start)),
        (
            "trigger output 1: inverted, falling edge 2.787 us late",
            write(TriggerOut1 { invert_byte: 1, rising: none, falling: on(2.787).unwrap() }),
        ),
        (
            "trigger output 2: 1.072 us early",
            write(TriggerOut2 { invert_byte: 0, rising: on(-1.072).unwrap() }),
        ),
        ("trigger input 1: 28085 us late", write(TriggerIn1Delay::from_us(28_085.0).unwrap())),
        ("trigger input 2: falling edge", write(TriggerIn2Edge::Falling)),
    ]
}

#[test]
fn sent_packets_are_golden() {
    let mut golden = golden(">");
    for (meaning, bytes) in sent() {
        let expected = golden.remove(meaning).unwrap_or_else(|| panic!("no golden packet: {meaning}"));
        assert_eq!(bytes, expected, "{meaning}: {bytes:02X?}");
    }
    assert!(golden.is_empty(), "never composed: {golden:?}");
}

#[test]
fn golden_replies_are_read() {
    let mut golden = golden("<");
    let mut reply = |meaning: &str| {
        let bytes = golden.remove(meaning).unwrap_or_else(|| panic!("no golden packet: {meaning}"));
        let mut report = [0; REPORT_BYTES];
        report[..bytes.len()].copy_from_slice(&bytes);
        let message = Assembler::default().push(&report).unwrap().expect("one report");
        let reply = Reply::from_message(&message).unwrap();
        assert_eq!(reply.sequence, 1);
        reply
    };
    let status =
        HardwareStatus::decode(&reply("hardware status: initialised, sequencer abort, sequencer error").data);
    let expected = HardwareStatus {
        initialised: true,
        sequencer_abort: true,
        sequencer_error: true,
        ..Default::default()
    };
    assert_eq!(status.unwrap(), expected);
    let main = MainStatus::decode(&reply("main status: running, gamma on").data).unwrap();
    assert_eq!(main, MainStatus { running: true, gamma: true, ..Default::default() });
    let versions = Versions::decode(&reply("versions 4.4.0, 3.0.1, 1.0.2, 0.1.3").data).unwrap();
    let all = [versions.application, versions.api, versions.software, versions.sequencer];
    assert_eq!(all.map(|version| version.to_string()), ["4.4.0", "3.0.1", "1.0.2", "0.1.3"]);
    assert_eq!(FirmwareTag::decode(&reply("firmware tag PLAY").data).unwrap().0, "PLAY");
    let time = ImageLoadTime::decode(&reply("load time 37334 ticks: 2 ms").data).unwrap();
    assert!((time.milliseconds() - 2.0).abs() < 1e-9);
    let validation =
        Validation::decode(&reply("validation: busy; timing, number and gap at fault").data).unwrap();
    assert!(validation.busy && validation.errors().len() == 2 && validation.warnings().len() == 1);
    let signal = VideoSignal::decode(&reply("video locked, 912 x 1140").data).unwrap();
    assert!(signal.locked() && signal.hsync_polarity == 1 && signal.pixel_clock == 73_008);
    assert_eq!((signal.line_rate, signal.frame_rate, signal.total_px), (7020, 6000, 1040));
    assert_eq!(signal.to_string(), "locked, 912 x 1140 pixels");
    let acknowledged = reply("acknowledgement of the display mode");
    assert!(!acknowledged.refused && !acknowledged.read && acknowledged.data == [0x1B, 0x1A]);
    assert!(reply("refusal of the run state").refused);
    let refused = reply("refusal of a read");
    assert!(refused.refused && refused.read && refused.data.is_empty());
    assert!(golden.is_empty(), "never read: {golden:?}");
}
