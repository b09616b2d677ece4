//! Step 4: fringe orders.

/// Price of a change of surface, as the length in fringe periods of contradicting nodes that it equals. A length and not a number
/// of nodes, so that the size of the cells does not matter. Larger: narrow objects keep the order of the surface behind them
/// (with 2.5 the neck of the captured bottle, `python evaluation/captures_report.py`). Smaller: noise makes patches of wrong
/// orders (varied x0.7: wrong orders of the textured face 1 -> 121 ppm, promised ones four times as many).
pub const JUMP_PERIODS: f64 = 1.25;

/// Bounds of that price in nodes. Follows from the arithmetic: at 30 nodes a price is 9990, so four sweeps of at most `COST_MAX`
/// plus the price sum to less than 65,536.
pub const JUMP_NODES_MIN: f64 = 1.0;
/// See [`JUMP_NODES_MIN`].
pub const JUMP_NODES_MAX: f64 = 30.0;

/// Greatest cost of a node: the truncation. Both beats are 0.3 rad off, or the cosines 0.3 (root mean square). Larger: one wrong
/// beat outweighs more neighbours. Smaller: evidence of noisy nodes is lost. Varied: no effect on orders; x0.7 promises 20 % more
/// wrong orders (textured: 70 %), x1.4 a third less.
pub const COST_MAX: i16 = 333;

/// Cost of a squared difference of 1 between observed and predicted cosines, the mean over the pixels of a node. It makes cosines
/// count as much as beats that are as many rad off. Larger: noise of single pixels counts more. Varied: no effect on orders; the
/// promised wrong orders of the textured face move by a third.
pub const COSINE_UNIT: f32 = 2048.0;

/// Rows of pixels that give the cosines of a node. More: less noise of the costs, more time. Varied (3 and 6): no effect.
pub const SAMPLED_ROWS: usize = 4;

/// Weight of a lit pixel in the number of pixels of a node if it is saturated, so that a node of such pixels is lit without
/// evidence. Follows from the size of a cell (4 rows of 16), over which the sum of the weights must stay below 1.
pub const LIT_WEIGHT: f32 = 1.0 / 1024.0;

/// Limit of an observed cosine. Beyond 1 it is noise or glare. Not measured: 2 lets a deviation of a whole amplitude count, and
/// no more.
pub const OBSERVED_COSINE_MAX: f32 = 2.0;

/// Greatest squared difference of a cosine that counts against a candidate order of a pixel: beyond it the candidate is wrong
/// anyway. Varied: no effect, but 4 % more RMS near edges of dim steps at x1.4.
pub const PIXEL_COST_MAX: f32 = 1.0;

/// Absolute phases of neighbouring nodes nearer than this, in rad, propose the same order. Not measured: between the phase step
/// of a steep surface from cell to cell (2 pi / 3.4 = 1.8) and the least step between orders seen there (2 pi - 1.8 = 4.4).
pub const SAME_ORDER_RAD: f32 = 2.0;
