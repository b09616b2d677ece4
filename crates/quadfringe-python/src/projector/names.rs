//! Python names of the driver's enum values.

use crate::device::unknown;
use lightcrafter::Profile;
use lightcrafter::command::{
    DisplayMode, EntryTrigger, InputPort, LedEnable, PowerMode, RunState, TestPattern, TriggerMode,
};
use lightcrafter::sequence::{BLUE, GREEN, RED};
use pyo3::prelude::*;

/// The light engine of this name.
pub fn profile(name: &str) -> PyResult<Profile> {
    match name {
        "evm" => Ok(Profile::EVM),
        "external" => Ok(Profile::EXTERNAL),
        _ => Err(unknown("light", name, "evm or external")),
    }
}

/// The LEDs of these letters: any of r, g and b.
pub fn leds(letters: &str) -> PyResult<u8> {
    letters.chars().try_fold(0, |leds, letter| match letter {
        'r' => Ok(leds | RED),
        'g' => Ok(leds | GREEN),
        'b' => Ok(leds | BLUE),
        _ => Err(unknown("leds", letters, "letters of rgb, such as g or rgb")),
    })
}

/// The LEDs of these letters, switched on; with None the patterns select the LEDs.
pub fn led_enable(letters: Option<&str>) -> PyResult<LedEnable> {
    let Some(letters) = letters else { return Ok(LedEnable::SEQUENCER) };
    let on = leds(letters)?;
    Ok(LedEnable { red: on & RED != 0, green: on & GREEN != 0, blue: on & BLUE != 0, sequencer: false })
}

/// The trigger of a pattern.
pub fn entry_trigger(name: &str) -> PyResult<EntryTrigger> {
    match name {
        "internal" => Ok(EntryTrigger::Internal),
        "rising" => Ok(EntryTrigger::Rising),
        "falling" => Ok(EntryTrigger::Falling),
        "continue" => Ok(EntryTrigger::Continue),
        _ => Err(unknown("trigger", name, "internal, rising, falling or continue")),
    }
}

/// The trigger mode of a sequence.
pub fn trigger_mode(name: &str) -> PyResult<TriggerMode> {
    match name {
        "video-sync" => Ok(TriggerMode::VideoSync),
        "internal" => Ok(TriggerMode::Internal),
        "alternate" => Ok(TriggerMode::Alternate),
        "variable-internal" => Ok(TriggerMode::VariableInternal),
        "variable-video-sync" => Ok(TriggerMode::VariableVideoSync),
        _ => {
            let known = "video-sync, internal, alternate, variable-internal or variable-video-sync";
            Err(unknown("trigger_mode", name, known))
        }
    }
}

/// The test pattern of this name.
pub fn test_pattern(name: &str) -> PyResult<TestPattern> {
    match name {
        "solid" => Ok(TestPattern::Solid),
        "horizontal-ramp" => Ok(TestPattern::HorizontalRamp),
        "vertical-ramp" => Ok(TestPattern::VerticalRamp),
        "horizontal-lines" => Ok(TestPattern::HorizontalLines),
        "diagonal-lines" => Ok(TestPattern::DiagonalLines),
        "vertical-lines" => Ok(TestPattern::VerticalLines),
        "grid" => Ok(TestPattern::Grid),
        "checkerboard" => Ok(TestPattern::Checkerboard),
        "rgb-ramp" => Ok(TestPattern::RgbRamp),
        "colour-bars" => Ok(TestPattern::ColourBars),
        "step-bars" => Ok(TestPattern::StepBars),
        _ => Err(unknown(
            "test pattern",
            name,
            "solid, horizontal-ramp, vertical-ramp, horizontal-lines, \
            diagonal-lines, vertical-lines, grid, checkerboard, rgb-ramp, colour-bars or step-bars",
        )),
    }
}

/// `normal` or `standby`.
pub fn of_power(power: PowerMode) -> &'static str {
    match power {
        PowerMode::Normal => "normal",
        PowerMode::Standby => "standby",
    }
}

/// `video` or `patterns`.
pub fn of_mode(mode: DisplayMode) -> &'static str {
    match mode {
        DisplayMode::Video => "video",
        DisplayMode::PatternSequence => "patterns",
    }
}

/// `stopped`, `paused` or `running`.
pub fn of_run(run: RunState) -> &'static str {
    match run {
        RunState::Stop => "stopped",
        RunState::Pause => "paused",
        RunState::Start => "running",
    }
}

/// `hdmi`, `test-pattern`, `flash` or `fpd-link`.
pub fn of_port(port: InputPort) -> &'static str {
    match port {
        InputPort::Parallel => "hdmi",
        InputPort::TestPattern => "test-pattern",
        InputPort::Flash => "flash",
        InputPort::FpdLink => "fpd-link",
    }
}
