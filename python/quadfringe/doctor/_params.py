"""The tuned numbers of the checks on a board, a plate and devices: value, unit, trade-off, and what measured each.

`pytest tests/test_doctor_board.py -rP` prints the figures that the limits separate: of sound benches, of calibrations
with one wrong number, and of shots that are decoded wrongly. Each limit is (warning, fault).
"""

from __future__ import annotations

__all__: list[str] = []

# Standard deviation of a normal distribution over the median size of its values. Follows from the distribution.
NORMAL = 1.4826

# --- A flat plate

# Distance from the surface, share of a whole order, from which a pixel has a wrong order: 8 mm where an order moves a
# point by 30 mm. Half of it is the least that a wrong order makes; the bow of any usable calibration is below a tenth.
ORDER_SHARE = 0.25
# Fewest points, and fewest tiles with enough of them: 6 unknowns of the quadratic surface, and as many to judge it.
PIXELS_MIN, TILES_MIN = 2000, 12
# Side of a tile, px, and fewest points in one. A tile is wider than a fringe, so that its median hides waves.
TILE_PX, TILE_PIXELS_MIN = 32, 200
# Rounds of weighting of a robust fit. Not measured: it moves by less than 1 % from the tenth on.
ROUNDS = 15
# Harmonics of the fringes that are looked for: a gamma makes the first three, crosstalk the first two.
HARMONICS = 4

# --- A board

# Fewest points of a board that are compared, of 7 unknowns: as for its detection in calibration.
POINTS_MIN = 12
# Reach around a point from which its place is taken, share of the distance to the nearest one, and fewest decoded
# pixels there. A larger reach averages more noise and more of the distortion of the lens.
AROUND, AROUND_PIXELS_MIN = 0.55, 40
# Largest light over that of paper in the picture in which the board is sought. Glare is cut there.
FULL_RATIO = 1.3

# --- Limits (warning, fault): calibration

# Distance in px between the points in the image and those of the board, in the pose that the camera alone gives. Sound
# benches have 0.06 px; a smaller limit names noise and blur, a larger one misses distortion.
REPROJECTION_PX = (0.3, 1.0)
# Error of decoded lengths, %, and of the form of the board, share of its diagonal. Sound: 0.004 % and 0.00003; 1 % of a
# focal length or of the distance between the devices: 0.09 % to 1.3 % or 0.001. Smaller limits name the board: a
# printed sheet glued to glass is not flatter.
SCALE_PERCENT = (0.1, 0.3)
FORM_SHARE = (1e-4, 4e-4)
# Bow of a flat plate, share of its diagonal. Sound: 0.00002; a distortion of 0.1 that the calibration does not know:
# 0.001 to 0.003. A plate of float glass is flat to 0.0001.
BOW_SHARE = (2e-4, 5e-4)
# Standard deviations above which an error of scale, form or bow counts. Smaller ones name chance and waves.
SCALE_SDS, FORM_SDS, BOW_SDS = 4.0, 2.0, 3.0

# --- Limits (warning, fault): decoding

# Scatter of the points over the stated one. Sound: 0.6 to 0.9; gamma 1.3 to 2 that nobody corrects: 1.9 to 2.5; a
# distortion of 0.1: up to 1.4, so that a smaller limit would blame the decoding for it.
SCATTER_RATIO = (1.5, 2.5)
# Amplitude of the waves that follow the fringes, rad. Sound: 0.003, on a print; gamma 1.3: 0.045 and more. Smaller
# limits name the edges of a print.
WAVE_RAD = (0.012, 0.025)
# Share of the pixels of the plate with a wrong order. Sound: up to 0.001, on a print with 3 % noise. Smaller limits
# name single pixels at its edges.
WRONG_ORDERS = (0.003, 0.02)

# --- Screens and webcams: pytest tests/test_doctor_system.py

# Relative difference of two rates, or of a period from an exposure, that counts: screens run at 59.94 Hz for 60.
RATE_SHARE = 0.05
# Frames that a webcam is looked through: at 15 Hz less than a second. More find slower changes of light.
FRAMES = 8
# Period of frames over the stated one from which frames are called slow; drivers deliver in bursts.
SLOW_RATIO = 1.5
# Range of the mean brightness of still frames, % (warning, fault). Not measured: as the steadiness of a projector in
# calibrate response; half an exposure more or less is 50.
STEADY_PERCENT = (2.0, 20.0)
