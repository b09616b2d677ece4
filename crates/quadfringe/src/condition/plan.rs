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
    /// `conditioner` must have been checked.
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

    /// Prepare a shot before its rows are read: images that will be interpolated are linearised here.
    pub fn prepare<T: Sample>(&mut self, shot: &Shot<'_, T>) {
        self.linear.prepare::<T>(shot.full_scale());
        if let Some((raw, pattern)) = shot.mosaic() {
            self.mosaic.fill(&raw, pattern, &self.linear);
        }
        if let Some(registered) = &mut self.registered {
            registered.fill(shot.infrared(), &self.linear);
        }
    }

    /// One row of the shot as four rows of linear light.
    #[inline(always)]
    pub fn row<T: Sample>(&self, shot: &Shot<'_, T>, y: usize, out: &mut [&mut [f32]; 4]) {
        let [red, green, blue, infrared] = out;
        match &shot.images {
            Images::Planes(planes) => {
                for (c, out) in [red, green, blue].into_iter().enumerate() {
                    self.linear.row(c, &row_of(&planes[c], y), out);
                }
            }
            Images::Bayer { .. } => self.mosaic.row(y, [red, green, blue]),
        }
        match &self.registered {
            Some(registered) => registered.row(y, infrared),
            None => self.linear.row(3, &row_of(shot.infrared(), y), infrared),
        }
        if let Some(unmix) = &self.unmix {
            unmix.row(out);
        }
    }

    /// Fill gaps in a row of infrared light with the nearest pixel of its chip, for steps that use neighbours.
    pub fn continue_infrared(&self, y: usize, infrared: &mut [f32]) {
        if let Some(registered) = &self.registered {
            registered.continue_row(y, infrared);
        }
    }

    /// Mark the pixels of a row that are saturated in no channel, and those with glare: saturated in R and in B, whose
    /// fringes are a quarter period apart and never both at their crest.
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
            Images::Planes([red, green, blue, _]) => {
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
        match &self.registered {
            Some(registered) => registered.saturation_row(shot, y, limit, unsaturated),
            None => {
                let row = row_of(shot.infrared(), y);
                for (unsaturated, raw) in unsaturated.iter_mut().zip(row.iter()) {
                    *unsaturated &= raw.intensity() < limit;
                }
            }
        }
    }
}
