"""Samples of a shape, and the direction in which projector columns grow in the images of its shot.

Camera and projector that stand upright see columns grow from left to right, whatever the surface. A calibration says
how they stand, and `plausibility` refuses what contradicts it. Without one, another direction is a doubt.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from quadfringe.data import Shape
from quadfringe.decoding import params
from quadfringe.decoding.cause import Cause

__all__ = ["Samples", "samples_of", "unusual_direction"]

UPRIGHT = "if camera and projector are meant to stand so, nothing is wrong, and a calibration ends this warning"


@dataclass(frozen=True)
class Samples:
    """Every so many pixels of a map, with those a few pixels to the right of each, and below."""

    stride: int

    @property
    def here(self) -> tuple[slice, slice]:
        """The samples."""
        return np.s_[: -params.REACH_PX : self.stride, : -params.REACH_PX : self.stride]

    @property
    def right(self) -> tuple[slice, slice]:
        """Pixels to the right of the samples."""
        return np.s_[: -params.REACH_PX : self.stride, params.REACH_PX :: self.stride]

    @property
    def below(self) -> tuple[slice, slice]:
        """Pixels below the samples."""
        return np.s_[params.REACH_PX :: self.stride, : -params.REACH_PX : self.stride]

    def growth(self, column_px: NDArray[np.float32]) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Give by how much columns grow to the right and down."""
        return column_px[self.right] - column_px[self.here], column_px[self.below] - column_px[self.here]


def samples_of(column_px: NDArray[np.float32]) -> Samples | None:
    """Give a few thousand samples, closer together on a small object; None with too few that are returned."""
    stride = max(1, min(column_px.shape) // params.SAMPLES)
    for samples in (Samples(stride), Samples(max(1, stride // params.FINER))):
        if np.count_nonzero(np.isfinite(column_px[samples.here])) >= params.SAMPLES_MIN:
            return samples
    return None


def unusual_direction(shape: Shape) -> Cause | None:
    """Find columns that do not grow from left to right in most of a shape without a calibration."""
    samples = samples_of(shape.column_px) if shape.calibration is None else None
    if samples is None:
        return None
    right, down = samples.growth(shape.column_px)
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
