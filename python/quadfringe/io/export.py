"""Write arrays for other programs: PLY and meshes for MeshLab and CloudCompare, TIFF for image tools, NPZ for NumPy."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadfringe.errors import require
from quadfringe.files import atomic
from quadfringe.io.glb import encoded, glb_bytes

__all__ = ["Triangles", "grey", "srgb", "write_depth", "write_mesh", "write_npz", "write_ply"]

# From mm in the camera frame (y down, z forward) to metres with y up: half a turn around x.
GLB_FROM_MM = np.array([1e-3, -1e-3, -1e-3], np.float32)


def grey(modulation: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Convert modulation (H, W) to a grey picture (H, W, 3) uint8; it follows the albedo and shows no fringes."""
    top = np.nanquantile(modulation, 0.99) if np.isfinite(modulation).any() else 1.0
    shades = np.nan_to_num(modulation / max(float(top), 1e-9)).clip(0, 1) * 255
    return np.repeat(shades.astype(np.uint8)[:, :, None], 3, axis=2)


def srgb(albedo: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Convert albedo (H, W, 4) to a picture (H, W, 3) sRGB; the brightest hundredth is white, no data is black."""
    light = np.nan_to_num(albedo[:, :, :3])
    brightest = light.max(axis=2)
    top = float(np.quantile(brightest[brightest > 0], 0.99)) if (brightest > 0).any() else 1.0
    return encoded(light / max(top, 1e-9))


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
    """Write a mesh by suffix: .stl, .obj, .ply, or .glb.

    glTF wants metres and y up: a GLB is turned and has no scalars.
    """
    require("trimesh", "export")
    from trimesh.exchange import obj, ply, stl

    suffix = path.suffix.lower()
    if suffix == ".glb":
        points, normals = mesh.vertices_mm * GLB_FROM_MM, np.nan_to_num(mesh.normals * np.sign(GLB_FROM_MM))
        content = glb_bytes(points, mesh.faces, mesh.colour, normals)
    elif suffix == ".obj":
        content = obj.export_obj(mesh.to_trimesh(), include_normals=True).encode()
    elif suffix == ".ply":
        content = ply.export_ply(mesh.to_trimesh(), vertex_normal=True)
    else:
        content = stl.export_stl(mesh.to_trimesh())
    with atomic(path) as temporary:
        temporary.write_bytes(content)


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
