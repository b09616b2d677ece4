"""Shots that were exposed too long: the intensities times a factor, cut off at full scale."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from quadfringe.data import Shot

__all__ = ["overexposed", "saturated_share"]


def overexposed(shot: Shot, factor: float) -> Shot:
    """Expose a shot of 8 bit this many times as long; its noise grows by the same factor."""
    assert shot.red.dtype == np.uint8, shot.red.dtype
    red, green, blue, ir = (
        np.minimum(np.round(factor * image), 255).astype(np.uint8) for image in shot.channels.values()
    )
    return Shot(red, green, blue, ir)


def saturated_share(shot: Shot) -> NDArray[np.float64]:
    """Give the shares of the pixels with at least one, two and three saturated channels."""
    count = np.sum([image == 255 for image in shot.channels.values()], axis=0)
    return np.array([np.mean(count >= least) for least in (1, 2, 3)])
