"""The tuned numbers of the verdict on a shot: value, unit, trade-off, and the command that measured each."""

from __future__ import annotations

__all__: list[str] = []

# Share of the returned pixels from which a trusted part is the object, and the rest are pixels lit by chance around it,
# which is not told. The wall around an object of 2 % of the frame has a tenth of them (`pytest tests/test_trusted.py`).
KEPT_MIN = 0.7
STRIDE, MARGIN_ROWS = 4, 48  # pixels between samples of the light; least rows and columns of samples of the margin
RETURNED_MIN = 0.05  # least share of the lit pixels that must be returned
# Median order margin of the lit pixels. Sound shots have more than 0.75, by the published method more than 0.4 when the
# response is not corrected. Exchanged channels have at most 0.44 (joint) and 0.49 (published), other fringe numbers 0.5
# (joint) and 0.3 (published). `pytest tests/test_verdict.py` tests both limits.
COLLAPSED = {"joint": 0.55, "published": 0.35}
# The same for shots whose channels do not have the ratios of the fringe numbers. Five of 1,000 shots of other numbers
# have 0.35 to 0.37 by the published method: `python -m hostile --shots 1000` in the folder tests.
COLLAPSED_UNFIT = {"joint": 0.55, "published": 0.4}
# From this margin up to the collapsed one, shots are kept whose channels agree only in the mean of several fringes.
# Below, other fringe numbers on coloured patches agree by chance. `pytest tests/test_real_objects.py` decodes both.
AGREEING_MIN = 0.3
DOUBTFUL = 0.6
# From this margin on, a shot is returned without further tests. Shots without one channel have at most 0.69, shots of
# other fringe numbers at most 0.70 (joint) and 0.42 (published), in images of a dozen fringes: `python -m hostile
# --shots 100` in the folder tests. Sound shots by the published method may have less, and other numbers are costly to
# try, so that these are tried below DOUBTFUL only.
SURE = 0.75
NUMBERS_SURE = {"joint": SURE, "published": DOUBTFUL}
CLEARLY_BETTER = 1.2  # ratio of margins from which channels count as exchanged, or fringe numbers as others
# Share of the lit pixels that must be returned for a shot to be compared with its other readings. A larger one refuses
# printed objects, a smaller one takes time for shots that are refused anyway: `python evaluation/soundness.py --texture
# photographs`.
STANDING_MIN = 0.5
# Mean width in fringes of what is returned, at least. A larger width refuses printed objects. Across one fringe, other
# numbers that are not among these readings are returned: `pytest tests/test_soundness.py -k broken`.
STANDING_FRINGES_MIN = 3.0
# Parts of a fringe of infrared by which it is shifted for such readings. With fewer, a shift lies between two of them
# and both explain little; more take time. The nearest one is off by a sixteenth, which changes no order.
SHIFTS_OF_A_FRINGE = 8
# Without infrared the frequency of green tells exchanged channels: sound shots are off by at most 0.002, white or with
# coloured patches, exchanged channels by 0.08 or more (`pytest tests/test_rgb.py`). Neighbouring fringe numbers are off
# by less than this.
GREEN_OFF = 0.05
# The same for another order of the channels to be named. Other orders are off by 0.03 or more.
GREEN_EXACT = 0.01
# Least share of lit pixels in an image: objects may fill 0.02 of it, and fewer than this are chance in noise. In an
# image that is mostly saturated more of them are chance, at the edges of clipped fringes.
LIT_MIN, UNSATURATED_MIN = 0.005, 0.05
# Least share of lit pixels among those that are as bright as they. Seven of 1,000 images of noise have 0.006 to 0.045
# lit pixels by chance (published): `python -m hostile --shots 1000` in the folder tests.
CHANCE_MAX = 0.1

# Margin in the band, as a share of the margin at which channels count as exchanged, from which the whole image is
# decoded. The band of the right channels must reach this share of the margin of their whole image: `pytest
# tests/test_verdict.py -k band -s` prints it for scenes of the virtual bench, at least 0.65 (joint) and 0.93
# (published). A larger number decodes fewer whole images and misses exchanges; a smaller one saves no time.
NEAR = {"joint": 0.6, "published": 0.85}

# --- Offsets of G and IR from the phase of a shape: `python evaluation/soundness.py` decodes small objects, sound and
# --- broken ones, and prints how many of either are returned. Chosen on seeds 41 to 43; others report.

# Two thirds of the tiles are off by at most this angle, rad. On coloured patches and photographs it is 0.1 rad in tiles
# of several fringes, and 0.2 rad or more with other fringe numbers (`pytest tests/test_real_objects.py`). A larger
# angle or a smaller share lets chance agree. A smaller angle takes print and harmonics for other fringes, and with a
# larger share a small part of an object that has the order of another surface refuses the whole.
OFFSET_MAX_RAD, OFFSET_QUANTILE = 0.12, 2 / 3
# The same for offsets less their medians, from which they contradict the phase. Sound shots have up to 0.065; through a
# response of exponent 0.7, crosstalk of 0.1 and blur of 3 px they have up to 0.14, 0.10 and 0.23. The median of broken
# shots is 0.14 with numbers 37, 36, 31, 0.18 with 64, 63, 56, and 0.36 with G and IR exchanged: `python
# evaluation/soundness.py --seeds 41 42 --offsets`. A larger angle returns more of these, a smaller one refuses benches
# that are badly calibrated.
SCATTER_MAX_RAD = 0.165
# Probability with which chance may make so many tiles agree. A larger one returns broken shots of small objects, a
# smaller one refuses objects of a fringe.
AGREED_BY_CHANCE_MAX = 1e-3
# Least share of a tile that is returned. A larger share leaves narrow surfaces out, a smaller one measures rims.
TILE_SHARE = 0.3
# Least side of a tile of half a fringe, px, and how many of them are measured at most. Smaller tiles see more noise,
# more tiles cost time, and fewer know the quantile less well.
FINE_TILE_MIN_PX, FINE_TILES_MAX = 16, 64
# Rows, and columns, of which one is looked at for the period of the fringes. With more, small objects are missed, with
# fewer it takes time.
PERIOD_STEP = 4
# Side of a tile of several fringes, px, in which texture averages out, and the least number of them. Smaller tiles see
# the texture, larger ones and more of them leave fewer objects that can be tested.
COARSE_TILE_PX, COARSE_TILES_MIN = 96, 4
