"""Flat field of a camera: vignetting, pixel gain, defects, and the gain map that corrects them.

Decoding does not apply the gain map: phase is insensitive to slow variation, and decoding windows average the gain of
single pixels. `evaluation/flat_field.py` measures what the correction would gain.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from quadfringe.calibration._params import DEFECT, FLAT_LIGHT, FLAT_SHOTS_MIN, SLOW_PX
from quadfringe.calibration.levels import row4, stacked
from quadfringe.config import Row4
from quadfringe.data import AnyShot
from quadfringe.errors import InputError

__all__ = ["FlatField", "flat_field"]


@dataclass(frozen=True)
class FlatField:
    """Gain map (4, H, W) float32, NaN at defective pixels, and figures of R, G, B, IR in per cent.

    Without infrared the map is (3, H, W), and its figures are 0. `vignetting` compares the darkest with the brightest
    region. `pixels` is the standard deviation of the pixel gain from its surroundings, temporal noise excluded.
    `uneven` is the standard deviation over the image before and after applying the gain, in shots that the gain was not
    computed from.
    """

    gain: NDArray[np.float32]
    vignetting_percent: Row4
    pixels_percent: Row4
    uneven_before_percent: Row4
    uneven_after_percent: Row4
    defects: int

    @property
    def figures(self) -> dict[str, float]:
        """The worst channel of each figure, by name."""
        names = ("vignetting_percent", "pixels_percent", "uneven_before_percent", "uneven_after_percent")
        return {name: max(getattr(self, name)) for name in names} | {"defects_pixels": float(self.defects)}


def flat_field(shots: Sequence[AnyShot], dark: Sequence[float] = (0.0,) * 4) -> FlatField:
    """Compute the gain of every pixel from at least four shots of an evenly lit white surface, best out of focus.

    Every second shot gives the gain; the others judge it. Raises `InputError` for fewer shots, for shots of different
    sizes, and for shots that are too dark or too bright.
    """
    if len(shots) < FLAT_SHOTS_MIN:
        raise InputError(
            f"flat field: expected {FLAT_SHOTS_MIN} shots or more of an evenly lit surface, got {len(shots)}"
        )
    levels = zip(shots[0].channels, dark, strict=False)  # the dark level of infrared is left over without it
    found = [_channel(stacked(shots, name) - level, name) for name, level in levels]
    return FlatField(
        gain=np.stack([channel.gain for channel in found]),
        vignetting_percent=row4([channel.vignetting_percent for channel in found]),
        pixels_percent=row4([channel.pixels_percent for channel in found]),
        uneven_before_percent=row4([channel.uneven_before_percent for channel in found]),
        uneven_after_percent=row4([channel.uneven_after_percent for channel in found]),
        defects=sum(channel.defects for channel in found),
    )


@dataclass(frozen=True)
class _Channel:
    """The fields of `FlatField` for one channel."""

    gain: NDArray[np.float32]
    vignetting_percent: float
    pixels_percent: float
    uneven_before_percent: float
    uneven_after_percent: float
    defects: int


def _channel(stack: NDArray[np.float64], name: str) -> _Channel:
    import cv2

    given, judged = stack[::2].mean(axis=0), stack[1::2].mean(axis=0)
    level = float(np.median(given))
    low_limit, high_limit = FLAT_LIGHT
    if not low_limit <= level <= high_limit:
        raise InputError(
            f"flat field: {name} has {level:.0%} of full scale, expected {low_limit:.0%} to {high_limit:.0%}; change "
            "the light or the exposure"
        )
    slow = cv2.GaussianBlur(given, (0, 0), SLOW_PX, borderType=cv2.BORDER_REFLECT)
    defective = np.abs(given / slow - 1) > DEFECT
    gain = np.where(defective, np.nan, level / given)
    # Temporal noise is independent between the two halves, so the mean of their product does not contain it.
    pixels = [(half / slow - 1)[~defective] for half in (given, judged)]
    shared = float(np.mean(pixels[0] * pixels[1]) - np.mean(pixels[0]) * np.mean(pixels[1]))
    low, high = np.quantile(slow, (0.001, 0.999))
    uneven = [100 * float(np.nanstd(image)) / level for image in (judged, judged * gain)]
    return _Channel(
        gain.astype(np.float32),
        vignetting_percent=100 * float(1 - low / high),
        pixels_percent=100 * max(shared, 0.0) ** 0.5,
        uneven_before_percent=uneven[0],
        uneven_after_percent=uneven[1],
        defects=int(defective.sum()),
    )
