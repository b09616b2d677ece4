"""Other readings of a shot: its channels exchanged, or another Bayer pattern, and bands of its rows to try them on."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations
from typing import get_args

import numpy as np

from quadfringe.config import BayerPattern
from quadfringe.data import AnyShot, BayerShot, Shape, Shot

__all__ = ["band_of", "other_readings", "rows_of"]

# A band of rows shows which exchanges can explain a doubtful shot: the share of the rows, and their least number.
BAND_SHARE, BAND_ROWS_MIN = 1 / 8, 96


def band_of(shape: Shape) -> tuple[int, int]:
    """Give the first row, which is even because a mosaic repeats after two, and the number of rows with most light."""
    lit = np.isfinite(shape.quality).sum(axis=1)
    count = min(lit.size, max(BAND_ROWS_MIN, 2 * round(BAND_SHARE * lit.size / 2)))
    return 2 * (int(np.convolve(lit, np.ones(count), "valid").argmax()) // 2), count


def rows_of(shot: AnyShot, first: int, count: int) -> AnyShot:
    """Give a shot of some rows only."""
    images = {name: image[first : first + count] for name, image in shot.images.items()}
    if isinstance(shot, BayerShot):
        return BayerShot(images["raw"], shot.bayer, images.get("ir"), shot.full_scale)
    return Shot(images["red"], images["green"], images["blue"], images.get("ir"), shot.full_scale)


def other_readings(shot: AnyShot) -> dict[str, AnyShot]:
    """Give the shot with channels exchanged or another Bayer pattern, by the message for that case."""
    if isinstance(shot, BayerShot):
        others = (name for name in get_args(BayerPattern) if name != shot.bayer)
        return {f"the Bayer pattern seems to be {o}, not {shot.bayer}": replace(shot, bayer=o) for o in others}
    pairs = combinations(shot.channels, 2)
    return {f"{a} and {b} seem to be swapped": _exchanged(shot, a, b) for a, b in pairs}


def _exchanged(shot: Shot, first: str, second: str) -> Shot:
    images = shot.channels
    images[first], images[second] = images[second], images[first]
    return Shot(images["red"], images["green"], images["blue"], images.get("ir"), shot.full_scale)
