"""Shots with too much light: the intensities times a factor, everywhere or in a highlight, cut off at full scale."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from quadfringe.data import Shot
from quadfringe.decoding.closures import in_squares

__all__ = ["Highlight", "fullest_tile", "overexposed", "saturated_share"]


@dataclass(frozen=True)
class Highlight:
    """A round highlight: centre (column, row) and radius in px; `gain` times the light of a pixel is added."""

    centre_px: tuple[float, float]
    radius_px: float
    gain: float

    def added(self, shape: tuple[int, ...]) -> NDArray[np.float64]:
        """Give the light that is added to the pixels (H, W) of an image, as a factor of theirs."""
        y, x = np.mgrid[: shape[0], : shape[1]]
        square = ((x - self.centre_px[0]) ** 2 + (y - self.centre_px[1]) ** 2) / (2 * self.radius_px**2)
        return np.asarray(self.gain * np.exp(-(square**2)), np.float64)

    def inside(self, shape: tuple[int, ...]) -> NDArray[np.bool_]:
        """Give the pixels (H, W) with a third of the greatest added light or more."""
        return self.added(shape) >= self.gain / 3

    def on(self, shot: Shot) -> Shot:
        """Add the highlight to a shot of 8 bit."""
        return overexposed(shot, 1 + self.added(shot.red.shape))


def overexposed(shot: Shot, factor: float | NDArray[np.float64]) -> Shot:
    """Give a shot of 8 bit this many times its light, or its pixels (H, W); its noise grows by the same factor."""
    assert shot.red.dtype == np.uint8, shot.red.dtype
    red, green, blue, ir = (
        np.minimum(np.round(factor * image), 255).astype(np.uint8) for image in shot.channels.values()
    )
    return Shot(red, green, blue, ir)


def saturated_share(shot: Shot) -> NDArray[np.float64]:
    """Give the shares of the pixels with at least one, two and three saturated channels."""
    count = np.sum([image == 255 for image in shot.channels.values()], axis=0)
    return np.array([np.mean(count >= least) for least in (1, 2, 3)])


def fullest_tile(shot: Shot, side_px: int = 32) -> float:
    """Give the greatest share of a tile whose pixels have a saturated channel and two or more that are not."""
    images = list(shot.channels.values())
    count = np.sum([image == 255 for image in images], axis=0)
    cut = (count > 0) & (len(images) - count >= 2)
    return float(in_squares(cut, side_px).mean(axis=1).max())
