"""Write arrays for other programs: PLY and meshes for MeshLab and CloudCompare, TIFF for image tools, NPZ for NumPy."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadfringe.errors import require
from quadfringe.files import atomic
from quadfringe.io.glb import encoded, glb_bytes

__all__ = ["Triangles", "grey", "srgb", "surface_picture", "write_depth", "write_mesh", "write_npz", "write_ply"]

ROWS_AT_ONCE = 64  # as many as fit into a cache
SAMPLES = 50_000  # pixels of a quantile: 500 lie above it
# From mm in the camera frame (y down, z forward) to metres with y up: half a turn around x.
GLB_FROM_MM = np.array([1e-3, -1e-3, -1e-3], np.float32)


def grey(modulation: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Convert modulation (H, W) to a grey picture (H, W, 3) uint8; it follows the albedo and shows no fringes."""
    shades = np.fmax(modulation * np.float32(255 / _white(_sampled(modulation))), 0).clip(0, 255)
    return np.repeat(shades.astype(np.uint8)[:, :, None], 3, axis=2)


def srgb(albedo: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Convert albedo (H, W, 4) to a picture (H, W, 3) sRGB; the brightest hundredth is white, no data is black."""
    table = _srgb_table()
    last = np.float32(len(table) - 1)
    scale = last / np.float32(_white(_sampled(albedo)[:, :, :3].max(axis=2)))
    picture = np.empty((*albedo.shape[:2], 3), np.uint8)
    for first in range(0, len(albedo), ROWS_AT_ONCE):
        rows = slice(first, first + ROWS_AT_ONCE)
        level = albedo[rows] * scale
        np.fmax(level, 0, out=level)
        np.fmin(level, last, out=level)
        picture[rows] = table.take(level.astype(np.uint16))[:, :, :3]
    return picture


def surface_picture(albedo: NDArray[np.float32], modulation: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Give the surface without fringes, (H, W, 3) sRGB; pixels without albedo are grey by their modulation."""
    picture, unknown = srgb(albedo), np.isnan(albedo[:, :, 0])
    picture[unknown] = grey(modulation)[unknown] if unknown.any() else 0
    return picture


def _sampled(values: NDArray[np.float32]) -> NDArray[np.float32]:
    """Give every n-th pixel of every n-th row, so that enough are left for a quantile."""
    stride = max(1, int((values.shape[0] * values.shape[1] / SAMPLES) ** 0.5))
    return values[::stride, ::stride]


def _white(light: NDArray[np.float32]) -> float:
    """Give the light that only the brightest hundredth of the lit pixels exceeds."""
    lit = light[light > 0]
    return max(float(np.quantile(lit, 0.99)), 1e-9) if lit.size else 1.0


@cache
def _srgb_table() -> NDArray[np.uint8]:
    """Give the code of each of 4096 levels of light (IEC 61966-2-1)."""
    return encoded(np.linspace(0, 1, 4096))


def write_ply(
    path: Path,
    points_mm: NDArray[np.float32],
    colour: NDArray[np.uint8],
    scalars: Mapping[str, NDArray[Any]],
) -> None:
    """Write N points as binary PLY: x, y, z (N, 3), mm, colour (N, 3), and scalars (N,) by name."""
    require("trimesh", "export")
    from trimesh import PointCloud
    from trimesh.exchange.ply import export_ply

    cloud = PointCloud(points_mm, colors=colour)
    cloud.vertex_attributes = {name: np.ascontiguousarray(values) for name, values in scalars.items()}
    with atomic(path) as temporary:
        temporary.write_bytes(export_ply(cloud))


@dataclass(frozen=True)
class Triangles:
    """A mesh: vertices (M, 3) mm, faces (F, 3), normals (M, 3), colour (M, 3) uint8, and scalars (M,) by name."""

    vertices_mm: NDArray[np.float32]
    faces: NDArray[np.uint32]
    normals: NDArray[np.float32]
    colour: NDArray[np.uint8]
    scalars: Mapping[str, NDArray[Any]]

    def to_trimesh(self) -> Any:
        """Give a `trimesh.Trimesh`; a normal is 0, 0, 0 where there is none."""
        trimesh = require("trimesh", "export")
        return trimesh.Trimesh(
            self.vertices_mm,
            self.faces.astype(np.int64),
            vertex_normals=np.nan_to_num(self.normals),
            vertex_colors=self.colour,
            vertex_attributes=dict(self.scalars),
            process=False,
        )


def write_mesh(path: Path, mesh: Triangles) -> None:
    """Write a mesh by suffix: .stl, .obj, .ply, or .glb, which alone needs no trimesh.

    glTF wants metres and y up: a GLB is turned and has no scalars.
    """
    suffix = path.suffix.lower()
    if suffix == ".glb":
        points, normals = mesh.vertices_mm * GLB_FROM_MM, np.nan_to_num(mesh.normals * np.sign(GLB_FROM_MM))
        content = glb_bytes(points, mesh.faces, mesh.colour, normals)
    else:
        content = _content(suffix, mesh)
    with atomic(path) as temporary:
        temporary.write_bytes(content)


def _content(suffix: str, mesh: Triangles) -> bytes:
    """Give the mesh in a format that trimesh writes."""
    require("trimesh", "export")
    from trimesh.exchange import obj, ply, stl

    content: bytes
    if suffix == ".obj":
        content = obj.export_obj(mesh.to_trimesh(), include_normals=True).encode()
    elif suffix == ".ply":
        content = ply.export_ply(mesh.to_trimesh(), vertex_normal=True)
    else:
        content = stl.export_stl(mesh.to_trimesh())
    return content


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
