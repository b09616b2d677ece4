"""The tuned numbers of the ratios of fringe numbers and of shifts of infrared: value, unit, trade-off, and command.

They were chosen on shots of seeds 5 to 11 and 31; `pytest tests/test_number_ratios.py tests/test_registration.py` has
others. Limits for the medians of ratios, which hold whatever the error, stand in `params`.
"""

from __future__ import annotations

__all__: list[str] = []

# --- Standard error of a ratio, from its medians in squares

# Side of a square, px. The local frequencies are means over 25 px, so that smaller squares know of one another and the
# error comes out too small; larger ones leave small objects without an error.
RATIO_SQUARE_PX = 50
# Share of a square that must be known, and the fewest squares that give an error. A larger share or number leaves small
# objects without an error, which then are named by other tests only; a smaller one sees little but rims.
SQUARE_SHARE, SQUARES_MIN = 0.25, 4
# Standard deviation of a normal deviation, in medians of its absolute value. Follows from the distribution.
SD_OF_DEVIATION = 1.4826

# --- Fringe numbers by likelihood

# Error of a ratio that does not average out: from the response and crosstalk for the question whether the numbers are
# others, and from rounding for the question which. Sound shots reach 0.002, and 0.007 when their response is not linear
# (`python evaluation/diagnosis.py --figures`). Larger ones miss neighbouring numbers; a smaller first one calls a wrong
# response other numbers, a smaller second one proposes none where crosstalk moves the ratios.
RATIO_SD, EXACT_SD = 0.004, 0.001
# Twice the logarithm of the likelihood by which numbers must explain two ratios better than others do. 6 is a factor of
# 20. A larger number leaves other numbers on objects of few fringes unnamed: 25, 24, 20 on a sphere of 8 % of the frame
# has 6.3. A smaller one takes shifted infrared on such objects for other numbers: 12 px on a face of 6 % have 0.1
# (`pytest tests/test_number_ratios.py tests/test_registration.py` have both).
LIKELIER = 6.0
# The same for numbers that are not of a family, which fit any two ratios. Follows from a deviation of four errors.
OFF_THE_PLAN = 16.0
# Errors by which both ratios may miss numbers that are proposed, or that a shot may have. Follows from the normal
# distribution: three errors are exceeded once in 400 shots.
ERRORS_MAX = 3.0

# Turns of drift of the infrared offsets over the field that are looked for once the closure drifts. 49, 48, 42 read as
# 36, 35, 30 have 7, and 64, 63, 56 have 16 of opposite sense. A larger number finds chance, which the ratios then
# contradict; a smaller one misses such numbers, for which only the ratios are stated.
CLOSED_TURNS_MAX = 8

# Probability with which chance may show a drift that both ratios then confirm. Narrow objects in half an image have
# lengths of 0.66 to 0.95 with 37, 36, 31 and 35, 34, 29, where chance reaches 0.48. A larger number leaves the
# decision to the ratios, a smaller one leaves such shots without a cause (`pytest tests/test_number_ratios.py`).
DRIFT_BY_CHANCE = 1e-3

# --- Shifts of infrared by whole fringes

# Largest shift along x that is looked for, share of the image width. A larger one finds chance: on a slanted plane a
# shift of 0.1 has nearly the phases of 36, 35, 31 fringes.
SHIFT_REACH = 0.1
# Errors by which the closure must be longer with infrared moved by this shift than by the nearest one, or not at all.
# 21 and 40 px on a face, 1 and 2 periods on clutter and steps have 5 to 30 (`pytest tests/test_registration.py -s`). A
# smaller number finds whole fringes by chance, a larger one names shifts of half a fringe with the wrong sign.
LONGER = 4.0
# Mean of the closure over its local length from which a shift is believed where noise leaves the local length below
# `AGREEMENT_MIN`. Noise and exchanged channels have 0.76 at most, clutter with a shift of 0.8 px has 0.95 or more
# (`python evaluation/diagnosis.py --figures`, `pytest tests/test_registration.py`). A smaller number believes noise, a
# larger one misses small shifts on dark objects.
STEADY_ALONE = 0.9
