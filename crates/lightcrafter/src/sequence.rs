//! A pattern sequence as a whole: what is shown, for how long, started by what; and the rules it must keep.

use crate::command::{EntryTrigger, LutControl, LutEntry, Timing, TriggerMode, VariableControl};
use crate::error::{Error, Result};

/// Columns of the mirror array.
pub const WIDTH_PX: usize = 912;
/// Rows of the mirror array.
pub const HEIGHT_PX: usize = 1140;
/// The longest exposure, us.
pub const MAX_EXPOSURE_US: u32 = 200_000_000;
/// The shortest black between two patterns, us.
pub const MIN_GAP_US: u32 = 230;
/// The time that loading a flash image may take, us, when it has not been measured.
pub const WORST_LOAD_US: u32 = 200_000;

/// The LED selection red of [`LutEntry::leds`].
pub const RED: u8 = 1;
/// The LED selection green.
pub const GREEN: u8 = 2;
/// The LED selection blue.
pub const BLUE: u8 = 4;

/// What a bit depth allows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DepthLimits {
    /// The shortest exposure, us.
    pub min_exposure_us: u32,
    /// The highest pattern number; at 1 bit, 24 is a pattern without planes: black, and white when inverted.
    pub last_number: u8,
    /// Patterns that fit into the two buffers of flash images, and so need no loading.
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

/// The bit planes of a pattern number, in the order G0 to G7, R0 to R7, B0 to B7, as first plane; as many as the bit
/// depth follow.
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

/// Where the bit planes come from.
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
        /// Frames per second of the input; all patterns of a frame must fit into it.
        frame_rate_hz: f64,
    },
    /// Flash.
    Flash {
        /// Image numbers in the order of use: one for the first pattern, one for each that takes the next image.
        images: Vec<u8>,
        /// How long an image takes to load, us: [`WORST_LOAD_US`] unless measured.
        load_us: u32,
    },
}

/// How long patterns are shown.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Exposures {
    /// All alike.
    Fixed(Timing),
    /// One for each pattern; firmware 3.0 or newer.
    Each(Vec<Timing>),
}

/// Everything that a projector must know before it starts.
#[derive(Debug, Clone, PartialEq)]
pub struct Sequence {
    /// Where patterns come from.
    pub source: Source,
    /// What starts them.
    pub trigger_mode: TriggerMode,
    /// The patterns in order.
    pub patterns: Vec<LutEntry>,
    /// Their times.
    pub exposures: Exposures,
    /// Again and again, or once.
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

/// Green, red and blue one after another, each with its own LED: a colour image.
pub fn colour_channels(bit_depth: u8) -> Vec<LutEntry> {
    let order = [(Colour::Green, GREEN), (Colour::Red, RED), (Colour::Blue, BLUE)];
    order.map(|(colour, led)| channel(colour, bit_depth, led)).to_vec()
}

impl Sequence {
    /// Patterns of every video frame, again and again; the first waits for the frame, the others follow.
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

    /// Patterns of one flash image, again and again.
    pub fn from_flash(image: u8, patterns: Vec<LutEntry>, exposure_us: u32) -> Self {
        Self {
            source: Source::Flash { images: vec![image], load_us: WORST_LOAD_US },
            trigger_mode: TriggerMode::Internal,
            patterns,
            exposures: Exposures::Fixed(Timing { exposure_us, period_us: exposure_us }),
            repeat: true,
        }
    }

    /// Times of pattern `i`; the last ones given when there are fewer.
    fn timing(&self, i: usize) -> Timing {
        match &self.exposures {
            Exposures::Fixed(timing) => *timing,
            Exposures::Each(timings) => timings[i.min(timings.len() - 1)],
        }
    }

    /// The control of the pattern table, for fixed exposures.
    pub fn lut_control(&self) -> LutControl {
        let count = self.patterns.len() as u16;
        LutControl { entries: count, repeat: self.repeat, patterns: count, images: self.image_count() }
    }

    /// The control of the variable table, for an exposure each.
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

    /// Check every rule that can be known without the projector; the error names the rule, the pattern and the limit.
    pub fn check(&self) -> Result<()> {
        self.check_sizes()?;
        self.check_trigger_mode()?;
        self.check_patterns()?;
        self.check_exposures()?;
        match &self.source {
            Source::Video { frame_rate_hz } => self.check_frames(*frame_rate_hz),
            Source::Flash { images, load_us } => self.check_images(images, *load_us),
        }
    }

    fn check_sizes(&self) -> Result<()> {
        let most = if self.variable() { 1824 } else { 128 };
        let count = self.patterns.len();
        if count == 0 || count > most {
            return Err(Error::value("patterns of a sequence", format!("1 to {most}"), count));
        }
        if let Exposures::Each(timings) = &self.exposures {
            if timings.len() != count {
                return Err(Error::value(
                    "exposures of a sequence",
                    format!("{count}, one each"),
                    timings.len(),
                ));
            }
        }
        Ok(())
    }

    /// Whether each pattern has its own exposure.
    pub fn variable(&self) -> bool {
        matches!(self.exposures, Exposures::Each(_))
    }

    /// Whether patterns come from the video input.
    pub fn from_the_video_input(&self) -> bool {
        matches!(self.source, Source::Video { .. })
    }

    fn check_trigger_mode(&self) -> Result<()> {
        use TriggerMode::{Alternate, Internal, VariableInternal, VariableVideoSync, VideoSync};
        let allowed: &[TriggerMode] = match (self.from_the_video_input(), self.variable()) {
            (true, false) => &[VideoSync],
            (false, false) => &[Internal, Alternate],
            (true, true) => &[VariableVideoSync],
            (false, true) => &[VariableInternal],
        };
        if allowed.contains(&self.trigger_mode) {
            return Ok(());
        }
        let name = "trigger mode for this source and these exposures";
        Err(Error::value(name, format!("one of {allowed:?}"), format!("{:?}", self.trigger_mode)))
    }

    fn check_patterns(&self) -> Result<()> {
        for (i, pattern) in self.patterns.iter().enumerate() {
            let last = depth_limits(pattern.bit_depth)?.last_number;
            let name = format!("number of pattern {i} at {} bit", pattern.bit_depth);
            if pattern.number > last {
                return Err(Error::value(name, format!("0 to {last}"), pattern.number));
            }
            if pattern.leds > 7 {
                return Err(Error::value(format!("LED selection of pattern {i}"), "0 to 7", pattern.leds));
            }
            if pattern.black_after && pattern.shares_exposure {
                let expected = "black after it or a shared exposure, not both";
                return Err(Error::value(format!("pattern {i}"), expected, "both"));
            }
        }
        if self.patterns[0].trigger == EntryTrigger::Continue || self.patterns[0].shares_exposure {
            let expected = "a trigger of its own";
            return Err(Error::value("pattern 0", expected, "a continuation of the pattern before"));
        }
        Ok(())
    }

    fn check_exposures(&self) -> Result<()> {
        let mut start = 0;
        while start < self.patterns.len() {
            let shared =
                self.patterns[start + 1..].iter().take_while(|pattern| pattern.shares_exposure).count();
            self.check_exposure(start, shared + 1)?;
            start += shared + 1;
        }
        Ok(())
    }

    /// Patterns that share an exposure divide it among themselves.
    fn check_exposure(&self, start: usize, group: usize) -> Result<()> {
        let mut least = 0;
        for pattern in &self.patterns[start..start + group] {
            least = least.max(depth_limits(pattern.bit_depth)?.min_exposure_us * group as u32);
        }
        let Timing { exposure_us, period_us } = self.timing(start);
        if !(least..=MAX_EXPOSURE_US).contains(&exposure_us) {
            let name = format!("exposure of pattern {start} in us ({group} share it)");
            return Err(Error::value(name, format!("{least} to {MAX_EXPOSURE_US}"), exposure_us));
        }
        if period_us != exposure_us && period_us < exposure_us.saturating_add(MIN_GAP_US) {
            let expected = format!("{exposure_us}, or {} and more", exposure_us + MIN_GAP_US);
            return Err(Error::value(format!("period of pattern {start} in us"), expected, period_us));
        }
        Ok(())
    }

    fn check_frames(&self, frame_rate_hz: f64) -> Result<()> {
        if !(1.0..=240.0).contains(&frame_rate_hz) {
            return Err(Error::value("frame rate in Hz", "1 to 240", frame_rate_hz));
        }
        let frame_us = (1e6 / frame_rate_hz) as u64;
        let mut used_us = 0;
        for (i, pattern) in self.patterns.iter().enumerate() {
            let Timing { exposure_us, period_us } = self.timing(i);
            if exposure_us != period_us {
                let expected = format!("{exposure_us}, the exposure, when patterns come from video");
                return Err(Error::value(format!("period of pattern {i} in us"), expected, period_us));
            }
            used_us = match pattern.trigger {
                EntryTrigger::Rising => u64::from(exposure_us),
                EntryTrigger::Continue if pattern.shares_exposure => used_us,
                EntryTrigger::Continue => used_us + u64::from(exposure_us),
                other => {
                    let name = format!("trigger of pattern {i} from video");
                    return Err(Error::value(name, "Rising or Continue", format!("{other:?}")));
                }
            };
            if used_us > frame_us {
                let expected = format!("at most {frame_us}, one frame at {frame_rate_hz} Hz");
                return Err(Error::value(format!("time up to pattern {i} in us"), expected, used_us));
            }
        }
        Ok(())
    }

    fn check_images(&self, images: &[u8], load_us: u32) -> Result<()> {
        let most = if self.variable() { 256 } else { 64 };
        let needed = 1 + self.patterns[1..].iter().filter(|pattern| pattern.next_image).count();
        if images.len() != needed || needed > most {
            let expected =
                format!("{needed}: one, and one for each pattern that takes the next (at most {most})");
            return Err(Error::value("flash images of the sequence", expected, images.len()));
        }
        // Two buffers hold two images; with more, each must be shown for longer than the next takes to load.
        if needed <= 2 {
            return Ok(());
        }
        let mut shown_us = 0_u64;
        for (i, pattern) in self.patterns.iter().enumerate() {
            if i > 0 && pattern.next_image {
                self.check_load(i, shown_us, load_us)?;
                shown_us = 0;
            }
            shown_us += if pattern.shares_exposure { 0 } else { u64::from(self.timing(i).period_us) };
        }
        self.check_load(self.patterns.len(), shown_us, load_us)
    }

    fn check_load(&self, end: usize, shown_us: u64, load_us: u32) -> Result<()> {
        if shown_us > u64::from(load_us) {
            return Ok(());
        }
        let expected = format!("more than {load_us}, in which the next flash image is loaded");
        Err(Error::value(
            format!("time of the image that ends before pattern {end}, in us"),
            expected,
            shown_us,
        ))
    }
}

/// The exposure of each pattern, us, when `count` patterns of this bit depth share a frame; an error when they do not fit.
pub fn exposure_in_frame_us(count: usize, bit_depth: u8, frame_rate_hz: f64) -> Result<u32> {
    let least = depth_limits(bit_depth)?.min_exposure_us;
    let share = (1e6 / frame_rate_hz / count.max(1) as f64) as u32;
    if share >= least {
        return Ok(share);
    }
    let name = format!("time in us for each of {count} patterns of {bit_depth} bit at {frame_rate_hz} Hz");
    Err(Error::value(name, format!("at least {least}; take fewer bits"), share))
}

#[cfg(test)]
mod tests;
