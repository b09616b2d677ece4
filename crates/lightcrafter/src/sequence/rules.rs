//! Rules of a sequence that can be checked without the projector.

use super::{Exposures, MAX_EXPOSURE_US, MIN_GAP_US, Sequence, Source, check_frame_rate, depth_limits};
use crate::command::{EntryTrigger, Timing, TriggerMode};
use crate::error::{Error, Result};

impl Sequence {
    /// Check every rule that does not need the projector. The error names the rule, the pattern and the limit.
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
        if let Exposures::Each(timings) = &self.exposures
            && timings.len() != count
        {
            return Err(Error::value(
                "exposures of a sequence",
                format!("{count}, one for each pattern"),
                timings.len(),
            ));
        }
        Ok(())
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
                let expected = "black after it or a shared exposure";
                return Err(Error::value(format!("pattern {i}"), expected, "both"));
            }
        }
        if self.patterns[0].trigger == EntryTrigger::Continue || self.patterns[0].shares_exposure {
            let expected = "a trigger that starts the sequence";
            return Err(Error::value("pattern 0", expected, "a continuation of the previous pattern"));
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

    /// Check patterns that share an exposure: each gets an equal part of it.
    fn check_exposure(&self, start: usize, group: usize) -> Result<()> {
        let mut least = 0;
        for pattern in &self.patterns[start..start + group] {
            least = least.max(depth_limits(pattern.bit_depth)?.min_exposure_us * group as u32);
        }
        let Timing { exposure_us, period_us } = self.timing(start);
        if !(least..=MAX_EXPOSURE_US).contains(&exposure_us) {
            let sharing = if group > 1 { format!(", shared by {group} patterns") } else { String::new() };
            let name = format!("exposure of pattern {start} in us{sharing}");
            return Err(Error::value(name, format!("{least} to {MAX_EXPOSURE_US}"), exposure_us));
        }
        if period_us != exposure_us && period_us < exposure_us.saturating_add(MIN_GAP_US) {
            let expected = format!("{exposure_us}, or at least {}", exposure_us + MIN_GAP_US);
            return Err(Error::value(format!("period of pattern {start} in us"), expected, period_us));
        }
        Ok(())
    }

    fn check_frames(&self, frame_rate_hz: f64) -> Result<()> {
        check_frame_rate(frame_rate_hz)?;
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
            let expected = format!(
                "{needed}: one for the first pattern and one for each pattern with next_image (at most {most})"
            );
            return Err(Error::value("flash images of the sequence", expected, images.len()));
        }
        // Two images fit into the two buffers. With more, each must be shown longer than the next one takes to load.
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
        let expected = format!("more than {load_us}, the time to load the next flash image");
        Err(Error::value(
            format!("time of the image that ends before pattern {end}, in us"),
            expected,
            shown_us,
        ))
    }
}
