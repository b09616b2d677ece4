//! Step 4: fringe orders.

/// Jump price: a change of surface costs as much as contradicting nodes over this length, in fringe periods. It is a length and
/// not a number of nodes, so that the size of the cells does not matter. Larger: narrow objects keep the order of the surface
/// behind them (with 2.5 the neck of the captured bottle, `python evaluation/captures_report.py`). Smaller: noise makes patches
/// of wrong orders (varied x0.7: wrong orders of the textured face 1 -> 121 ppm, promised ones four times as many).
pub const JUMP_PERIODS: f64 = 1.25;

/// Bounds of the jump price in nodes. Follows from the arithmetic: at 30 nodes a price is 9990, so four sweeps of at most
/// `COST_MAX` plus the price sum to less than 65,536.
pub const JUMP_NODES_MIN: f64 = 1.0;
/// Follows from the arithmetic, as [`JUMP_NODES_MIN`].
pub const JUMP_NODES_MAX: f64 = 30.0;

/// Greatest cost of a node, at which costs are truncated. It is reached if both beats are wrong by 0.3 rad, or the cosines by 0.3
/// (root mean square). Larger: one wrong beat outweighs more neighbours. Smaller: evidence of noisy nodes is lost. Varied: no
/// effect on orders; x0.7 promises 20 % more wrong orders (textured: 70 %), x1.4 a third less.
pub const COST_MAX: i16 = 333;

/// A weight of 1 of a beat, as a whole number. Follows from the arithmetic: a squared beat is at most 1008, and its product with the
/// weight must stay below 32,768.
pub const WEIGHT_ONE: i16 = 16;

/// Cost of a squared difference of 1 between observed and predicted cosines, the mean over the pixels of a node. With it an error
/// of the cosines costs about as much as an equal error of the beats in rad. Larger: noise of single pixels counts more. Varied:
/// no effect on orders; the promised wrong orders of the textured face move by a third.
pub const COSINE_UNIT: f32 = 2048.0;

/// The same without infrared, where the cosines of G decide alone. Larger: where coloured patches meet, the wrong albedo that R and B
/// give speaks for a wrong order as loudly as the beat against it. Smaller: the sharpness of the cosines is lost. Varied, with 16
/// and 15 fringes: wrong orders of patches of 20 mm on peaks 0 -> 677 (x1.4) and 3100 ppm (x2); of white steps and faces none
/// (`python evaluation/rgb.py`).
pub const COSINE_UNIT_WITHOUT_INFRARED: f32 = 1024.0;

/// Weight with which a saturated lit pixel enters the number of pixels of a node, so that a node with only such pixels
/// counts as lit but has no evidence. Follows from the size of a cell (4 rows of 16 pixels), over which the sum of these
/// weights must stay below 1.
pub const LIT_WEIGHT: f32 = 1.0 / 1024.0;

/// Greatest magnitude of an observed cosine. Values beyond 1 come from noise or glare. Not measured: with 2 a deviation of up to a
/// whole amplitude counts. 1 (with a greatest cost of 4): painted face +8 % (`python evaluation/world.py --half tune`).
pub const OBSERVED_COSINE_MAX: f32 = 2.0;

/// Limit for the squared difference of a cosine that counts against a candidate order of a pixel: beyond it the candidate is
/// wrong anyway. Varied: no effect, but 4 % more RMS near edges of dim steps at x1.4.
pub const PIXEL_COST_MAX: f32 = 1.0;

/// Weight of the albedo of the surroundings where R alone shows that of a pixel, relative to the squared offset of R. Larger: a
/// pixel on a print has the albedo of its surroundings. Smaller: that of a pixel in a dark fringe of R is noise. Not measured: from
/// 0.05 to 0.2 it counts where R is dark alone.
pub const ALBEDO_KNOWN: f32 = 0.1;
