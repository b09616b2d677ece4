//! Input of the steps of the joint method: four planes of light, the mask of usable pixels, and a grid of cells.

use super::cells::Grid;
use super::infrared::{PairPhase, wave};
use super::params::pyramid::MOSAIC_REACH_PX;
use crate::Reason;

/// A grid of cells over one level of the image pyramid.
#[derive(Clone, Copy)]
pub(super) struct ScaledGrid<'a> {
    pub grid: &'a Grid,
    /// Fringe period across the fringes, in pixels of this level.
    pub period_px: f64,
    /// Number of camera pixels along a side of a pixel of this level, which is a mean of camera pixels.
    pub factor: usize,
}

/// The grids of one shot on both levels of the image pyramid.
pub(super) struct Frame<'a> {
    pub full: ScaledGrid<'a>,
    pub coarse: ScaledGrid<'a>,
    /// Number of pixels by which interpolated light reaches into a shadow.
    pub reach_px: usize,
    /// Least modulation of R and B that counts as light, in linear light.
    pub modulation_min: f32,
}

impl<'a> Frame<'a> {
    /// `coarse` must have the cells of `full`, each with fewer pixels. The fringe period is in pixels of `full`.
    pub fn new([full, coarse]: [&'a Grid; 2], period_px: f64, modulation_min: f32, is_mosaic: bool) -> Self {
        let factor = full.step / coarse.step;
        Self {
            full: ScaledGrid { grid: full, period_px, factor: 1 },
            coarse: ScaledGrid { grid: coarse, period_px: period_px / factor as f64, factor },
            reach_px: if is_mosaic { MOSAIC_REACH_PX } else { 0 },
            modulation_min,
        }
    }

    /// [`Self::reach_px`] in pixels of the coarse level.
    pub fn coarse_reach_px(&self) -> usize {
        self.reach_px.div_ceil(self.coarse.factor)
    }
}

/// Four planes of linear light, row-major and padded, with a grid of cells over them.
#[derive(Clone, Copy)]
pub(super) struct Scene<'a> {
    /// R, G, B, IR.
    pub light: [&'a [f32]; 4],
    /// 1 for pixels that may take part in a fit, 0 for the others.
    pub usable: &'a [f32],
    pub grid: &'a Grid,
    /// Fringe period across the fringes in pixels.
    pub period_px: f64,
    /// Number of camera pixels along a side of a pixel, which is a mean of camera pixels.
    pub factor: usize,
    /// The infrared phase of a calibrated pair; `None` for coaxial projectors.
    pub pair: Option<&'a PairPhase>,
}

/// What is known about the pixels of a shot, in padded rows.
#[derive(Debug, Default)]
pub(super) struct Pixels {
    /// Absolute phase in rad.
    pub phase: Vec<f32>,
    /// Modulation of R and B in linear light, 0 where there is no light.
    pub modulation: Vec<f32>,
    /// Why steps 1, 6, 7 and 8 exclude a pixel, else [`Reason::Returned`].
    pub reasons: Vec<Reason>,
}

impl Pixels {
    pub fn map(&self) -> PhaseMap<'_> {
        PhaseMap { phase: &self.phase, modulation: &self.modulation }
    }
}

/// The phase of an image and where it is known, in padded rows.
#[derive(Clone, Copy)]
pub(super) struct PhaseMap<'a> {
    /// Phase of R and B in rad.
    pub phase: &'a [f32],
    /// Modulation of R and B in linear light; 0 where the pixel is not lit or does not take part.
    pub modulation: &'a [f32],
}

/// One padded row of a [`PhaseMap`], and which of its pixels may take part in a fit.
pub(super) struct PixelRow<'a> {
    pub phase: &'a [f32],
    pub modulation: &'a [f32],
    pub usable: &'a [f32],
}

/// Two planes of working memory, as large as the image; their content is lost.
pub(super) struct Scratch<'a> {
    pub first: &'a mut [f32],
    pub second: &'a mut [f32],
}

impl Scratch<'_> {
    /// Lends the planes to one step.
    pub fn lend(&mut self) -> Scratch<'_> {
        Scratch { first: &mut *self.first, second: &mut *self.second }
    }
}

impl<'a> Scene<'a> {
    /// Row `y` of a padded plane.
    pub fn row<'b, T>(&self, plane: &'b [T], y: usize) -> &'b [T] {
        &plane[y * self.grid.stride..][..self.grid.stride]
    }

    /// Row `y` of the four planes.
    pub fn rows(&self, y: usize) -> [&'a [f32]; 4] {
        self.light.map(|plane| self.row(plane, y))
    }

    /// Row `y` of a map over the scene.
    pub fn pixel_row<'b>(&'b self, map: PhaseMap<'b>, y: usize) -> PixelRow<'b> {
        PixelRow {
            phase: self.row(map.phase, y),
            modulation: self.row(map.modulation, y),
            usable: self.row(self.usable, y),
        }
    }

    /// The infrared phase at the pixel at `at`; `ratio` is that of coaxial projectors.
    #[inline(always)]
    pub fn infrared_phase(&self, at: usize, ratio: f32, phase: f32) -> f32 {
        match self.pair {
            None => ratio * phase,
            Some(pair) => wave(pair.at(at), phase).phase,
        }
    }

    /// Converts a width from fringe periods to cells.
    pub fn cells(&self, periods: f32) -> f32 {
        periods * self.period_px as f32 / self.grid.step as f32
    }
}
