"""Fringe numbers and ideal images of the encoding, with arguments that are checked before the kernel takes them.

>>> import quadfringe as qf
>>> numbers = qf.optimum(36, 912)
>>> numbers, qf.pattern("red", numbers, 912, 2).shape
([36.0, 35.0, 30.0], (2, 912))
"""

from __future__ import annotations

from collections.abc import Sequence
from operator import index
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from quadfringe import _core
from quadfringe.config._base import SIZE_MAX
from quadfringe.config.fringes import fringe_numbers as numbers_of
from quadfringe.config.memory import require_memory
from quadfringe.errors import InputError

__all__ = ["check_code", "optimum", "pattern", "require_image"]

PATTERN_BYTES_PER_PX = 4  # of one channel, float32
CHANNELS = {"red": "R", "green": "G", "blue": "B", "ir": "IR"}


def optimum(n: int, projector_width: int) -> list[float]:
    """Give the fringe numbers N, N - 1, N - sqrt(N) of the optimum three-frequency selection.

    ValueError unless N is a perfect square that fits `projector_width` columns.
    """
    return list(_core.optimum(_whole("n", n), _whole("projector_width", projector_width)))


def check_code(
    fringe_numbers: Sequence[float], projector_width: int, *, columns_px: tuple[float, float] | None = None
) -> float:
    """Give the ambiguity margin in rad; ValueError when the joint range does not cover the projector.

    With `columns_px`, the first and the last column that can light the scene, only these must be distinguished.
    """
    width = _whole("projector_width", projector_width)
    return _core.check_code(numbers_of(fringe_numbers), width, columns_px=columns_px)


def pattern(
    channel: str,
    fringe_numbers: Sequence[float],
    width: int,
    height: int,
    *,
    layout: Literal["regular", "diamond"] = "regular",
) -> NDArray[np.float32]:
    """Give the ideal image of a channel, (height, width) float32, linear light from 0 to 1.

    `channel` is "red", "green", "blue" or "ir", or R, G, B or IR. ValueError for other names and wrong sizes, and for
    images that do not fit into memory. Two fringe numbers, or three and 0 as `Fringes.code` gives them, are
    those of an encoding without infrared.
    """
    letters = CHANNELS.get(channel, channel)
    if letters not in CHANNELS.values():
        raise InputError(f"channel: expected one of {', '.join(CHANNELS)}, or R, G, B, IR, got {channel!r}")
    require_image("pattern", (width, height), PATTERN_BYTES_PER_PX)
    return _core.pattern(letters, numbers_of(fringe_numbers), index(width), index(height), layout=layout)


def require_image(work: str, size_px: tuple[int, int], bytes_per_px: float) -> None:
    """Raise `InputError` unless an image of this size (columns, rows) is possible, and `work` on it fits into memory.

    >>> require_image("pattern", (912, 1140), 4)
    """
    width, height = _whole("width", size_px[0]), _whole("height", size_px[1])
    require_memory(work, (height, width), bytes_per_px)


def _whole(name: str, value: Any) -> int:
    try:
        number = index(value)
    except TypeError:
        raise InputError(f"{name}: expected a whole number, got {value!r}") from None
    if not 1 <= number <= SIZE_MAX:
        raise InputError(f"{name}: expected a number from 1 to {SIZE_MAX}, got {number}")
    return number
