//! Pattern sequences: patterns, exposures, trigger, and the rules that they must satisfy.

mod rules;

use crate::command::{EntryTrigger, LutControl, LutEntry, Timing, TriggerMode, VariableControl};
use crate::error::{Error, Result};

/// Columns of the mirror array.
pub const WIDTH_PX: usize = 912;
/// Rows of the mirror array.
pub const HEIGHT_PX: usize = 1140;
/// Longest exposure, us.
pub const MAX_EXPOSURE_US: u32 = 200_000_000;
/// Shortest black time between two patterns, us.
pub const MIN_GAP_US: u32 = 230;
/// Longest time that a flash image takes to load, us, to be used until the time is measured.
pub const WORST_LOAD_US: u32 = 200_000;

/// The LED selection red of [`LutEntry::leds`].
pub const RED: u8 = 1;
/// The LED selection green.
pub const GREEN: u8 = 2;
/// The LED selection blue.
pub const BLUE: u8 = 4;

/// Limits of a bit depth.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DepthLimits {
    /// The shortest exposure, us.
    pub min_exposure_us: u32,
    /// The highest pattern number. At 1 bit, number 24 has no bit plane: it is black, or white if inverted.
    pub last_number: u8,
    /// Patterns that fit into the two buffers for flash images and need no loading.
    pub preloaded: u8,
}

/// The limits of a bit depth from 1 to 8.
pub fn depth_limits(bit_depth: u8) -> Result<DepthLimits> {
    let (min_exposure_us, last_number, preloaded) = match bit_depth {
        1 => (235, 24, 48),
        2 => (700, 11, 24),
        3 => (1570, 7, 16),
        4 => (1700, 5, 12),
        5 => (2000, 3, 8),
        6 => (2500, 3, 8),
        7 => (4500, 2, 6),
        8 => (8333, 2, 6),
        _ => return Err(Error::value("bit depth", "1 to 8", bit_depth)),
    };
    Ok(DepthLimits { min_exposure_us, last_number, preloaded })
}

/// First bit plane of a pattern number, in the order G0 to G7, R0 to R7, B0 to B7. The pattern has as many planes as
/// its bit depth.
pub fn first_plane(bit_depth: u8, number: u8) -> Result<u8> {
    let last = depth_limits(bit_depth)?.last_number.min(23);
    if number > last {
        return Err(Error::value(
            format!("pattern number at {bit_depth} bit"),
            format!("0 to {last}"),
            number,
        ));
    }
    Ok(match bit_depth {
        5 => 1 + 6 * number,
        7 => 1 + 8 * number,
        depth => depth * number,
    })
}

/// Colour channel that holds the bit planes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Colour {
    /// Green: the first planes.
    Green = 0,
    /// Red.
    Red = 1,
    /// Blue.
    Blue = 2,
}

/// Where patterns come from.
#[derive(Debug, Clone, PartialEq)]
pub enum Source {
    /// The video input.
    Video {
        /// Frame rate of the input, Hz; all patterns of a frame must fit into one period.
        frame_rate_hz: f64,
    },
    /// Flash.
    Flash {
        /// Image numbers in the order of use: one for the first pattern and one for each pattern with `next_image`.
        images: Vec<u8>,
        /// Time to load an image, us: measured, or [`WORST_LOAD_US`].
        load_us: u32,
    },
}

/// How long patterns are shown.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Exposures {
    /// The same for all patterns.
    Fixed(Timing),
    /// One for each pattern; needs firmware 3.0 or newer.
    Each(Vec<Timing>),
}

/// A complete pattern sequence.
#[derive(Debug, Clone, PartialEq)]
pub struct Sequence {
    /// Where patterns come from.
    pub source: Source,
    /// What starts them.
    pub trigger_mode: TriggerMode,
    /// The patterns in order.
    pub patterns: Vec<LutEntry>,
    /// Their exposures.
    pub exposures: Exposures,
    /// Whether the sequence repeats.
    pub repeat: bool,
}

/// One colour channel of an image as a pattern.
pub fn channel(colour: Colour, bit_depth: u8, leds: u8) -> LutEntry {
    LutEntry {
        trigger: EntryTrigger::Internal,
        number: colour as u8,
        bit_depth,
        leds,
        invert: false,
        black_after: false,
        next_image: false,
        shares_exposure: false,
    }
}

/// A colour image: green, red and blue one after another, each with the LED of its colour.
pub fn colour_channels(bit_depth: u8) -> Vec<LutEntry> {
    let order = [(Colour::Green, GREEN), (Colour::Red, RED), (Colour::Blue, BLUE)];
    order.map(|(colour, led)| channel(colour, bit_depth, led)).to_vec()
}

impl Sequence {
    /// Show the patterns in every video frame. The first one starts with the frame, and the others follow it.
    pub fn from_video(mut patterns: Vec<LutEntry>, frame_rate_hz: f64, exposure_us: u32) -> Self {
        for (i, pattern) in patterns.iter_mut().enumerate() {
            pattern.trigger = if i == 0 { EntryTrigger::Rising } else { EntryTrigger::Continue };
            pattern.next_image = i == 0;
        }
        Self {
            source: Source::Video { frame_rate_hz },
            trigger_mode: TriggerMode::VideoSync,
            patterns,
            exposures: Exposures::Fixed(Timing { exposure_us, period_us: exposure_us }),
            repeat: true,
        }
    }

    /// Show the patterns of one flash image repeatedly.
    pub fn from_flash(image: u8, patterns: Vec<LutEntry>, exposure_us: u32) -> Self {
        Self {
            source: Source::Flash { images: vec![image], load_us: WORST_LOAD_US },
            trigger_mode: TriggerMode::Internal,
            patterns,
            exposures: Exposures::Fixed(Timing { exposure_us, period_us: exposure_us }),
            repeat: true,
        }
    }

    /// Exposure and period of pattern `i`, or the last ones if there are fewer.
    fn timing(&self, i: usize) -> Timing {
        match &self.exposures {
            Exposures::Fixed(timing) => *timing,
            Exposures::Each(timings) => timings[i.min(timings.len() - 1)],
        }
    }

    /// Control message of the pattern table, for fixed exposures.
    pub fn lut_control(&self) -> LutControl {
        let count = self.patterns.len() as u16;
        LutControl { entries: count, repeat: self.repeat, patterns: count, images: self.image_count() }
    }

    /// Control message of the variable table, for individual exposures.
    pub fn variable_control(&self) -> VariableControl {
        let count = self.patterns.len() as u16;
        VariableControl { entries: count, patterns: count, images: self.image_count(), repeat: self.repeat }
    }

    fn image_count(&self) -> u16 {
        match &self.source {
            Source::Video { .. } => 1,
            Source::Flash { images, .. } => images.len() as u16,
        }
    }

    /// Whether the patterns have individual exposures.
    pub fn variable(&self) -> bool {
        matches!(self.exposures, Exposures::Each(_))
    }

    /// Whether patterns come from the video input.
    pub fn from_the_video_input(&self) -> bool {
        matches!(self.source, Source::Video { .. })
    }
}

/// Exposure of each pattern, us, if `count` patterns of this bit depth share a frame. It is an error if they do not fit.
pub fn exposure_in_frame_us(count: usize, bit_depth: u8, frame_rate_hz: f64) -> Result<u32> {
    let least = depth_limits(bit_depth)?.min_exposure_us;
    check_frame_rate(frame_rate_hz)?;
    let share = (1e6 / frame_rate_hz / count.max(1) as f64) as u32;
    if share >= least {
        return Ok(share);
    }
    let name = format!("time in us for each of {count} patterns of {bit_depth} bit at {frame_rate_hz} Hz");
    Err(Error::value(name, format!("at least {least}; use fewer bits"), share))
}

fn check_frame_rate(frame_rate_hz: f64) -> Result<()> {
    if (1.0..=240.0).contains(&frame_rate_hz) {
        return Ok(());
    }
    Err(Error::value("frame rate in Hz", "1 to 240", frame_rate_hz))
}

#[cfg(test)]
mod tests;
