//! Step 6: the energy of phase, albedo and contrast.
//!
//! Chosen on one seed of the half `tune` of `python evaluation/world.py` and on the captures (`python evaluation/captures_report.py`).
//! What half and twice of each change is in docs/method/sensitivity.md.

/// Side of a tile in cells, whole vectors. Larger: scales average over more of the surface. Smaller: more cells are computed twice.
/// `python benches/bench_decode.py` (an image of 1024 x 768 with cells of 4 px has twelve tiles, 1.6 times its cells; tiles of 64
/// have 1.7 times).
pub const SIDE: usize = 80;
/// Number of cells at each side of a tile that are discarded, because their neighbours are missing. Fewer: seams. More: time.
/// `python evaluation/sensitivity.py --only energy::DISCARDED`.
pub const DISCARDED: usize = 4;
/// Number of cells at each side over which tiles are blended. Fewer: seams where the scales of two tiles differ. More: time.
/// `python evaluation/sensitivity.py --only energy::BLENDED`.
pub const BLENDED: usize = 8;

/// Least number of cells in a fringe period, for cells of more than 2 px. Larger: time. Smaller: detail is lost (with 4.5 the
/// bottle has cells of 4 px and a phase RMS 4 % larger, `python evaluation/captures_report.py`).
pub const CELLS_PER_PERIOD_MIN: f64 = 5.1;
/// Least number of cells in a fringe period, for cells of 2 px. Follows from the mean of a cosine over a cell, which keeps 90 % of
/// its contrast with 4; cells of 1 px take four times as long.
pub const SMALL_CELLS_PER_PERIOD_MIN: f64 = 4.0;
/// Greatest side of a cell in pixels. Larger: detail is lost. Smaller: time, which grows with the number of cells.
/// `python evaluation/sensitivity.py --only energy::CELL_MAX_PX`.
pub const CELL_MAX_PX: usize = 4;
/// Greatest difference of the phase between the pixels of a cell, in rad for each pixel of its side. Larger: cells on two surfaces
/// take part. Smaller: steep slopes are left out.
/// `python evaluation/sensitivity.py --only energy::SPREAD_MAX_RAD`.
pub const SPREAD_MAX_RAD: f32 = 0.5;
/// Greatest width of a gap of the surface in cells that takes part without light, about half a fringe. Larger: surfaces on both sides
/// of a shadow bend each other. Smaller: narrow pieces of a surface between dark print are free. `python evaluation/sensitivity.py --only energy::GAP_MAX_CELLS`.
pub const GAP_MAX_CELLS: usize = 4;
/// Least share of usable pixels of a cell that takes part. Larger: noise that saturates single pixels removes cells. Smaller: cells
/// are biased by the pixels that are left out.
/// `python evaluation/sensitivity.py --only energy::USABLE_MIN`.
pub const USABLE_MIN: f32 = 0.7;

/// Degrees of freedom of Student's t for second differences of the phase. Larger: steps are smoothed. Smaller: noise stays.
/// `python evaluation/sensitivity.py --only energy::BEND_FREEDOM`.
pub const BEND_FREEDOM: f32 = 2.0;
/// The same for first differences of brightness, colour and contrast. Larger: edges of the texture are smoothed.
/// `python evaluation/sensitivity.py --only energy::DIFFERENCE_FREEDOM`.
pub const DIFFERENCE_FREEDOM: f32 = 1.0;

/// Standard deviations with which the estimate of the priors starts: second differences of the phase in rad, and first differences
/// of the logarithms of brightness, colour and contrast. The estimate forgets them after a few steps, but for the first, from which
/// the surface loosens (J43). Larger: the surface keeps more of the errors of its start. Smaller: time.
/// `python evaluation/sensitivity.py --only energy::START`.
pub const START: [f32; 4] = [0.002, 0.04, 0.015, 0.02];
/// Growth of the greatest standard deviation of the second differences from one step to the next (J43). Larger: the surface keeps
/// more of the errors of its start. Smaller: time; at 1 it stays stiff. `python evaluation/sensitivity.py --only BEND_GROWTH`.
pub const BEND_GROWTH: f32 = 2.0;
/// Exponent of the change of a scale from one step to the next (successive over-relaxation of a fixed point). Larger: the scales
/// overshoot, from about 2 on for good. Smaller: they are far from their end when the steps are used up (1, even with ten steps, leaves
/// 0.50 in place of 0.57 of the height of waves of 16 px). `python evaluation/world.py --half tune --only resolution`.
pub const RELAXATION: f32 = 1.5;
/// Weight of these in the estimate, as a number of cells. It keeps the estimate of a tile with few lit cells finite.
/// `python evaluation/sensitivity.py --only energy::PRIOR_CELLS`.
pub const PRIOR_CELLS: f32 = 0.1;
/// Bounds of the standard deviations, in the same units. They keep the weights within the range of `f32`; at the lower one the surface of
/// the second and the third start begins to loosen (J43). `python evaluation/sensitivity.py --only energy::SCALE_LIMITS`.
pub const SCALE_LIMITS: [f32; 2] = [0.0005, 1.0];
/// Least share of the unknowns that counts as determined by the data. Without it, the scale of a tile without structure is the
/// quotient of two small numbers.
/// `python evaluation/sensitivity.py --only energy::DETERMINED_MIN`.
pub const DETERMINED_MIN: f32 = 0.02;

/// Error of the model as a share of the albedo: response, crosstalk and registration are never known exactly. Larger: less noise,
/// and ripples of an error of the model are smoothed, but fine relief too. Smaller: finer relief.
/// `python evaluation/world.py --half tune`, `python evaluation/captures_report.py`.
pub const MODEL_SHARE: f32 = 0.0125;

/// Number of rounds of contrast and albedo before the first step. More: time.
/// `python evaluation/sensitivity.py --only energy::START_ROUNDS`.
pub const START_ROUNDS: usize = 2;
/// Bounds of the contrast of the light in these rounds. Light has no more than full contrast, with a margin for noise.
/// Follows from the model.
pub const CONTRAST_START_LIMITS: [f32; 2] = [0.1, 1.05];
/// Bounds of the albedo in these rounds, in linear light. They keep the logarithm finite; 1 is full scale.
/// `python evaluation/sensitivity.py --only energy::ALBEDO_LIMITS`.
pub const ALBEDO_LIMITS: [f32; 2] = [0.004, 4.0];

/// Greatest number of Gauss-Newton steps in which the scale of the surface is free; a tile that rests takes fewer. More: time on
/// painted surfaces. Fewer: scales stop before their limit, and fine relief is lost (with six, 0.48 instead of 0.57 of the height of
/// waves of 16 px is left). `python evaluation/world.py --half tune --only resolution`.
pub const OUTER_STEPS: usize = 8;
/// Number of Gauss-Newton steps with another scale of the surface, if `detail` is not 1. Fewer: the surface stops on the way. More:
/// time. One leaves the median of the coin 14 % larger with half the detail; six change no RMS by more than 4 %.
/// `python evaluation/world.py --half tune --detail 0.5`.
pub const DETAIL_STEPS: usize = 2;
/// Greatest number of steps of conjugate gradients in a linear system. More: time where one converges slowly. Fewer: it is not solved.
/// `python evaluation/sensitivity.py --only energy::INNER_STEPS`.
pub const INNER_STEPS: usize = 60;
/// Share of the squared residual, in the norm of the preconditioner, at which conjugate gradients end. Larger: long ripples of the start
/// stay on painted surfaces, which are a small share of this residual. Smaller: time.
/// `python evaluation/sensitivity.py --only energy::RESIDUAL_LEFT`.
pub const RESIDUAL_LEFT: f64 = 3e-3;
/// Mean squared length of the step that is left in a cell, in the same norm and in units of the variance of the noise, at which
/// they end as well. Larger: white surfaces are less exact (3e-3: faces 8 %, waves of 39 px keep 0.75 instead of 0.83 of their
/// height). Smaller: time on tiles that are nearly solved.
/// `python evaluation/world.py --half tune`.
pub const NEGLIGIBLE: f64 = 1e-3;
/// Root mean square change of the phase in rad below which a tile rests. Larger: scales stop too early. Smaller: time.
/// With 0.0003 white surfaces take 5 % longer; cloth has 4 % less error, but 88 in place of 96 % of the errors inside 3 sigma.
/// `python evaluation/world.py --half report`.
pub const RESTING_RAD: f32 = 0.0005;

/// Greatest change of an unknown in one Gauss-Newton step, in rad of the phase, and in the logarithm of albedo and contrast. Larger: steps
/// leave the range in which the linearisation holds, about a tenth of a turn. Smaller: far minima are not reached.
/// `python evaluation/sensitivity.py --only energy::STEP_MAX`.
pub const STEP_MAX: f32 = 0.5;

/// Ridge of the matrix in linear light squared. It only keeps cells without light finite.
/// Not measured: any small number will do.
pub const RIDGE: f32 = 1e-6;
/// Ridge of the contrast, which a cell at the zero of all fringes does not determine.
/// Not measured: any small number will do.
pub const CONTRAST_RIDGE: f32 = 1e-4;
/// Ridge of the preconditioner, as a share of each diagonal. Larger: smooth changes of the surface converge slowly. Smaller: rounding
/// makes pivots negative where nothing else determines a cell (with 0 `cargo test --package quadfringe --lib lone_column` fails).
pub const PIVOT_RIDGE: f32 = 1e-6;

/// Second difference of the phase of cells, in standard deviations of the bending of the tile, up to which they count as one surface,
/// on which pixels lose detail finer than a cell (J44). Larger: steps lower than a radian are rounded (with 15 their error is a tenth
/// larger). Smaller: texture bends the surface. `python evaluation/sensitivity.py --only energy::CURVED_MAX`.
pub const CURVED_MAX: f32 = 5.0;
/// Greatest correction of the phase, in rad, of a pixel that is valid by itself. Larger: pixels in a wrong minimum stay, and a wrong dark
/// level bends the phase by so much that other faults are named (`pytest tests/test_black.py`). Smaller: pixels whose start is wrong are
/// lost at outlines; on one surface region growing returns them. `python evaluation/sensitivity.py --only energy::MOVED_MAX_RAD`.
pub const MOVED_MAX_RAD: f32 = 0.35;

/// Difference of the logarithm of the albedo between neighbouring cells from which a tile has more starts. Larger: patches of
/// similar colours have one start (twice: small objects return 0.5 points less). Smaller: time, and saturated light has
/// less error (half: 9 %). `python evaluation/sensitivity.py --only energy::TEXTURE_MIN`.
pub const TEXTURE_MIN: f32 = 0.4;
/// Error of the phase of a cell without texture, in rad, and the least difference between two starts. Larger: fewer cells are
/// compared (twice: rods and clutter have 9 % less error on one seed, and no other group changes). Smaller: more are, and nothing
/// changes. `python evaluation/sensitivity.py --only energy::SAME_RAD`.
pub const SAME_RAD: f32 = 0.02;
/// Share of the cells around a cell in its albedo at the second and the third start. Larger: edges of the albedo are blurred. Smaller: a
/// cell in the dark of a fringe does not know its albedo, and the prior, with its long tails, keeps any (with 0 the minimum that
/// starts at the true phase of the painted face has a higher energy than that of the first start).
/// `python evaluation/sensitivity.py --only energy::SURROUNDINGS_SHARE`.
pub const SURROUNDINGS_SHARE: f32 = 0.2;
/// Least excess of the energy of the lower minimum of a tile over the other one, summed over 5 x 5 cells and over the scales of both, at
/// which these cells take the other one in the mixture; a difference of 1 is a factor of e in probability. Below it, in either direction,
/// the difference of the minima is uncertainty (U19). Larger: wrong minima stay. Smaller: where the model is wrong it decides by chance.
/// `python evaluation/sensitivity.py --only energy::GAIN_MIN`.
pub const GAIN_MIN: f32 = 30.0;
