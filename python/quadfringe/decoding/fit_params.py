"""The tuned numbers of the fit of waves to a decoded shot: value, unit, trade-off, and what measured each."""

from __future__ import annotations

__all__: list[str] = []

# Ratio of the second harmonic to the first, from which a refused shot is said to be not linear. Sound shots have
# 0.007.
HARMONIC = 0.08
# Relative amplitude of the fringes of another channel from which a refused shot is said to have crosstalk.
STRAY = 0.15
# Ratio that either must surely exceed to be named. Sound white shots have up to 0.01, painted faces 0.02, photographs
# 0.05 with as large an error (value of the finding `crosstalk`; `pytest tests/test_first_cause.py` has such shots). A
# larger number leaves crosstalk on narrow or printed objects unnamed, a smaller one names what shading and print leave.
SOUND = 0.02
# Standard errors by which it must be exceeded, and side of the tiles that tell the error, px, or a fringe if it is
# wider: `python evaluation/narrow.py` counts what is named on objects of 4 to 20 % of the frame, across which fringes
# are nearly alike. Of sound ones none is at 3, and at 2 some are. More errors leave real crosstalk on small objects
# unnamed; wider tiles leave too few of them, and narrower ones share their print, so that errors seem small.
SURE_SDS, TILE_OF_ERRORS_PX = 3.0, 48
