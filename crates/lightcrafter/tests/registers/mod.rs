//! For every register that can be read and written, a value that differs from the one after power-on.

use lightcrafter::command::*;
use lightcrafter::{LightCrafter, Transport};
use std::fmt::Debug;

/// Write each value and read it back.
pub fn every_register_returns<T: Transport>(projector: &mut LightCrafter<T>) {
    macro_rules! returns {
        ($($value:expr),+ $(,)?) => { $(returns(projector, $value);)+ };
    }
    let rectangle = Rectangle { first_px: 1, first_line: 2, width_px: 900, height_px: 1000 };
    let edge = EdgeDelay(0x10);
    returns!(
        DisplayFreeze(true),
        InputSource { port: InputPort::FpdLink, width: ParallelWidth::Bits8 },
        PixelFormat::YCrCb444,
        PortClock::C,
        ChannelSwap { port: SwapPort::FpdLink, order: ChannelOrder::Cba },
        FpdLink { map_mode: 3, polarity_swapped: true, field: 7 },
        DisplayArea { input: rectangle, display: rectangle },
        TestPattern::StepBars,
        TestPatternColours { foreground: [1, 2, 1023], background: [1023, 0, 4] },
        FlashImage(2),
        LongAxisFlip(true),
        ShortAxisFlip(true),
        Gamma { enabled: true, table: 1 },
        Curtain([1023, 5, 0]),
        LedEnable { red: true, green: false, blue: true, sequencer: false },
        LedCurrent { raw: [1, 2, 3] },
        LedPolarity::Inverted,
        RedLedDelay { rising: edge, falling: EdgeDelay::NONE },
        GreenLedDelay { rising: edge, falling: edge },
        BlueLedDelay { rising: EdgeDelay(255), falling: edge },
        PatternSource::Video,
        TriggerMode::VariableVideoSync,
        Timing { exposure_us: 123_456, period_us: 234_567 },
        LutControl { entries: 128, repeat: true, patterns: 256, images: 64 },
        VariableControl { entries: 1824, patterns: 1, images: 256, repeat: true },
        InvertData(true),
        TriggerOut1 { invert_byte: 2, rising: edge, falling: EdgeDelay(0xD5) },
        TriggerOut2 { invert_byte: 1, rising: EdgeDelay(255) },
        TriggerIn1Delay { steps: 0x7_FFFF },
        TriggerIn2Edge::Falling,
    );
}

fn returns<T: Transport, M>(projector: &mut LightCrafter<T>, value: M)
where
    M: Readable + Writable + PartialEq + Debug,
{
    projector.write(&value).unwrap_or_else(|error| panic!("{value:?}: {error}"));
    assert_eq!(projector.read::<M>(), Ok(value));
}
