"""How evenly a camera sees even light: vignetting, gain of single pixels, defects, and the gain that makes it even.

Decoding does not use the gain: phase does not see what varies slowly, and single pixels are averaged over a window.
What it would save is measured by `evaluation/flat_field.py`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from quadfringe.calibration.levels import CHANNELS, row4, stacked
from quadfringe.config import Row4
from quadfringe.data import AnyShot
from quadfringe.errors import InputError

__all__ = ["FlatField", "flat_field"]

SHOTS_MIN = 4
SLOW_PX = 15.0  # what varies over more than this is vignetting and light, what varies faster is pixels
DEFECT = 0.5  # a pixel whose gain differs from its surroundings by more than this share
LIGHT = (0.15, 0.9)  # mean captured intensity of an evenly lit shot that can be used, share of full scale


@dataclass(frozen=True)
class FlatField:
    """Gain (4, H, W) float32 that makes even light even, NaN at defective pixels; figures of R, G, B, IR in per cent.

    `vignetting` is how much darker the darkest region is than the brightest, `pixels` the standard deviation of single
    pixels from their surroundings without their noise, `uneven` the standard deviation over the image without and with
    the gain, in shots that the gain was not made from.
    """

    gain: NDArray[np.float32]
    vignetting_percent: Row4
    pixels_percent: Row4
    uneven_before_percent: Row4
    uneven_after_percent: Row4
    defects: int

    @property
    def figures(self) -> dict[str, float]:
        """Give the worst of the channels by name."""
        names = ("vignetting_percent", "pixels_percent", "uneven_before_percent", "uneven_after_percent")
        return {name: max(getattr(self, name)) for name in names} | {"defects_pixels": float(self.defects)}


def flat_field(shots: Sequence[AnyShot], dark: Sequence[float] = (0.0,) * 4) -> FlatField:
    """Give the gain of every pixel from four shots or more of an evenly lit white surface, best out of focus.

    Every second shot makes the gain, the others judge it. Raises `InputError` for fewer shots, shots of different size,
    and shots too dark or too bright to tell anything.
    """
    if len(shots) < SHOTS_MIN:
        raise InputError(f"flat field: expected {SHOTS_MIN} shots or more of an evenly lit surface, got {len(shots)}")
    found = [_channel(stacked(shots, name) - level, name) for name, level in zip(CHANNELS, dark, strict=True)]
    figures = [row4([channel.figures[i] for channel in found]) for i in range(4)]
    gain = np.stack([channel.gain for channel in found])
    return FlatField(gain, figures[0], figures[1], figures[2], figures[3], sum(channel.defects for channel in found))


@dataclass(frozen=True)
class _Channel:
    gain: NDArray[np.float32]
    figures: tuple[float, float, float, float]
    defects: int


def _channel(stack: NDArray[np.float64], name: str) -> _Channel:
    import cv2

    made, judged = stack[::2].mean(axis=0), stack[1::2].mean(axis=0)
    level = float(np.median(made))
    if not LIGHT[0] <= level <= LIGHT[1]:
        raise InputError(
            f"flat field: {name} has {level:.0%} of full scale; light the surface so that it lies between "
            f"{LIGHT[0]:.0%} and {LIGHT[1]:.0%}"
        )
    slow = cv2.GaussianBlur(made, (0, 0), SLOW_PX, borderType=cv2.BORDER_REFLECT)
    defective = np.abs(made / slow - 1) > DEFECT
    gain = np.where(defective, np.nan, level / made)
    # Noise is independent between the two halves and drops out of their product.
    pixels = [(half / slow - 1)[~defective] for half in (made, judged)]
    shared = float(np.mean(pixels[0] * pixels[1]) - np.mean(pixels[0]) * np.mean(pixels[1]))
    low, high = np.quantile(slow, (0.001, 0.999))
    uneven = [100 * float(np.nanstd(image)) / level for image in (judged, judged * gain)]
    vignetting = 100 * float(1 - low / high)
    figures = (vignetting, 100 * max(shared, 0.0) ** 0.5, uneven[0], uneven[1])
    return _Channel(gain.astype(np.float32), figures, int(defective.sum()))
