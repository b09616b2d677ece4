"""The points of a shape, or the error that says how to get them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from quadfringe.errors import InputError

if TYPE_CHECKING:
    from quadfringe.data.shape import Shape

__all__ = ["xyz_mm_of"]


def xyz_mm_of(shape: Shape) -> NDArray[np.float32]:
    """Give the points, (H, W, 3) mm; raises `InputError` when the shape holds phase only."""
    if shape.xyz_mm is None:
        raise InputError("this shape holds phase only: decode with a calibration to get millimetres")
    return shape.xyz_mm
