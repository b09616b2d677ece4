"""Precision and trueness in the words of data sheets of 3D cameras.

Precision is what repeated or neighbouring points scatter by; trueness is how far their mean is off. Each figure is one
standard deviation or one deviation, not a range, so that it is smaller than the form errors of VDI/VDE 2634 part 2.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from quadfringe.calibration._params import SAME_POSE_MM, TILE_FILLED, TILE_PX
from quadfringe.decoding.compare import Deviations
from quadfringe.decoding.compare.deviations import deviations_of

__all__ = ["dimension_trueness_percent", "global_planarity_mm", "local_planarity_mm", "point_precision_mm"]

Map = NDArray[np.float64]


def point_precision_mm(shapes: Sequence[NDArray[np.floating]]) -> float | None:
    """Give the standard deviation of the depth of one point in repeated captures; None without a repeated pose.

    `shapes` are points (H, W, 3), mm. Neighbours in the sequence whose depths agree within 0.5 mm in three points of
    four count as one pose; the robust spread of their difference is that of two captures.
    """
    found = [one.robust_rms / np.sqrt(2) for a, b in pairwise(shapes) if (one := _repeated(a, b))]
    return float(np.median(found)) if found else None


def _repeated(a: NDArray[np.floating], b: NDArray[np.floating]) -> Deviations | None:
    if a.shape != b.shape:
        return None
    difference = a[..., 2].astype(np.float64) - b[..., 2]
    known = np.isfinite(difference)
    if not known.any() or float(np.quantile(np.abs(difference[known]), 0.75)) > SAME_POSE_MM:
        return None
    return deviations_of(difference, known, None, "mm")


def local_planarity_mm(distances_mm: Map) -> float:
    """Give the precision of local planarity: median standard deviation of points from a plane through their tile.

    `distances_mm` (H, W) are distances from the plane that fits all, NaN without data; tiles are 32 x 32 pixels. NaN
    without a filled tile.
    """
    y, x = np.mgrid[:TILE_PX, :TILE_PX].astype(np.float64)
    terms = np.stack([np.ones_like(x), x, y], axis=-1)
    found = []
    for tile in _tiles(distances_mm):
        known = np.isfinite(tile)
        rest = tile[known] - terms[known] @ np.linalg.lstsq(terms[known], tile[known], rcond=None)[0]
        found.append(float(rest.std()))
    return float(np.median(found)) if found else float("nan")


def global_planarity_mm(distances_mm: Map) -> float:
    """Give the trueness of global planarity: how far the mean of a tile is from the plane, at most, in 95 % of them.

    Arguments as in `local_planarity_mm`.
    """
    means = [float(np.nanmean(tile)) for tile in _tiles(distances_mm)]
    return float(np.quantile(np.abs(means), 0.95)) if means else float("nan")


def dimension_trueness_percent(errors_mm: Sequence[float], sizes_mm: Sequence[float]) -> float:
    """Give the largest error of a length over the length, %."""
    return 100 * max(abs(error) / abs(size) for error, size in zip(errors_mm, sizes_mm, strict=True))


def _tiles(values: Map) -> Iterator[Map]:
    rows, columns = values.shape
    for y in range(0, rows - TILE_PX + 1, TILE_PX):
        for x in range(0, columns - TILE_PX + 1, TILE_PX):
            tile = values[y : y + TILE_PX, x : x + TILE_PX]
            if np.isfinite(tile).mean() >= TILE_FILLED:
                yield tile
