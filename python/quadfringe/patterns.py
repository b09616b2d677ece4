"""The images that projectors show, as files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from quadfringe import _core
from quadfringe.files import folder_for
from quadfringe.images import write_image

__all__ = ["projector_images", "write_patterns"]


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


def write_patterns(
    folder: Path, fringes: tuple[float, float, float], size_px: tuple[int, int], layout: str
) -> list[Path]:
    """Write visible.png and infrared.png into `folder`; returns their paths."""
    visible, infrared = projector_images(fringes, size_px, layout)
    folder_for(folder)
    paths = [folder / "visible.png", folder / "infrared.png"]
    for path, image in zip(paths, (visible, infrared), strict=True):
        write_image(path, image)
    return paths
