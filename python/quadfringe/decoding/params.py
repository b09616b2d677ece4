"""The tuned numbers of diagnosis and plausibility: value, unit, trade-off, and the command that measured each.

`python evaluation/diagnosis.py` prints every named cause for thirty shots with a planted fault and for sound shots;
`--figures` adds the figures that the numbers below limit. They were chosen on seeds 1 to 4; other seeds report.
"""

from __future__ import annotations

__all__: list[str] = []

# --- Geometry: sound shots have shares of 0.00, mirrored ones a share of 1.00.
# --- The published method, which keeps wrong orders, has shares up to 0.04.

# Samples along the shorter side of the image. More samples cost time in every decode, fewer miss small objects.
SAMPLES = 48
# Distance in px over which columns must rise. A longer one crosses more edges, a shorter one is lost in noise.
REACH_PX = 4
# Angle between the direction in which columns grow and the rows, deg, up to which images count as upright. A camera may
# be inclined by 45 degrees. A larger angle misses images that are turned by 90 degrees on a tilted surface.
# `pytest tests/test_column_direction.py` has shots on both sides.
UPRIGHT_DEG = 60.0
# Share of the samples whose columns run backwards, or whose points are impossible, from which the shot is refused:
# most of it contradicts the calibration. A larger share returns more wrong shapes.
REFUSED_SHARE = 0.5
# Share from which the shape carries a warning. A smaller share warns of stray pixels, a larger one misses the border
# of a light field that has moved by a few percent of the image.
WARNED_SHARE = 0.05
# Fewest samples from which a share is taken, and how many times closer they lie where there are fewer. Below about a
# hundred samples, a share of WARNED_SHARE is a handful of stray pixels. A smaller factor leaves objects unchecked that
# fill a hundredth of the frame.
SAMPLES_MIN, FINER = 100, 4
# Rows beyond the image of the projector that are still possible, px. Follows from lens distortion, which calibrations
# know to a few px at the border. A larger number misses small shifts of the rows.
ROWS_PX = 8.0
# Angle in degrees between the normal of the surface as a whole and the line of sight from which a calibration is
# doubted. A projector whose z has the opposite sign has 51, one with half of its focal length 70
# (`pytest tests/test_wrong_calibration.py`). A smaller angle warns of objects that are seen at a slant.
TILT_DEG = 45.0
# Depth in medians from which a point counts as far: fringes there have a ninth of the light. Sound shots by the
# published method, which keeps wrong orders, have a share of 0.01, a projector with half of its focal length has 0.08.
# A smaller factor counts rooms behind the object.
FAR_MEDIANS = 3.0
# Factor by which the median depth may leave the depths of the board in the calibration. Between them the calibration is
# tested. A projector that was turned by 5 degrees moves 800 mm by 140 mm or more, a distance of the devices that is 1.2
# times too large by 160 mm; boards lie at 730 to 870 mm (`python evaluation/geometry.py --calibrated`). A larger factor
# misses these, a smaller one warns of objects a little beyond the boards.
CALIBRATED_FACTOR = 1.1

# --- The upper and the lower border of the light: `python evaluation/geometry.py` prints the figures of sound and
# --- moved shots. On sound ones the border lies 1.7 rows inside its place; 20 of 384 image rows move it by 63 or more.

# Dark image rows beyond a border, px. A smaller number takes the edge of the image for the border.
BORDER_DARK_PX = 6
# Share of the image columns in which the border lies at one projector row, and rows by which it may scatter. A smaller
# share and more rows take edges of objects for the border, the others miss a border that is in view in part.
BORDER_SHARE, BORDER_ROWS_PX = 0.3, 4.0
# Share of the image, and of the projector columns, in which a border reaches the end of the view or of the light. A
# larger one takes straight edges of objects for the border.
BORDER_END_SHARE = 0.03
# Share of the image columns in which some pixels lie more than ROWS_PX beyond the border, and how many pixels. Sound
# shots have 0.00, by the published method, which keeps wrong orders, up to 0.04. Smaller ones warn of wrong orders,
# larger ones miss a projector that was turned by 5 degrees, which has 0.13 or more where the border is in view.
BEYOND_SHARE, BEYOND_PIXELS = 0.08, 8
# Rows between the pixels that are looked at for this. More pixels cost time in every decode, 0.6 ms more with 1
# (`python benches/checks.py`); fewer would miss a border that is off by ten rows.
BEYOND_STRIDE = 4
# Image columns in which the upper and the lower border of the light are looked for, at least. More: time, 1.5 ms with
# all 1024 in place of 0.4 (`python benches/checks.py`). Fewer: a border in few columns is missed (`python
# evaluation/geometry.py`).
BORDER_COLUMNS = 200

# --- Numbers of a calibration, without a shape

# Focal lengths in units of the longer side of the image: least and largest. Follows from fields of view of 136 and 0.6
# degrees. Narrower limits refuse rare lenses, wider ones pass a focal length in mm, which is 0.02 sides.
FOCAL_SIZES = 0.2, 100.0
# Largest ratio of the focal lengths along x and y. Follows from pixels, which are square, and mirrors in a diamond
# array, whose columns are half as far apart as their rows. A larger ratio passes a digit too many.
FOCAL_ASPECT = 2.5
# Distance of the principal point from the middle, in halves of the image. Follows from projectors that shine upwards,
# which have up to 1.5. A larger distance passes a digit too many.
CENTRE_HALVES = 3.0
# Distance of the principal point from the middle along x, in halves of the image, from which its coordinates may be
# exchanged, and the share of that distance that is left when they are. Follows from lenses, which are centred within a
# few percent, and images of 5 x 4, where an exchange moves it by 0.2. A smaller distance or a larger share doubts
# images that are cut from larger ones; the others miss exchanges in images that are nearly square, which cost little.
CENTRE_ASIDE, CENTRE_EXCHANGED = 0.1, 0.25
# How far a lens may move a point, as a share of its radius: everywhere, and more with the square of the radius in focal
# lengths. Follows from fisheye lenses, r = atan(R), whose share is R^2 / 3. Larger numbers miss a digit too many.
BENT_ALL, BENT_WIDE = 0.03, 0.5
# Distances of camera and projector, mm, below the first and above the last of which a shape is refused, and below the
# second of which it carries a warning. Follows from lenses, which are 12 mm wide or more, and mostly 30; a bench of
# 250 mm has 0.25 in m, 25 in cm and 250,000 in um. Closer limits refuse unusual benches.
BASELINES_MM = 2.0, 30.0, 10_000.0
# Angle in degrees and distance in mm between the two projectors from which a shape, decoded as of a coaxial pair,
# contradicts them. Not measured: three times what makes a fault of the doctor. Smaller ones warn of pairs that work.
PAIR_DEG, PAIR_MM = 18.0, 45.0

# --- Fringe numbers and registration: closure of the three phases

# Relative deviation of a channel's local frequency from its fringe number. Sound shots reach 0.002, and 0.007 when
# their response is not linear; neighbouring families of numbers differ from 36, 35, 30 by 0.008 (green) and 0.029
# (infrared) or more. A smaller number calls noise another fringe number, a larger one misses 49, 48, 42.
RATIO_OFF = 0.015
# Deviation from which channels count as exchanged rather than as fringes of other numbers: green in place of infrared
# has 0.14 or more, and families from 16 to 144 fringes at most 0.1. A larger number explains exchanges as numbers.
RATIO_STRANGE = 0.12
# Mean length of the closure over a window of CLOSURE_PX, in [0, 1], from which its angle is read. Sound shots with 2
# % noise have 0.35 (clutter) to 0.97 (plane), exchanged channels at most 0.22. A smaller number trusts noise, a
# larger one misses shifts on dark objects.
AGREEMENT_MIN = 0.3
CLOSURE_PX = 31
# Lag of the local frequency, px, and its window. Longer ones cross more edges, shorter ones are noisier.
LAG_PX, FREQUENCY_PX = 8, 25
# The same lag in periods, at most: beyond half a period the direction is ambiguous. A larger share reverses fine
# fringes, a smaller one is noisier.
LAG_TURNS = 0.4
# Angle of the closure in rad from which infrared counts as shifted: 0.2 is 1.3 px at a period of 41 px. Sound shots
# reach 0.03, in tiles 0.13 (patches of 12 mm). A smaller angle names misalignments that cost no order, a larger one
# misses shifts that bend the phase.
CLOSURE_RAD = 0.2
# Mean of the closure over its local length, from which the angle counts as one for the whole image. Shifted and sound
# shots have 0.8 or more, a strong response or crosstalk 0.55 or less. A smaller number calls those shifts.
STEADY_MIN = 0.7
# Bands of rows in which the offsets of the channels are measured in every decode, and their rows. More cost time
# (`python benches/checks.py`), fewer miss small objects: one of 2 % of the frame is a seventh of its height.
BANDS, BAND_ROWS = 8, 16
# Rows between those of a band that are looked at. A smaller number costs time, a larger one sees more noise.
ROW_STRIDE = 4
# Width of a tile in a band, px, and the share of its pixels that must be returned. Wider tiles miss narrow objects,
# narrower ones hold less than a fringe.
OFFSET_TILE_PX, OFFSET_SHARE = 96, 0.3
# Fewest tiles from which a fault is named. A smaller number names faults for the print in a single tile.
OFFSET_TILES_MIN = 4
# Least share of the tiles that are off by as much which agree with those around and so are a part. When it was set,
# photographs that differ from channel to channel had 0.26 at most, broken parts 0.54 or more; `pytest
# tests/test_channel_offsets.py tests/test_trusted.py tests/test_texture.py` hold it. A smaller share calls texture a
# shift, a larger one misses small parts.
OFFSET_TOGETHER_MIN = 0.4
# Share of the lit pixels with quality 0, because green and infrared contradict every order, from which the shot is
# decoded once more with them to name the cause. A smaller share costs time, a larger one takes parts out silently
# (`pytest tests/test_trusted.py -k contradicts`).
TAKEN_OUT_SHARE = 0.05
# Pixels between those that are counted for it. A smaller number costs time (`python benches/checks.py`), a larger one
# counts small objects less exactly: one of 2 % of 1024 x 768 pixels has a thousand of them.
TAKEN_OUT_STRIDE = 4
# Largest share of the tiles that is a part. Crosstalk of red and green turns the closure everywhere (0.84 at 0.15:
# `pytest tests/test_channel_offsets.py`). A smaller number misses broken halves.
OFFSET_PART_MAX = 0.7
# Most turns of drift over the field, the least length of the mean phasor, and by how much it must exceed that without
# drift. Numbers that are farther off leave no margin. Sound shots have no drift that is better than none, and other
# numbers have a length of 0.82 or more. Smaller numbers believe prints, larger ones miss other numbers on narrow
# objects: `pytest tests/test_channel_offsets.py`.
DRIFT_TURNS_MAX, DRIFT_LENGTH, DRIFT_BETTER = 4, 0.75, 0.1
# Largest shift along y that is searched, px, and the correlation from which it is believed: scenes with detail along
# y have 0.66 or more, a plane 0.04. A wider search finds chance maxima, a narrower one misses coarse misalignment.
SHIFT_MAX_PX = 24
CORRELATION_MIN = 0.5
# Shift along y, px, from which it is named without one along x. Sound shots have 0, blurred ones up to 1.
SHIFT_MIN_PX = 1.5
# By how much the correlation must fall when infrared is moved along x, for the projector to be blamed and not the
# chip. Not measured: above the scatter of equal correlations, 0.02. A larger number blames the chip for a moved
# projector.
CORRELATION_MORE = 0.05

# --- The part of a shot that can be trusted: `pytest tests/test_trusted.py`

# Window in px, and the share of it that must be lit, for a place to count as lit. 300 images of noise have no such
# place, and clusters of 1 % of the frame with a window of 9 px. A larger window or share loses thin objects.
LIT_WINDOW_PX, LIT_WINDOW_SHARE = 15, 0.8
# Mean order margin in the window from which a region is looked at. Objects of 2 % of the frame before an even wall have
# 0.5, all of it right. A larger number loses them; a smaller one looks at regions that the phases then reject.
LOCAL_MARGIN_MIN = 0.3
# The same from which lit places are an object and not chance. In 300 images of noise no place has it, and objects of
# 2 % of the frame have it in 1.2 % by the published method. A smaller number takes noise for an object.
OBJECT_MARGIN_MIN = 0.6
# Deviation of the local frequencies from the fringe numbers, and of the phases of the channels from that of the shape,
# and of their closure, rad, that end a region. A wrong order puts infrared off by 1 rad. Smaller numbers cut regions at
# noise; larger ones join regions with shifted infrared to sound ones.
LOCAL_RATIO_OFF, LOCAL_OFF_RAD, LOCAL_CLOSURE_RAD = 0.1, 0.5, 0.6
# How far green or infrared may drift across the widest region, rad, and the agreement of the closure. Sound regions
# drift by at most 0.1; 37, 36, 31 read as 36, 35, 30 by 0.3 over a third of the image. A larger number returns regions
# of neighbouring fringe numbers.
REGION_DRIFT_RAD, REGION_AGREEMENT_MIN = 0.15, 0.5
# Share of the window of the closure that must lie in the region for a place to be rejected. A larger share returns
# wrong orders next to the border of the sound part, a smaller one loses the rim of small objects.
INNER_SHARE = 0.9
# Mean width of such a region in infrared fringes, at least. With exchanged channels the phases agree by chance in
# strips of less than a fringe. A larger number refuses small objects.
REGION_PERIODS_MIN = 1.2
# Share of the frame, and number of pixels, of a region that is trusted. An object of 2 % of the frame has 1.5 % inside
# its rim. Smaller numbers trust chance, larger ones refuse small objects.
REGION_SHARE, REGION_PX = 0.01, 1500

# --- Direction of the fringes

# Period along the rows over that along the columns, from which the published method may be refused for fringes along
# the rows. Of the plate turned by 60 degrees it is 1.5 and most orders are right, by 75 degrees 3 to 5 and half of
# them, by 90 degrees 5 and none to half (`python evaluation/captures.py --only turned`). A larger number returns wrong
# orders, a smaller one refuses inclined fringes that can be decoded.
ALONG_ROWS = 2.0

# --- Blur

# Contrast of the fringes below which blur is considered. Sound shots have 0.88 to 0.9, a blur of 4 px leaves 0.68. A
# larger number names room light, a smaller one misses light blur.
BLURRED_CONTRAST = 0.78
# Largest detail finer than the fringes, over the noise. Sound scenes with edges have 2.3 or more, blurred ones at
# most 1.96. A larger number calls sharp scenes in room light blurred.
SHARP_MIN = 2.15
# Steepness of the strongest detail. Sharp print and edges have 0.57 or more, blurred by 3 px 0.34 to 0.58, by 4 px up
# to 0.55; highlights, which have no edge, have 0.44 to 0.93 (`pytest tests/test_first_cause.py -s`, scenes of
# `evaluation/world.py` with seeds 13 and 14). A larger number calls sharp scenes in room light blurred, a smaller one
# misses blur.
STEEP_MIN = 0.55
# Standard deviation of the blur, px, that the contrasts of 36 and 30 fringes must show together. Scatter of the
# contrasts reaches 1.7 px. A larger number misses light blur.
BLUR_PX = 2.2

# Contrast below which fringes nearly vanish, measured without them: everything wider than a pixel counts. Sound shots
# have 0.89 or more, and a blur by a quarter of the period leaves 0.3 to 0.42 with shading and print. A larger number
# names room light, a smaller one misses blur of painted objects.
VANISHING_CONTRAST = 0.45
# Detail of 1.5 to 3 px over that of 6 to 12 px. Scenes with sharp edges have 0.55 or more, those with a blur of 6 px or
# more 0.17 to 0.32, noise 3.6. A larger number calls sharp scenes in room light blurred, a smaller one misses blur.
UNSHARP = 0.42
# Standard deviation of the mean light that this contrast is relative to, px, and share of the brightest mean light
# from which a pixel counts. A wider one counts shading as contrast, a narrower one takes the fringes out. A larger
# share leaves dark objects out, a smaller one measures dark ground.
MEAN_PX, LIT_SHARE = 24.0, 0.1

# --- Images as they were given

# Correlation of the second differences along the rows from which two channels are the same image. The same image has 1,
# at another brightness; other images have less on five scenes (`pytest tests/test_given.py`). A larger number misses
# copies that were compressed, a smaller one takes the edges of prints for copies.
SAME_MIN = 0.98
# Rows between those that are compared. A larger number leaves few pixels in small images, a smaller one costs time.
SAME_ROWS = 8

# --- Light

# Bits up to which 16-bit data that hold no more are surely those of a camera with so many bits: a sixteenth of the
# light is too dark by any measure. With 14, a quarter of the light explains them as well.
SURE_BITS = 12

# Brightest pixels, share of full scale, below which the light counts as too dark. Sound shots have 0.6 or more. A
# larger number names dark paint, a smaller one misses shots whose noise hides the fringes.
DIM = 0.25
# The same, below which darkness is named before any other cause of a refusal: the fringes of the sound scenes then
# have about the amplitude of 2 % noise. A larger number hides other causes of dim shots.
DARK = 0.1
# Share of saturated pixels from which saturation is the cause of a refusal. A larger number names the harmonics of
# the clipped crests instead, a smaller one blames a few glints.
SATURATED = 0.1
# Rows between those whose saturated pixels are counted. A larger number misses small images, a smaller one costs time
# in every decode: 0.20 ms with 1, 0.08 ms with 4 (`python benches/checks.py`).
SATURATED_ROWS = 4
# --- Black of a stated response: `python evaluation/captures.py` holds captures with a tenth of the light against the
# --- response of their full light. They have a channel below black in 0.5 or more of the places, the others in 0.001.

# Side of the squares over which pixels are averaged, px. A larger one blurs fine fringes, a smaller one leaves noise.
SQUARE_PX = 4
# Rows of squares between those that are looked at. A larger number leaves less than ten thousand squares, too few for
# small bright places; a smaller one costs time in every decode: 2.6 ms with 1, 0.7 ms with 4 (`python
# benches/checks.py`).
SQUARE_ROWS = 4
# A place is bright from this share of the bright light, which is this quantile of the brightest channels. A larger
# share leaves dark objects out; a smaller one counts shadows, which may be darker than any fringe.
BRIGHT_SHARE, BRIGHT_QUANTILE = 0.25, 0.99
# Share of black, and number of standard deviations of the noise, by which a channel must lie below black. Smaller
# numbers call noise a contradiction, larger ones keep a black that hides a part of the dark fringes.
BELOW_BLACK, BELOW_NOISES = 0.25, 3.0
# Share of the bright places from which the response is contradicted. A smaller share lets a few shadows decide, a
# larger one needs more dark fringes.
BELOW_SHARE = 0.05
# Median of the absolute value of a normal deviation, in standard deviations. Follows from the distribution.
MEDIAN_OF_NORMAL = 0.6745

# --- The reference measurement

# Share of the lit pixels whose fringe numbers contradict each other from which a reference measurement is refused. With
# images in a wrong order it is 0.9 and more, on the captures 0.001 (`pytest tests/test_reference.py`).
CONTRADICTED_SHARE = 0.5
# Peak memory of a reference measurement beyond its images, bytes per pixel: its maps. Not measured with other inputs.
STEP_BYTES_PER_PX = 60

# --- A pair of projectors that stand apart

# Ambiguity margin of the fringe numbers along a camera ray, rad, below which a pair is warned of. 36, 35, 30 of coaxial
# projectors have 1.05. With an infrared projector 50 mm farther from the camera than the visible one it is 0.26, and
# 0.6 % of steps get a wrong order, in place of 0.06 % with 24 infrared fringes and 1.1 rad; 50 mm nearer it is 0.8 and
# 0.1 %, in place of none with 40 (`python evaluation/pair.py --half tune --only steps`, and with `--infrared 30`).
PAIR_MARGIN_RAD = 0.6
