"""A saved shape of two planes with a step between, and rays to its points."""

from __future__ import annotations

import numpy as np

from quadfringe.data import Shape
from quadfringe.view.measuring import Ray

__all__ = ["COLUMNS", "ROWS", "SOUGHT", "STEP_MM", "stepped_shape", "towards"]

ROWS, COLUMNS, STEP_MM = 60, 80, 40.0
SOUGHT = (20, 30)  # a pixel of the far plane


def stepped_shape() -> Shape:
    """Two planes with a step between, as a camera sees them, and one missing row."""
    row, column = np.mgrid[0:ROWS, 0:COLUMNS].astype(np.float32)
    depth = np.where(column < COLUMNS / 2, 800.0, 800.0 - STEP_MM).astype(np.float32)
    xyz = np.stack([(column - 40) * depth / 400, (row - 30) * depth / 400, depth], axis=2)
    xyz[50] = np.nan
    sigma = (0.1 + 0.001 * row).astype(np.float32)
    return Shape(row, column, np.ones_like(depth), column / COLUMNS, xyz_mm=xyz, uncertainty_mm=sigma)


def towards(shape: Shape, pixel: tuple[int, int], eye: tuple[float, float, float]) -> Ray:
    """The ray from an eye through a point of the shape."""
    assert shape.xyz_mm is not None
    away = shape.xyz_mm[pixel].astype(float) - eye
    return Ray(np.array(eye), away / np.linalg.norm(away))
