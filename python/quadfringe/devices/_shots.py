"""The one place where images of a camera become a shot, with or without an infrared image.

>>> import numpy as np
>>> from quadfringe.devices._shots import shot_of
>>> grey = np.zeros((6, 8), np.uint8)
>>> shot_of({"red": grey, "green": grey, "blue": grey}, 255.0)
Shot(8 x 6 uint8 up to 255, without infrared)
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadfringe.config import BayerPattern
from quadfringe.data import AnyShot, BayerShot, Shot, Stamp

__all__ = ["shot_of", "split_colours"]


def shot_of(
    images: Mapping[str, NDArray[Any]],
    full_scale: float,
    *,
    bayer: BayerPattern | None = None,
    stamp: Stamp | None = None,
) -> AnyShot:
    """Make a shot of the images of one exposure, (H, W) each: `red`, `green`, `blue`, or with `bayer` `raw`.

    Without `ir` the shot is one of three colours. Raises `InputError` for images of unequal size or type.
    """
    ir = images.get("ir")
    if bayer is not None:
        return BayerShot(images["raw"], bayer, ir, full_scale, stamp=stamp)
    return Shot(images["red"], images["green"], images["blue"], ir, full_scale, stamp=stamp)


def split_colours(image: NDArray[Any]) -> dict[str, NDArray[Any]]:
    """Give the planes of a colour image (H, W, 3) in R, G, B order, as arrays that share no memory with it."""
    return {name: np.ascontiguousarray(image[:, :, n]) for n, name in enumerate(("red", "green", "blue"))}
