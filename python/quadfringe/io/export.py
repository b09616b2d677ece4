"""Write arrays for other programs: PLY for MeshLab and CloudCompare, TIFF for image tools, NPZ for NumPy."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadfringe.errors import require
from quadfringe.files import atomic

__all__ = ["grey", "write_depth", "write_npz", "write_ply"]


def grey(modulation: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Convert modulation (H, W) to a grey picture (H, W, 3) uint8; it follows the albedo and shows no fringes."""
    top = np.nanquantile(modulation, 0.99) if np.isfinite(modulation).any() else 1.0
    shades = np.nan_to_num(modulation / max(float(top), 1e-9)).clip(0, 1) * 255
    return np.repeat(shades.astype(np.uint8)[:, :, None], 3, axis=2)


def write_ply(
    path: Path,
    points_mm: NDArray[np.float32],
    colour: NDArray[np.uint8],
    scalars: Mapping[str, NDArray[np.float32]],
) -> None:
    """Write N points as binary PLY: x, y, z (N, 3), mm, colour (N, 3), and scalars (N,) by name."""
    require("trimesh", "export")
    from trimesh import PointCloud
    from trimesh.exchange.ply import export_ply

    cloud = PointCloud(points_mm, colors=colour)
    cloud.vertex_attributes = {name: np.ascontiguousarray(values, np.float32) for name, values in scalars.items()}
    with atomic(path) as temporary:
        temporary.write_bytes(export_ply(cloud))


def write_depth(path: Path, depth_mm: NDArray[np.float32]) -> None:
    """Write a depth map (H, W) as 32-bit float TIFF, mm; missing data stays NaN."""
    tifffile = require("tifffile", "export")
    with atomic(path) as temporary:
        tifffile.imwrite(temporary, depth_mm.astype(np.float32), metadata={"unit": "mm"})


def write_npz(path: Path, maps: Mapping[str, NDArray[Any]], texts: Mapping[str, str]) -> None:
    """Write named maps and named JSON texts to one NPZ file."""
    arrays: dict[str, Any] = {**maps, **{name: np.array(text) for name, text in texts.items()}}
    with atomic(path) as temporary, temporary.open("wb") as stream:
        np.savez(stream, **arrays)
