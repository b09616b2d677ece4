"""The tuned numbers of the calibration: value, unit, trade-off, and the reason or the check of each.

The heading of each group names the tests that exercise its numbers against the exact truth of the virtual bench.
`python evaluation/calibration.py` measures the accuracy that all of them give together.
"""

from __future__ import annotations

__all__: list[str] = []

# --- Finding the board in an image: pytest tests/test_targets.py

# Share of full scale: an image whose bright parts stay below DARK, or whose contrast stays below CONTRAST_MIN, shows
# nothing to detect. Larger values refuse usable images; smaller ones report a dark image as a missing board.
DARK = 0.06
CONTRAST_MIN = 0.05
# Share of the image at (nearly) full scale from which saturation is named as the cause of a failed detection.
SATURATED_SHARE = 0.25
FULL = 0.999
# Standard deviations of the smoothing tried before blob detection, px, in this order. More smoothing suppresses noise
# and closes small holes, so the search stops at the first that finds the grid.
SMOOTHING_PX = (1.0, 2.0, 0.5)
# Slope of the steepest edges of a sharp image, share of its contrast per px: an edge with a Gaussian blur of 5 px
# standard deviation has this slope, 1 / (5 sqrt(2 pi)).
SHARP = 0.08
# Least darkness of an orientation mark, where paper is 0 and solid ink 1; below one half, because blur lightens a dot.
MARK_MIN = 0.35
# Corners of a ChArUco board below which a view says little about a pose: a homography needs four, and eight leave it
# as many redundant observations as unknowns.
CORNERS_MIN = 8
# Smallest blob, px^2: a disc of 4 px diameter; smaller ones are noise.
BLOB_AREA_MIN_PX = 12.0
# Largest over smallest blob diameter of one board: a board reaches this ratio when it is tilted by 45 degrees and 0.88
# times as wide as it is distant. A larger ratio admits more stray blobs.
BLOB_SIZE_RATIO_MAX = 1.9
# Largest distance of a neighbour from its predicted place, share of the grid step. Below 0.5 no two neighbours compete.
NEIGHBOUR_OFF_MAX = 0.3
# Blobs near the middle from which the grid is followed; one suffices unless a stray blob lies there.
SEEDS = 5

# --- Sub-pixel centres: pytest tests/test_targets.py, which also compares them with the blob centres of OpenCV

# Radius of the window around a ring, in ring radii, unless a neighbour is nearer. A larger window averages more paper
# pixels into the fit of the white level, but meets the next ring.
WINDOW_RADII = 1.65
# Paper begins at this distance from the centre, in ring radii: blur of the edge must not reach the white level.
PAPER_FROM_RADII = 1.25
# Rounds of centroid and perspective correction: each improves the homography that the correction of the next needs.
CENTRE_ROUNDS = 3
# Mean darkness of a window below which it shows no ink.
INK_MIN = 0.05

# --- Poses: pytest tests/test_rig_calibration.py, with sets of poses that leave each kind of parameter undetermined

# Fewest poses: with five, one bad pose still contradicts the others; 9 to 15 are recommended.
POSES_MIN = 5
# Standard deviation of the depth change across the board, share of the depth, along the direction in which the tilts
# differ most (TILT_MIN) and least (AXIS_MIN). Smaller limits admit poses that leave the focal length undetermined.
TILT_MIN = 0.03
AXIS_MIN = 0.012
# Range of the board distances, share of the mean distance: below this, distortion and distance are strongly correlated.
DEPTH_RANGE_MIN = 0.04

# --- Projector maps: pytest tests/test_projector_maps.py

# Modulation, share of full scale, below which a pixel counts as unlit: with noise of 1 % and eight steps the phase
# noise sqrt(2 / 8) 0.01 / 0.02 is then 0.25 rad.
MODULATION_MIN = 0.02
# Order margin, 0 to 1, below which a fringe order may be wrong; an outlier in the fit around a point costs more than
# a missing pixel.
ORDER_MARGIN_MIN = 0.3
# Share of full scale from which a pixel is saturated and its phase biased.
SATURATED = 0.999
# Radius of the fit around a point, share of the distance to the nearest point: half way to its neighbour.
FIT_RADIUS = 0.5
# Share of the pixels around a point that must be lit; below it the quadratic is extrapolated.
LIT_SHARE_MIN = 0.4
# Relative change of the modulation from pixel to pixel that marks the edge of the print, whose pixels get a hundredth
# of the weight, because they mix the light of ink and paper.
PRINT_EDGE = 0.06

# --- Adjustment: pytest tests/test_rig_calibration.py

# Points of a board that a device must see in a pose: as CORNERS_MIN.
SIGHT_MIN = 8
# Condition number of the scaled normal equations from which the parameters are undetermined: double precision then
# leaves four digits.
CONDITION_MAX = 1e12
# Smallest standard deviation of a point, px: noise-free points are limited by rounding.
POINT_SD_MIN_PX = 1e-4
# Distance in standard deviations from which a point is an outlier: one Gaussian point in exp(12.5) = 270 000 lies
# farther off.
OUTLIER_SD = 5.0
# Share of outliers among the points of a device in one pose from which the pose is refused.
OUTLIER_SHARE_MAX = 0.25
# Most rounds of adjusting and marking outliers; the loop ends earlier, when the set of outliers no longer changes.
OUTLIER_ROUNDS = 8
# A point is a gross error when a homography misses it by this many times the median miss: lens distortion displaces
# the corners of a board by less.
GROSS_MEDIANS = 20.0
# Relative difference between the adjusted and the measured distance of the first board that reveals a wrong board
# size: a tape measure errs by a few per cent.
DISTANCE_OFF_MAX = 0.1
# Step of central differences for the covariance of the pair, rad and mm: far above rounding (1e-16) and small enough
# that the curvature of a rotation does not count.
DIFFERENCE_STEP = 1e-6

# --- Registration of the two chips: pytest tests/test_calibration_files.py tests/test_guide.py

# Points needed: 24 observations for the six unknowns of an affine map.
REGISTRATION_POINTS_MIN = 12
# Distance in robust standard deviations from which a point is left out.
REGISTRATION_OUTLIER_SD = 4.0
# RMS distance, px, above which the two sets are not the same points: centres are good to 0.05 px.
REGISTRATION_RMS_MAX_PX = 0.5
# Extent of the points across their main direction, divided by that along it; below it, the affine map is undetermined
# across.
REGISTRATION_SPREAD_MIN = 0.1

# --- Light, that is dark level, responses, crosstalk and flat field: pytest tests/test_channels.py

LEVEL_STEPS = 8  # levels of a ramp: three determine its curvature, the others judge the fit
# Shorter exposures of the brightest level, shares of the full one: at a quarter, an exponent of the camera that is off
# by 0.1 changes the level by 3 % of full scale. A shorter one would need more frames of a projector at full exposure.
SHORTER_EXPOSURES = (0.25, 0.5)
DARK_LEVEL_MAX = 0.2  # share of full scale: a brighter shot was taken with the lens open
HOT = 0.02  # share of full scale above the dark level from which a pixel is hot: 5 of 255
# Share of full scale from which a captured mean is left out, because the sensor cuts off part of the noise.
CLIPPED = 0.97
# Weak priors, share of full scale: the cost in the fit of a camera exponent one unit from 1, and of a dark level one
# unit from the measured one. They decide only what the captures leave undetermined: a camera is linear unless they
# show otherwise.
CAMERA_PRIOR = 2e-3
DARK_PRIOR = 0.05
# Residual, share of full scale, from which a capture counts less (soft-L1): half a grey level of 8 bit.
ROBUST = 2e-3
# Light of a channel seen by the channel itself, share of full scale, below which it cannot be calibrated.
UNLIT = 0.02
# Largest share of full light that room light may add; more leaves the fringes no range.
AMBIENT_MAX = 0.45
# Unsaturated levels of a ramp that determine its offset, slope and exponent.
USABLE_LEVELS_MIN = 3
FLAT_SHOTS_MIN = 4  # two that give the gain and two that judge it
# Scale, px, that separates vignetting and illumination (slower) from the gain of single pixels (faster).
SLOW_PX = 15.0
DEFECT = 0.5  # relative difference of a pixel's gain from its surroundings that marks a defect
# Usable mean of an evenly lit shot, share of full scale: above the noise, below saturation.
FLAT_LIGHT = (0.15, 0.9)

# --- Heights and acceptance: pytest tests/test_heights.py

# A height may lie outside the calibrated range by this share of it: polynomials do not extrapolate.
HEIGHT_BEYOND = 0.05
FIT_POINTS_MIN = 100  # points below which a form error is meaningless: the worst 0.3 % are left out
# Relative difference from its calibrated diameter at which a sphere is still recognised.
SPHERE_SIZE_REACH = 0.05
BORDER_PX = 30  # border of the image that is left out: about a fringe, where decoding windows are cut off
CAP_DEG = 60.0  # points of a sphere seen more obliquely than this are left out
ARTEFACT_BAND_MM = 1.0  # points farther from the artefact than this belong to something else

# --- What a session accepts: pytest tests/test_guide.py

REPROJECTION_MAX_PX = 0.3  # mean reprojection error; the paper reports 0.269 and 0.221 px
COVERAGE_GRID = 4  # the image is divided into 4 x 4 fields
COVERAGE_MIN = 0.5  # share of the fields in which the board was seen
HEIGHTS_AGREE_MAX_MM = 0.1  # RMS between polynomial and triangulated height
REGISTERED_MAX_PX = 0.2  # RMS of the registration
SESSION_DARK_MAX = 0.1  # share of full scale
HOT_PIXELS_MAX = 500  # of the image: 0.06 % of 1024 x 768
LEFT_MAX_PERCENT = 0.5  # stray light and RMS level error that may be left, per cent of full light
UNEVEN_MAX_PERCENT = 5.0  # unevenness left after correction, per cent: more means that the light flickers

# --- Precision and trueness: quadfringe accept

# Side of a tile of local planarity, px, and share of it that must be filled. A larger tile counts form as scatter, a
# smaller one counts the noise that neighbours share as form. Not measured: about a fringe.
TILE_PX, TILE_FILLED = 32, 0.9
# Difference of depth in mm up to which two captures show one pose. Not measured: above the errors of a bench, below a
# pose that was changed on purpose.
SAME_POSE_MM = 0.5
