//! Conditioning row by row, with tables and interpolated images prepared once per shot.

use super::linear::{Linear, row_of};
use super::mosaic::{self, Mosaic};
use super::params::CLIPPED;
use super::registered::Registered;
use super::saturated::Saturated;
use super::shot::Images;
use super::unmix::Unmix;
use super::{Conditioner, Sample, Shot};
use crate::Result;

/// A conditioner prepared for shots of one kind.
#[derive(Debug, Clone)]
pub(crate) struct Plan {
    linear: Linear,
    unmix: Option<Unmix>,
    registered: Option<Registered>,
    mosaic: Mosaic,
}

impl Plan {
    /// Prepares a conditioner that has been checked.
    pub fn new(conditioner: &Conditioner) -> Result<Self> {
        let identity = Conditioner::default();
        let mixed = conditioner.crosstalk != identity.crosstalk;
        Ok(Self {
            linear: Linear::new(conditioner, mixed),
            unmix: mixed.then(|| Unmix::new(conditioner)).transpose()?,
            registered: (conditioner.ir_registration != identity.ir_registration)
                .then(|| Registered::new(conditioner.ir_registration)),
            mosaic: Mosaic::default(),
        })
    }

    /// Prepares a shot before its rows are read. Images that must be interpolated are linearised here.
    pub fn prepare<T: Sample>(&mut self, shot: &Shot<'_, T>) {
        self.linear.prepare::<T>(shot.full_scale());
        if let Some((raw, pattern)) = shot.mosaic() {
            self.mosaic.fill(&raw, pattern, &self.linear);
        }
        if let (Some(registered), Some(infrared)) = (&mut self.registered, shot.infrared()) {
            registered.fill(infrared, &self.linear);
        }
    }

    /// Converts one row of the shot to four rows of linear light. IR is 0 without an infrared image.
    #[inline(always)]
    pub fn row<T: Sample>(&self, shot: &Shot<'_, T>, y: usize, out: &mut [&mut [f32]; 4]) {
        let [red, green, blue, infrared] = out;
        match &shot.images {
            Images::Planes { colours, .. } => {
                for (c, out) in [red, green, blue].into_iter().enumerate() {
                    self.linear.row(c, &row_of(&colours[c], y), out);
                }
            }
            Images::Bayer { .. } => self.mosaic.row(y, [red, green, blue]),
        }
        match (&self.registered, shot.infrared()) {
            (_, None) => infrared.fill(0.0),
            (Some(registered), _) => registered.row(y, infrared),
            (None, Some(image)) => self.linear.row(3, &row_of(image, y), infrared),
        }
        if let Some(unmix) = &self.unmix {
            unmix.row(out);
        }
    }

    /// Fills gaps in a row of infrared light with the nearest pixel of the infrared chip, for steps that use
    /// neighbouring pixels.
    pub fn continue_infrared(&self, y: usize, infrared: &mut [f32]) {
        if let Some(registered) = &self.registered {
            registered.continue_row(y, infrared);
        }
    }

    /// Writes which channels of the pixels of a row are saturated.
    #[inline(always)]
    pub fn saturated_row<T: Sample>(&self, shot: &Shot<'_, T>, y: usize, out: &mut [Saturated]) {
        let limit = CLIPPED * shot.full_scale();
        match &shot.images {
            Images::Planes { colours, .. } => {
                let rows = colours.each_ref().map(|plane| row_of(plane, y));
                let [red, green, blue] = rows.each_ref().map(|row| &row[..out.len()]);
                for (x, out) in out.iter_mut().enumerate() {
                    let [red, green, blue] = [red, green, blue].map(|row| row[x].intensity() >= limit);
                    *out = Saturated::new([red, green, blue, false]);
                }
            }
            Images::Bayer { .. } => mosaic::saturated_row(shot, y, limit, out),
        }
        match (&self.registered, shot.infrared()) {
            (_, None) => {}
            (Some(registered), Some(image)) => registered.saturated_row(image, y, limit, out),
            (None, Some(image)) => {
                let row = row_of(image, y);
                for (out, raw) in out.iter_mut().zip(row.iter()) {
                    *out |= Saturated::new([false, false, false, raw.intensity() >= limit]);
                }
            }
        }
    }
}
