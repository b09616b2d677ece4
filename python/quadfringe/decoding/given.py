"""How the images of a shot were given: saturated, without fringes, or one image twice."""

from __future__ import annotations

import math
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadfringe.data import AnyShot, BayerShot
from quadfringe.decoding import params
from quadfringe.decoding.cause import Cause

__all__ = ["blind_channels", "copied", "same_images", "saturated_from"]

STRIDE = 4  # pixels between samples of the light, along rows and columns: enough for quantiles
DARK = 0.02  # fraction of full scale; a channel whose brightest pixels stay below it is black
# Range of the values of a channel, relative to the widest one, below which it is even. Fringes of the weakest light
# that is decoded have 0.15 of the others and a noise of 3 % of full scale has 0.2: `pytest tests/test_doctor.py`.
EVEN = 0.12
NEARLY_NONE = 5e-4  # share of the pixels of a black or saturated channel that may differ


def blind_channels(shot: AnyShot) -> Cause | None:
    """Find the channels that are black, saturated or even over nearly the whole image, and so show no fringes."""
    full, found = shot.full_scale_value, []
    ranges = {name: _range(image) for name, image in shot.channels.items()}
    widest = max(high - low for low, high in ranges.values())
    for name, (low, high) in ranges.items():
        if high < DARK * full:
            found.append(f"channel {name} is black (hardly a pixel is above {high:g} of {full:g})")
        elif low >= full:
            found.append(f"channel {name} is saturated (hardly a pixel is below {full:g})")
        elif high - low < EVEN * widest:
            found.append(f"channel {name} is even (nearly all pixels are from {low:g} to {high:g} of {full:g})")
    return Cause("blind channel", "; ".join(found), "check exposure, lens cap and light source") if found else None


def _range(image: NDArray[Any]) -> tuple[float, float]:
    """Give the values between which nearly all pixels lie."""
    low, high = np.quantile(image[::STRIDE, ::STRIDE], (NEARLY_NONE, 1 - NEARLY_NONE))
    return float(low), float(high)


def copied(shot: AnyShot) -> bool:
    """Say whether two channels are equal in some of the rows."""
    if isinstance(shot, BayerShot):
        return False
    rows = [image[:: params.SAME_ROWS] for image in shot.channels.values()]
    return any(np.array_equal(*pair) for pair in combinations(rows, 2))


def same_images(shot: AnyShot) -> Cause | None:
    """Find channels that are the same image, by their noise, which no other image has.

    The second difference along the rows keeps noise, and hardly any of the fringes and the print that channels share.
    """
    if isinstance(shot, BayerShot):
        return None
    rows = {name: image[:: params.SAME_ROWS].astype(np.float32) for name, image in shot.channels.items()}
    fine = {name: (row[:, :-2] + row[:, 2:] - 2 * row[:, 1:-1]).ravel() for name, row in rows.items()}
    groups: list[list[str]] = []
    for name, detail in fine.items():
        same = [group for group in groups if _correlation(fine[group[0]], detail) > params.SAME_MIN]
        if same:
            same[0].append(name)
        else:
            groups.append([name])
    words = [f"{', '.join(group[:-1])} and {group[-1]} are the same image" for group in groups if len(group) > 1]
    if not words:
        return None
    return Cause(
        "same image", ", and ".join(words), "check that the image of every channel is given once, and under its name"
    )


def _correlation(first: NDArray[np.float32], second: NDArray[np.float32]) -> float:
    """Give the correlation of two signals without a mean; 0 if one of them is even."""
    scale = float(np.sqrt(np.dot(first, first) * np.dot(second, second)))
    return float(np.dot(first, second)) / scale if scale else 0.0


def saturated_from(shot: AnyShot) -> float:
    """Give the value from which a pixel of a shot counts as saturated."""
    level = 0.998 * shot.full_scale_value
    # For whole numbers it is the same, and they are compared without conversion.
    return math.ceil(level) if shot.first.dtype.kind == "u" else level
