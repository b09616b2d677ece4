//! Step 9: uncertainty and wrong-order probability.

/// Error of the method on a smooth surface without noise, in rad. Larger: the error of a quiet camera is overstated.
/// With 3 % noise the number does not matter (`cargo test --test uncertainty`).
pub const METHOD_RAD: f32 = 1.5e-4;

/// Share of the mean squared correction by which the energy moves the phase of its start that counts as variance (U14). Larger: more
/// of the errors of relief and translucent light are inside. Smaller: fewer errors on prints are. `python evaluation/world.py --half
/// tune` at half and at twice the value: see docs/method/uncertainty.md.
pub const CORRECTION_LEFT: f32 = 0.05;
/// The same in a tile with more than one start, where the differences of the minima show a part of this error (U19). Larger: the
/// uncertainty on prints and patches is too large (`pytest tests/test_prints.py`). Smaller: that on cloth is too small. At half and at
/// twice the value: see docs/method/uncertainty.md.
pub const CORRECTION_LEFT_COMPARED: f32 = 0.01;
/// Share of the residuals beyond noise that counts as an error of the model, which neighbouring cells share (U14). Larger: the
/// uncertainty on photographs is too large. Smaller: that on real captures is too small. `python evaluation/world.py --half tune
/// --only photographs`; at half and at twice the value: see docs/method/uncertainty.md.
pub const EXCESS_LEFT: f32 = 0.5;
/// Number of times that the squares in (U18) are smoothed. More: fine relief lends its bias to its surroundings. Fewer: chance looks like
/// a bias (with two, 1 % more of the errors on a plane are inside one standard deviation).
/// `python evaluation/world.py --half tune --only plane cloth`.
pub const BIAS_PASSES: usize = 3;
/// What the mean square by noise alone does not exceed by more than its standard deviation (U18). Follows from the number of cells that
/// the passes average, 38: 1 + sqrt(2 / 38).
pub const BIAS_CHANCE: f32 = 1.23;
/// Side in cells of the blocks whose channels are compared (U17), whole vectors: about two fringes. Larger: materials that change over
/// a block are missed. Smaller: the errors of one fringe count. Not measured: a tile has five blocks along its side.
pub const BLOCK_CELLS: usize = 16;
/// Least number of blocks around one, itself included, that tell a mean from its scatter. Follows from the corner of a tile, which
/// has four.
pub const BLOCKS_MIN: usize = 4;

/// Worth of a lead relative to (U10). Larger: wrong orders have a smaller probability than their share. Smaller: right ones have a
/// greater one. With 1, as (U10) has it, pixels with a probability of 0.14 are wrong in 0.034 of all cases, and with 1.5 in 0.088
/// (`python evaluation/world.py --half tune`).
pub const EVIDENCE: f32 = 1.5;

/// Least temperature of a shot, in units of the greatest cost of a node. Follows from the costs: they are whole numbers up to
/// 333.
pub const TEMPERATURE_MIN: f32 = 1.0 / super::orders::COST_MAX as f32;

/// Least information of a cell in linear light squared. Not measured: any small number will do; it keeps cells without light finite.
pub const CELL_INFORMATION_MIN: f32 = 1e-9;

/// Greatest exponent of a probability. Follows from the arithmetic: `f32` overflows beyond exp(88.7), and
/// exp(-80) is 2e-35.
pub const EXPONENT_MAX: f32 = 80.0;

/// Least probability of a pixel whose order its region settles: the observed share of wrong orders, 0.0021 on the half `tune` of
/// `python evaluation/world.py`. Half and twice the value are half and twice what these pixels state.
pub const SETTLED_PROBABILITY_MIN: f32 = 0.0025;
/// The same for pixels that were added by region growing, because some of them belong to another surface: observed 0.018 on the half
/// `tune` of `python evaluation/world.py`.
pub const GROWN_PROBABILITY_MIN: f32 = 0.02;
