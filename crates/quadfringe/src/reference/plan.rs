//! What is measured: the fringe numbers with their steps, and the options.

use super::params::{MODULATION_MIN, STEPS_MIN};
use crate::condition::{CLIPPED, Response};
use crate::encoding::{ChannelCode, Encoding, Projector};
use crate::error::{Error, Limit, Result};
use std::ops::Range;

/// The images of one fringe number: `steps` equal phase shifts over one period.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct StepSet {
    /// Number of fringes over the full projector width. It need not be an integer.
    pub fringe_number: f64,
    /// Number of images; step `s` shows `0.5 + 0.5 cos(Phi + 2 pi s / steps)`.
    pub steps: usize,
}

impl StepSet {
    /// `steps` images of `fringe_number` fringes. [`Reference::new`](super::Reference::new) checks the numbers.
    #[must_use]
    pub const fn new(fringe_number: f64, steps: usize) -> Self {
        Self { fringe_number, steps }
    }
}

/// The options of a reference measurement. This is the only place that defines their defaults.
///
/// ```
/// use quadfringe::reference::ReferenceOptions;
/// let options = ReferenceOptions::default().with_columns_px(200.0..700.0);
/// assert_eq!(options.modulation_min, 0.02);
/// ```
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct ReferenceOptions {
    /// Least modulation of every fringe number that counts as light, as a fraction of full scale. Default: 0.02.
    pub modulation_min: f32,
    /// Intensity from which a sample counts as saturated, as a fraction of full scale; such samples are left out of the fit.
    /// Default: 0.998, between the last two values of an 8-bit camera.
    pub saturation: f32,
    /// Inverse response of the camera. Default: linear. With `N` steps, harmonics of the fringes up to the order `N - 2` do
    /// not change the phase, so that few steps alone need a response.
    pub response: Response,
    /// Projector columns that the camera can see, if fewer than all. The fringe numbers need to distinguish these only.
    /// Default: all columns.
    pub columns_px: Option<Range<f64>>,
}

impl Default for ReferenceOptions {
    fn default() -> Self {
        Self {
            modulation_min: MODULATION_MIN,
            saturation: CLIPPED,
            response: Response::default(),
            columns_px: None,
        }
    }
}

impl ReferenceOptions {
    /// These options with this least modulation.
    #[must_use]
    pub const fn with_modulation_min(mut self, modulation_min: f32) -> Self {
        self.modulation_min = modulation_min;
        self
    }

    /// These options with this intensity of saturation.
    #[must_use]
    pub const fn with_saturation(mut self, saturation: f32) -> Self {
        self.saturation = saturation;
        self
    }

    /// These options with this inverse response of the camera.
    #[must_use]
    pub const fn with_response(mut self, response: Response) -> Self {
        self.response = response;
        self
    }

    /// These options for a camera that sees these projector columns only.
    #[must_use]
    pub const fn with_columns_px(mut self, columns_px: Range<f64>) -> Self {
        self.columns_px = Some(columns_px);
        self
    }

    fn check(&self, projector_width: usize) -> Result<()> {
        if !(0.0..1.0).contains(&self.modulation_min) {
            return Err(Error::value("modulation_min", Limit::Fraction, self.modulation_min));
        }
        if self.saturation.is_nan() || self.saturation <= 0.0 {
            return Err(Error::value("saturation", Limit::Positive, self.saturation));
        }
        self.response.check("response", "the camera")?;
        let width = projector_width as f64;
        match &self.columns_px {
            Some(columns)
                if !(0.0 <= columns.start && columns.start < columns.end && columns.end <= width) =>
            {
                let expected = format!("first and last column in ascending order, from 0 to {width}");
                Err(Error::value("columns_px", expected, format!("{} to {}", columns.start, columns.end)))
            }
            _ => Ok(()),
        }
    }
}

/// The fringe numbers and the range of columns, as the search takes them: in turns and in fractions of the projector width.
#[derive(Debug, Clone)]
pub(super) struct Code {
    pub sets: Vec<StepSet>,
    pub projector_width: usize,
    /// Place of the greatest fringe number, whose orders are searched.
    pub finest: usize,
    /// The columns that can be seen, as fractions of the width. The first column begins at `-0.5 / width`.
    pub window: Range<f32>,
}

impl Code {
    /// Checks everything once.
    ///
    /// # Errors
    /// As [`Reference::new`](super::Reference::new).
    pub fn new(sets: Vec<StepSet>, projector_width: usize, options: &ReferenceOptions) -> Result<Self> {
        for set in &sets {
            if set.steps < STEPS_MIN {
                let name = format!("steps of {} fringes", set.fringe_number);
                return Err(Error::value(name, Limit::AtLeast(STEPS_MIN as f64), set.steps));
            }
        }
        let channels: Vec<_> =
            sets.iter().map(|set| ChannelCode::new(set.fringe_number, 0.0, Projector::Visible)).collect();
        let whole = Encoding::new(channels, projector_width);
        match whole {
            Err(error @ Error::JointRange { .. }) if options.columns_px.is_none() => return Err(error),
            Err(error) if !matches!(error, Error::JointRange { .. }) => return Err(error),
            _ => options.check(projector_width)?,
        }
        let width = projector_width as f64;
        let columns = options.columns_px.clone().unwrap_or(0.0..width);
        check_distinct(&sets, width, &columns)?;
        let by_number = |a: &usize, b: &usize| sets[*a].fringe_number.total_cmp(&sets[*b].fringe_number);
        let finest = (0..sets.len()).max_by(by_number).unwrap_or(0);
        let window = ((columns.start - 0.5) / width) as f32..((columns.end - 0.5) / width) as f32;
        Ok(Self { sets, projector_width, finest, window })
    }
}

/// Refuses fringe numbers that repeat within the stated columns.
fn check_distinct(sets: &[StepSet], width: f64, columns: &Range<f64>) -> Result<()> {
    let span = (columns.end - columns.start).ceil().max(2.0);
    // The same fringes over a projector that has the stated columns only.
    let scaled = |set: &StepSet| ChannelCode::new(set.fringe_number * span / width, 0.0, Projector::Visible);
    let shorter: Vec<_> = sets.iter().map(scaled).collect();
    match Encoding::new(shorter, span as usize) {
        Err(Error::JointRange { second_px, .. }) => {
            let expected = format!("a range in which all columns differ, below {second_px:.1} columns");
            Err(Error::value("columns_px", expected, format!("{} to {}", columns.start, columns.end)))
        }
        _ => Ok(()),
    }
}
