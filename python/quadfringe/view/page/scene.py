"""The surface of a report: the mesh of a shape, thinned and packed for the program of the page.

The arrays follow one another, each axis or channel by itself and as differences of neighbours, compressed by zlib:
positions (uint16, three axes), normals (int8, three axes), colour (uint8, three channels), levels of each further layer
(uint8), and the corners of the triangles (int32).
"""

from __future__ import annotations

import base64
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from math import ceil, sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadfringe.data import Shape
from quadfringe.data.mesh import Mesh
from quadfringe.errors import require
from quadfringe.view.page._params import VERTICES_MAX

__all__ = ["Scene", "packed"]

TURNED = np.array([1, -1, -1], np.float32)  # from the camera frame (y down, z forward) to y up


@dataclass(frozen=True)
class Scene:
    """A packed surface: base64 text, facts for the program, the names of the layers, and words for the reader."""

    data: str
    facts: Mapping[str, Any]
    layers: tuple[str, ...]
    words: str


def packed(shape: Shape) -> Scene | None:
    """Pack the surface of a shape, every n-th pixel of every n-th row; None without a calibration or triangles."""
    if shape.xyz_mm is None:
        return None
    step = max(1, ceil(sqrt(np.isfinite(shape.xyz_mm[:, :, 2]).sum() / VERTICES_MAX)))
    mesh = shape.mesh(step=step)
    if not len(mesh.faces):
        return None
    points = mesh.vertices_mm * TURNED
    low, high = points.min(axis=0), points.max(axis=0)
    scale = np.maximum(high - low, 1e-6) / 65535
    levels = _levels(mesh)
    parts = [
        _apart(np.round((points - low) / scale).astype(np.uint16)),
        _apart(np.round(np.nan_to_num(mesh.normals) * TURNED * 127).astype(np.int8)),
        _apart(mesh.colour),
        *(_apart(values[:, None]) for values in levels.values()),
        np.diff(mesh.faces.astype(np.int32).ravel(), prepend=np.int32(0)).astype("<i4").tobytes(),
    ]
    inner = np.quantile(points, (0.02, 0.98), axis=0)
    facts = {
        "vertices": len(points),
        "faces": len(mesh.faces),
        "low": low.tolist(),
        "scale": scale.tolist(),
        "centre": inner.mean(axis=0).tolist(),
        "radius": max(float(np.linalg.norm(inner[1] - inner[0])) / 2, 1e-3),
        "levels": len(levels),
        "colours": _ramp(),
    }
    thinned = f"every {_nth(step)} pixel of every {_nth(step)} row" if step > 1 else "every pixel"
    words = f"{len(points)} points and {len(mesh.faces)} triangles: {thinned}. The full surface: quadfringe convert."
    data = base64.b64encode(zlib.compress(b"".join(parts), 9)).decode()
    return Scene(data, facts, ("colour", "grey", *levels), words)


def _nth(step: int) -> str:
    return f"{step}{ {2: 'nd', 3: 'rd'}.get(step, 'th') }"


def _apart(values: NDArray[Any]) -> bytes:
    """Give the columns of (M, n) one after another, as differences of neighbours, which wrap around."""
    columns = np.ascontiguousarray(values.T)
    return np.diff(columns, axis=1, prepend=columns.dtype.type(0)).astype(columns.dtype.newbyteorder("<")).tobytes()


def _levels(mesh: Mesh) -> dict[str, NDArray[np.uint8]]:
    """Give the level of each vertex on the colour map, by the name of the layer; near is bright."""
    layers = {"depth": -mesh.vertices_mm[:, 2], "uncertainty": mesh.uncertainty_mm, "quality": mesh.quality}
    return {name: _level(values) for name, values in layers.items() if values is not None}


def _level(values: NDArray[np.float32]) -> NDArray[np.uint8]:
    finite = values[np.isfinite(values)]
    low, high = (float(v) for v in np.quantile(finite, (0.01, 0.99))) if finite.size else (0.0, 1.0)
    share = (np.nan_to_num(values, nan=low) - low) / max(high - low, 1e-9)
    return (share.clip(0, 1) * 255).astype(np.uint8)


def _ramp() -> list[int]:
    """Give the 256 colours of the map, red, green and blue of each."""
    ramp = require("matplotlib", "plot").colormaps["viridis"](np.arange(256), bytes=True)[:, :3]
    return [int(value) for value in ramp.ravel()]
