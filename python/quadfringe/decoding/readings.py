"""Other readings of a shot: its channels in another order, or another Bayer pattern; bands of rows to try them on."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import permutations
from typing import get_args

import numpy as np

from quadfringe.config import BayerPattern
from quadfringe.data import AnyShot, BayerShot, Shape, Shot

__all__ = ["Reading", "band_of", "other_readings", "rows_of"]

# A band of rows shows which exchanges can explain a doubtful shot: the share of the rows, and their least number.
BAND_SHARE, BAND_ROWS_MIN = 1 / 8, 96


@dataclass(frozen=True)
class Reading:
    """A shot as it may have been meant, in words, and what to do if so."""

    found: str
    fix: str
    shot: AnyShot


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


def other_readings(shot: AnyShot) -> list[Reading]:
    """Give the shot with its channels in every other order, or with another Bayer pattern."""
    if isinstance(shot, BayerShot):
        return [_pattern(shot, name) for name in get_args(BayerPattern) if name != shot.bayer]
    names = tuple(shot.channels)
    return [_ordered(shot, order) for order in permutations(names) if order != names]


def _pattern(shot: BayerShot, name: BayerPattern) -> Reading:
    words = f"the Bayer pattern seems to be {name}, not {shot.bayer}"
    return Reading(
        words, f'read the mosaic with bayer="{name}", on the command line --bayer {name}', replace(shot, bayer=name)
    )


def _ordered(shot: Shot, order: tuple[str, ...]) -> Reading:
    """Read the image given as each channel as that of `order`."""
    images = dict(zip(order, shot.channels.values(), strict=True))
    moved = [(given, name) for given, name in zip(shot.channels, order, strict=True) if given != name]
    read = Shot(images["red"], images["green"], images["blue"], images.get("ir"), shot.full_scale)
    if len(moved) == 2:
        words = f"{moved[0][0]} and {moved[1][0]} seem to be swapped"
        return Reading(words, "give the images of these channels the other way round", read)
    words = f"the channels seem to be in the order {', '.join(order)}"
    return Reading(words, "give " + ", ".join(f"the image given as {given} as {name}" for given, name in moved), read)
