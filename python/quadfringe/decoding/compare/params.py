"""The tuned numbers of the comparison: value, unit, trade-off, and the command that measured each.

`python evaluation/comparison.py --tune` prints the figures that the limits below separate, for shots of the virtual
bench with one fault each and for sound ones. They were chosen on half of its scenes and seeds; without `--tune` it
reports the other half.
"""

from __future__ import annotations

__all__: list[str] = []

# Standard deviation of a normal distribution over the median size of its values. Follows from the distribution.
NORMAL = 1.4826

# --- Pixels

# Distance in px from a step of half a fringe within which pixels mix two sides. Follows from the windows of the
# decoders, whose smallest is 3 px. A larger one leaves small parts out, a smaller one counts mixed pixels.
EDGE_PX = 2
# Cut-off of the slow part, in fringe periods: a Gaussian lets half of a wave of this length pass (ISO 16610-21), and
# 6 % of the fringe itself. Not measured: a longer one counts the form of small parts as noise, a shorter one counts the
# waves of gamma as form.
CUT_OFF_PERIODS = 2.0
# Bins of a profile, and fewest pixels in one. More bins show finer waves and are noisier.
BINS, BIN_PIXELS_MIN = 48, 50
# Length in px over which slopes are measured. A longer one is less noisy and crosses more edges.
SLOPE_PX = 8

# --- Causes: waves (gamma and crosstalk)

# Fewest pixels, and rows of the shots that are made. More rows take longer, fewer see less of it.
PIXELS_MIN, ROWS = 5000, 256
# Pixels farther from the median than this many robust deviations do not count for waves. A smaller one cuts waves, a
# larger one lets the rim of a shape speak.
OUTLIER_SIGMAS = 5.0
# Exponent and share of foreign light of the shots that are made. The answer of a decoder is near linear up to about
# four times this. Smaller ones are closer to linear and nearer to rounding.
GAMMA_STEP = 0.1
STRAY_STEP = 0.05
# Least and largest exponent of a made shot. Follows from what projectors and displays have.
EXPONENTS = 0.2, 5.0
# Noise of the shots that are made, standard deviation, share of full scale: it sets how far a decoder smooths. Not
# tuned: measured shapes have 0.5 to 3 %.
SYNTHETIC_NOISE = 0.02
# Share of the difference that waves must explain, once the smooth part is taken out of both, alone and next to the
# other family. Sound and blurred shots reach 0.08, faults have 0.3 or more; gamma adds at most 0.03 to crosstalk and
# crosstalk as much to gamma. Larger numbers miss weak faults under noise, smaller ones name noise.
WAVES_SHARE = 0.2
WAVES_MORE = 0.1
# Least size of what is named: difference of exponents, share of foreign light. Smaller ones harm nobody.
GAMMA_MIN, STRAY_MIN = 0.02, 0.01

# --- Causes: defocus and light

# Square of the blur in px2 that the fall of the modulation with the frequency of the fringes must show, and its share
# of the blur that would explain the whole loss. Sound shots and half the light show 0.1 px2; steps, whose edges light
# their neighbours, show 0.4 of the whole. Smaller ones name vignetting, larger ones miss blur of steps.
BLUR_PX2 = 1.0
BLUR_AGREES = 0.3
# Loss of modulation (natural logarithm) from which it is a cause. Not measured: 5 % more noise.
LOSS_MIN = 0.05
# Share of the difference that lost modulation must explain. A smaller one names what is hardly seen.
LOSS_SHARE = 0.2

# --- Causes: form and orders

# Share that offset, tilt and bow must explain, and their RMS in combined uncertainties. The mean of thousands of
# pixels is good to a tenth of an uncertainty. Smaller ones name slow noise.
FORM_SHARE = 0.3
FORM_SIGMAS = 0.3
# Share of the pixels with a wrong order, and their share of the mean square. Smaller ones name stray pixels.
WRONG_PERCENT = 0.1
WRONG_SHARE = 0.3
# Median distance of the differences of such pixels from whole fringes, in fringes, above which they are no wrong
# orders. Wrong orders have up to 0.09 (published method, 20 % noise), two scenes 0.19 or more, and even differences
# would have 0.25. A larger one blames the decoding for a moved object, a smaller one hides orders that are noisy.
WHOLE_OFF = 0.13

# --- Meshes and alignment

# Longest edge of the triangles among which the closest one is sought, mm. Longer ones make the search slower for
# every point, shorter ones make more triangles.
EDGE_MM = 4.0
# Most triangles after the division of long edges. Follows from memory: 2 million are some 500 MB.
FACES_MAX = 2_000_000
# Distance in mm beyond which a point does not belong to the surface, without and with alignment. A larger one counts
# clutter, a smaller one hides gross errors.
REACH_MM = 5.0
# Points used for the alignment, and for each of the trial rotations. More are slower; the noise of the alignment falls
# with their root.
ALIGN_POINTS, TRIAL_POINTS = 6000, 400
# Iterations of a trial. More find the way from farther off.
TRIAL_ITERATIONS = 8
# Most iterations of the alignment; it ends when a step moves no point by more than this, mm.
ITERATIONS, STILL_MM = 60, 1e-5
# Residuals beyond this many robust deviations are left out of the alignment. A smaller one keeps fewer points of a
# partial overlap, a larger one lets clutter pull.
TRIM_SIGMAS = 3.0

# --- Doubts

# Relative difference of the fringe periods from which fringes count as others. Follows from neighbouring fringe
# numbers, which differ by 0.7 % or more.
PERIOD_OFF = 0.005
# Share of the points that an alignment must rest on, below which it is doubted. Not measured: a half.
USED_MIN = 0.5
