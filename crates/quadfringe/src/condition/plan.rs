//! Conditioning row by row, with tables and interpolated images prepared once per shot.

use super::linear::{Linear, row_of};
use super::mosaic::{self, Mosaic};
use super::params::CLIPPED;
use super::registered::Registered;
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

    /// Marks the pixels of a row that are not saturated in any channel, and the pixels with glare, which are saturated
    /// in both R and B. Fringes cannot do this, because R and B are a quarter period apart.
    #[inline(always)]
    pub fn saturation_row<T: Sample>(
        &self,
        shot: &Shot<'_, T>,
        y: usize,
        unsaturated: &mut [bool],
        glare: &mut [bool],
    ) {
        let limit = CLIPPED * shot.full_scale();
        match &shot.images {
            Images::Planes { colours: [red, green, blue], .. } => {
                let rows = [red, green, blue].map(|plane| row_of(plane, y));
                let [red, green, blue] = rows.each_ref().map(|row| &row[..unsaturated.len()]);
                for x in 0..unsaturated.len() {
                    let [red, green, blue] = [red, green, blue].map(|row| row[x].intensity() >= limit);
                    unsaturated[x] = !(red | green | blue);
                    glare[x] = red & blue;
                }
            }
            Images::Bayer { .. } => mosaic::saturation_row(shot, y, limit, unsaturated, glare),
        }
        match (&self.registered, shot.infrared()) {
            (_, None) => {}
            (Some(registered), Some(image)) => registered.saturation_row(image, y, limit, unsaturated),
            (None, Some(image)) => {
                let row = row_of(image, y);
                for (unsaturated, raw) in unsaturated.iter_mut().zip(row.iter()) {
                    *unsaturated &= raw.intensity() < limit;
                }
            }
        }
    }
}
