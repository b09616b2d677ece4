"""The direction in which projector columns grow in the images of a shot.

Camera and projector that stand upright see columns grow from left to right, whatever the surface. A calibration says
how they stand, and `plausibility` refuses what contradicts it. Without one, another direction is a doubt.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from quadfringe.data import Shape
from quadfringe.decoding import params
from quadfringe.decoding.cause import Cause

__all__ = ["unusual_direction"]

UPRIGHT = "if camera and projector are meant to stand so, nothing is wrong, and a calibration ends this warning"


def unusual_direction(shape: Shape) -> Cause | None:
    """Find columns that do not grow from left to right in most of a shape without a calibration."""
    if shape.calibration is not None:
        return None
    right, down = _growth(shape.column_px)
    known = np.isfinite(right) & np.isfinite(down)
    if np.count_nonzero(known) < params.SAMPLES_MIN:
        return None
    angle_deg = np.abs(np.degrees(np.arctan2(down[known], right[known])))
    upright = angle_deg < params.UPRIGHT_DEG
    backwards = angle_deg > 180 - params.UPRIGHT_DEG
    if np.mean(~upright & ~backwards) > params.REFUSED_SHARE:
        words = "the images seem to be turned by 90 degrees: fringes run along the rows, and projector columns grow "
        words += "down the images" if np.median(down[known]) > 0 else "up the images"
        return Cause("turned images", words, f"turn the images, or the camera, by 90 degrees; {UPRIGHT}", fatal=False)
    if np.mean(backwards) > params.REFUSED_SHARE:
        words = "the images seem to be mirrored, or turned by 180 degrees: projector columns grow from right to left"
        fix = f"switch off mirroring and rotation in the settings of camera and projector; {UPRIGHT}"
        return Cause("mirrored or rotated", words, fix, fatal=False)
    return None


def _growth(column_px: NDArray[np.float32]) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Give by how much columns grow to the right and down, over a few pixels, at a few thousand samples."""
    reach, stride = params.REACH_PX, max(1, min(column_px.shape) // params.SAMPLES)
    here = column_px[:-reach:stride, :-reach:stride]
    return column_px[:-reach:stride, reach::stride] - here, column_px[reach::stride, :-reach:stride] - here
