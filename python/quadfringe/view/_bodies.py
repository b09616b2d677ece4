"""What a page draws of a shape: points, or the triangles between them, with a colour for each."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from quadfringe.data import Shape
from quadfringe.data.points import xyz_mm_of
from quadfringe.view.colours import Picture

__all__ = ["NO_FACES", "Body", "body_of", "spacing_mm"]

Map = NDArray[np.float32]
SAMPLES = 20_000  # of neighbours, for their median distance
FALLBACK_MM = 0.3  # between points without neighbours
NO_FACES: NDArray[np.uint32] = np.empty((0, 3), np.uint32)


@dataclass(frozen=True)
class Body:
    """Points (N, 3) mm with colours (N, 3) and triangles (F, 3); without triangles, points of a size are drawn."""

    points_mm: Map
    faces: NDArray[np.uint32]
    colour: Picture
    size_mm: float


def body_of(shape: Shape, step: int, picture: Picture, *, surface: bool) -> Body:
    """Give the surface or the points of every `step`-th pixel of every `step`-th row, in the colours of their picture.

    `picture` holds these pixels alone.
    """
    xyz_mm = xyz_mm_of(shape)
    size_mm = spacing_mm(xyz_mm[::step, ::step])
    if surface:
        # Triangles of the whole shape, so that none lies across a step between the pixels that are left out. Colours
        # are taken afterwards, because painting every pixel takes longer than the triangles.
        mesh = shape.mesh(step=step, colour=np.zeros(xyz_mm.shape, np.uint8))
        if len(mesh.faces):
            row, column = (mesh.pixel // step).T
            return Body(mesh.vertices_mm, mesh.faces, picture[row, column], size_mm)
    points_mm = np.ascontiguousarray(xyz_mm[::step, ::step]).reshape(-1, 3)
    valid = np.flatnonzero(np.isfinite(points_mm[:, 2]))
    return Body(points_mm[valid], NO_FACES, picture.reshape(-1, 3)[valid], size_mm)


def spacing_mm(xyz_mm: Map) -> float:
    """Return the median distance of neighbours in a row of points (H, W, 3).

    >>> columns = np.arange(12, dtype=np.float32).reshape(3, 4)
    >>> spacing_mm(np.stack([0.5 * columns, columns * 0, columns * 0 + 800], axis=2))
    0.5
    """
    every = max(1, xyz_mm.shape[0] * xyz_mm.shape[1] // SAMPLES)
    away = np.linalg.norm(np.diff(xyz_mm[:: max(1, every // 4)], axis=1), axis=2)
    known = away[np.isfinite(away)]
    return float(np.median(known)) if known.size else FALLBACK_MM
