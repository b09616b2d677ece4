//! Input of the choice of orders.

use crate::joint::cells::RowMaps;
use crate::joint::local_fit::LocalFit;
use crate::joint::model::{CellFringes, FringeRows};
use crate::joint::photometry::Photometry;
use crate::joint::scene::{PhaseMap, Scene};
use crate::joint::slopes::Slopes;

/// A wrapped phase, and the sources of offsets, amplitudes and beats.
#[derive(Clone, Copy)]
pub(in crate::joint) struct Wrapped<'a> {
    /// Wrapped phase of R and B.
    pub map: PhaseMap<'a>,
    pub fit: &'a LocalFit,
    /// Source of offsets and amplitudes; `None` before the first choice of orders, when they come from the local fit.
    pub photometry: Option<&'a Photometry>,
    pub slopes: &'a Slopes,
}

impl Wrapped<'_> {
    /// Offsets and amplitudes along row `y`.
    pub(super) fn fringes<'b>(
        &self,
        scene: &Scene<'_>,
        y: usize,
        maps: &'b mut [RowMaps; 2],
    ) -> FringeRows<'b> {
        match self.photometry {
            None => self.fit.fringes(scene, y, maps),
            Some(photometry) => photometry.sample(scene, y, &mut maps[0]),
        }
    }

    /// Offsets and amplitudes in one cell.
    pub(super) fn cell(&self, row: usize, column: usize) -> CellFringes {
        match self.photometry {
            None => self.fit.cell(row, column),
            Some(photometry) => photometry.cell(row, column),
        }
    }
}
