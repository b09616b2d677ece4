"""Step images of a smooth surface whose columns are known, for tests of the reference measurement."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

import quadfringe as qf

__all__ = ["COLUMN_PX", "NUMBERS", "WIDTH_PX", "errors_px", "levels", "stacks"]

WIDTH_PX, NUMBERS = 912, (36.0, 35.0, 30.0)
COLUMN_PX = 100 + 0.7 * np.arange(256) + 0.3 * np.sin(np.arange(64) / 9)[:, None]


def stacks(
    steps: tuple[int, ...],
    numbers: tuple[float, ...] = NUMBERS,
    noise: float = 0.0,
    level: float = 0.5,
    amplitude: float = 0.3,
) -> list[NDArray[np.float32]]:
    """Give step images of a smooth surface, shares of full scale, clipped at 1."""
    rng = np.random.default_rng(7)
    found = []
    for number, count in zip(numbers, steps, strict=True):
        phase_rad = 2 * np.pi * number * COLUMN_PX / WIDTH_PX
        shifts_rad = 2 * np.pi * np.arange(count)[:, None, None] / count
        light = level + amplitude * np.cos(phase_rad + shifts_rad)
        found.append(np.clip(light + noise * rng.standard_normal(light.shape), 0, 1).astype(np.float32))
    return found


def levels(images: list[NDArray[np.float32]], full_scale: int) -> list[NDArray[np.uint8 | np.uint16]]:
    dtype = np.uint8 if full_scale == 255 else np.uint16
    return [np.round(image * full_scale).astype(dtype) for image in images]


def errors_px(shape: qf.Shape) -> NDArray[np.float64]:
    return np.asarray(shape.column_px - COLUMN_PX)
