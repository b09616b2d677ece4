"""The tuned numbers of the report: value, unit, trade-off, and the reason of each."""

from __future__ import annotations

__all__: list[str] = []

# Most vertices of the surface. More show finer detail and make a larger file: 100 000 take about 1 MB. Not measured on
# slow computers: any that draws in a browser has ten times as many in a game.
VERTICES_MAX = 100_000
# Probability of a wrong order from which a returned pixel is doubtful. Not measured: in a hundred such pixels at most
# one is expected to be displaced by a fringe. A smaller one counts more pixels that are right.
ORDER_DOUBTFUL = 0.01
# Uncertainty, times the median, from which a returned pixel is doubtful. Not measured: the rims and dark parts of a
# shape. A larger number counts less of them.
UNCERTAINTY_DOUBTFUL = 3.0
# Bins of the histogram of the uncertainty, and the share of the pixels that it shows. Not measured: more bins are
# noisier, and a larger share leaves less room for the rest.
BINS, SHOWN = 80, 0.99
# Size of a picture, inches, and its resolution, px per inch. Not measured: larger ones are sharper, and their file
# grows as the square.
PICTURE_INCHES, PICTURE_DPI = (5.6, 4.2), 120
# Length in letters of a value of the settings in a table; the full settings follow below it. Not tuned: two lines.
LETTERS_MAX = 160
