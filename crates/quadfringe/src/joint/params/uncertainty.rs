//! Step 9: uncertainty and wrong-order probability.

/// Variance of a phase step divided by `noise^2 / J`, on the safe side. The albedo of a pixel is a mean of nine pixels with the
/// weights 1 2 1 in both directions. A free albedo would take the share `x = (a^2 + b^2 / 4) / (4 a^2 + 2 b^2)` of the
/// information of four channels, from 0.21 for full contrast to 0.25 for none. Relative to an information of `1 - x`, the
/// variance is greater by the factor 1.17 to 1.21. `J` leaves out only `x / 4` (`ALBEDO_SHARE`), for which the factor is 0.97, so
/// the stated deviation is larger than the noise of a smooth surface (U5). Checked by `cargo test --test uncertainty --
/// --nocapture`. Varied: errors inside one standard deviation 0.76 -> 0.69 (x0.7) and 0.82 (x1.4) on peaks.
pub const ALBEDO_LOSS: f32 = 1.18;

/// Error of the method on a smooth surface without noise, in rad. Varied: with 3e-4 the plane with 1 % noise has 0.80 of its
/// errors inside one standard deviation instead of 0.76; with 3 % noise the number does not matter (`cargo test --test uncertainty`).
pub const METHOD_RAD: f32 = 1.5e-4;

/// Share of the disagreement of the channels, a variance, that the energy leaves. The disagreement is that of the photometry of
/// windows. Smaller: errors on real captures are larger than stated. Larger: errors on prints are far smaller than stated (`pytest
/// tests/test_prints.py`, `python evaluation/captures_report.py`).
pub const DISAGREEMENT_LEFT: f32 = 0.5;

/// Least temperature of a shot, in units of the greatest cost of a node. Follows from the costs: they are whole numbers up to
/// 333.
pub const TEMPERATURE_MIN: f32 = 1.0 / super::orders::COST_MAX as f32;

/// Least information of a window in linear light squared. It bounds the quotient of noise and information where a window
/// contains no light. Not measured: such pixels are not valid.
pub const INFORMATION_MIN: f32 = 1e-12;

/// Greatest exponent of a wrong-order probability. Follows from the arithmetic: `f32` overflows beyond exp(88.7), and
/// exp(-80) is 2e-35.
pub const EXPONENT_MAX: f32 = 80.0;

/// Width (sigma) in fringe periods of the windows from which each pair of channels gets a phase. Larger: less noise, but
/// blurred near edges. Varied: 0.79 and 0.74 of the errors of peaks inside one standard deviation instead of 0.76.
pub const PAIR_WINDOW: f32 = 0.125;
/// Width (sigma) in fringe periods of the neighbourhood over which the squared differences between the pairs are averaged.
/// Larger: local errors are missed. Smaller: the uncertainty becomes noisy. Varied: 0.69 -> 0.70 (face) and 0.94 -> 0.91
/// (textured face) inside one standard deviation at x0.7; x1.4 no effect.
pub const PAIR_NEIGHBOURHOOD: f32 = 0.4;
/// Number of pixel rows that are sampled for each row of cells. Fewer: noise counts as disagreement. Varied: 0.76 -> 0.77 (1
/// row) and 0.75 (3 rows) of the errors of peaks inside one standard deviation.
pub const PAIR_SAMPLED_ROWS: usize = 2;
/// Least share of the information that a pair must have. With less, a pair does not determine a phase. Varied: no effect.
pub const PAIR_SHARE_MIN: f32 = 0.02;
/// Greatest squared difference of the pairs beyond noise, in rad^2. Not measured: beyond 1 rad the linearisation has no meaning.
pub const PAIR_EXCESS_MAX_RAD2: f32 = 1.0;

/// A pixel is doubtful if its wrong-order probability exceeds this. Varied x1.4: the promised wrong orders of peaks rise from
/// 48 to 59 ppm.
pub const DOUBTFUL: f32 = 0.01;
/// A doubtful pixel may take its probability from a pixel up to this number of cells away, which is the reach of windows
/// across a discontinuity. Varied (2 and 4): no effect.
pub const PROPAGATION_CELLS: usize = 3;
/// Least probability of a pixel whose order its component settles. It is a bound, about twice the observed share on the
/// captures (`pytest tests/test_captures.py`). Varied: promised wrong orders of peaks 48 -> 38 and 61 ppm, 0 observed.
pub const SETTLED_PROBABILITY_MIN: f32 = 0.005;
/// This bound for pixels that were added by region growing, because some of them belong to another surface. Varied: promised
/// wrong orders of steps 1358 -> 1140 and 1594 ppm, 20 observed.
pub const GROWN_PROBABILITY_MIN: f32 = 0.1;
