"""The images that projectors show."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from quadfringe import _core

__all__ = ["projector_images"]


def projector_images(
    fringes: tuple[float, float, float], size_px: tuple[int, int], layout: str
) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """Give the composite colour image (H, W, 3) and the infrared image (H, W), uint8; `size_px` is (W, H).

    Raises ValueError when the joint range of the fringes does not cover the width.
    """
    _core.check_code(fringes, size_px[0])
    red, green, blue, ir = (
        _core.pattern(channel, fringes, *size_px, layout=layout) for channel in ("R", "G", "B", "IR")
    )
    return _eight_bit(np.stack([red, green, blue], axis=2)), _eight_bit(ir)


def _eight_bit(light: NDArray[np.float32]) -> NDArray[np.uint8]:
    return np.round(light * 255).astype(np.uint8)
