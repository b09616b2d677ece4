//! Step 8: the support of an order, which is the share of the neighbourhood whose evidence agrees with the orders
//! chosen there.

use crate::joint::cells::{CellMaps, Grid, RowMaps, TaskWork};
use crate::joint::orders::Orders;
use crate::joint::params::photometry::NEIGHBOURHOOD;
use crate::joint::scene::Scene;
use crate::parallel::slots::Slots;

/// Support on the cells, in [0, 1], with working maps.
#[derive(Debug, Default)]
pub(super) struct Support {
    support: CellMaps,
    agreement: CellMaps,
    sums: CellMaps,
    slots: Slots<TaskWork<()>>,
}

impl Support {
    /// Measures the support from the costs of the chosen orders.
    pub fn measure(&mut self, scene: &Scene<'_>, orders: &Orders) {
        let grid = scene.grid;
        let Self { support, agreement, sums, slots } = self;
        agreement.fill::<2>(grid, |row, [weight, agree]| {
            for ((weight, agree), node) in weight.iter_mut().zip(agree).zip(orders.verdicts(scene, row)) {
                (*weight, *agree) = if node.lit { (1.0, 1.0 - node.order_cost) } else { (0.0, 0.0) };
            }
        });
        let agreement = &*agreement;
        *support = CellMaps::new(1);
        grid.smooth::<2, ()>(
            scene.cells(NEIGHBOURHOOD),
            slots,
            sums,
            support,
            |row, k| Some(agreement.line(row, k)),
            |_, [weight, agree], out| {
                for (out, (weight, agree)) in out.iter_mut().zip(weight.iter().zip(agree)) {
                    *out = ((agree + 1e-6) / (weight + 1e-6)).clamp(0.0, 1.0);
                }
            },
        );
    }

    /// Support along row `y` of the image.
    pub fn row<'a>(&self, grid: &Grid, y: usize, maps: &'a mut RowMaps) -> &'a [f32] {
        let [row] = maps.sample(grid, &self.support, 0, y);
        row
    }
}
